//! What can go wrong, in words a user can act on.

use thiserror::Error;

/// An error of the simulator.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum Error {
    /// A scene value that cannot be simulated. `key` is the dotted path into the scene, such as `sheet.width`.
    #[error("{key}: {problem}{}", hint_suffix(.hint))]
    Scene {
        /// Dotted path of the key in the scene.
        key: String,
        /// What is wrong with it.
        problem: String,
        /// What to try; empty when there is nothing to say.
        hint: String,
    },
    /// A mesh that cannot be burnt.
    #[error("mesh: {problem}{}", hint_suffix(.hint))]
    Mesh {
        /// What is wrong with it.
        problem: String,
        /// What to try; empty when there is nothing to say.
        hint: String,
    },
    /// The state stopped being finite.
    #[error(
        "{field} of node {node} has grown past all bounds at {time:.6} s (frame {frame}); \
         likeliest cause: {cause}; the frames before it are kept"
    )]
    NotFinite {
        /// Name of the state column.
        field: &'static str,
        /// Row in it.
        node: usize,
        /// Simulated time [s].
        time: f64,
        /// Frame being simulated.
        frame: u32,
        /// The likeliest cause.
        cause: String,
    },
    /// A snapshot that does not fit the scene it is to be resumed with.
    #[error("cannot resume: {0}")]
    Resume(String),
    /// A sink (a file writer, say) gave up.
    #[error("{0}")]
    Sink(String),
}

fn hint_suffix(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!("; {hint}") }
}

impl Error {
    /// A scene value that cannot be simulated, with what to try.
    pub fn scene(key: impl Into<String>, problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Scene { key: key.into(), problem: problem.into(), hint: hint.into() }
    }

    /// A mesh that cannot be burnt, with what to try.
    pub fn mesh(problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Mesh { problem: problem.into(), hint: hint.into() }
    }
}
