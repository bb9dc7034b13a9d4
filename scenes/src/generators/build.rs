//! Mesh building: a pen that draws quads, boxes, swept profiles and curved surfaces in one material.

use std::f32::consts::TAU;

use glam::{Affine3A, BVec3, Mat3A, Vec2, Vec3};

use super::Geometry;
use crate::{Material, Mesh, Texture};

/// Cosine of 40 degrees. Sharper corners of a profile are hard edges; gentler ones are shaded smoothly.
const CREASE_COSINE: f32 = 0.766;

/// Twice the area, square metres, below which a triangle is dropped: collapsed poles and strips of zero width.
const DEGENERATE_AREA: f32 = 1e-9;

/// The face of a block with the normal -x.
pub const LEFT: u8 = 1;
/// Normal +x.
pub const RIGHT: u8 = 2;
/// Normal -y.
pub const BELOW: u8 = 4;
/// Normal +y.
pub const ABOVE: u8 = 8;
/// Normal -z.
pub const BEHIND: u8 = 16;
/// Normal +z.
pub const FRONT: u8 = 32;

/// A geometry under construction: one mesh per material.
#[derive(Default)]
pub struct Builder {
    geometry: Geometry,
    /// Length that one repeat of each material's texture covers, metres.
    repeats: Vec<f32>,
    /// Local to world space of the parts that are drawn next; rotation and translation only.
    pub frame: Affine3A,
}

/// Index of a material of a [`Builder`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(usize);

impl Builder {
    /// Adds an untextured material of this linear albedo.
    pub fn plain(&mut self, name: &str, albedo: [f32; 3]) -> MaterialId {
        self.add(Material { name: name.into(), albedo, ..Material::default() }, 1.0)
    }

    /// Adds a material with this albedo texture; one repeat covers `metres`.
    pub fn textured(&mut self, texture: Texture, metres: f32) -> MaterialId {
        let name = texture.name.trim_end_matches(".png").to_owned();
        let index = self.geometry.textures.len();
        let masked = texture.rgba.chunks_exact(4).any(|texel| texel[3] < 255);
        self.geometry.textures.push(texture);
        self.add(
            Material {
                name,
                albedo: [1.0; 3],
                albedo_texture: Some(index),
                alpha_texture: masked.then_some(index),
                ..Material::default()
            },
            metres,
        )
    }

    /// Adds a material; one repeat of its texture covers `metres`.
    pub fn add(&mut self, material: Material, metres: f32) -> MaterialId {
        let id = self.geometry.materials.len();
        self.geometry.meshes.push(Mesh { name: material.name.clone(), material: id, ..Mesh::default() });
        self.geometry.materials.push(material);
        self.repeats.push(metres);
        MaterialId(id)
    }

    /// A pen that draws in this material, in the current frame.
    pub fn on(&mut self, MaterialId(id): MaterialId) -> Pen<'_> {
        Pen { mesh: &mut self.geometry.meshes[id], frame: self.frame, repeat: self.repeats[id] }
    }

    /// The finished geometry, without empty meshes.
    pub fn finish(mut self) -> Geometry {
        self.geometry.meshes.retain(|mesh| !mesh.indices.is_empty());
        self.geometry
    }
}

/// A rigid frame: `quarter_turns` of 90 degrees about +y (exact, no rounding), then a translation.
pub fn placed(quarter_turns: i32, translation: Vec3) -> Affine3A {
    let (x, z) = match quarter_turns.rem_euclid(4) {
        0 => (Vec3::X, Vec3::Z),
        1 => (Vec3::NEG_Z, Vec3::X),
        2 => (Vec3::NEG_X, Vec3::NEG_Z),
        _ => (Vec3::Z, Vec3::NEG_X),
    };
    Affine3A { matrix3: Mat3A::from_cols(x.into(), Vec3::Y.into(), z.into()), translation: translation.into() }
}

/// Draws into the mesh of one material. Texture coordinates are given in metres.
pub struct Pen<'a> {
    mesh: &'a mut Mesh,
    frame: Affine3A,
    repeat: f32,
}

impl Pen<'_> {
    /// Adds a vertex and returns its index. The normal need not be unit length.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        let index = self.mesh.positions.len() as u32;
        self.mesh.positions.push(self.frame.transform_point3(position).into());
        self.mesh.normals.push(self.frame.transform_vector3(normal).normalize_or(Vec3::Y).into());
        self.mesh.uvs.push((uv / self.repeat).into());
        index
    }

    /// Adds a triangle whose winding agrees with its vertex normals. Degenerate triangles are dropped.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        let position = |i: u32| Vec3::from(self.mesh.positions[i as usize]);
        let normal = |i: u32| Vec3::from(self.mesh.normals[i as usize]);
        let face = (position(b) - position(a)).cross(position(c) - position(a));
        if face.length() > DEGENERATE_AREA {
            let along = face.dot(normal(a) + normal(b) + normal(c)) >= 0.0;
            self.mesh.indices.extend(if along { [a, b, c] } else { [a, c, b] });
        }
    }

    /// A flat quad with corners in counter-clockwise order; `uvs` in metres.
    pub fn quad_uv(&mut self, corners: [Vec3; 4], uvs: [Vec2; 4]) {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        let [a, b, c, d] = std::array::from_fn(|i| self.vertex(corners[i], normal, uvs[i]));
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// A flat quad textured by projection along the main axis of its normal.
    pub fn quad(&mut self, corners: [Vec3; 4]) {
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
        self.quad_uv(corners, corners.map(|corner| planar_uv(corner, normal)));
    }

    /// A solid box between two opposite corners.
    pub fn block(&mut self, low: Vec3, high: Vec3) {
        self.block_without(0, low, high);
    }

    /// A box without the faces of the set `hidden`, which are inside other parts.
    pub fn block_without(&mut self, hidden: u8, low: Vec3, high: Vec3) {
        let corner = |i: usize| Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
        for (face, corners) in [
            (BEHIND, [0, 2, 3, 1]),
            (FRONT, [4, 5, 7, 6]),
            (BELOW, [0, 1, 5, 4]),
            (ABOVE, [2, 6, 7, 3]),
            (LEFT, [0, 4, 6, 2]),
            (RIGHT, [1, 3, 7, 5]),
        ] {
            if hidden & face == 0 {
                self.quad(corners.map(corner));
            }
        }
    }

    /// A curved sheet: `surface(s, t)` gives position and texture coordinates (metres) for s and t in 0..1.
    /// It faces d/ds x d/dt. The normal of a vertex is the area-weighted mean of the facets around it.
    pub fn sheet(&mut self, columns: usize, rows: usize, surface: impl Fn(f32, f32) -> (Vec3, Vec2)) {
        let start = self.mesh.positions.len();
        let points: Vec<_> = (0..=rows)
            .flat_map(|j| (0..=columns).map(move |i| (i as f32 / columns as f32, j as f32 / rows as f32)))
            .map(|(s, t)| surface(s, t))
            .collect();
        let cells: Vec<[usize; 4]> = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| j * (columns + 1) + i))
            .map(|a| [a, a + 1, a + columns + 2, a + columns + 1])
            .collect();
        let mut normals = vec![Vec3::ZERO; points.len()];
        for &[a, b, c, d] in &cells {
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                let facet = (points[b].0 - points[a].0).cross(points[c].0 - points[a].0);
                for corner in [a, b, c] {
                    normals[corner] += facet;
                }
            }
        }
        for (&(position, uv), normal) in points.iter().zip(normals) {
            self.vertex(position, normal, uv);
        }
        for cell in cells {
            self.cell(cell.map(|corner| (start + corner) as u32));
        }
    }

    /// A profile swept along frames. Each station maps the profile's plane to x and y of a frame; `u` is its texture
    /// coordinate (metres). The profile's `v` is its arc length.
    pub fn sweep(&mut self, profile: &Profile, stations: impl IntoIterator<Item = (Affine3A, f32)>) {
        self.carry(profile, stations, |(frame, u), point, normal| {
            (frame.transform_point3(point.extend(0.0)), frame.transform_vector3(normal.extend(0.0)), *u)
        });
    }

    /// Sweeps a profile along stations. `place` gives position, normal and `u` of a point of the profile.
    fn carry<S>(
        &mut self,
        profile: &Profile,
        stations: impl IntoIterator<Item = S>,
        place: impl Fn(&S, Vec2, Vec2) -> (Vec3, Vec3, f32),
    ) {
        let start = self.mesh.positions.len() as u32;
        let mut count = 0;
        for station in stations {
            for &(point, normal, arc) in &profile.rows {
                let (position, normal, u) = place(&station, point, normal);
                self.vertex(position, normal, Vec2::new(u, arc));
            }
            count += 1;
        }
        let width = profile.rows.len() as u32;
        for station in 0..count - 1 {
            for &band in &profile.bands {
                let a = start + station * width + band;
                self.cell([a, a + 1, a + width + 1, a + width]);
            }
        }
    }

    /// A surface of revolution: a profile of (radius, height) about the y axis through `foot`.
    pub fn lathe(&mut self, foot: Vec3, profile: &Profile, segments: usize) {
        let girth = profile.rows.iter().map(|row| row.0.x).fold(0.0, f32::max) * TAU;
        self.sweep(
            profile,
            (0..=segments).map(|i| {
                let turn = i as f32 / segments as f32;
                // The last station equals the first exactly, so that the seam is closed.
                let spin = Mat3A::from_rotation_y(if i == segments { 0.0 } else { turn * TAU });
                (Affine3A { matrix3: spin, translation: foot.into() }, turn * girth)
            }),
        );
    }

    /// A profile of (outward, up) extruded along x at height `y`, towards +z from the plane `z`. Its ends are mitred:
    /// they move inwards by `mitre` times the distance from the plane. 1 fits a concave corner, -1 a convex one.
    pub fn moulding(&mut self, profile: &Profile, x: [f32; 2], y: f32, z: f32, mitre: f32) {
        self.carry(profile, [(x[0], mitre), (x[1], -mitre)], |&(x, mitre), point, normal| {
            let x = x + mitre * (point.x + z);
            (Vec3::new(x, y + point.y, z + point.x), Vec3::new(0.0, normal.y, normal.x), x)
        });
    }

    /// A round bar along a polyline, open at its ends.
    pub fn tube(&mut self, path: &[Vec3], radius: f32, sides: usize) {
        let mut travelled = 0.0;
        let mut across = (path[1] - path[0]).normalize().any_orthonormal_vector();
        let stations: Vec<_> = (0..path.len())
            .map(|i| {
                let tangent = (path[(i + 1).min(path.len() - 1)] - path[i.saturating_sub(1)]).normalize();
                // The frame is transported without twist.
                across = (across - tangent * across.dot(tangent)).normalize();
                travelled += if i > 0 { path[i].distance(path[i - 1]) } else { 0.0 };
                let matrix3 = Mat3A::from_cols(across.into(), tangent.cross(across).into(), tangent.into());
                (Affine3A { matrix3, translation: path[i].into() }, travelled)
            })
            .collect();
        self.sweep(&Profile::circle(radius, sides), stations);
    }

    fn cell(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }
}

/// A cross-section: a polyline whose outside is on its right.
pub struct Profile {
    /// Point, unit outward normal, arc length from the start.
    rows: Vec<(Vec2, Vec2, f32)>,
    /// Rows that are connected to the next row.
    bands: Vec<u32>,
}

impl Profile {
    /// A profile through these points: smooth at gentle corners, creased at sharp ones.
    pub fn new(points: &[[f32; 2]]) -> Self {
        let points: Vec<Vec2> = points.iter().map(|&p| p.into()).collect();
        let outward: Vec<Vec2> = points.windows(2).map(|w| -(w[1] - w[0]).perp().normalize_or_zero()).collect();
        let (mut rows, mut bands, mut arc) = (vec![(points[0], outward[0], 0.0)], vec![], 0.0);
        for (i, pair) in points.windows(2).enumerate() {
            arc += pair[0].distance(pair[1]);
            bands.push(rows.len() as u32 - 1);
            let next = outward.get(i + 1).copied().unwrap_or(outward[i]);
            if outward[i].dot(next) < CREASE_COSINE {
                rows.extend([(pair[1], outward[i], arc), (pair[1], next, arc)]);
            } else {
                rows.push((pair[1], (outward[i] + next).normalize(), arc));
            }
        }
        Self { rows, bands }
    }

    /// A full circle of `sides` sides.
    pub fn circle(radius: f32, sides: usize) -> Self {
        let rows = (0..=sides).map(|i| {
            let turn = i as f32 / sides as f32;
            let normal = Vec2::from_angle(if i == sides { 0.0 } else { turn * TAU });
            (normal * radius, normal, turn * TAU * radius)
        });
        Self { rows: rows.collect(), bands: (0..sides as u32).collect() }
    }
}

/// Reproducible random numbers: a permuted congruential generator (PCG-RXS-M-XS 32).
pub struct Chance(u32);

impl Chance {
    /// One stream per seed.
    pub fn new(seed: u32) -> Self {
        Self(hash(seed))
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        unit(permute(self.0))
    }

    /// Uniform between two bounds.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// One step of the generator: a hash of its argument.
pub fn hash(value: u32) -> u32 {
    permute(value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453))
}

/// The upper 24 bits as a number in 0..1.
pub fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 / (1 << 24) as f32
}

fn permute(state: u32) -> u32 {
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Texture coordinates in metres by projection along the main axis of `normal`; `v` points down on a wall.
pub fn planar_uv(position: Vec3, normal: Vec3) -> Vec2 {
    let n = normal.abs();
    if n.y >= n.x && n.y >= n.z {
        Vec2::new(position.x, position.z)
    } else if n.x >= n.z {
        Vec2::new(position.z, -position.y)
    } else {
        Vec2::new(position.x, -position.y)
    }
}
