//! Points on emitting surfaces, each standing for its share of them: area lights on the screen or not.

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::reflective_shadow_maps::emitters::{self, Emitters};

use crate::{gi::resolution::Level, scene::SceneFacts};

/// Destination of the points: two surfaces each, after the `first` others.
pub struct EmitterPoints {
    /// Positions, `array<vec4f>`.
    pub positions: ResourceId,
    /// Packed light, `array<vec4u>`.
    pub lights: ResourceId,
    /// Number of surfaces before them in both buffers.
    pub first: u32,
    /// Number of points.
    pub points: u32,
}

/// Plans the points. With `chosen` they are in view space, with importances for receivers of this level.
pub fn plan_emitter_points(
    plan: &mut FramePlan,
    scene: &SceneFacts,
    to: &EmitterPoints,
    chosen: Option<(ResourceId, &Level)>,
) {
    let triangles = scene.emitters.len() as u32;
    let bytes = bytemuck::cast_slice(&scene.emitters).to_vec();
    let emitters_data = plan.data("emitters", bytes, "triangles that emit light");
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let indices = plan.scene_buffer("scene.indices", "the scene's indices");
    let materials = plan.scene_buffer("scene.materials", "the scene's materials");
    let objects = scene.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));
    let run = Emitters {
        emitters: emitters_data,
        vertices,
        indices,
        materials,
        positions: to.positions,
        lights: to.lights,
        animated: objects,
        chosen: chosen.map(|(importances, receivers)| emitters::Chosen { surfels: receivers.surfels, importances }),
        params: emitters::Params {
            first: to.first,
            points: to.points,
            triangles,
            scale: chosen.map(|(_, receivers)| receivers.scale as f32),
        },
    };
    plan.pass(Part::Technique, "emitters", run)
        .because("the scene has emitters, on the screen or not")
        .over([to.points, 1]);
}
