//! Screen-space ambient occlusion (Mittring 2007). The result is ambient visibility (1 = open; occlusion is 1 minus
//! it): the share of points around a surface that no visible surface occludes.

use halflight_shared_shaders::ssao::gather::{self, Gather};
use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Technique};
use halflight_renderer::{
    gi::{
        StartResolution, Storage, UpsamplingKernel,
        resolution::{Upsampling, dark_surfels, to_display},
    },
    parameters,
    parameters::{Settings, SettingsError},
};

parameters! {
    /// Parameters of screen-space ambient occlusion.
    pub struct Ssao("ssao") {
        /// Resolution of the gather. Its cost is proportional to the number of pixels, and coarse resolutions lose
        /// detail.
        start_resolution: StartResolution = StartResolution::Full, unit "",
        grid [StartResolution::Full, StartResolution::Half], role Plan;
        /// Samples of the hemisphere.
        samples: u32 = 32, in 1..=1024, unit "1", grid [16, 32, 64], role Override;
        /// Radius of the hemisphere; 0 takes a thirtieth of the diagonal of what is looked at.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Ssao::TECHNIQUE,
    title: "Ambient occlusion (SSAO)",
    summary: "screen-space ambient occlusion (Mittring 2007): ambient visibility alone, no light",
    parameters: Ssao::parameters,
    main: &["samples", "radius", "start_resolution"],
    complete: |settings| Ok(Ssao::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources::NONE),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Ssao::from_settings(settings)?;
    let radius = inputs.nearby(parameters.radius, Ssao::TECHNIQUE)?;
    let level = dark_surfels(plan, inputs, parameters.start_resolution.divisor());
    let gathered = plan.texture("gathered", level.size, Format::R32Float, "ambient visibility at the start resolution");
    let run = Gather {
        surfels: level.surfels,
        gathered,
        params: gather::Params { scale: level.scale as f32, radius },
        constants: gather::Constants { samples: parameters.samples },
    };
    plan.pass(Part::Technique, "gather", run)
        .because("occluded points reduce ambient visibility")
        .costs(parameters.samples.into())
        .over(level.size);
    let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: Storage::Float32 };
    let open = to_display(plan, inputs, &upsampling, &level, gathered, "ambient_occlusion");
    plan.outputs.insert("ambient_occlusion", open);
    plan.attributes.insert("ambient_occlusion.radius", radius);
    Ok(None)
}
