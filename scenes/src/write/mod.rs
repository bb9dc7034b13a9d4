//! Writers: a [`crate::Scene`] as the files that the readers read.

mod obj;
mod scene_file;

pub use obj::write_obj;
pub use scene_file::write_scene;
