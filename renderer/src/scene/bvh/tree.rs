//! Builds a tree of triangles.

use glam::{Mat3, Mat4, Vec3, Vec3A};
use halflight_scenes::{Mesh, Scene, Texture};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh, node::CwBvhNode},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    splits::split_aabbs_preset,
    triangle::Triangle,
};

use super::BvhError;
use crate::scene::texel_pool::{self, HEADER};

/// Depth of the shader's stack: `MAX_DEPTH` of `truth/traversal.wgsl`.
const MAX_DEPTH: usize = 24;

/// Bit of a triangle's material for receive-only surfaces. Twin of `truth/path_trace.wgsl`.
const RECEIVE_ONLY: u32 = 1 << 31;

/// Bit of a triangle's material for animated surfaces. Twin of `truth/surface.wgsl`.
const MOVES: u32 = 1 << 30;

/// The meshes of a tree.
#[derive(Clone, Copy)]
pub(super) enum Meshes<'a> {
    /// Those that do not move.
    Static,
    /// Those that do, with the pose of each object.
    Animated(&'a [Mat4]),
}

impl Meshes<'_> {
    /// The pose of a mesh of this tree; `None` for other meshes.
    fn pose_of(self, mesh: &Mesh) -> Option<Mat4> {
        match (self, mesh.object) {
            (Self::Static, None) => Some(Mat4::IDENTITY),
            (Self::Animated(poses), Some(object)) => Some(poses.get(object).copied().unwrap_or(Mat4::IDENTITY)),
            _ => None,
        }
    }
}

/// The nodes of a tree, and texels of 16 bytes: three per triangle for its shape and four for its attributes.
pub(super) struct Tree {
    /// Nodes. Indices are those within the tree.
    pub(super) nodes: Vec<CwBvhNode>,
    /// Box of all triangles.
    pub(super) bounds: Aabb,
    pub(super) triangles: Vec<[u32; 4]>,
    pub(super) attributes: Vec<[u32; 4]>,
    /// Whether any triangle is alpha-masked.
    pub(super) has_holes: bool,
    /// Whether any triangle emits light.
    pub(super) emits: bool,
    /// Slot of each triangle of the scene, in the order of its indices; `None` for a triangle without an area or of another
    /// tree. A triangle in several leaves has several slots, of which this is one.
    pub(super) slots: Vec<Option<u32>>,
}

impl Tree {
    /// Builds the tree of all triangles with an area. The result depends on the scene and the poses only.
    pub(super) fn build(scene: &Scene, meshes: Meshes) -> Result<Self, BvhError> {
        let (triangles, sources) = triangles(scene, meshes);
        let moves = matches!(meshes, Meshes::Animated(_));
        let wide = if moves { build_quickly(&triangles) } else { build_wide(&triangles) };
        let depth = depth(&wide);
        // Animated triangles are built again in other poses, and hang below a common root.
        if depth + if moves { 4 } else { 1 } > MAX_DEPTH {
            return Err(BvhError(format!(
                "scene \"{}\" needs a BVH of {depth} levels and rays take {MAX_DEPTH}; \
                 its triangles differ too much in size: remove the tiniest",
                scene.name
            )));
        }
        let masks = alpha_masks(scene);
        let texel = |v: Vec3A, word: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word];
        let mut bvh = Self {
            bounds: triangles.iter().fold(Aabb::INVALID, |bounds, triangle| bounds.union(&triangle.aabb())),
            nodes: wide.nodes,
            triangles: Vec::with_capacity(3 * wide.primitive_indices.len()),
            attributes: Vec::with_capacity(4 * wide.primitive_indices.len()),
            has_holes: false,
            emits: false,
            slots: vec![None; scene.triangle_count()],
        };
        for (slot, &index) in wide.primitive_indices.iter().enumerate() {
            let Source { mesh, number, corners, pose } = sources[index as usize];
            let triangle = triangles[index as usize];
            bvh.slots[number as usize] = Some(slot as u32);
            let mask = scene.materials.get(mesh.material).and_then(|m| m.alpha_texture).map(|texture| masks[texture]);
            let [start, size] = mask.unwrap_or([0; 2]);
            bvh.has_holes |= mask.is_some();
            bvh.emits |= scene.materials.get(mesh.material).is_some_and(|material| material.emission != [0.0; 3]);
            bvh.triangles.extend([
                texel(triangle.v0, 0),
                texel(triangle.v1 - triangle.v0, start),
                texel(triangle.v2 - triangle.v0, size),
            ]);
            let [n0, n1, n2] = corners.map(|i| {
                let normal = Vec3::from(mesh.normals[i as usize]);
                if !moves {
                    return Vec3A::from(normal);
                }
                let to_world = Mat3::from_mat4(pose).inverse().transpose();
                (to_world * normal).normalize_or(Vec3::Y).into()
            });
            let [a, b, c] = corners.map(|i| mesh.uvs[i as usize].map(f32::to_bits));
            let receives_only = scene.materials.get(mesh.material).is_some_and(|material| material.receive_only);
            let flags = if receives_only { RECEIVE_ONLY } else { 0 } | if moves { MOVES } else { 0 };
            let material = mesh.material as u32 | flags;
            bvh.attributes.extend([texel(n0, a[0]), texel(n1, a[1]), texel(n2, material), [b[0], b[1], c[0], c[1]]]);
        }
        Ok(bvh)
    }
}

/// Source of a triangle.
#[derive(Clone, Copy)]
struct Source<'a> {
    mesh: &'a Mesh,
    /// Number of the triangle in the scene.
    number: u32,
    corners: [u32; 3],
    /// World space at rest to world space.
    pose: Mat4,
}

/// Triangles with finite corners and an area. No ray hits the others.
fn triangles<'a>(scene: &'a Scene, meshes: Meshes) -> (Vec<Triangle>, Vec<Source<'a>>) {
    let all = scene.meshes.iter().flat_map(|mesh| mesh.indices.as_chunks::<3>().0.iter().map(move |&c| (mesh, c)));
    let chosen = (0..).zip(all).filter_map(|(number, (mesh, corners))| {
        let pose = meshes.pose_of(mesh)?;
        let [v0, v1, v2] = corners.map(|i| {
            let position = Vec3A::from(mesh.positions[i as usize]);
            if mesh.object.is_some() { pose.transform_point3a(position) } else { position }
        });
        Some((Triangle { v0, v1, v2 }, Source { mesh, number, corners, pose }))
    });
    chosen
        .filter(|(t, _)| {
            let (edge_1, edge_2) = (t.v1 - t.v0, t.v2 - t.v0);
            let size = edge_1.abs().max(edge_2.abs()).max_element();
            t.v0.is_finite() && (edge_1 / size).cross(edge_2 / size).length_squared() > 0.0
        })
        .unzip()
}

/// For each texture, the index of its first texel in `SceneBuffers::texels` (width and height are before the texels)
/// and its size, with the height in the upper 16 bits.
fn alpha_masks(scene: &Scene) -> Vec<[u32; 2]> {
    let textures = &scene.textures;
    let size = |texture: &Texture| texture.width | texture.height << 16;
    texel_pool::headers(textures).zip(textures).map(|(start, texture)| [start + HEADER, size(texture)]).collect()
}

/// Parameters measured on the atrium under lavapipe: splitting the boxes of large triangles gains 10 % rays per second,
/// leaves of up to three triangles 5 %. Reinserting more than one node in twenty gains nothing.
fn build_wide(triangles: &[Triangle]) -> CwBvh {
    let mut boxes: Vec<_> = triangles.iter().map(Triangle::aabb).collect();
    let mut indices: Vec<_> = (0..triangles.len() as u32).collect();
    let areas = boxes.iter().map(|b| b.half_area());
    let (mean, largest) = (areas.clone().sum::<f32>() / triangles.len().max(1) as f32, areas.fold(0.0, f32::max));
    split_aabbs_preset(&mut boxes, &mut indices, triangles, mean, largest);
    // The crate's own `build_*` functions read a clock, which panics in a browser.
    let mut binary: Bvh2 = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        &boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    binary.uses_spatial_splits = true;
    ReinsertionOptimizer::default().run(&mut binary, 0.05, None);
    bvh2_to_cwbvh(&binary, 3, true, false)
}

/// A tree in a fraction of the time, with more work for each ray.
fn build_quickly(triangles: &[Triangle]) -> CwBvh {
    let boxes: Vec<_> = triangles.iter().map(Triangle::aabb).collect();
    let indices = (0..triangles.len() as u32).collect();
    let binary = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Minimum,
        &boxes,
        indices,
        SortPrecision::U64,
        3,
    );
    bvh2_to_cwbvh(&binary, 3, true, false)
}

/// Number of levels, counted from the root.
fn depth(bvh: &CwBvh) -> usize {
    let mut level = if bvh.nodes.is_empty() { vec![] } else { vec![0] };
    for depth in 0.. {
        if level.is_empty() {
            return depth;
        }
        level = level
            .iter()
            .map(|&index| &bvh.nodes[index as usize])
            .flat_map(|node| (0..node.imask.count_ones()).map(|child| node.child_base_idx + child))
            .collect();
    }
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(triangles: &[[[f32; 3]; 3]]) -> Scene {
        let positions: Vec<_> = triangles.iter().flatten().copied().collect();
        let indices = (0..positions.len() as u32).collect();
        let (normals, uvs) = (vec![[0.0; 3]; positions.len()], vec![[0.0; 2]; positions.len()]);
        Scene { meshes: vec![Mesh { positions, normals, uvs, indices, ..Mesh::default() }], ..Scene::default() }
    }

    #[test]
    fn triangles_without_area_are_left_out() {
        let good = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let broken = [[f32::NAN; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        for (triangles, kept) in
            [(vec![], 0), (vec![line], 0), (vec![good], 1), (vec![line, broken, good, [[1.0; 3]; 3], good], 2)]
        {
            let bvh = Tree::build(&scene(&triangles), Meshes::Static).expect("shallow");
            assert_eq!(bvh.triangles.len(), 3 * kept);
            assert_eq!(bvh.nodes.len(), usize::from(kept > 0));
        }
    }

    #[test]
    fn a_million_to_one_in_size_stays_shallow() {
        // Each triangle is 0.8 times as large as the previous one and nested in its corner.
        let triangles: Vec<_> = (0..60)
            .map(|i| {
                let s = 1e3 * 0.8f32.powi(i);
                [[0.0; 3], [s, 0.0, 0.0], [0.0, s, 0.0]]
            })
            .collect();
        Tree::build(&scene(&triangles), Meshes::Static).expect("fits the stack");
    }
}
