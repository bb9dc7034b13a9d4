//! How a command ends when it does not end well.

use std::path::Path;

/// One sentence for the user, sorted by whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The user can mend it: a file, a key, a value, a path that cannot be written. Exit code 2.
    #[error("{0}")]
    BadInput(String),
    /// The work itself failed. Exit code 1.
    #[error("{0}")]
    Failed(String),
}

impl Error {
    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Failed(_) => 1,
            Self::BadInput(_) => 2,
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

impl From<halflight_native::images::ImageError> for Error {
    fn from(error: halflight_native::images::ImageError) -> Self {
        Self::BadInput(error.to_string())
    }
}
