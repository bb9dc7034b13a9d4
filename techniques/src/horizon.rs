//! Horizon-based indirect lighting (Mayaux 2018): a sample above the horizon so far lights the receiver through the
//! angle between the two. It is the baseline of the visibility bitmask for light: the same slices and steps over a
//! height field.

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Reach, Technique};
use halflight_renderer::{
    gi::{
        Finds, Resolution, Spacing, Storage, Switch,
        sky_light::Sky,
        slices::{SliceGather, SliceInputs},
    },
    parameters,
    parameters::{Settings, SettingsError},
};
use halflight_shared_shaders::{
    Call,
    horizon::gather::{self, Gather},
};

parameters! {
    /// Parameters of horizon-based indirect lighting.
    pub struct Horizon("horizon") {
        /// Radius of occluders and senders; 0 for the whole screen.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0, 1.0, 4.0], role Uniform;
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
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Horizon::TECHNIQUE,
    title: "Horizons (HBIL)",
    summary: "indirect light between successive horizons (HBIL, Mayaux 2018)",
    parameters: Horizon::parameters,
    main: &["slices", "steps", "radius", "resolution", "denoise"],
    complete: |settings| Ok(Horizon::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources { sky: Reach::Scene, ..LightSources::SCREEN }),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Horizon::from_settings(settings)?;
    let slices = SliceGather {
        technique: Horizon::TECHNIQUE,
        finds: Finds::Light,
        radius: parameters.radius,
        resolution: parameters.resolution,
        samples: 2 * parameters.slices * parameters.steps,
        sky_rays: 2 * parameters.slices,
        denoise: parameters.denoise,
        storage: parameters.storage,
    };
    Ok(slices.plan(plan, inputs, |SliceInputs { surfels, planes, gathered, sky, packed, float16, scale, radius }| {
        Call::from(Gather {
            surfels,
            planes,
            gathered,
            ambient: sky.map(|Sky { environment, voxels }| gather::Ambient {
                environment,
                grid: voxels.grid,
                voxels: voxels.voxels,
            }),
            packed,
            float16,
            params: gather::Params { scale, radius },
            constants: gather::Constants {
                slices: parameters.slices,
                steps: parameters.steps,
                spacing: parameters.spacing as u32,
                jitter: parameters.jitter == Switch::On,
            },
        })
    }))
}
