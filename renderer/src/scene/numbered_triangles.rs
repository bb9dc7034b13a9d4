//! Triangles that carry their number to the fragment shader without `primitive_index`.

use halflight_frame_graph::Gpu;
use halflight_scenes::{Mesh, Scene};

/// The triangles with their numbers, for browsers without `primitive_index`: the first corner of each triangle, from
/// which a flat varying is taken, begins no other triangle.
pub(crate) struct NumberedTriangles {
    /// Index buffer into `corners`, in the order of the scene's indices.
    pub(crate) indices: wgpu::Buffer,
    /// `array<vec2u>`: a vertex, and the number of the triangle that begins with it, counted from 1.
    pub(crate) corners: wgpu::Buffer,
}

impl NumberedTriangles {
    /// Uploads the triangles of `indices`, three per triangle, over this many vertices.
    pub(crate) fn new(gpu: &Gpu, vertices: u32, indices: &[u32]) -> Self {
        let (mut indices, mut corners) = numbered(vertices, indices);
        if indices.is_empty() {
            (indices, corners) = (vec![0; 3], vec![[0; 2]]);
        }
        let buffer = |label, bytes: &[u8], usage| gpu.filled_buffer(label, bytes, usage);
        Self {
            indices: buffer("numbered triangles", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            corners: buffer("scene.corners", bytemuck::cast_slice(&corners), wgpu::BufferUsages::STORAGE),
        }
    }
}

/// Number of the corners that [`NumberedTriangles`] uploads for this scene.
pub(super) fn corner_count(scene: &Scene) -> u64 {
    let of_mesh = |mesh: &Mesh| {
        let mut taken = vec![false; mesh.positions.len()];
        let mut count = mesh.positions.len() as u64;
        for of in mesh.indices.as_chunks::<3>().0 {
            match of.iter().find(|&&corner| !taken[corner as usize]) {
                Some(&corner) => taken[corner as usize] = true,
                None => count += 1,
            }
        }
        count
    };
    // Triangles of different meshes share no vertex.
    scene.meshes.iter().map(of_mesh).sum()
}

/// Indices with each triangle rotated so that it begins with a corner of its own, and those corners: a vertex and the
/// number of the triangle that begins with it, counted from 1, or 0. A vertex is duplicated if all corners of a
/// triangle are taken.
fn numbered(vertices: u32, indices: &[u32]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut corners: Vec<[u32; 2]> = (0..vertices).map(|vertex| [vertex, 0]).collect();
    let mut turned = Vec::with_capacity(indices.len());
    for (triangle, of) in indices.chunks_exact(3).enumerate() {
        let free = (0..3).find(|&i| corners[of[i] as usize][1] == 0);
        let (turn, first) = free.map_or((0, corners.len() as u32), |i| (i, of[i]));
        if free.is_none() {
            corners.push([of[0], 0]);
        }
        corners[first as usize][1] = triangle as u32 + 1;
        turned.extend([first, of[(turn + 1) % 3], of[(turn + 2) % 3]]);
    }
    (turned, corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_triangle_begins_with_a_corner_of_its_own() {
        // A closed fan around vertex 0, and a triangle without a free vertex.
        let fan = [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1, 0, 1, 2, 1, 2, 3];
        let (turned, corners) = numbered(5, &fan);
        let vertex = |corner: &u32| corners[*corner as usize][0];
        for (triangle, (own, of)) in turned.chunks_exact(3).zip(fan.chunks_exact(3)).enumerate() {
            assert_eq!(corners[own[0] as usize][1], triangle as u32 + 1);
            let own: Vec<u32> = own.iter().map(vertex).collect();
            assert!((0..3).any(|turn| own == [of[turn], of[(turn + 1) % 3], of[(turn + 2) % 3]]), "{own:?} {of:?}");
        }
        // Five vertices serve five triangles. The sixth triangle duplicates one.
        assert_eq!(corners.len(), 6);
    }
}
