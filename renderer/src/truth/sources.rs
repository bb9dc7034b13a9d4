//! Sources of light with an area, from which the path tracer draws points.

use glam::Vec3;
use halflight_scenes::{Environment, Scene};

/// Contrast above which points are drawn: the mean square of the radiance over the square of its mean, over the sphere
/// for a sky, over the area of all surfaces for emitters. Even light has 1. Rays drawn from the cosine find it with less
/// noise and without a second ray. A clear sky without its sun disc stays below, and a room whose walls all glow.
const UNEVEN: f64 = 2.0;

/// The contrast of a radiance, from its values and their weights.
#[derive(Default)]
struct Contrast {
    weight: f64,
    mean: f64,
    square: f64,
}

impl Contrast {
    fn add(&mut self, weight: f64, radiance: f64) {
        self.weight += weight;
        self.mean += weight * radiance;
        self.square += weight * radiance * radiance;
    }

    fn is_uneven(&self) -> bool {
        self.square * self.weight > UNEVEN * self.mean * self.mean
    }
}

/// Emitting triangles.
pub(super) struct Emitters {
    /// For each triangle: cumulative power up to and including it, as a share of 2^32 less 1; its slot in the BVH. Twin
    /// of `emitters` in `truth/sources.wgsl`.
    pub(super) table: Vec<[u32; 2]>,
    /// Density over area at which points are drawn on a surface of emission 1, radiance scale included; areas are in
    /// units of the square of the scene's radius.
    pub(super) density: f32,
}

impl Emitters {
    /// The triangles that emit light and send it on; none if the surfaces of the scene emit evenly. Power is area times
    /// the largest channel. `slots` are those of [`crate::scene::SceneBvh`].
    pub(super) fn of(scene: &Scene, slots: &[Option<u32>], scene_radius: f32, radiance_scale: f32) -> Self {
        let mut table = Vec::new();
        let (mut sum, mut contrast) = (0.0, Contrast::default());
        let mut number = 0;
        let unit = f64::from(scene_radius.max(1e-30));
        for mesh in &scene.meshes {
            let material = scene.materials.get(mesh.material).filter(|material| !material.receive_only);
            let emission = material.map_or(0.0, |material| material.emission.into_iter().fold(0.0, f32::max));
            let emission = f64::from(emission) * f64::from(radiance_scale);
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
        Self { table, density: if sum > 0.0 { (1.0 / sum) as f32 } else { 0.0 } }
    }
}

/// Whether directions are drawn from this sky.
pub(super) fn is_uneven(sky: &Environment) -> bool {
    let mut contrast = Contrast::default();
    for (y, row) in sky.texels.chunks_exact(sky.width as usize).enumerate() {
        let solid_angle = (std::f64::consts::PI * (y as f64 + 0.5) / f64::from(sky.height)).sin();
        row.iter().for_each(|texel| contrast.add(solid_angle, f64::from(texel.iter().sum::<f32>())));
    }
    contrast.is_uneven()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_uneven_skies_are_drawn_from() {
        let sky = |texels: Vec<[f32; 3]>| Environment { map: None, width: 64, height: 32, texels };
        assert!(!is_uneven(&sky(vec![[0.3, 0.4, 0.5]; 64 * 32])));
        assert!(!is_uneven(&sky(vec![[0.0; 3]; 64 * 32])), "no light");
        // A gradient from 1 to 2.
        assert!(!is_uneven(&sky((0..64 * 32).map(|i| [1.0 + i as f32 / 2048.0; 3]).collect())));
        let mut sun = vec![[1.0; 3]; 64 * 32];
        sun[700] = [1e4; 3];
        assert!(is_uneven(&sky(sun)));
    }
}
