//! Ground-truth ambient occlusion (Jimenez et al. 2016): openness between the two horizons of each slice. The baseline of
//! the visibility bitmask: the same slices and steps, with everything that is seen infinitely thick.

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, Technique};
use halflight_renderer::{
    gi::{
        Finds, Resolution, Spacing, Storage, Switch,
        slices::{SliceGather, SliceInputs},
    },
    parameters,
    parameters::{Settings, SettingsError},
};
use halflight_shared_shaders::{
    Call,
    gtao::gather::{self, Gather},
};

parameters! {
    /// Parameters of ground-truth ambient occlusion.
    pub struct Gtao("gtao") {
        /// Radius within which surfaces count; 0 for all of the screen.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0, 1.0, 4.0], role Uniform;
        /// Part of the radius, at its end, over which an occluder's weight falls from 1 to 0; 0 counts all that is on the way, however far.
        falloff: f32 = 0.0, in 0.0..=1.0, unit "1", grid [0.0, 0.6], role Uniform;
        /// Slices of the hemisphere: noise falls with their square root, cost rises with them.
        slices: u32 = 1, in 1..=64, unit "1", grid [1, 2, 4], role Override;
        /// Steps on each side of a slice.
        steps: u32 = 12, in 1..=256, unit "1", grid [8, 12, 16, 32], role Override;
        /// How steps are spread: constant, or exponential with more of them nearby.
        spacing: Spacing = Spacing::Exponential, unit "",
        grid [Spacing::Constant, Spacing::Exponential], role Override;
        /// Whether steps start at random within their stride; otherwise in its middle, which shows as bands.
        jitter: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Override;
        /// Resolution of the gather: half costs a quarter and blurs.
        resolution: Resolution = Resolution::Full, unit "", grid [Resolution::Full, Resolution::Half], role Plan;
        /// Passes of the spatial filter, each of 3x3 taps twice as far apart as before; 0 for none.
        denoise: u32 = 1, in 0..=4, unit "1", grid [0, 1, 2], role Plan;
    }
}

/// See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Gtao::TECHNIQUE,
    summary: "openness between horizons, without thickness (GTAO, Jimenez et al. 2016)",
    parameters: Gtao::parameters,
    complete: |settings| Ok(Gtao::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Gtao::from_settings(settings)?;
    let slices = SliceGather {
        technique: Gtao::TECHNIQUE,
        finds: Finds::Occlusion,
        radius: parameters.radius,
        resolution: parameters.resolution,
        denoise: parameters.denoise,
        // Openness is one float, whatever light is stored as.
        storage: Storage::Float32,
    };
    Ok(slices.plan(plan, inputs, |SliceInputs { surfels, planes, gathered, scale, radius, .. }| {
        Call::from(Gather {
            surfels,
            planes,
            gathered,
            params: gather::Params { scale, radius, falloff: parameters.falloff },
            constants: gather::Constants {
                slices: parameters.slices,
                steps: parameters.steps,
                spacing: parameters.spacing as u32,
                jitter: parameters.jitter == Switch::On,
                falls: parameters.falloff > 0.0,
            },
        })
    }))
}
