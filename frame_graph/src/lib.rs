//! A frame as data. A [`FramePlan`] lists passes and resources, each with the reason for it. A [`CompiledGraph`] is a
//! plan on a device: textures, pipelines and bind groups are created once and recorded every frame.
//!
//! The crate knows wgpu and the descriptions of shaders. It knows no scene, no light and no technique. It compiles for
//! `wasm32-unknown-unknown`.

mod compiled;
pub mod gpu;
pub mod non_finite;
mod plan;
pub mod uniform;
mod view;

pub use compiled::{Changed, CompiledGraph, Externals, PassTime, Provider, Triangles};
pub use gpu::Gpu;
pub use plan::{
    BeyondLimits, Cause, Demand, Dependency, DeviceLimits, Draw, ExternalSize, FramePlan, Handle, History, Limit,
    Memory, Part, Pass, PassBuilder, PlannedView, Resource, ResourceId, ResourceKind, Tile, WORK_ON_GPU,
    WORK_ON_PROCESSOR, When, Work, bytes_in_words, check_external,
};
pub use view::{Continuity, View};
