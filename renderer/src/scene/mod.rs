//! A scene on a device: its buffers, what its lights look at, what moves in it, and the facts that plans start from.

mod buffers;
mod emitters;
mod facts;
mod motion;
pub(crate) mod shadow;

pub use buffers::{SceneBuffers, triangles};
pub use emitters::EmittingTriangle;
pub use facts::SceneFacts;
pub use motion::SceneMotion;
pub use shadow::ShadowLayer;
