//! Depth of what casts shadows into a part of a directional light's view.

use glam::{DMat4, DVec2, DVec3, Mat4, Vec3};
use halflight_scenes::Scene;

/// A rectangle: lower and upper corner.
pub(super) type Rectangle = (DVec2, DVec2);

/// Least and largest z of all surfaces of the scene, over all frames, whose x and y are inside `rectangle` after the
/// rotation `to_light`; `None` if there are none. A moving object counts with its bounding box.
///
/// Triangles are clipped, because one that reaches far beyond the rectangle would leave no depth precision inside.
pub(super) fn depth_range(scene: &Scene, to_light: &Mat4, rectangle: Rectangle) -> Option<(f32, f32)> {
    // In double precision, because a clipped triangle may be millions of times as long as the rectangle.
    let to_light = to_light.as_dmat4();
    let mut range: Option<(f64, f64)> = None;
    let mut add = |z: f64| {
        let (low, high) = range.unwrap_or((z, z));
        range = Some((low.min(z), high.max(z)));
    };
    for mesh in &scene.meshes {
        let motion = mesh.object.and_then(|object| scene.moves.objects.get(object));
        let positions: Vec<DVec3> =
            mesh.positions.iter().map(|&p| to_light.transform_point3(Vec3::from(p).as_dvec3())).collect();
        if let Some(motion) = motion {
            let points = mesh.positions.iter().map(|&p| Vec3::from(p));
            let (low, high) = points.fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
            let swept = if positions.is_empty() { None } else { Some(motion.swept(low, high)) };
            let corners = swept.map(|swept| corners(swept, &to_light)).unwrap_or_default();
            if overlaps(&corners, rectangle) {
                corners.iter().for_each(|corner| add(corner.z));
            }
            continue;
        }
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let triangle = triangle.map(|i| positions[i as usize]);
            if overlaps(&triangle, rectangle) {
                clipped(&triangle, rectangle).iter().for_each(|corner| add(corner.z));
            }
        }
    }
    range.map(|(low, high)| (low as f32, high as f32))
}

fn corners((low, high): (Vec3, Vec3), to_light: &DMat4) -> Vec<DVec3> {
    let pick = |bit: u32, low: f32, high: f32| if bit & 1 == 0 { low } else { high };
    let corner = |i: u32| Vec3::new(pick(i, low.x, high.x), pick(i >> 1, low.y, high.y), pick(i >> 2, low.z, high.z));
    (0..8).map(|i| to_light.transform_point3(corner(i).as_dvec3())).collect()
}

/// Whether the bounding rectangle of these positions overlaps `rectangle`. False for a position that is not finite.
fn overlaps(positions: &[DVec3], (low, high): Rectangle) -> bool {
    let bounds = |(a, b): Rectangle, p: &DVec3| (a.min(p.truncate()), b.max(p.truncate()));
    let (a, b) = positions.iter().fold((DVec2::MAX, DVec2::MIN), bounds);
    positions.iter().all(|p| p.is_finite()) && a.cmple(high).all() && b.cmpge(low).all()
}

/// The part of a triangle inside the rectangle (Sutherland & Hodgman 1974).
fn clipped(triangle: &[DVec3; 3], (low, high): Rectangle) -> Vec<DVec3> {
    let mut polygon = triangle.to_vec();
    for (axis, bound, sign) in [(0, low.x, 1.0), (0, high.x, -1.0), (1, low.y, 1.0), (1, high.y, -1.0)] {
        let inside = |p: DVec3| sign * (p[axis] - bound);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &b) in polygon.iter().enumerate() {
            let a = polygon[(i + polygon.len() - 1) % polygon.len()];
            let (from, to) = (inside(a), inside(b));
            if (from < 0.0) != (to < 0.0) {
                kept.push(a + (b - a) * (from / (from - to)));
            }
            if to >= 0.0 {
                kept.push(b);
            }
        }
        polygon = kept;
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_scenes::{Keyframe, Mesh, Motion};

    fn scene(triangles: &[[[f32; 3]; 3]]) -> Scene {
        let positions: Vec<_> = triangles.iter().flatten().copied().collect();
        let indices = (0..positions.len() as u32).collect();
        Scene { meshes: vec![Mesh { positions, indices, ..Mesh::default() }], ..Scene::default() }
    }

    const UNIT: Rectangle = (DVec2::ZERO, DVec2::ONE);

    fn range(scene: &Scene) -> Option<(f32, f32)> {
        depth_range(scene, &Mat4::IDENTITY, UNIT)
    }

    #[test]
    fn a_triangle_counts_as_far_as_it_is_inside() {
        // z = x + 2 y on a plane that is a million times as large as the rectangle.
        let large = [[-1e6, -1e6, -3e6], [1e6, -1e6, -1e6], [0.0, 1e6, 2e6]];
        let (low, high) = range(&scene(&[large])).expect("it covers the rectangle");
        // Rounding of the corners, which are near 1e6.
        assert!(low.abs() < 0.2 && (high - 3.0).abs() < 0.2, "{low} {high}");
        // Inside, exactly.
        assert_eq!(range(&scene(&[[[0.25, 0.25, -4.0], [0.5, 0.25, 7.0], [0.25, 0.5, 1.0]]])), Some((-4.0, 7.0)));
        // Cut at x = 1, halfway.
        let cut = [[0.5, 0.25, 0.0], [1.5, 0.25, 8.0], [0.5, 0.75, 0.0]];
        assert_eq!(range(&scene(&[cut])), Some((0.0, 4.0)));
    }

    #[test]
    fn triangles_beside_it_do_not_count() {
        let beside = [[2.0, 0.0, 5.0], [3.0, 0.0, 5.0], [2.0, 1.0, 5.0]];
        // Its bounding rectangle overlaps, the triangle does not.
        let corner = [[2.5, 0.0, 5.0], [2.5, 2.5, 5.0], [0.0, 2.5, 5.0]];
        let broken = [[0.5, 0.5, f32::NAN], [0.6, 0.5, 0.0], [0.5, 0.6, 0.0]];
        assert_eq!(range(&scene(&[beside, corner, broken])), None);
        assert_eq!(range(&Scene::default()), None);
    }

    #[test]
    fn a_moving_object_counts_over_its_motion() {
        let mut moving = scene(&[[[-5.0, 0.25, 1.0], [-4.0, 0.25, 1.0], [-5.0, 0.75, 2.0]]]);
        assert_eq!(range(&moving), None);
        moving.meshes[0].object = Some(0);
        let end = Keyframe { frame: 9, translate: [10.0, 0.0, 3.0], ..Keyframe::default() };
        moving.moves.objects.push(Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default(), end] });
        assert_eq!(range(&moving), Some((1.0, 5.0)));
    }
}
