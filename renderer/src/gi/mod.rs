//! Shared parts of the techniques: inputs, reflective shadow maps, scene voxels, resolutions, slices, and temporal
//! filters.

pub mod bvh;
mod choices;
pub mod denoise;
pub mod emitters;
mod inputs;
pub mod previous_frame_bounce;
pub mod resolution;
pub mod rsm;
pub mod scene_voxels;
pub mod shadow_maps;
pub mod sky_light;
pub mod slices;
mod technique;
pub mod temporal;
pub mod translucency;

pub use choices::{
    Finds, Resolution, Sources, Spacing, StartResolution, Storage, Switch, TextureFilter, UpsamplingKernel, Weighting,
};
pub use inputs::{ExtraView, Inputs, MotionInputs, ReceiveOnlyInputs};
pub use technique::{GBufferNeeds, LightSources, Reach, Technique};
