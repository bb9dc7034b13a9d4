//! What is lit: meshes, materials, lights and cameras; readers and writers of scene files; generated scenes; and the
//! facts about a scene that a frame plan starts from.
//!
//! The crate is plain data. It uses no graphics API, no window and no clock, and it compiles for
//! `wasm32-unknown-unknown`. Files are read through [`FileSource`], so the same code serves a disk, files dropped onto a
//! web page, and a test.
//!
//! ```
//! use std::path::Path;
//! use halflight_scenes::{MemoryFiles, SceneNeeds, load_scene, write_scene};
//!
//! let file = "[[model]]\ngenerator = \"cornell\"\n";
//! let mut scene = load_scene(&MemoryFiles::from_iter([("box.toml", file)]), Path::new("box.toml"))?;
//! assert!(SceneNeeds::of(&scene).triangles > 0);
//! // The camera was chosen automatically. Move it and save the scene.
//! scene.camera.eye = [0.0, 1.0, 3.0];
//! let files = write_scene(&scene, "closer")?;
//! assert_eq!(files[0].0, "closer.toml");
//! # Ok::<(), halflight_scenes::SceneError>(())
//! ```

pub mod bulk;
pub mod bundled;
mod data;
mod error;
pub mod generators;
mod lengths;
mod load;
mod moves;
mod needs;
mod pose;
mod watertight;
mod write;

pub use data::{Camera, Environment, Light, Material, Mesh, Model, ModelSource, Scene, Texture, Transform};
pub use error::{SceneError, one_line};
pub use lengths::{LENGTHS, check_length};
pub use load::keys;
pub use load::{DiskFiles, FileSource, MemoryFiles, load_scene, nearest_name};
pub use moves::{CameraKeyframe, Keyframe, Motion, Moves};
pub use needs::SceneNeeds;
pub use pose::Pose;
pub use write::{write_obj, write_scene};
