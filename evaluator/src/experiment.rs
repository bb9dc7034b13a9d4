//! Experiments: a grid of configurations is run on scenes, and each configuration is measured against the path-traced
//! reference.

pub mod cell_id;
pub mod cell_log;
pub(crate) mod frames;
pub mod grid;
mod machine;
pub mod manifest;
pub mod moving;
pub mod reference;
pub(crate) mod run;
mod scene_runner;
pub mod session;
pub mod shard;
pub mod temporal;

pub use frames::check_textures;
pub use run::{RunOptions, run};

/// Commit that this program was built from.
pub const COMMIT: &str = env!("HALFLIGHT_COMMIT");
