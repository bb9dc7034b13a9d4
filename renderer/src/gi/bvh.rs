//! The scene's BVH, for passes that trace rays.

use halflight_frame_graph::{FramePlan, ResourceId};

use crate::scene::{BVH_ATTRIBUTES, BVH_EMITTERS, BVH_NODES, BVH_TRIANGLES, SceneFacts};

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
    /// Emitting triangles; `None` if there are none.
    pub emitters: Option<ResourceId>,
}

/// The BVH of the scene.
pub fn plan_bvh(plan: &mut FramePlan, scene: &SceneFacts) -> PlannedBvh {
    let mut texture = |name| plan.scene_buffer(name, "rays through the scene's triangles");
    let [nodes, triangles, attributes] = [BVH_NODES, BVH_TRIANGLES, BVH_ATTRIBUTES].map(&mut texture);
    let emitters =
        (!scene.emitters.is_empty()).then(|| plan.scene_buffer(BVH_EMITTERS, "points on the scene's emitters"));
    PlannedBvh { nodes, triangles, attributes, emitters }
}
