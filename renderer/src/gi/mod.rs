//! What techniques of global illumination share: inputs, reflective shadow maps, voxels of the scene, changes of
//! resolution, slices, and filters over frames.

mod choices;
pub mod emitters;
mod inputs;
pub mod previous_frame_bounce;
pub mod resolution;
pub mod rsm;
pub mod scene_voxels;
pub mod slices;
mod technique;
pub mod temporal;
pub mod translucency;

pub use choices::{Finds, Resolution, Sources, Spacing, StartResolution, Storage, Switch, UpsamplingKernel, Weighting};
pub use inputs::{ExtraView, Inputs, MotionInputs, ReceiveOnlyInputs};
pub use technique::{GBufferNeeds, Technique};
