//! The BVH of a scene in the layout of `truth/traversal.wgsl`, for passes that trace rays.
//!
//! The first node is the common root of two trees: of the static triangles, and of the animated ones, which is built again
//! when they have moved.

mod emitters;
mod moving;
mod tree;

use std::sync::Arc;

use halflight_frame_graph::Gpu;
use halflight_scenes::Scene;

use emitters::Emitters;
use moving::Joined;
pub(crate) use moving::MovingBvh;
use tree::{Meshes, Tree};

/// Why a scene has no BVH: one sentence with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BvhError(String);

/// The BVH on a device: three textures of 16-byte texels, and a table of its emitters.
pub struct SceneBvh {
    /// Five texels per node.
    pub nodes: wgpu::Texture,
    /// Three texels per triangle: its corners and alpha mask.
    pub triangles: wgpu::Texture,
    /// Four texels per triangle: normals, texture coordinates and material.
    pub attributes: wgpu::Texture,
    /// Whether any triangle is alpha-masked.
    pub has_holes: bool,
    /// The emitting triangles: see `truth/emitters.wgsl`.
    pub emitters: wgpu::Texture,
    /// Number of emitting triangles on which points are drawn; 0 where the scene emits evenly.
    pub emitter_count: u32,
    /// Density over area at which points are drawn on a surface of emission 1; areas are in units of the square of half the
    /// diagonal of the scene's bounding box.
    pub emitter_density: f32,
    /// The part that moves; `None` if nothing is animated.
    pub(crate) moving: Option<Arc<MovingBvh>>,
}

impl SceneBvh {
    /// Builds and uploads the BVH of all triangles, with animated ones where they are in the first frame.
    ///
    /// # Errors
    /// If it is too deep or too large for the device.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, BvhError> {
        let tree = Tree::build(scene, Meshes::Static)?;
        if scene.meshes.iter().all(|mesh| mesh.object.is_none()) {
            let nodes = bytemuck::cast_slice(&tree.nodes).to_vec();
            return Self::upload(gpu, [nodes, tree.triangles, tree.attributes], tree.has_holes, scene, &tree.slots);
        }
        let poses = scene.pose(0).objects;
        let moving = Tree::build(scene, Meshes::Animated(&poses))?;
        let has_holes = tree.has_holes || moving.has_holes;
        let joined = Joined::new(tree, &moving);
        let mut bvh = Self::upload(gpu, joined.texels(&moving), has_holes, scene, &joined.slots_of(&moving))?;
        let moving = MovingBvh::new(joined, &bvh, poses);
        #[cfg_attr(
            target_arch = "wasm32",
            expect(clippy::arc_with_non_send_sync, reason = "only elsewhere may textures go to other threads")
        )]
        let moving = Arc::new(moving);
        bvh.moving = Some(moving);
        Ok(bvh)
    }

    fn upload(
        gpu: &Gpu,
        [nodes, triangles, attributes]: [Vec<[u32; 4]>; 3],
        has_holes: bool,
        scene: &Scene,
        slots: &[Option<u32>],
    ) -> Result<Self, BvhError> {
        let storage = wgpu::TextureUsages::STORAGE_BINDING;
        let words = wgpu::TextureFormat::Rgba32Uint;
        let emitters = Emitters::of(scene, slots);
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        Ok(Self {
            nodes: upload(gpu, "scene.bvh_nodes", nodes, words, storage)?,
            triangles: upload(gpu, "scene.bvh_triangles", triangles, words, storage)?,
            attributes: upload(gpu, "scene.bvh_attributes", attributes, words, storage)?,
            emitters: upload(gpu, "scene.bvh_emitters", emitters.texels(), wgpu::TextureFormat::Rg32Uint, sampled)?,
            emitter_count: emitters.table.len() as u32,
            emitter_density: emitters.density,
            has_holes,
            moving: None,
        })
    }

    /// Bytes on the device.
    pub(crate) fn bytes(&self) -> u64 {
        let texels = |texture: &wgpu::Texture| u64::from(texture.width()) * u64::from(texture.height());
        [&self.nodes, &self.triangles, &self.attributes].into_iter().map(texels).sum::<u64>() * 16
            + texels(&self.emitters) * 8
    }
}

/// Texels in a row of the BVH's textures: 2^`ROW_BITS` of `truth/traversal.wgsl`.
const ROW: usize = 4096;

fn upload<const WORDS: usize>(
    gpu: &Gpu,
    label: &str,
    mut texels: Vec<[u32; WORDS]>,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> Result<wgpu::Texture, BvhError>
where
    [u32; WORDS]: bytemuck::Pod,
{
    use wgpu::util::DeviceExt;
    let rows = texels.len().div_ceil(ROW).max(1);
    let most = gpu.device.limits().max_texture_dimension_2d;
    if rows > most as usize {
        return Err(BvhError(format!(
            "the scene's BVH takes {rows} texture rows and the adapter allows {most}; use a scene of fewer triangles"
        )));
    }
    texels.resize(rows * ROW, [0; WORDS]);
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: ROW as u32, height: rows as u32, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let bytes = bytemuck::cast_slice(&texels);
    Ok(gpu.device.create_texture_with_data(&gpu.queue, &descriptor, Default::default(), bytes))
}
