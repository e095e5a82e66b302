//! What can go wrong with a file: what, where in it, and what to try.

use charcloth::error::Error;
use std::path::{Path, PathBuf};

/// An error of reading or writing a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IoError {
    /// The operating system would not let us: no such file, a full disk.
    #[error("cannot {action} {}: {problem}{}", path.display(), suffix(hint))]
    System {
        /// "read", "write", "create"...
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// What the system said.
        problem: String,
        /// What to try; empty when there is nothing to say.
        hint: String,
    },
    /// A file that does not say what it should.
    #[error("{}{}: {problem}{}", path.display(), line.map(|n| format!(":{n}")).unwrap_or_default(), suffix(hint))]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1, in text files.
        line: Option<usize>,
        /// What is wrong with it.
        problem: String,
        /// What to try; empty when there is nothing to say.
        hint: String,
    },
}

fn suffix(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!("; {hint}") }
}

impl IoError {
    /// The operating system refused.
    pub fn system(action: &'static str, path: &Path, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let hint = match error.kind() {
            ErrorKind::NotFound => "check the path; it is taken from where the program was started",
            ErrorKind::PermissionDenied => "check who may read and write there",
            ErrorKind::StorageFull => "make room on the disk; what is already written is kept",
            ErrorKind::IsADirectory => "name a file, not a folder",
            _ => "",
        };
        Self::System { action, path: path.to_path_buf(), problem: error.to_string(), hint: hint.to_string() }
    }

    /// A file that does not say what it should.
    pub fn content(path: &Path, problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), line: None, problem: problem.into(), hint: hint.into() }
    }

    /// A text file that does not say what it should at a line, counted from 1.
    pub fn at_line(path: &Path, line: usize, problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), line: Some(line), problem: problem.into(), hint: hint.into() }
    }

    /// An error of the simulator about what a file holds.
    pub(crate) fn about(path: &Path, error: Error) -> Self {
        match error {
            Error::Mesh { problem, hint } => Self::content(path, problem, hint),
            other => Self::content(path, other.to_string(), ""),
        }
    }
}

impl From<IoError> for Error {
    fn from(error: IoError) -> Self {
        Error::Sink(error.to_string())
    }
}
