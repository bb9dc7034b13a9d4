//! The scene's BVH, for passes that trace rays.

use halflight_frame_graph::{FramePlan, ResourceId};

use crate::scene::{BVH_ATTRIBUTES, BVH_NODES, BVH_TRIANGLES};

/// The BVH's textures: the bindings of `truth/traversal.wgsl`. The caller creates them before the plan is compiled:
/// [`crate::scene::SceneBuffers::prepare`].
#[derive(Clone, Copy, Debug)]
pub struct PlannedBvh {
    /// Nodes.
    pub nodes: ResourceId,
    /// Corners of triangles.
    pub triangles: ResourceId,
    /// Normals, texture coordinates and materials of triangles.
    pub attributes: ResourceId,
}

/// The BVH of the scene.
pub fn plan_bvh(plan: &mut FramePlan) -> PlannedBvh {
    let mut texture = |name| plan.scene_buffer(name, "rays through the scene's triangles");
    PlannedBvh { nodes: texture(BVH_NODES), triangles: texture(BVH_TRIANGLES), attributes: texture(BVH_ATTRIBUTES) }
}
