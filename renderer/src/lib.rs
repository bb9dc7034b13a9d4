//! One frame: needs and settings become a plan, the plan becomes recorded passes, the passes leave
//! textures and timings.
//!
//! The crate knows wgpu and nothing of files, windows or reports; it compiles for
//! `wasm32-unknown-unknown`.

mod emitters;
mod feedback;
mod frame;
mod gpu;
pub mod invocation;
mod light_views;
mod motion;
pub mod parameters;
pub mod plan;
pub mod preset;
mod record;
mod resolution;
pub mod scan;
mod scene_buffers;
mod scene_voxels;
mod shadow;
mod slices;
pub mod techniques;
pub mod temporal;
pub mod texels;
mod translucency;
pub mod truth;
mod uniform;
mod view;

pub use emitters::EmittingTriangle;
pub use frame::{
    DirectLight, DirectSource, SceneFacts, extra_views, plan_frame, plan_indirect, plan_scene, plan_technique,
    plan_technique_of_scene,
};
pub use gpu::Gpu;
pub use light_views::send_only_what_is_seen;
pub use motion::SceneMotion;
pub use record::{Externals, PassTime, Recording};
pub use scene_buffers::SceneBuffers;
pub use shadow::ShadowLayer;
pub use uniform::UniformValue;
pub use view::{Continuity, View};
