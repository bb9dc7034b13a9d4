//! The hierarchical gather in reflective shadow maps: first-bounce light of all lit surfaces, on the screen or not.

use wgpu::TextureFormat as Format;

use super::{Hierarchical, LightVisibility, covering_radius, ring_radii};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::{
    gi::{
        Inputs,
        emitters::{EmitterPoints, plan_emitter_points},
        resolution::Level,
        rsm::plan_light_pyramid,
        scene_voxels::plan_scene_voxels,
    },
    parameters::SettingsError,
};
use halflight_shared_shaders::hierarchical::gather_lights::{self, GatherLights};

/// Plans the gather from the reflective shadow maps at the resolution of `level`, and adds `near`: the screen's light
/// within the near-field distance (scene units). Without `near`, the maps send light from any distance. `None` if there
/// is no light.
pub(super) fn plan_light_from_lights(
    plan: &mut FramePlan,
    inputs: &Inputs,
    parameters: &Hierarchical,
    level: &Level,
    only: Option<u32>,
    near: Option<(ResourceId, f32)>,
) -> Result<Option<ResourceId>, SettingsError> {
    let technique = Hierarchical::TECHNIQUE;
    let size = parameters.light_view_size.next_multiple_of(1 << (parameters.levels - 1));
    let [first, end] = only.map_or([0, parameters.levels], |only| [only, only + 1]);
    let pyramid = plan_light_pyramid(plan, inputs, technique, size, end)?;
    // Emitters have no levels. They are gathered with the finest level.
    let emitters = inputs.scene.filter(|_| !inputs.emitters().is_empty() && first == 0).map(|scene| {
        let points = parameters.samples;
        let mut buffer = |name: &str, reason: &str| plan.buffer(name, 2 * u64::from(points) * 16, reason);
        let positions = buffer("emitter_places", "positions of points on emitters");
        let lights = buffer("emitter_lights", "light of points on emitters");
        let to = EmitterPoints { positions, lights, first: 0, points };
        plan_emitter_points(plan, scene, &to, None);
        to
    });
    if pyramid.is_none() && emitters.is_none() {
        return Ok(near.map(|(light, _)| light));
    }
    let views = pyramid.as_ref().map_or(1, |pyramid| pyramid.views);
    let voxels = inputs
        .scene
        .filter(|_| parameters.light_visibility == LightVisibility::Voxels)
        .map(|scene| plan_scene_voxels(plan, scene, parameters.voxel_resolution));
    let radius = covering_radius(parameters.ring, parameters.levels, [size; 2]);
    let [inner, outer] = ring_radii(parameters.ring, radius, 1);
    let gathered =
        plan.texture("gathered_from_lights", level.size, Format::Rgba32Float, "light from reflective shadow maps");
    // The maps share the samples of each level. Emitters have as many points.
    let samples = u64::from(parameters.samples) * u64::from(end - first + 1);
    let rays = samples.div_ceil(parameters.samples_per_ray.into());
    let of_ray = voxels.map_or(0, |voxels| voxels.ray_cost(plan));
    let run = GatherLights {
        surfels: level.surfels,
        gathered,
        visibility: voxels.map(|voxels| voxels.grid),
        near: near.map(|(light, _)| light),
        lit: pyramid.map(|pyramid| gather_lights::Lit {
            light_pyramid: pyramid.texels,
            light_projections: pyramid.projections,
        }),
        emitters: emitters.map(|points| gather_lights::Emitters {
            emitter_positions: points.positions,
            emitter_lights: points.lights,
        }),
        voxels: voxels.map(|voxels| voxels.voxels),
        params: gather_lights::Params {
            scale: level.scale as f32,
            size,
            views,
            first_level: first,
            end_level: end,
            inner_square: inner * inner,
            outer_square: outer * outer,
            near_field_distance: near.map_or(0.0, |(_, near_field_distance)| near_field_distance),
        },
        constants: gather_lights::Constants {
            // The maps share the samples.
            light_samples: parameters.samples.div_ceil(views),
            samples_per_ray: parameters.samples_per_ray,
            over_frames: parameters.temporal_a > 0.0,
        },
    };
    plan.pass(Part::Technique, "gather_lights", run)
        .because("light from lit surfaces, on the screen or not")
        .costs(samples + rays * of_ray)
        .over(level.size);
    Ok(Some(gathered))
}
