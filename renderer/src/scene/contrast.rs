//! How uneven light is: whether points on its sources are worth drawing.

use halflight_scenes::Environment;

/// Contrast above which points are drawn: the mean square of the radiance over the square of its mean, over the sphere
/// for a sky, over the area of all surfaces for emitters. Even light has 1. Rays drawn from the cosine find it with less
/// noise and without a second ray. A clear sky without its sun disc stays below, and a room whose walls all glow.
const UNEVEN: f64 = 2.0;

/// The contrast of a radiance, from its values and their weights.
#[derive(Default)]
pub(crate) struct Contrast {
    weight: f64,
    mean: f64,
    square: f64,
}

impl Contrast {
    pub(crate) fn add(&mut self, weight: f64, radiance: f64) {
        self.weight += weight;
        self.mean += weight * radiance;
        self.square += weight * radiance * radiance;
    }

    pub(crate) fn is_uneven(&self) -> bool {
        self.square * self.weight > UNEVEN * self.mean * self.mean
    }
}

/// Whether directions are drawn from this sky.
pub(crate) fn is_uneven(sky: &Environment) -> bool {
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
