//! The range of lengths that techniques and the path tracer are right for.

use std::ops::RangeInclusive;

use glam::{DVec3, Vec3};

use crate::{Light, Scene};

/// Lengths that float32 can compute with, scene units. A form factor multiplies up to three lengths, and neighbouring
/// pixels are up to a thousand times closer to each other than a scene is long: outside of this range products leave that
/// of float32 (1e-38 to 3e38), and light would be lost silently. `cargo xtask stability` renders at both ends.
pub const LENGTHS: RangeInclusive<f64> = 1e-12..=1e13;

/// Whether a box of this size can be rendered; otherwise what is wrong with it and the fix, without a full stop. A box
/// without any extent shows nothing and is accepted.
///
/// # Errors
/// `what` is smaller or larger than [`LENGTHS`].
pub fn check_length(what: &str, length: f64) -> Result<(), String> {
    // Also refuses NaN.
    if length == 0.0 || LENGTHS.contains(&length) {
        return Ok(());
    }
    let (least, most) = (LENGTHS.start(), LENGTHS.end());
    // To a size of 1 to 10.
    let factor = if length.is_finite() { format!("1e{}", -length.log10().floor()) } else { "a smaller number".into() };
    Err(format!(
        "{what} is {length:.1e} scene units, outside of {least:.0e} to {most:.0e}, where float32 keeps its light: scale all \
         positions by {factor}, for example with `scale` in the `transform` of each `[[model]]` of a scene file"
    ))
}

impl Scene {
    /// Whether the scene's lengths are within [`LENGTHS`]: its diagonal, and its distance from cameras and lights.
    ///
    /// # Errors
    /// What is too small or too large, and the fix; without the name of the scene.
    pub fn check_lengths(&self) -> Result<(), String> {
        let Some((low, high)) = self.swept_bounds() else { return Ok(()) };
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        check_length("the scene's diagonal", low.distance(high))?;
        let middle = 0.5 * (low + high);
        let distance = |position: [f32; 3]| middle.distance(Vec3::from(position).as_dvec3());
        let cameras = self.extra_cameras.iter().chain([&self.camera]).map(|camera| camera.eye);
        for eye in cameras.chain(self.moves.camera.iter().map(|key| key.eye)) {
            check_farthest("the distance of a camera from the scene", distance(eye))?;
        }
        for light in &self.lights {
            if let Light::Point { position, .. } | Light::Spot { position, .. } = *light {
                check_farthest("the distance of a light from the scene", distance(position))?;
            }
        }
        check_farthest("the distance of the scene from its origin", middle.distance(DVec3::ZERO))
    }
}

/// As [`check_length`], for a length that may be as small as it likes.
fn check_farthest(what: &str, length: f64) -> Result<(), String> {
    if length < *LENGTHS.start() { Ok(()) } else { check_length(what, length) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    fn scene(size: f32) -> Scene {
        let mesh = Mesh { positions: vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]], ..Mesh::default() };
        let camera = crate::Camera { eye: [0.0, 0.0, size], ..crate::Camera::default() };
        Scene { meshes: vec![mesh], camera, ..Scene::default() }
    }

    #[test]
    fn lengths_outside_of_the_range_are_refused_with_the_fix() {
        for size in [0.0, 1e-12, 1.0, 1e12] {
            assert_eq!(scene(size).check_lengths(), Ok(()), "{size}");
        }
        let small = scene(1e-20).check_lengths().expect_err("it is refused");
        assert!(small.contains("diagonal is 1.4e-20") && small.contains("by 1e20"), "{small}");
        let large = scene(f32::MAX).check_lengths().expect_err("it is refused");
        assert!(large.contains("4.8e38") && large.contains("by 1e-38"), "{large}");
        let mut far = scene(1.0);
        far.camera.eye = [1e20, 0.0, 0.0];
        let far = far.check_lengths().expect_err("it is refused");
        assert!(far.contains("a camera") && far.contains("by 1e-20"), "{far}");
        assert!(check_length("it", f64::NAN).is_err());
    }
}
