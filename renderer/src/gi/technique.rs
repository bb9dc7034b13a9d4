//! A technique of indirect illumination, as the registry lists it.

use halflight_frame_graph::{FramePlan, ResourceId};

use super::Inputs;
use crate::parameters::{Parameter, Settings, SettingsError};

/// Optional channels of the G-buffer that a technique with its settings requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GBufferNeeds {
    /// Index of each pixel's material, in a scene with glossy materials.
    pub glossy_material: bool,
    /// Index of each pixel's material, in a scene with translucent materials.
    pub translucent_material: bool,
    /// G-buffers of the scene's extra cameras, if there are some.
    pub extra_cameras: bool,
}

impl GBufferNeeds {
    /// No optional channels.
    pub const NONE: Self = Self { glossy_material: false, translucent_material: false, extra_cameras: false };
}

/// A technique of indirect illumination.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Name in files and tables.
    pub name: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: fn() -> Vec<Parameter>,
    /// Fills in defaults and checks values. Settings of other techniques are ignored.
    pub complete: fn(&Settings) -> Result<Settings, SettingsError>,
    /// The optional G-buffer channels that it reads.
    pub needs: fn(&Settings) -> Result<GBufferNeeds, SettingsError>,
    /// Adds the passes that compute `indirect` from the inputs, and returns it; `None` if there is no indirect light.
    /// Other results are added to the plan's outputs: `ambient_occlusion`, `glossy`. State between frames is a
    /// [`halflight_frame_graph::History`] of the plan.
    pub plan: fn(&mut FramePlan, &Inputs, &Settings) -> Result<Option<ResourceId>, SettingsError>,
}
