//! The one error type of this crate.

/// Why a scene could not be read: one sentence that names the file, the line or key, and the mend.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(pub String);
