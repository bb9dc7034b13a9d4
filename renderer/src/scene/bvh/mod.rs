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
use serde::{Deserialize, Serialize};

use super::{
    Piece, Pieces,
    contents::{Part, TexturePart},
};
use emitters::Emitters;
pub(crate) use moving::MovingBvh;
use moving::{Joined, Moving};
use tree::{Meshes, Tree};

/// Why a scene has no BVH: one sentence with the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
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

/// What a BVH holds apart from the contents of its textures.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BvhContents {
    /// Bytes of the textures.
    nodes: u64,
    triangles: u64,
    attributes: u64,
    emitters: u64,
    has_holes: bool,
    emitter_count: u32,
    emitter_density: f32,
    moving: Option<Moving>,
}

impl BvhContents {
    /// Builds the BVH of all triangles, with animated ones where they are in the first frame. Takes long for a large scene and
    /// uses no device.
    ///
    /// # Errors
    /// If it is too deep.
    pub fn of(scene: &Scene) -> Result<(Self, Pieces), BvhError> {
        let tree = Tree::build(scene, Meshes::Static)?;
        if scene.meshes.iter().all(|mesh| mesh.object.is_none()) {
            let texels = [bytemuck::cast_slice(&tree.nodes).to_vec(), tree.triangles, tree.attributes];
            return Ok(Self::new(texels, tree.has_holes, Emitters::of(scene, &tree.slots), None));
        }
        let poses = scene.pose(0).objects;
        let moving = Tree::build(scene, Meshes::Animated(&poses))?;
        let has_holes = tree.has_holes || moving.has_holes;
        let (joined, texels) = Joined::new(tree, &moving);
        let emitters = Emitters::of(scene, &joined.slots_of(&moving));
        Ok(Self::new(texels, has_holes, emitters, Some(Moving { joined, poses })))
    }

    fn new(
        [nodes, triangles, attributes]: [Vec<[u32; 4]>; 3],
        has_holes: bool,
        emitters: Emitters,
        moving: Option<Moving>,
    ) -> (Self, Pieces) {
        let mut pieces = Pieces::default();
        let contents = Self {
            nodes: pieces.add(Part::Texture(TexturePart::BvhNodes), nodes),
            triangles: pieces.add(Part::Texture(TexturePart::BvhTriangles), triangles),
            attributes: pieces.add(Part::Texture(TexturePart::BvhAttributes), attributes),
            emitters: pieces.add(Part::Texture(TexturePart::BvhEmitters), emitters.texels()),
            has_holes,
            emitter_count: emitters.table.len() as u32,
            emitter_density: emitters.density,
            moving,
        };
        (contents, pieces)
    }
}

impl SceneBvh {
    /// Builds and uploads the BVH of all triangles, with animated ones where they are in the first frame.
    ///
    /// # Errors
    /// If it is too deep or too large for the device.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, BvhError> {
        let (contents, pieces) = BvhContents::of(scene)?;
        let bvh = Self::reserve(gpu, contents)?;
        pieces.iter().for_each(|piece| bvh.write(gpu, &piece));
        Ok(bvh)
    }

    /// Creates the textures for these contents, of which nothing is written yet: see [`Self::write`].
    ///
    /// # Errors
    /// If it is too large for the device.
    pub fn reserve(gpu: &Gpu, contents: BvhContents) -> Result<Self, BvhError> {
        let most = u64::from(gpu.device.limits().max_texture_dimension_2d);
        let texture = |part: TexturePart, bytes: u64| match part.rows(bytes) {
            rows if rows > most => Err(BvhError(format!(
                "the scene's BVH takes {rows} texture rows and the adapter allows {most}; use a scene of fewer triangles"
            ))),
            _ => Ok(part.reserve(gpu, bytes)),
        };
        let mut bvh = Self {
            nodes: texture(TexturePart::BvhNodes, contents.nodes)?,
            triangles: texture(TexturePart::BvhTriangles, contents.triangles)?,
            attributes: texture(TexturePart::BvhAttributes, contents.attributes)?,
            emitters: texture(TexturePart::BvhEmitters, contents.emitters)?,
            emitter_count: contents.emitter_count,
            emitter_density: contents.emitter_density,
            has_holes: contents.has_holes,
            moving: None,
        };
        if let Some(moving) = contents.moving {
            let moving = MovingBvh::new(moving, &bvh);
            #[cfg_attr(
                target_arch = "wasm32",
                expect(clippy::arc_with_non_send_sync, reason = "only elsewhere may textures go to other threads")
            )]
            let moving = Arc::new(moving);
            bvh.moving = Some(moving);
        }
        Ok(bvh)
    }

    /// Writes a piece of the contents. No ray may be traced before all of them are written.
    pub fn write(&self, gpu: &Gpu, piece: &Piece) {
        let Part::Texture(part) = piece.part else { return };
        let texture = match part {
            TexturePart::BvhNodes => &self.nodes,
            TexturePart::BvhTriangles => &self.triangles,
            TexturePart::BvhAttributes => &self.attributes,
            TexturePart::BvhEmitters => &self.emitters,
            TexturePart::Texels => return,
        };
        piece.write_to_texture(gpu, part, texture);
    }

    /// Bytes on the device.
    pub(crate) fn bytes(&self) -> u64 {
        let texels = |texture: &wgpu::Texture| u64::from(texture.width()) * u64::from(texture.height());
        [&self.nodes, &self.triangles, &self.attributes].into_iter().map(texels).sum::<u64>() * 16
            + texels(&self.emitters) * 8
    }
}
