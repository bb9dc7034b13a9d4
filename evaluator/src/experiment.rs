//! Experiments: a grid of configurations is run on scenes, and each configuration is measured against the path-traced
//! reference.

mod cell_file;
pub(crate) mod frames;
pub mod grid;
pub mod reference;
mod run;
mod scene_runner;
pub mod session;
pub mod temporal;

pub use frames::check_textures;
pub use run::{RunOptions, run};

/// Commit that this program was built from.
pub const COMMIT: &str = env!("HALFLIGHT_COMMIT");
