//! What is lit: meshes, materials, lights and cameras; the readers that load them, the
//! generators that make them, and the facts about a scene that a frame plan starts from.
//!
//! This crate is plain data and plain Rust: no graphics interface, no window, no clock. It
//! compiles for `wasm32-unknown-unknown`; readers take bytes through [`FileSource`], so the
//! same code serves a disk, a dropped folder and a test.

mod data;
mod error;
pub mod generators;
mod load;
mod motion;
mod needs;
mod watertight;

pub use data::{Camera, Environment, Light, Material, Mesh, Scene, Texture};
pub use error::{SceneError, one_line};
pub use load::keys;
pub use load::{DiskFiles, FileSource, MemoryFiles, load_scene, nearest_name, write_obj, write_scene};
pub use motion::{CameraKeyframe, Keyframe, Motion, Moves, Pose};
pub use needs::SceneNeeds;
