//! What can go wrong between a frame and a picture, in words a user can act on.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// An error of the renderer.
#[derive(Debug, Error)]
pub enum RenderError {
    /// A picture that cannot be made: no pixels, or too many.
    #[error("output.size: {width} x {height} pixels cannot be drawn; take 1 to {largest} each way", largest = crate::image::LARGEST_SIDE)]
    Size {
        /// Width asked for [pixels].
        width: u32,
        /// Height asked for [pixels].
        height: u32,
    },
    /// A camera that sees nothing.
    #[error("output.camera: {0}")]
    Camera(String),
    /// A look that is not in the table.
    #[error("{0}")]
    Look(#[from] charcloth::error::Error),
    /// A frame without nodes.
    #[error("frame {number} has no nodes, so there is nothing to draw; was the sheet meshed?")]
    EmptyFrame {
        /// Frame number.
        number: u32,
    },
    /// Tables of a frame that do not fit together.
    #[error("frame {number} is broken: {problem}")]
    BrokenFrame {
        /// Frame number.
        number: u32,
        /// What does not fit.
        problem: String,
    },
    /// A value that is not a finite number.
    #[error("{field} of node {node} in frame {number} is not a finite number; the frame cannot be drawn")]
    NotFinite {
        /// Name of the column.
        field: &'static str,
        /// Row in it.
        node: usize,
        /// Frame number.
        number: u32,
    },
    /// A picture of another size than the movie.
    #[error("a picture of {got_width} x {got_height} pixels does not fit a movie of {width} x {height}")]
    MovieSize {
        /// Width of the movie [pixels].
        width: u32,
        /// Height of the movie [pixels].
        height: u32,
        /// Width of the picture [pixels].
        got_width: u32,
        /// Height of the picture [pixels].
        got_height: u32,
    },
    /// The movie could not be encoded or packed.
    #[error("{}: {problem}", path.display())]
    Movie {
        /// The movie file.
        path: PathBuf,
        /// What went wrong.
        problem: String,
    },
    /// A file that could not be written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl RenderError {
    /// A file that could not be written.
    pub(crate) fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File { path: path.to_path_buf(), source }
    }

    /// A movie that could not be made.
    pub(crate) fn movie(path: &Path, problem: impl std::fmt::Display) -> Self {
        Self::Movie { path: path.to_path_buf(), problem: problem.to_string() }
    }
}
