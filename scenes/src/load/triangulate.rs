//! Polygons to triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Divides polygons into triangles; keeps its buffers from one polygon to the next.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    ears: Vec<u32>,
    flat: Vec<DVec2>,
}

impl Triangulator {
    pub fn new() -> Self {
        Self { earcut: Earcut::new(), ears: Vec::new(), flat: Vec::new() }
    }

    /// The triangles of the polygon with these corners, as indices of corners, with the polygon's sense of rotation.
    ///
    /// A polygon that a fan around its first corner covers gets that fan. Other polygons are cut along their ears in the
    /// plane that fits them best (Newell's normal), which holds for concave polygons, and for holes that are joined to
    /// the outline by a double edge.
    pub fn triangles(&mut self, corners: &[DVec3], mut found: impl FnMut([usize; 3])) {
        let count = corners.len();
        let fan = (2..count).map(|i| [0, i - 1, i]);
        if count == 3 || !self.is_folded(corners) {
            fan.for_each(found);
            return;
        }
        self.ears.clear();
        self.earcut.earcut(self.flat.iter().map(|p| p.to_array()), &[], &mut self.ears);
        let ears = self.ears.as_chunks::<3>().0.iter().map(|ear| ear.map(|i| i as usize));
        let twice_area = |[a, b, c]: [usize; 3]| (self.flat[b] - self.flat[a]).perp_dot(self.flat[c] - self.flat[a]);
        let covered: f64 = ears.clone().map(|ear| twice_area(ear).abs()).sum();
        let whole: f64 = fan.clone().map(twice_area).sum();
        // A face that crosses itself has no inside. Its ears may leave a part out; a fan reaches every corner.
        if (covered - whole).abs() > 1e-6 * whole {
            fan.for_each(found);
            return;
        }
        ears.for_each(|[a, b, c]| found(if twice_area([a, b, c]) < 0.0 { [a, c, b] } else { [a, b, c] }));
    }

    /// Whether a fan around the first corner has a triangle that is turned round. Leaves the polygon, projected onto its
    /// plane, in `flat`.
    fn is_folded(&mut self, corners: &[DVec3]) -> bool {
        let first = corners[0];
        let next = |i: usize| corners[(i + 1) % corners.len()] - first;
        let newell: DVec3 = (0..corners.len()).map(|i| (corners[i] - first).cross(next(i))).sum();
        // Without an area there is no plane, and a fan is as good as anything.
        let Some(normal) = newell.try_normalize() else { return false };
        let (x, y) = normal.any_orthonormal_pair();
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&p| DVec2::new((p - first).dot(x), (p - first).dot(y))));
        let size = self.flat.iter().map(|p| p.length_squared()).fold(0.0, f64::max);
        // Corners in float32 that lie on a line give areas of either sign.
        self.flat.windows(2).skip(1).any(|pair| pair[0].perp_dot(pair[1]) < -1e-6 * size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles and the sum of their areas along z.
    fn divided(corners: &[[f64; 2]]) -> (Vec<[usize; 3]>, f64) {
        let corners: Vec<_> = corners.iter().map(|&[x, y]| DVec3::new(x, y, 3.0)).collect();
        let mut triangles = Vec::new();
        Triangulator::new().triangles(&corners, |triangle| triangles.push(triangle));
        let area = |t: &[usize; 3]| 0.5 * (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]).z;
        assert!(triangles.iter().all(|t| area(t) > -1e-12), "a triangle is turned round: {triangles:?}");
        let sum = triangles.iter().map(area).sum();
        (triangles, sum)
    }

    #[test]
    fn convex_polygons_are_fans() {
        assert_eq!(divided(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]).0, [[0, 1, 2], [0, 2, 3]]);
        // Concave, but the fan around its first corner covers it.
        assert_eq!(divided(&[[0.0, 0.0], [2.0, -1.0], [1.0, 0.0], [2.0, 1.0]]).0, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_polygons_cover_their_own_area_only() {
        // An arrow, whose fan would leave it at the second corner.
        let (triangles, area) = divided(&[[2.0, 1.0], [0.0, 0.0], [2.0, -1.0], [1.0, 0.0]]);
        assert_eq!((triangles.len(), area), (2, 1.0));
        // A letter C of area 7: a fan covers 9 and more.
        let c = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [3.0, 2.0], [3.0, 3.0], [0.0, 3.0]];
        let (triangles, area) = divided(&c);
        assert!(triangles.len() == 6 && (area - 7.0).abs() < 1e-12, "{area}");
        // The first and the last corner are the same, one corner stands twice, and one lies on an edge.
        let repeated = [&c[..2], &[[3.0, 0.5], [3.0, 1.0]], &c[2..], &c[..1]].concat();
        assert!((divided(&repeated).1 - 7.0).abs() < 1e-12);
        // Mirrored, with its corners in the opposite order.
        let turned: Vec<_> = c.iter().rev().map(|&[x, y]| [-x, y]).collect();
        assert!((divided(&turned).1 - 7.0).abs() < 1e-12);
    }

    #[test]
    fn a_hole_joined_by_a_double_edge_stays_open() {
        let ring = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ];
        assert!((divided(&ring).1 - 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_comb_of_many_teeth_is_covered_exactly() {
        // 60 teeth of 1 x 10 on a bar of 119 x 1.
        let teeth = (0..60).flat_map(|i| {
            let x = 119.0 - 2.0 * f64::from(i);
            [[x, 1.0], [x, 11.0], [x - 1.0, 11.0], [x - 1.0, 1.0]]
        });
        let comb: Vec<_> = [[0.0, 0.0], [119.0, 0.0]].into_iter().chain(teeth).collect();
        assert!((divided(&comb).1 - 719.0).abs() < 1e-9);
    }

    #[test]
    fn a_face_that_crosses_itself_reaches_every_corner() {
        let mut triangles = Vec::new();
        let bow_tie = [[0.0, 0.0], [3.0, 0.0], [0.0, 2.0], [2.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        Triangulator::new().triangles(&bow_tie, |triangle| triangles.push(triangle));
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_polygon_without_a_plane_is_a_fan() {
        let mut count = 0;
        Triangulator::new().triangles(&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0, DVec3::ZERO], |_| count += 1);
        assert_eq!(count, 2);
    }

    #[test]
    fn corners_need_not_lie_in_one_plane() {
        // The arrow with a bent wing, in the plane x = y.
        let corners = [[2.0, 2.0, 1.0], [0.0, 0.0, 0.0], [2.0, 2.0, -1.0], [1.1, 0.9, 0.0]].map(DVec3::from);
        let mut triangles = Vec::new();
        Triangulator::new().triangles(&corners, |triangle| triangles.push(triangle));
        let from_3 =
            |t: [usize; 3]| std::array::from_fn(|i| t[(i + t.iter().position(|&i| i == 3).expect("a part of it")) % 3]);
        let mut triangles: Vec<[usize; 3]> = triangles.into_iter().map(from_3).collect();
        triangles.sort();
        assert_eq!(triangles, [[3, 0, 1], [3, 1, 2]]);
    }
}
