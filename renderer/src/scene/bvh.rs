//! The BVH of a scene in the layout of `truth/traversal.wgsl`, for passes that trace rays.

use glam::Vec3A;
use halflight_frame_graph::Gpu;
use halflight_scenes::{Mesh, Scene, Texture};
use obvhs::{
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    splits::split_aabbs_preset,
    triangle::Triangle,
};

use super::texel_pool::{self, HEADER};

/// Why a scene has no BVH: one sentence with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BvhError(String);

/// The BVH on a device: three textures of 16-byte texels.
pub struct SceneBvh {
    /// Five texels per node.
    pub nodes: wgpu::Texture,
    /// Three texels per triangle: its corners and alpha mask.
    pub triangles: wgpu::Texture,
    /// Four texels per triangle: normals, texture coordinates and material.
    pub attributes: wgpu::Texture,
    /// Whether any triangle is alpha-masked.
    pub has_holes: bool,
    /// Slot of each triangle of the scene, in the order of its indices; `None` for a triangle without an area.
    pub(crate) slots: Vec<Option<u32>>,
}

impl SceneBvh {
    /// Builds and uploads the BVH of all triangles at rest.
    ///
    /// # Errors
    /// If it is too deep or too large for the device.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, BvhError> {
        let bvh = Bvh::build(scene)?;
        Ok(Self {
            nodes: upload(gpu, "scene.bvh_nodes", bvh.nodes)?,
            triangles: upload(gpu, "scene.bvh_triangles", bvh.triangles)?,
            attributes: upload(gpu, "scene.bvh_attributes", bvh.attributes)?,
            has_holes: bvh.has_holes,
            slots: bvh.slots,
        })
    }

    /// Bytes on the device.
    pub(crate) fn bytes(&self) -> u64 {
        let texels = |texture: &wgpu::Texture| u64::from(texture.width()) * u64::from(texture.height());
        [&self.nodes, &self.triangles, &self.attributes].into_iter().map(texels).sum::<u64>() * 16
    }
}

/// Texels in a row of the BVH's textures: 2^`ROW_BITS` of `truth/traversal.wgsl`.
const ROW: usize = 4096;

fn upload(gpu: &Gpu, label: &str, mut texels: Vec<[u32; 4]>) -> Result<wgpu::Texture, BvhError> {
    use wgpu::util::DeviceExt;
    let rows = texels.len().div_ceil(ROW).max(1);
    let most = gpu.device.limits().max_texture_dimension_2d;
    if rows > most as usize {
        return Err(BvhError(format!(
            "the scene's BVH takes {rows} texture rows and the adapter allows {most}; use a scene of fewer triangles"
        )));
    }
    texels.resize(rows * ROW, [0; 4]);
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: ROW as u32, height: rows as u32, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    };
    let bytes = bytemuck::cast_slice(&texels);
    Ok(gpu.device.create_texture_with_data(&gpu.queue, &descriptor, Default::default(), bytes))
}

/// Depth of the shader's stack: `MAX_DEPTH` of `truth/traversal.wgsl`.
const MAX_DEPTH: usize = 24;

/// Bit of a triangle's material for receive-only surfaces. Twin of `truth/path_trace.wgsl`.
const RECEIVE_ONLY: u32 = 1 << 31;

/// Texels of 16 bytes: five per node, three per triangle for its shape and four for its attributes.
struct Bvh {
    nodes: Vec<[u32; 4]>,
    triangles: Vec<[u32; 4]>,
    attributes: Vec<[u32; 4]>,
    /// Whether any triangle is alpha-masked.
    has_holes: bool,
    /// Slot of each triangle of the scene, in the order of its indices; `None` for a triangle without an area. A triangle
    /// in several leaves has several slots, of which this is one.
    slots: Vec<Option<u32>>,
}

impl Bvh {
    /// Builds the BVH of all triangles with an area. The result depends on the scene only.
    fn build(scene: &Scene) -> Result<Self, BvhError> {
        let (triangles, sources) = triangles(scene);
        let wide = build_wide(&triangles);
        let depth = depth(&wide);
        if depth > MAX_DEPTH {
            return Err(BvhError(format!(
                "scene \"{}\" needs a BVH of {depth} levels and rays take {MAX_DEPTH}; \
                 its triangles differ too much in size: remove the tiniest",
                scene.name
            )));
        }
        let masks = alpha_masks(scene);
        let texel = |v: Vec3A, word: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word];
        let mut bvh = Self {
            nodes: bytemuck::cast_slice(&wide.nodes).to_vec(),
            triangles: Vec::with_capacity(3 * wide.primitive_indices.len()),
            attributes: Vec::with_capacity(4 * wide.primitive_indices.len()),
            has_holes: false,
            slots: vec![None; scene.triangle_count()],
        };
        for (slot, &index) in wide.primitive_indices.iter().enumerate() {
            let (triangle, Source { mesh, number, corners }) = (triangles[index as usize], sources[index as usize]);
            bvh.slots[number as usize] = Some(slot as u32);
            let mask = scene.materials.get(mesh.material).and_then(|m| m.alpha_texture).map(|texture| masks[texture]);
            let [start, size] = mask.unwrap_or([0; 2]);
            bvh.has_holes |= mask.is_some();
            bvh.triangles.extend([
                texel(triangle.v0, 0),
                texel(triangle.v1 - triangle.v0, start),
                texel(triangle.v2 - triangle.v0, size),
            ]);
            let [n0, n1, n2] = corners.map(|i| Vec3A::from(mesh.normals[i as usize]));
            let [a, b, c] = corners.map(|i| mesh.uvs[i as usize].map(f32::to_bits));
            let receives_only = scene.materials.get(mesh.material).is_some_and(|material| material.receive_only);
            let material = mesh.material as u32 | if receives_only { RECEIVE_ONLY } else { 0 };
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
}

/// Triangles with finite corners and an area. No ray hits the others.
fn triangles(scene: &Scene) -> (Vec<Triangle>, Vec<Source<'_>>) {
    let all = scene.meshes.iter().flat_map(|mesh| {
        mesh.indices.as_chunks::<3>().0.iter().map(move |&corners| {
            let [v0, v1, v2] = corners.map(|i| Vec3A::from(mesh.positions[i as usize]));
            (Triangle { v0, v1, v2 }, mesh, corners)
        })
    });
    let numbered =
        (0..).zip(all).map(|(number, (triangle, mesh, corners))| (triangle, Source { mesh, number, corners }));
    numbered
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
            let bvh = Bvh::build(&scene(&triangles)).expect("shallow");
            assert_eq!(bvh.triangles.len(), 3 * kept);
            assert_eq!(bvh.nodes.len(), if kept == 0 { 0 } else { 5 });
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
        Bvh::build(&scene(&triangles)).expect("fits the stack");
    }
}
