//! Surfaces that emit light, as points that stand for their shares of them: area lights on the screen or not.

use halflight_frame_graph::{FramePlan, Part, ResourceId, variant};

use crate::{gi::resolution::Level, scene::SceneFacts};

/// Where the points go: two surfaces each, behind `first` others.
pub struct EmitterPoints {
    pub places: ResourceId,
    pub lights: ResourceId,
    pub first: u32,
    pub points: u32,
}

/// Plans the points; with `chosen`, in view space and with their importances for receivers of this level.
pub fn plan_emitter_points(
    plan: &mut FramePlan,
    scene: &SceneFacts,
    to: &EmitterPoints,
    chosen: Option<(ResourceId, &Level)>,
) {
    let triangles = scene.emitters.len() as u32;
    let bytes = bytemuck::cast_slice(&scene.emitters).to_vec();
    let emitters = plan.data("emitters", bytes, "triangles that emit light");
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let indices = plan.scene_buffer("scene.indices", "its triangles");
    let materials = plan.scene_buffer("scene.materials", "the scene's materials");
    let objects = scene.moving().then(|| plan.scene_buffer("scene.objects", "objects move"));
    let features = [("moving", scene.moving()), ("chosen", chosen.is_some())];
    let mut pass = plan
        .pass(Part::Technique, "emitters", variant("light_views/emitters", &features))
        .param("first", to.first)
        .param("points", to.points)
        .param("triangles", triangles)
        .bind("emitters", emitters)
        .bind("vertices", vertices)
        .bind("indices", indices)
        .bind("materials", materials)
        .bind("places", to.places)
        .bind("lights", to.lights)
        .because("the scene has emitters, on the screen or not");
    if let Some((importances, receivers)) = chosen {
        pass = pass
            .param("scale", receivers.scale as f32)
            .bind("surfels", receivers.surfels)
            .bind("importances", importances);
    }
    if let Some(objects) = objects {
        pass = pass.bind("objects", objects);
    }
    pass.over([to.points, 1]);
}
