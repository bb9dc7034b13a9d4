//! Emitting triangles, on which points are drawn.

use glam::Vec3;
use halflight_scenes::Scene;

use crate::scene::contrast::Contrast;

/// Emitting triangles.
pub(super) struct Emitters {
    /// For each triangle: cumulative power up to and including it, as a share of 2^32 less 1; its slot in the BVH. Twin
    /// of `emitters` in `truth/emitters.wgsl`.
    pub(super) table: Vec<[u32; 2]>,
    /// Density over area at which points are drawn on a surface of emission 1; areas are in units of the square of the
    /// radius.
    pub(super) density: f32,
    /// Half the diagonal of the scene's bounding box.
    pub(super) radius: f32,
}

impl Emitters {
    /// The triangles that emit light and send it on; none if the surfaces of the scene emit evenly. Power is area times
    /// the largest channel. `slots` are those of [`crate::scene::SceneBvh`]. Areas are those at rest.
    pub(super) fn of(scene: &Scene, slots: &[Option<u32>]) -> Self {
        let radius = scene.bounds().map_or(0.0, |(low, high)| (high - low).length() / 2.0);
        let mut table = Vec::new();
        let (mut sum, mut contrast) = (0.0, Contrast::default());
        let mut number = 0;
        let unit = f64::from(radius.max(1e-30));
        for mesh in &scene.meshes {
            let material = scene.materials.get(mesh.material).filter(|material| !material.receive_only);
            let emission = material.map_or(0.0, |material| material.emission.into_iter().fold(0.0, f32::max));
            let emission = f64::from(emission);
            for &corners in mesh.indices.as_chunks::<3>().0 {
                if let Some(slot) = slots[number] {
                    let [a, b, c] = corners.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3() / unit);
                    let area = 0.5 * (b - a).cross(c - a).length();
                    contrast.add(area, emission);
                    if emission > 0.0 {
                        sum += area * emission;
                        table.push((sum, slot));
                    }
                }
                number += 1;
            }
        }
        if !contrast.is_uneven() {
            table.clear();
        }
        let share = |power: f64| ((power / sum * 2f64.powi(32)).round() as u64).clamp(1, 1 << 32) - 1;
        let table = table.into_iter().map(|(power, slot)| [share(power) as u32, slot]).collect();
        Self { table, density: if sum > 0.0 { (1.0 / sum) as f32 } else { 0.0 }, radius }
    }

    /// The texels of `emitters` in `truth/emitters.wgsl`.
    pub(super) fn texels(&self) -> Vec<[u32; 2]> {
        let header = [[self.table.len() as u32, self.density.to_bits()], [self.radius.to_bits(), 0]];
        [&header[..], &self.table[..]].concat()
    }
}
