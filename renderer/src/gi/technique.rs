//! A way to find indirect light, as the registry of techniques lists it.

use halflight_frame_graph::{FramePlan, ResourceId};

use super::Inputs;
use crate::parameters::{Parameter, Settings, SettingsError};

/// Channels of the G-buffer that exist only where a technique with its settings asks for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GBufferNeeds {
    /// Index of each pixel's material, in a scene that has glossy ones.
    pub glossy_material: bool,
    /// Index of each pixel's material, in a scene that has translucent ones.
    pub translucent_material: bool,
    /// G-buffers of the scene's extra cameras, in a scene that has some.
    pub extra_cameras: bool,
}

impl GBufferNeeds {
    /// Those of a technique that needs nothing more.
    pub const NONE: Self = Self { glossy_material: false, translucent_material: false, extra_cameras: false };
}

/// A way to find indirect light.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Name in files and tables.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: fn() -> Vec<Parameter>,
    /// Fills in defaults and checks values; settings of other techniques are left out.
    pub complete: fn(&Settings) -> Result<Settings, SettingsError>,
    /// What it reads of the G-buffer beyond depth, normal, direct light and albedo.
    pub needs: fn(&Settings) -> Result<GBufferNeeds, SettingsError>,
    /// Appends passes that turn the inputs into `indirect`, which it returns; `None` where it finds none. Other results
    /// it adds to the plan's outputs: `ambient_occlusion`, `glossy`. What it keeps between frames is a
    /// [`halflight_frame_graph::History`] of the plan.
    pub plan: fn(&mut FramePlan, &Inputs, &Settings) -> Result<Option<ResourceId>, SettingsError>,
}
