//! The part of a BVH that is built again when animated objects move.

use std::sync::{Mutex, PoisonError};

use glam::{Mat4, Vec3A};
use halflight_frame_graph::Gpu;
use halflight_scenes::{Scene, bulk};
use obvhs::{aabb::Aabb, cwbvh::node::CwBvhNode};
use serde::{Deserialize, Serialize};

use super::{
    SceneBvh,
    emitters::Emitters,
    tree::{Meshes, Tree},
};
use crate::scene::contents::BVH_ROW as ROW;

/// The first node or slot of the animated part is a multiple of this, so that it starts a row of each texture.
const ALIGNMENT: usize = ROW;

/// Texels of a node, and of a triangle in `triangles` and in `attributes`.
const NODE: usize = 5;
const SHAPE: usize = 3;
const ATTRIBUTES: usize = 4;

/// A node with up to two inner children, which follow each other from `first`.
fn root_of(children: &[Aabb], first: u32) -> CwBvhNode {
    let all = children.iter().fold(Aabb::INVALID, |all, child| all.union(child));
    let mut node = CwBvhNode { child_base_idx: first, ..CwBvhNode::default() };
    if children.is_empty() {
        return node;
    }
    node.p = all.min.into();
    let extent = all.max - all.min;
    // 253 steps, so that the planes below have room to be rounded outwards.
    let exponent = |length: f32| (length.max(1e-30) / 253.0).log2().ceil().clamp(-126.0, 127.0) as i32;
    let exponents = extent.to_array().map(exponent);
    node.e = exponents.map(|exponent| (exponent + 127) as u8);
    let scale = Vec3A::from(exponents.map(|exponent| (exponent as f32).exp2()));
    for (index, child) in children.iter().enumerate() {
        node.imask |= 1 << index;
        node.child_meta[index] = (24 + index as u8) | 0b0010_0000;
        let low = ((child.min - all.min) / scale).floor() - 1.0;
        let high = ((child.max - all.min) / scale).ceil() + 1.0;
        [node.child_min_x[index], node.child_min_y[index], node.child_min_z[index]] = low.to_array().map(|v| v as u8);
        [node.child_max_x[index], node.child_max_y[index], node.child_max_z[index]] = high.to_array().map(|v| v as u8);
    }
    node
}

/// The static part of a BVH, and where its animated part is. The BVH is two trees below a common root: the root, the roots of
/// both trees, the other nodes of the static tree, and from an aligned index on those of the animated tree. An empty tree has
/// no root.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Joined {
    /// The root of the static tree, if it is not empty.
    #[serde(with = "bulk")]
    root: Vec<CwBvhNode>,
    /// Lower and upper corner of the static tree.
    bounds: [Vec3A; 2],
    /// Slots of the static triangles: see [`Tree::slots`].
    still: Vec<Option<u32>>,
    /// First node and slot of the animated part.
    first_node: usize,
    first_slot: usize,
    /// Nodes and slots that it has room for.
    nodes: usize,
    slots: usize,
}

impl Joined {
    /// Joins two trees; also returns all texels: of nodes, triangles and attributes.
    pub(super) fn new(still: Tree, moving: &Tree) -> (Self, [Vec<[u32; 4]>; 3]) {
        let slots = moving.triangles.len() / SHAPE;
        let joined = Self {
            first_node: (still.nodes.len() + 2).next_multiple_of(ALIGNMENT),
            first_slot: (still.triangles.len() / SHAPE).next_multiple_of(ALIGNMENT),
            // A wide node has at least one triangle of its own or two children.
            nodes: slots.max(1),
            slots,
            root: still.nodes.first().copied().into_iter().collect(),
            bounds: [still.bounds.min, still.bounds.max],
            still: still.slots,
        };
        let mut nodes = joined.roots(moving);
        nodes.resize(3, CwBvhNode::default());
        let below = still.nodes.iter().skip(1);
        nodes.extend(below.map(|node| CwBvhNode { child_base_idx: node.child_base_idx + 2, ..*node }));
        nodes.resize(joined.first_node, CwBvhNode::default());
        nodes.extend(joined.below_root(moving));
        nodes.resize(joined.first_node + joined.nodes, CwBvhNode::default());
        let join = |mut texels: Vec<[u32; 4]>, moving: &[[u32; 4]], each: usize| {
            texels.resize(joined.first_slot * each, [0; 4]);
            texels.extend(moving);
            texels
        };
        let texels = [
            bytemuck::cast_slice(&nodes).to_vec(),
            join(still.triangles, &moving.triangles, SHAPE),
            join(still.attributes, &moving.attributes, ATTRIBUTES),
        ];
        (joined, texels)
    }

    /// Slot of each triangle of the scene: see [`Tree::slots`].
    pub(super) fn slots_of(&self, moving: &Tree) -> Vec<Option<u32>> {
        let moved = |slot: &Option<u32>| slot.map(|slot| slot + self.first_slot as u32);
        self.still.iter().zip(&moving.slots).map(|(still, moving)| still.or(moved(moving))).collect()
    }

    /// The common root and the roots below it.
    fn roots(&self, moving: &Tree) -> Vec<CwBvhNode> {
        let still = self.root.first().map(|root| CwBvhNode { child_base_idx: root.child_base_idx + 2, ..*root });
        let moved = moving.nodes.first().map(|&root| self.placed(root));
        let [min, max] = self.bounds;
        let bounds = [still.map(|_| Aabb { min, max }), moved.map(|_| moving.bounds)];
        let bounds: Vec<Aabb> = bounds.into_iter().flatten().collect();
        [root_of(&bounds, 1)].into_iter().chain(still).chain(moved).collect()
    }

    /// A node of the animated tree at its place.
    fn placed(&self, node: CwBvhNode) -> CwBvhNode {
        CwBvhNode {
            child_base_idx: node.child_base_idx + self.first_node as u32 - 1,
            primitive_base_idx: node.primitive_base_idx + self.first_slot as u32,
            ..node
        }
    }

    /// Nodes of the animated tree below its root.
    fn below_root(&self, moving: &Tree) -> Vec<CwBvhNode> {
        moving.nodes.iter().skip(1).map(|&node| self.placed(node)).collect()
    }
}

/// What is needed to build the animated part again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Moving {
    pub(super) joined: Joined,
    /// Poses of the objects as they are.
    pub(super) poses: Vec<Mat4>,
}

/// The animated part of a BVH on a device.
pub(crate) struct MovingBvh {
    joined: Joined,
    nodes: wgpu::Texture,
    triangles: wgpu::Texture,
    attributes: wgpu::Texture,
    emitters: wgpu::Texture,
    /// Poses of the objects as they are on the device.
    poses: Mutex<Vec<Mat4>>,
}

impl MovingBvh {
    pub(super) fn new(Moving { joined, poses }: Moving, bvh: &SceneBvh) -> Self {
        Self {
            joined,
            nodes: bvh.nodes.clone(),
            triangles: bvh.triangles.clone(),
            attributes: bvh.attributes.clone(),
            emitters: bvh.emitters.clone(),
            poses: Mutex::new(poses),
        }
    }

    /// Moves the objects of `scene`, whose BVH this is, to these poses, unless they are there.
    pub(crate) fn pose(&self, gpu: &Gpu, scene: &Scene, poses: &[Mat4]) {
        let mut uploaded = self.poses.lock().unwrap_or_else(PoisonError::into_inner);
        if *uploaded == poses {
            return;
        }
        // Rigid motion hardly changes the depth, for which there is room.
        let Ok(moving) = Tree::build(scene, Meshes::Animated(poses)) else { return };
        if moving.nodes.len() > self.joined.nodes || moving.triangles.len() > SHAPE * self.joined.slots {
            return;
        }
        *uploaded = poses.to_vec();
        let first_row = |first: usize, each: usize| (first * each / ROW) as u32;
        let (first_node, first_slot) = (self.joined.first_node, self.joined.first_slot);
        write(gpu, &self.nodes, 0, bytemuck::cast_slice::<_, [u32; 4]>(&self.joined.roots(&moving)));
        let below = self.joined.below_root(&moving);
        write(gpu, &self.nodes, first_row(first_node, NODE), bytemuck::cast_slice::<_, [u32; 4]>(&below));
        write(gpu, &self.triangles, first_row(first_slot, SHAPE), &moving.triangles);
        write(gpu, &self.attributes, first_row(first_slot, ATTRIBUTES), &moving.attributes);
        if moving.emits {
            // The triangles of the tree have another order.
            write(gpu, &self.emitters, 0, &Emitters::of(scene, &self.joined.slots_of(&moving)).texels());
        }
    }
}

/// Writes texels from the start of a row on.
fn write<const WORDS: usize>(gpu: &Gpu, texture: &wgpu::Texture, first_row: u32, texels: &[[u32; WORDS]])
where
    [u32; WORDS]: bytemuck::Pod,
{
    for (row, texels) in (first_row..texture.height()).zip(texels.chunks(ROW)) {
        let target = wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: row, z: 0 },
            aspect: wgpu::TextureAspect::All,
        };
        let size = wgpu::Extent3d { width: texels.len() as u32, height: 1, depth_or_array_layers: 1 };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None };
        gpu.queue.write_texture(target, bytemuck::cast_slice(texels), layout, size);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Where a child's box is, from the node.
    fn bounds_of(node: &CwBvhNode, child: usize) -> [Vec3; 2] {
        let scale = Vec3::from(node.e.map(|e| f32::from_bits(u32::from(e) << 23)));
        let at = |x: u8, y: u8, z: u8| node.p + scale * Vec3::new(x.into(), y.into(), z.into());
        [
            at(node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]),
            at(node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]),
        ]
    }

    #[test]
    fn a_root_covers_its_children() {
        let boxes = [
            Aabb { min: Vec3A::new(-3.0, 0.0, 1e-3), max: Vec3A::new(7.0, 1e5, 2e-3) },
            Aabb { min: Vec3A::new(6.9, -20.0, 0.0), max: Vec3A::new(7.3, -19.0, 0.0) },
        ];
        let root = root_of(&boxes, 1);
        for (index, child) in boxes.iter().enumerate() {
            let [low, high] = bounds_of(&root, index);
            assert!(
                Vec3A::from(low).cmple(child.min).all() && Vec3A::from(high).cmpge(child.max).all(),
                "{low} {high}"
            );
        }
        assert_eq!(root.imask, 3);
    }
}
