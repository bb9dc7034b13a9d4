//! Whether a mesh encloses solid matter, which decides how it may be voxelized.

use rustc_hash::FxHashMap;

use crate::data::{Mesh, Scene};

impl Scene {
    /// Whether a mesh of this scene is the boundary of solid matter: watertight and without an alpha mask.
    pub fn is_solid(&self, mesh: &Mesh) -> bool {
        let masked = self.materials.get(mesh.material).is_some_and(|material| material.alpha_texture.is_some());
        !masked && mesh.is_watertight()
    }
}

impl Mesh {
    /// Whether the mesh is the boundary of solid matter: every edge has exactly two faces, which use it in opposite
    /// directions, and every connected part encloses a positive volume. A closed room is not watertight in this sense,
    /// because it encloses air and its volume is negative. Vertices are equal if their positions are, whatever their
    /// normals and texture coordinates. Triangles of zero area are ignored.
    ///
    /// For a watertight mesh the parity of the faces along a line separates inside from outside (Eisemann and Décoret
    /// 2008).
    pub fn is_watertight(&self) -> bool {
        let mut corners = FxHashMap::default();
        let mut welded = Vec::with_capacity(self.positions.len());
        for position in &self.positions {
            // Adding 0 turns -0 into 0, which is the same position.
            let next = corners.len();
            welded.push(*corners.entry(position.map(|v| (v + 0.0).to_bits())).or_insert(next));
        }
        let mut parts = Parts::new(corners.len());
        let mut edges: FxHashMap<[usize; 2], [u32; 2]> = FxHashMap::default();
        let mut volumes = vec![0.0; corners.len()];
        let triangles = || {
            let corners = self.indices.as_chunks::<3>().0.iter();
            corners.map(|triangle| triangle.map(|i| welded[i as usize])).zip(self.indices.as_chunks::<3>().0)
        };
        let flat = |[a, b, c]: [usize; 3]| a == b || b == c || c == a;
        for (triangle, _) in triangles().filter(|(t, _)| !flat(*t)) {
            for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|i| triangle[i])) {
                edges.entry([from.min(to), from.max(to)]).or_default()[usize::from(from < to)] += 1;
                parts.join(from, to);
            }
        }
        if edges.is_empty() || edges.values().any(|&faces| faces != [1, 1]) {
            return false;
        }
        for (triangle, vertices) in triangles().filter(|(t, _)| !flat(*t)) {
            // Six times the signed volume of the tetrahedron between the triangle and a corner of its own part. A far
            // origin would lose it in rounding.
            let part = parts.of(triangle[0]);
            let [a, b, c] = vertices.map(|i| glam::DVec3::from(self.positions[i as usize].map(f64::from)));
            let origin = parts.origin(part, a);
            volumes[part] += (a - origin).dot((b - origin).cross(c - origin));
        }
        // Corners that represent no part are skipped.
        (0..volumes.len()).all(|i| parts.of(i) != i || parts.origins[i].is_none() || volumes[i] > 0.0)
    }
}

/// Connected parts as a union-find forest: every corner leads to its part's representative.
struct Parts {
    parents: Vec<usize>,
    origins: Vec<Option<glam::DVec3>>,
}

impl Parts {
    fn new(count: usize) -> Self {
        Self { parents: (0..count).collect(), origins: vec![None; count] }
    }

    fn of(&mut self, mut corner: usize) -> usize {
        while self.parents[corner] != corner {
            self.parents[corner] = self.parents[self.parents[corner]];
            corner = self.parents[corner];
        }
        corner
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.parents[a] = b;
    }

    /// The first corner requested for this part.
    fn origin(&mut self, part: usize, corner: glam::DVec3) -> glam::DVec3 {
        *self.origins[part].get_or_insert(corner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit cube whose faces have their own vertices, as readers and generators produce them.
    fn cube(at: [f32; 3]) -> Mesh {
        let corner = |i: u32| [(i & 1) as f32 + at[0], (i >> 1 & 1) as f32 + at[1], (i >> 2) as f32 + at[2]];
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut mesh = Mesh::default();
        for (face, corners) in faces.into_iter().enumerate() {
            mesh.positions.extend(corners.map(corner));
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| 4 * face as u32 + i));
        }
        mesh
    }

    fn joined(meshes: [Mesh; 2]) -> Mesh {
        let [mut mesh, other] = meshes;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(other.positions);
        mesh.indices.extend(other.indices.iter().map(|i| first + i));
        mesh
    }

    fn inside_out(mut mesh: Mesh) -> Mesh {
        mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        mesh
    }

    #[test]
    fn closed_boundaries_of_solid_matter_are_watertight() {
        assert!(cube([0.0; 3]).is_watertight());
        assert!(cube([1e6, -1e6, 0.0]).is_watertight());
        assert!(joined([cube([0.0; 3]), cube([3.0; 3])]).is_watertight());
        // A triangle of zero area changes nothing.
        let mut mesh = cube([0.0; 3]);
        mesh.indices.extend([0, 0, 1]);
        assert!(mesh.is_watertight());
    }

    #[test]
    fn holes_duplicate_faces_and_rooms_are_not_watertight() {
        assert!(!Mesh::default().is_watertight());
        let mut open = cube([0.0; 3]);
        open.indices.truncate(33);
        assert!(!open.is_watertight(), "a triangle is missing");
        let mut turned = cube([0.0; 3]);
        turned.indices.swap(1, 2);
        assert!(!turned.is_watertight(), "a triangle is flipped");
        let mut double = cube([0.0; 3]);
        double.indices.extend([0, 1, 2]);
        assert!(!double.is_watertight(), "a face is duplicated");
        assert!(!inside_out(cube([0.0; 3])).is_watertight(), "a room encloses air");
        assert!(!joined([cube([0.0; 3]), inside_out(cube([3.0; 3]))]).is_watertight(), "a part is a room");
        // Two cubes that share a face's edges: four faces meet there.
        assert!(!joined([cube([0.0; 3]), cube([1.0, 1.0, 0.0])]).is_watertight(), "four faces at an edge");
    }
}
