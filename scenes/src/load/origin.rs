//! Models far from the origin.
//!
//! Steps of float32 grow with the distance from the origin: they are 0.03 at 500,000 and 1 at 10,000,000. A model there
//! loses its shape. Positions are therefore read as float64, and a scene that is small against its distance from the
//! origin is kept relative to a point beside it, [`crate::Scene::origin`].

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::Reader;

/// Largest step of float32, as a share of a model's size, at which the model keeps its shape.
const STEP: f64 = 4e-5;

/// What positions within these bounds are to be relative to. It is 0 along an axis whose float32 steps are fine enough.
///
/// The offset is a multiple of a power of two near the model's size, so that subtracting it from a number of few digits
/// leaves a number of few digits.
pub(super) fn offset(low: DVec3, high: DVec3) -> DVec3 {
    let size = (high - low).max_element();
    if !size.is_finite() {
        return DVec3::ZERO;
    }
    let unit = if size > 0.0 { size.log2().floor().exp2() } else { 1.0 };
    let along = |low: f64, high: f64| {
        let step = f64::from(f32::EPSILON) * low.abs().max(high.abs());
        if step > STEP * size { (0.5 * (low + high) / unit).round() * unit } else { 0.0 }
    };
    DVec3::new(along(low.x, high.x), along(low.y, high.y), along(low.z, high.z))
}

/// A model's meshes in the scene, which are still relative to `offset` in world space.
pub(super) struct Placement {
    /// Indices into [`crate::Scene::meshes`].
    pub meshes: Range<usize>,
    /// World position of the meshes' origin.
    pub offset: DVec3,
    /// The motions of the model, indices into [`crate::Moves::objects`], and the world positions of their pivots.
    pub motions: Vec<(usize, DVec3)>,
}

/// Moves all meshes to the scene's origin, which it chooses from their bounds.
pub(super) fn place(reader: &mut Reader, placements: &[Placement]) {
    let scene = &mut reader.scene;
    let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for placement in placements {
        let positions = scene.meshes[placement.meshes.clone()].iter().flat_map(|mesh| &mesh.positions);
        let (low, high) = positions
            .map(|&p| Vec3::from(p))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        bounds.0 = bounds.0.min(low.as_dvec3() + placement.offset);
        bounds.1 = bounds.1.max(high.as_dvec3() + placement.offset);
    }
    let origin = offset(bounds.0, bounds.1);
    scene.origin = origin.to_array();
    for placement in placements {
        let shift = placement.offset - origin;
        if shift != DVec3::ZERO {
            // In float32, a translation by a float32 number has the same result, bit for bit.
            let exact = shift.as_vec3().as_dvec3() == shift;
            for position in scene.meshes[placement.meshes.clone()].iter_mut().flat_map(|mesh| &mut mesh.positions) {
                let p = Vec3::from(*position);
                let moved = if exact { p + shift.as_vec3() } else { (p.as_dvec3() + shift).as_vec3() };
                *position = moved.to_array();
            }
        }
        for &(object, pivot) in &placement.motions {
            if origin == DVec3::ZERO {
                continue;
            }
            let motion = &mut scene.moves.objects[object];
            let turns = motion.keyframes.iter().any(|key| key.rotate_degrees != [0.0; 3] || key.scale != [1.0; 3]);
            // A pivot far away would take a translation its precision, which needs none.
            motion.pivot = if turns { (pivot - origin).as_vec3().to_array() } else { [0.0; 3] };
        }
    }
    if origin != DVec3::ZERO {
        let [x, y, z] = scene.origin;
        let warning = format!(
            "the model is far from the origin; positions are relative to [{x}, {y}, {z}], as float32 would lose its shape"
        );
        let file = &reader.path;
        scene.warnings.push(format!("{}: {warning}", file.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_axes_with_coarse_steps_are_offset() {
        let room = |at: [f64; 3]| offset(DVec3::from(at), DVec3::from(at) + DVec3::new(4.0, 3.0, 4.0)).to_array();
        assert_eq!(room([-2.0, 0.0, -2.0]), [0.0; 3]);
        // Steps of 6e-5 at 1 km are fine; steps of 0.03 and 0.5 are not.
        assert_eq!(room([998.0, 0.0, -1002.0]), [0.0; 3]);
        assert_eq!(room([499_998.0, 0.0, 4_649_774.0]), [500_000.0, 0.0, 4_649_776.0]);
        // A model of 40 km in the same place keeps its shape within a ten-thousandth of its size.
        let country = offset(DVec3::new(5e5, 0.0, 4.6e6), DVec3::new(5.4e5, 100.0, 4.64e6)).to_array();
        assert_eq!(country, [0.0; 3]);
    }

    #[test]
    fn a_point_has_an_offset_and_nothing_has_none() {
        assert_eq!(offset(DVec3::splat(1e6), DVec3::splat(1e6)), DVec3::splat(1e6));
        assert_eq!(offset(DVec3::INFINITY, DVec3::NEG_INFINITY), DVec3::ZERO);
    }
}
