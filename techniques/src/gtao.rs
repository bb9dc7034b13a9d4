//! Ground-truth ambient occlusion (Jimenez et al. 2016): ambient visibility between the two horizons of each slice. It
//! is the baseline of the visibility bitmask: the same slices and steps, with infinitely thick surfaces.

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
        /// Radius of occluders; 0 for the whole screen.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0, 1.0, 4.0], role Uniform;
        /// Share of the radius, at its end, over which the weight of an occluder decreases from 1 to 0. 0 counts all
        /// occluders fully.
        falloff: f32 = 0.0, in 0.0..=1.0, unit "1", grid [0.0, 0.6], role Uniform;
        /// Slices of the hemisphere. Noise decreases with the square root, cost is proportional.
        slices: u32 = 1, in 1..=64, unit "1", grid [1, 2, 4], role Override;
        /// Steps on each side of a slice.
        steps: u32 = 12, in 1..=256, unit "1", grid [8, 12, 16, 32], role Override;
        /// Spacing of the steps: constant, or exponential with more steps near the receiver.
        spacing: Spacing = Spacing::Exponential, unit "",
        grid [Spacing::Constant, Spacing::Exponential], role Override;
        /// Whether steps start at random positions in their strides. Otherwise they start in the middle, which shows as
        /// banding.
        jitter: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Override;
        /// Resolution of the gather. Half costs a quarter and blurs.
        resolution: Resolution = Resolution::Full, unit "", grid [Resolution::Full, Resolution::Half], role Plan;
        /// Passes of the spatial filter, each of 3x3 taps at twice the previous distance; 0 for none.
        denoise: u32 = 1, in 0..=4, unit "1", grid [0, 1, 2], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Gtao::TECHNIQUE,
    title: "Ambient occlusion (GTAO)",
    summary: "ambient visibility between horizons, without thickness (GTAO, Jimenez et al. 2016)",
    parameters: Gtao::parameters,
    main: &["radius", "slices", "steps", "resolution", "denoise"],
    complete: |settings| Ok(Gtao::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(Finds::Occlusion.sources()),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Gtao::from_settings(settings)?;
    let slices = SliceGather {
        technique: Gtao::TECHNIQUE,
        finds: Finds::Occlusion,
        radius: parameters.radius,
        resolution: parameters.resolution,
        samples: 2 * parameters.slices * parameters.steps,
        sky_rays: 0,
        denoise: parameters.denoise,
        // Ambient visibility is one float, whatever the storage of light.
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
