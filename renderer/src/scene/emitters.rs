//! Emitting triangles of a scene.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_scenes::Scene;

/// A triangle that emits light. Twin of an element of `emitters` in `reflective_shadow_maps/emitters.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EmittingTriangle {
    /// Cumulative power up to and including this triangle, relative to the total: 0..1. Evaluated at rest; animated
    /// triangles keep their share.
    pub power_up_to: f32,
    /// Index of its first corner in the scene's indices.
    pub first_index: u32,
}

/// Triangles that emit light and are not receive-only, in the order of the scene's indices.
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
