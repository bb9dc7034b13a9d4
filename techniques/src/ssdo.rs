//! Screen-space directional occlusion, its indirect light (Ritschel et al. 2009): visible surfaces that occlude points
//! of a hemisphere light the receiver.

use halflight_shared_shaders::ssdo::gather::{self, Gather};
use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::Weighting;
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Technique};
use halflight_renderer::{
    gi::{
        StartResolution, Storage, UpsamplingKernel,
        resolution::{Upsampling, pyramid, to_display},
    },
    parameters,
    parameters::{Settings, SettingsError},
};

parameters! {
    /// Parameters of screen-space directional occlusion.
    pub struct Ssdo("ssdo") {
        /// Weights: published, without units; radiometric, each sample by its share of the disc below the hemisphere.
        weighting: Weighting = Weighting::Radiometric, unit "",
        grid [Weighting::Published, Weighting::Radiometric], role Override;
        /// Resolution of the gather. Its cost is proportional to the number of pixels, and coarse resolutions lose
        /// detail.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Samples of the hemisphere.
        samples: u32 = 100, in 1..=1024, unit "1", grid [50, 100, 150, 200], role Override;
        /// Radius of the hemisphere; 0 takes a thirtieth of the diagonal of what is looked at.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
        /// Brightness of the published weighting.
        intensity: f32 = 1.0, in 0.0..=1e9, unit "scene units squared", grid [1.0], role Uniform;
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Ssdo::TECHNIQUE,
    title: "Directional occlusion (SSDO)",
    summary: "indirect light of screen-space directional occlusion (Ritschel et al. 2009)",
    parameters: Ssdo::parameters,
    main: &["samples", "radius", "start_resolution", "intensity", "weighting"],
    complete: |settings| Ok(Ssdo::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources::SCREEN),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Ssdo::from_settings(settings)?;
    let radius = inputs.nearby(parameters.radius, Ssdo::TECHNIQUE)?;
    let level = pyramid(plan, inputs, false, parameters.start_resolution.divisor(), 0).remove(0);
    let gathered = plan.texture("gathered", level.size, Format::Rgba32Float, "light at the start resolution");
    let run = Gather {
        surfels: level.surfels,
        gathered,
        params: gather::Params { scale: level.scale as f32, radius, intensity: parameters.intensity },
        constants: gather::Constants {
            samples: parameters.samples,
            radiometric: parameters.weighting == Weighting::Radiometric,
        },
    };
    plan.pass(Part::Technique, "gather", run)
        .because("surfaces that occlude points of the hemisphere light the receiver")
        .costs(parameters.samples.into())
        .over(level.size);
    let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: parameters.storage };
    Ok(Some(to_display(plan, inputs, &upsampling, &level, gathered, "indirect")))
}
