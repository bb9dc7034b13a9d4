//! A scene on a device, its G-buffer and direct light, a path tracer, and what techniques of global illumination share.
//!
//! The crate knows wgpu. It knows nothing of files, windows, reports or single techniques. It compiles for
//! `wasm32-unknown-unknown`.
//!
//! The feature `truth`, which is on by default, adds the path tracer. Techniques do without it.

mod frame;
pub mod gi;
pub mod parameters;
pub mod scene;
pub mod texels;
#[cfg(feature = "truth")]
pub mod truth;

pub use frame::{
    DirectSource, PlanInputs, Planner, Surfaces, extra_views, frame_parameters, plan_frame, plan_indirect, plan_scene,
    plan_technique, plan_technique_of_scene, plan_within,
};
pub use gi::shadow_maps::DirectLight;
