//! Reflective shadow maps (Dachsbacher & Stamminger 2005): the lit surfaces of each light's map send light. They are
//! sampled around the receiver's position in the map. As published, a receiver outside the view of a spot light or cube
//! face gets nothing from that map.

use halflight_renderer::scene::shadow_view;
use halflight_shared_shaders::rsm::gather::{self, Gather};
use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Reach, Technique};
use halflight_renderer::{
    gi::{
        StartResolution, Storage, UpsamplingKernel, Weighting,
        resolution::{Upsampling, pyramid, to_display},
        rsm::plan_reflective_shadow_maps,
    },
    parameters,
    parameters::{Settings, SettingsError},
};

parameters! {
    /// Parameters of reflective shadow maps.
    pub struct Rsm("rsm") {
        /// Weights: published, without units; radiometric, each sample by the area that it stands for.
        weighting: Weighting = Weighting::Radiometric, unit "",
        grid [Weighting::Published, Weighting::Radiometric], role Override;
        /// Resolution of the gather. Its cost is proportional to the number of pixels, and coarse resolutions lose
        /// detail.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Samples of each map.
        samples: u32 = 100, in 1..=1024, unit "1", grid [50, 100, 150, 200], role Override;
        /// Largest distance of a sample in a map, as a share of the map's width.
        map_radius: f32 = 0.3, in 0.001..=1.5, unit "1", grid [0.3], role Uniform;
        /// Brightness of the published weighting.
        intensity: f32 = 1.0, in 0.0..=1e9, unit "scene units squared", grid [1.0], role Uniform;
        /// Width and height of each map.
        light_view_size: u32 = 256, in 8..=1024, unit "px", grid [256, 512], role Plan;
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Rsm::TECHNIQUE,
    title: "Reflective shadow maps",
    summary: "reflective shadow maps (Dachsbacher & Stamminger 2005)",
    parameters: Rsm::parameters,
    main: &["samples", "map_radius", "light_view_size", "start_resolution", "weighting"],
    complete: |settings| Ok(Rsm::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources { lamps: Reach::Scene, ..LightSources::NONE }),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Rsm::from_settings(settings)?;
    if inputs.scene.is_some() && inputs.shadow_layers().is_empty() {
        return Ok(None);
    }
    let views = inputs.shadow_layers().len();
    let level = pyramid(plan, inputs, false, parameters.start_resolution.divisor(), 0).remove(0);
    // With several maps, passes alternate between two textures, because no pass may read the texture that it writes.
    let mut sum = |i| plan.texture(format!("sum_{i}"), level.size, Format::Rgba32Float, "light of the maps so far");
    let (first, several) = (sum(0), views > 1);
    let sums = [first, if several { sum(1) } else { first }];
    let mut written = sums[0];
    plan_reflective_shadow_maps(
        plan,
        inputs,
        Rsm::TECHNIQUE,
        parameters.light_view_size,
        |plan, maps, index, view| {
            let run = Gather {
                shadow_view: shadow_view(plan, index, view),
                surfels: level.surfels,
                rsm_position: maps.position,
                light: maps.light,
                gathered: sums[index % 2],
                further: (index > 0).then_some(sums[(index + 1) % 2]),
                params: gather::Params {
                    scale: level.scale as f32,
                    map_radius: parameters.map_radius,
                    index: index as u32,
                    intensity: parameters.intensity,
                },
                constants: gather::Constants {
                    samples: parameters.samples,
                    radiometric: parameters.weighting == Weighting::Radiometric,
                },
            };
            plan.pass(Part::Technique, format!("rsm_{index}"), run)
                .because("lit surfaces around the receiver's position in the map")
                .costs(parameters.samples.into())
                .over(level.size);
            written = sums[index % 2];
        },
    )?;
    let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: parameters.storage };
    Ok(Some(to_display(plan, inputs, &upsampling, &level, written, "indirect")))
}
