//! Why a command fails, and its exit code.

use std::path::Path;

use halflight_output::{FolderError, PrintError};

/// One sentence for the user.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The user can fix it: a file, a key, a value, a path that cannot be written. Exit code 2.
    #[error("{0}")]
    BadInput(String),
    /// The work itself failed. Exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Standard output is closed or full. Exit code 0 or 2.
    #[error("{0}")]
    Print(#[from] PrintError),
}

impl Error {
    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Failed(_) => 1,
            Self::BadInput(_) => 2,
            Self::Print(error) => error.exit_code(),
        }
    }

    /// A file that cannot be written, and why.
    pub fn unwritable(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::BadInput(format!("cannot write {}: {reason}", path.display()))
    }

    pub(crate) fn unreadable(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::BadInput(format!("cannot read {}: {reason}", path.display()))
    }
}

impl From<FolderError> for Error {
    fn from(error: FolderError) -> Self {
        Self::BadInput(error.to_string())
    }
}

impl From<halflight_native::images::ImageError> for Error {
    fn from(error: halflight_native::images::ImageError) -> Self {
        Self::BadInput(error.to_string())
    }
}
