//! Closed solids: bodies of grid cells, padded blocks and rods. Each encloses matter, so that a mesh of them is watertight
//! ([`crate::Mesh::is_watertight`]) if they do not touch each other.

use std::f32::consts::TAU;

use glam::{Affine3A, BVec3, Mat3A, Vec2, Vec3, vec3};

use super::build::{Pen, Profile, planar_uv};

/// Distances of the grid lines of a rounded edge from where the edge begins, in units of its radius.
const EDGE: [f32; 3] = [1.0, 0.5, 0.0];
/// Grid points along each side of a rounded block: two edges and three points between them.
const POINTS: usize = 2 * EDGE.len() + 3;

impl Pen<'_> {
    /// The union of cells of a grid, without the faces between two solid cells. `planes` are the ascending coordinates
    /// of the grid's planes along x, y and z; `solid` says for a cell whether it belongs to the body.
    ///
    /// Neighbours share all corners, so the body is watertight if no two cells touch in an edge or corner alone.
    pub fn cells(&mut self, planes: [&[f32]; 3], solid: impl Fn([usize; 3]) -> bool) {
        let counts = planes.map(|list| list.len() - 1);
        let is_solid = |cell: [Option<usize>; 3]| match cell {
            [Some(x), Some(y), Some(z)] => x < counts[0] && y < counts[1] && z < counts[2] && solid([x, y, z]),
            _ => false,
        };
        for i in 0..counts[0] * counts[1] * counts[2] {
            let cell = [i % counts[0], i / counts[0] % counts[1], i / (counts[0] * counts[1])];
            if !solid(cell) {
                continue;
            }
            let at = |high: usize| Vec3::from(std::array::from_fn::<f32, 3, _>(|axis| planes[axis][cell[axis] + high]));
            let (low, high) = (at(0), at(1));
            let corner = |i: usize| Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
            for (axis, up, corners) in [
                (0, false, [0, 4, 6, 2]),
                (0, true, [1, 3, 7, 5]),
                (1, false, [0, 1, 5, 4]),
                (1, true, [2, 6, 7, 3]),
                (2, false, [0, 2, 3, 1]),
                (2, true, [4, 5, 7, 6]),
            ] {
                let mut next = cell.map(Some);
                next[axis] = if up { Some(cell[axis] + 1) } else { cell[axis].checked_sub(1) };
                if !is_solid(next) {
                    self.quad(corners.map(corner));
                }
            }
        }
    }

    /// A block between two opposite corners with rounded edges of this radius, like upholstery. Its faces bulge outwards
    /// by `bulge` in their centres.
    pub fn rounded(&mut self, low: Vec3, high: Vec3, radius: f32, bulge: Vec3) {
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let inner = half - radius;
        let lines: [[f32; POINTS]; 3] = std::array::from_fn(|axis| {
            std::array::from_fn(|i| match (i.checked_sub(EDGE.len()), (POINTS - 1 - i).checked_sub(EDGE.len())) {
                (None, _) => -inner[axis] - radius * EDGE[i],
                (_, None) => inner[axis] + radius * EDGE[POINTS - 1 - i],
                (Some(k), _) => inner[axis] * (0.5 * (k as f32 + 1.0) - 1.0),
            })
        });
        let position = |[x, y, z]: [usize; 3]| {
            let on_block = vec3(lines[0][x], lines[1][y], lines[2][z]);
            let nearest = on_block.clamp(-inner, inner);
            let rounded = nearest + radius * (on_block - nearest).normalize_or_zero();
            let t = on_block / half;
            let open = 1.0 - t * t;
            centre + rounded + bulge * t * vec3(open.y * open.z, open.z * open.x, open.x * open.y)
        };
        // A point on the surface has one vertex, whichever of its faces asks for it.
        let index = |[x, y, z]: [usize; 3]| (z * POINTS + y) * POINTS + x;
        let mut normals = vec![Vec3::ZERO; POINTS * POINTS * POINTS];
        let mut cells = vec![];
        for (axis, high) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
            for i in 0..(POINTS - 1) * (POINTS - 1) {
                let (u, v) = (i % (POINTS - 1), i / (POINTS - 1));
                let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                    let mut point = [0; 3];
                    point[axis] = if high { POINTS - 1 } else { 0 };
                    point[(axis + 1) % 3] = u + du;
                    point[(axis + 2) % 3] = v + dv;
                    point
                });
                if !high {
                    quad.reverse();
                }
                let [a, b, c, d] = quad.map(position);
                let normal = (c - a).cross(d - b);
                quad.iter().for_each(|&point| normals[index(point)] += normal);
                cells.push(quad);
            }
        }
        let mut vertices = vec![None; normals.len()];
        for quad in cells {
            let [a, b, c, d] = quad.map(|point| {
                let normal = normals[index(point)];
                *vertices[index(point)].get_or_insert_with(|| {
                    let at = position(point);
                    self.vertex(at, normal, planar_uv(at, normal))
                })
            });
            self.triangle([a, b, c]);
            self.triangle([a, c, d]);
        }
    }

    /// A round rod with flat ends whose radius changes linearly from the first to the second end.
    pub fn rod(&mut self, ends: [Vec3; 2], radii: [f32; 2], sides: usize) {
        let along = ends[1] - ends[0];
        let axis = along.normalize();
        let across = axis.any_orthonormal_vector();
        let basis = Mat3A::from_cols(across.into(), axis.into(), across.cross(axis).into());
        let length = along.length();
        let profile = Profile::new(&[[0.0, 0.0], [radii[0], 0.0], [radii[1], length], [0.0, length]]);
        self.sweep(
            &profile,
            (0..=sides).map(|i| {
                let turn = TAU * (i % sides) as f32 / sides as f32;
                let matrix3 = basis * Mat3A::from_rotation_y(turn);
                (Affine3A { matrix3, translation: ends[0].into() }, radii[0] * TAU * i as f32 / sides as f32)
            }),
        );
    }

    /// A ball.
    pub fn ball(&mut self, centre: Vec3, radius: f32, segments: usize) {
        let rings = segments / 2;
        let points: Vec<[f32; 2]> = (0..=rings)
            .map(|i| {
                let up = Vec2::from_angle(0.5 * TAU * i as f32 / rings as f32);
                [if i % rings == 0 { 0.0 } else { radius * up.y }, -radius * up.x]
            })
            .collect();
        self.lathe(centre, &Profile::new(&points), segments);
    }
}

#[cfg(test)]
mod tests {
    use super::super::build::Builder;
    use super::*;
    use crate::Mesh;

    /// What `draw` draws, and the volume that it encloses.
    fn solid(draw: impl Fn(&mut Pen<'_>)) -> (Mesh, f32) {
        let mut builder = Builder::default();
        let material = builder.plain("solid", [0.5; 3]);
        draw(&mut builder.on(material));
        let mesh = builder.finish().meshes.remove(0);
        let corner = |i: u32| Vec3::from(mesh.positions[i as usize]);
        let sum = |t: &[u32]| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])));
        let volume = mesh.indices.chunks_exact(3).map(sum).sum::<f32>() / 6.0;
        (mesh, volume)
    }

    /// Float32 sums of a few thousand terms near 1 are exact to about 1e-5.
    fn assert_near(value: f32, expected: f32) {
        assert!((value - expected).abs() < 1e-5 * expected.abs().max(1.0), "{value} instead of {expected}");
    }

    #[test]
    fn cells_have_no_faces_between_them() {
        // A ring: eight cells of 1x1x1 around an opening.
        let lines = [0.0, 1.0, 2.0, 3.0];
        let (ring, volume) = solid(|pen| pen.cells([&lines, &lines, &[0.0, 1.0]], |[i, j, _]| i != 1 || j != 1));
        assert!(ring.is_watertight());
        assert_near(volume, 8.0);
        // Front and back have 8 faces each, the outside 12 and the opening 4.
        assert_eq!(ring.indices.len() / 3, 2 * (8 + 8 + 12 + 4));
    }

    #[test]
    fn a_rounded_block_is_closed_and_keeps_to_its_corners() {
        let (low, high) = (vec3(-1.0, 0.5, 2.0), vec3(1.0, 1.5, 2.6));
        let (block, volume) = solid(|pen| pen.rounded(low, high, 0.1, Vec3::ZERO));
        assert!(block.is_watertight());
        let points = || block.positions.iter().map(|&p| Vec3::from(p));
        let reached = points().fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(p), h.max(p)));
        assert!(reached.0.distance(low) < 1e-6 && reached.1.distance(high) < 1e-6, "{reached:?}");
        // Between the block without its edges' strips and the true rounded block: three pairs of plates, twelve quarters
        // of a cylinder, one ball.
        let (a, b, c, r) = (1.8, 0.8, 0.4, 0.1_f32);
        let plates = 2.0 * r * (a * b + b * c + c * a) + a * b * c;
        let round = 0.5 * TAU * r * r * (a + b + c) + 2.0 / 3.0 * TAU * r * r * r;
        assert!(plates < volume && volume < plates + round, "{volume}");
        // Facets cut off little: an edge of four facets has 97 % of its quarter circle.
        assert!(volume > plates + 0.9 * round, "{volume} of {}", plates + round);
        // Every point of the surface has the distance r from the inner block.
        let inner = |p: Vec3| p.clamp(low + r, high - r);
        assert!(points().all(|p| (p.distance(inner(p)) - r).abs() < 1e-6));
    }

    #[test]
    fn a_bulge_moves_the_centres_of_faces_only() {
        let bulge = vec3(0.1, 0.2, 0.3);
        let (block, _) = solid(|pen| pen.rounded(-Vec3::ONE, Vec3::ONE, 0.25, bulge));
        assert!(block.is_watertight());
        let high = block.positions.iter().fold(Vec3::MIN, |high, &p| high.max(p.into()));
        assert!(high.distance(Vec3::ONE + bulge) < 1e-6, "{high}");
    }

    #[test]
    fn rods_and_balls_are_closed() {
        let (ends, radii) = ([vec3(0.3, -0.2, 0.1), vec3(0.7, 0.9, -0.5)], [0.2, 0.1]);
        let (rod, volume) = solid(|pen| pen.rod(ends, radii, 16));
        assert!(rod.is_watertight());
        // A frustum over a regular polygon.
        let length = ends[0].distance(ends[1]);
        let polygon = 8.0 * (TAU / 16.0).sin();
        assert_near(volume, polygon * length * (0.04 + 0.02 + 0.01) / 3.0);
        let (ball, volume) = solid(|pen| pen.ball(Vec3::ONE, 0.5, 64));
        assert!(ball.is_watertight());
        // Inscribed: a little less than the ball, 0.4 % in the plane and 0.2 % along the meridian at 64 segments.
        let exact = 2.0 / 3.0 * TAU * 0.125;
        assert!(volume < exact && volume > 0.99 * exact, "{volume} of {exact}");
    }
}
