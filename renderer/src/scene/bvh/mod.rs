//! The BVH of a scene in the layout of `truth/traversal.wgsl`, for passes that trace rays.
//!
//! The first node is the common root of two trees: of the static triangles, and of the animated ones, which is built again
//! when they have moved.

mod moving;
mod tree;

use std::sync::Arc;

use halflight_frame_graph::Gpu;
use halflight_scenes::Scene;

use moving::Joined;
pub(crate) use moving::MovingBvh;
use tree::{Meshes, Tree};

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
    /// The part that moves; `None` if nothing is animated.
    pub(crate) moving: Option<Arc<MovingBvh>>,
}

impl SceneBvh {
    /// Builds and uploads the BVH of all triangles, with animated ones where they are in the first frame.
    ///
    /// # Errors
    /// If it is too deep or too large for the device.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, BvhError> {
        let mut tree = Tree::build(scene, Meshes::Static)?;
        if scene.meshes.iter().all(|mesh| mesh.object.is_none()) {
            let nodes = bytemuck::cast_slice(&tree.nodes).to_vec();
            return Self::upload(gpu, [nodes, tree.triangles, tree.attributes], tree.has_holes, tree.slots);
        }
        let poses = scene.pose(0).objects;
        let moving = Tree::build(scene, Meshes::Animated(&poses))?;
        let has_holes = tree.has_holes || moving.has_holes;
        let mut slots = std::mem::take(&mut tree.slots);
        let joined = Joined::new(tree, &moving);
        for (slot, moved) in slots.iter_mut().zip(&moving.slots) {
            *slot = slot.or(moved.map(|slot| slot + joined.first_slot()));
        }
        let mut bvh = Self::upload(gpu, joined.texels(&moving), has_holes, slots)?;
        bvh.moving = Some(Arc::new(MovingBvh::new(joined, &bvh, poses)));
        Ok(bvh)
    }

    fn upload(
        gpu: &Gpu,
        [nodes, triangles, attributes]: [Vec<[u32; 4]>; 3],
        has_holes: bool,
        slots: Vec<Option<u32>>,
    ) -> Result<Self, BvhError> {
        Ok(Self {
            nodes: upload(gpu, "scene.bvh_nodes", nodes)?,
            triangles: upload(gpu, "scene.bvh_triangles", triangles)?,
            attributes: upload(gpu, "scene.bvh_attributes", attributes)?,
            has_holes,
            slots,
            moving: None,
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
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let bytes = bytemuck::cast_slice(&texels);
    Ok(gpu.device.create_texture_with_data(&gpu.queue, &descriptor, Default::default(), bytes))
}
