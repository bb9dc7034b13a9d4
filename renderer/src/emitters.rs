//! Surfaces that emit light, as points that stand for their shares of them: area lights on the screen or not.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_scenes::Scene;

use crate::{
    frame::variant,
    plan::{FramePlan, Part, ResourceId},
    resolution::Level,
    techniques::SceneInputs,
};

/// A triangle that emits light. Twin of an element of `emitters` in `light_views/emitters.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EmittingTriangle {
    /// Power of this triangle and all before it, of all that emit: 0..1. At rest: what moves keeps its share.
    pub power_up_to: f32,
    /// Place of its first corner in the scene's indices.
    pub first_index: u32,
}

/// Triangles that emit light and send it on, in the order of the scene's indices.
pub(crate) fn emitting_triangles(scene: &Scene) -> Vec<EmittingTriangle> {
    let mut found = Vec::new();
    let mut sum = 0.0f64;
    let mut first_index = 0;
    for mesh in &scene.meshes {
        let material = scene.materials.get(mesh.material).filter(|material| !material.receive_only);
        let emission = material.map_or(0.0, |material| material.emission.into_iter().fold(0.0, f32::max));
        for (index, &[a, b, c]) in mesh.indices.as_chunks::<3>().0.iter().enumerate().filter(|_| emission > 0.0) {
            let [a, b, c] = [a, b, c].map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3());
            let power = (b - a).cross(c - a).length() * f64::from(emission);
            if power > 0.0 {
                sum += power;
                found.push((sum, first_index + 3 * index as u32));
            }
        }
        first_index += mesh.indices.len() as u32;
    }
    let share = |(power, first_index)| EmittingTriangle { power_up_to: (power / sum) as f32, first_index };
    found.into_iter().map(share).collect()
}

/// Where the points go: two surfaces each, behind `first` others.
pub(crate) struct EmitterPoints {
    pub(crate) places: ResourceId,
    pub(crate) lights: ResourceId,
    pub(crate) first: u32,
    pub(crate) points: u32,
}

/// Plans the points; with `chosen`, in view space and with their importances for receivers of this level.
pub(crate) fn plan_emitter_points(
    plan: &mut FramePlan,
    scene: &SceneInputs,
    to: &EmitterPoints,
    chosen: Option<(ResourceId, &Level)>,
) {
    let triangles = plan.emitters.len() as u32;
    let bytes = bytemuck::cast_slice(&plan.emitters).to_vec();
    let emitters = plan.data("emitters", bytes, "triangles that emit light");
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let indices = plan.scene_buffer("scene.indices", "its triangles");
    let materials = plan.scene_buffer("scene.materials", "the scene's materials");
    let objects = scene.moving.then(|| plan.scene_buffer("scene.objects", "objects move"));
    let features = [("moving", scene.moving), ("chosen", chosen.is_some())];
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
