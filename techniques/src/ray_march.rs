//! Screen-space ray marching: a few rays per pixel advance along the screen until they are behind the visible surface.
//! It is the baseline of the visibility bitmask for noise (Therrien et al. 2023, Figure 15: 2 rays of 16 steps).

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, Technique};
use halflight_renderer::{
    gi::{
        Finds, Resolution, Spacing, Storage,
        slices::{SliceGather, SliceInputs},
    },
    parameters,
    parameters::{Settings, SettingsError},
};
use halflight_shared_shaders::{
    Call,
    ray_march::march::{self, March},
};

parameters! {
    /// Parameters of ray marching on the screen.
    pub struct RayMarch("ray-march") {
        /// Result: indirect light, or ambient visibility alone.
        finds: Finds = Finds::Light, unit "", grid [Finds::Light, Finds::Occlusion], role Plan;
        /// Radius of occluders and senders; 0 for the whole screen.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0, 1.0, 4.0], role Uniform;
        /// Thickness of every surface, away from the eye.
        thickness: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.1, 0.25, 0.5, 1.0], role Uniform;
        /// Additional thickness per unit of depth. It has no unit, so the default suits scenes of any size.
        thickness_slope: f32 = 0.03, in 0.0..=10.0, unit "1", grid [0.0, 0.03], role Uniform;
        /// Rays per pixel. Noise decreases with the square root, cost is proportional.
        rays: u32 = 2, in 1..=256, unit "1", grid [1, 2, 4], role Override;
        /// Steps per ray.
        steps: u32 = 16, in 1..=256, unit "1", grid [8, 16, 32], role Override;
        /// Spacing of the steps: constant, or exponential with more steps near the receiver.
        spacing: Spacing = Spacing::Exponential, unit "",
        grid [Spacing::Constant, Spacing::Exponential], role Override;
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
    name: RayMarch::TECHNIQUE,
    title: "Screen-space rays",
    summary: "rays marched through the depth buffer (Sousa et al. 2011)",
    parameters: RayMarch::parameters,
    main: &["rays", "steps", "thickness", "resolution", "denoise"],
    complete: |settings| Ok(RayMarch::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |settings| Ok(RayMarch::from_settings(settings)?.finds.sources()),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = RayMarch::from_settings(settings)?;
    let slices = SliceGather {
        technique: RayMarch::TECHNIQUE,
        finds: parameters.finds,
        radius: parameters.radius,
        resolution: parameters.resolution,
        samples: parameters.rays * parameters.steps,
        sky_rays: parameters.rays,
        denoise: parameters.denoise,
        storage: parameters.storage,
    };
    Ok(slices.plan(plan, inputs, |SliceInputs { surfels, planes, gathered, sky, packed, float16, scale, radius }| {
        Call::from(March {
            surfels,
            planes,
            gathered,
            ambient: sky.is_some(),
            light: parameters.finds == Finds::Light,
            packed,
            float16,
            environment: sky.map(|sky| sky.environment),
            grid: sky.map(|sky| sky.voxels.grid),
            voxels: sky.map(|sky| sky.voxels.voxels),
            params: march::Params {
                scale,
                radius,
                thickness: parameters.thickness,
                thickness_slope: parameters.thickness_slope,
            },
            constants: march::Constants {
                rays: parameters.rays,
                steps: parameters.steps,
                spacing: parameters.spacing as u32,
            },
        })
    }))
}
