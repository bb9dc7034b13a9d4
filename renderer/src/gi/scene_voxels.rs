//! A binary voxel grid over what is looked at, on the screen or not. It holds the occluders between a surface and a
//! light that no camera sees. Surfaces outside of the grid occlude nothing.

use glam::Vec3;

use crate::scene::SceneFacts;
use halflight_frame_graph::{FramePlan, Part, ResourceId, ResourceKind};
use halflight_shared_shaders::scene_voxels::fill::{self, Fill};

/// Smallest number of invocations that share a triangle.
const FEWEST_ROWS: u32 = 8;
/// Twin of `POINTS_PER_VOXEL` in fill.wgsl.
const POINTS_PER_VOXEL: f64 = 1.5;
/// Largest number of points that one invocation sets. Software drivers of the Mesa project silently end the loops of an
/// invocation after 65,535 iterations; half of that is reserved for the outer loops.
const MOST_POINTS: f64 = 32768.0;

/// Work of an invocation, on average over a scene: most triangles are smaller than a voxel.
const ROW_COST: u64 = 64;

/// Number of invocations that share a triangle, so that they cover the largest triangle inside the grid. Its sides are
/// no longer than the grid's diagonal, and it has half of the product of their points.
///
/// With `clips`, the grid's sides clip triangles to polygons with up to twice as many points.
fn rows(resolution: u32, clips: bool) -> u32 {
    let side = 3f64.sqrt() * f64::from(resolution) * POINTS_PER_VOXEL + 2.0;
    let share = if clips { 1.0 } else { 0.5 };
    ((share * side * side / MOST_POINTS).ceil() as u32).next_power_of_two().max(FEWEST_ROWS)
}

/// The grid on the device.
#[derive(Clone, Copy)]
pub struct SceneVoxels {
    /// `Grid` of `scene_voxels/grid.wgsl`.
    pub grid: ResourceId,
    /// One bit per voxel.
    pub voxels: ResourceId,
}

impl SceneVoxels {
    /// Work of a ray through the grid (see [`PassBuilder::costs`](halflight_frame_graph::PassBuilder::costs)). A step to
    /// the next voxel is a quarter of a fetch, and a ray crosses about as many voxels as the longest side has.
    pub fn ray_cost(&self, plan: &FramePlan) -> u64 {
        let ResourceKind::Data { bytes, .. } = &plan.resources[self.grid.0].kind else { return 0 };
        let words: &[u32] = bytemuck::cast_slice(bytes);
        u64::from(words[4..7].iter().copied().max().unwrap_or_default() / 4)
    }
}

/// Plans a grid with `resolution` voxels along the longest side of what is looked at. If that is a small part of the
/// scene, the grid is a cube, so that its size does not depend on the camera.
pub fn plan_scene_voxels(plan: &mut FramePlan, scene: &SceneFacts, resolution: u32) -> SceneVoxels {
    let [low, high] = scene.bounds.map(Vec3::from);
    let longest = (high - low).max_element().max(f32::MIN_POSITIVE * 1e10);
    let width = longest / resolution as f32;
    let part = scene.extent.is_part();
    let sides = if part { Vec3::splat(longest) } else { high - low };
    // One more voxel on each side keeps surfaces on the boundary inside.
    let voxels = (sides / width).ceil().as_uvec3() + 2;
    let size = [voxels.x.next_multiple_of(32), voxels.y, voxels.z];
    // No side of the bounding box lies on a voxel boundary, where rounding would decide.
    let origin = low - 0.63 * width;
    let words: [u32; 8] =
        [origin.x.to_bits(), origin.y.to_bits(), origin.z.to_bits(), width.to_bits(), size[0], size[1], size[2], 0];
    let grid = plan.data("scene_grid", bytemuck::cast_slice(&words).to_vec(), "position and size of the voxel grid");
    let bytes = size.map(u64::from).iter().product::<u64>() / 8;
    let bits =
        plan.buffer("scene_cubes", bytes, format!("{} x {} x {} voxels, one bit each", size[0], size[1], size[2]));
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let indices = plan.scene_buffer("scene.indices", "the scene's indices");
    let alpha_tested = scene.needs.alpha_tested.then(|| {
        let [materials, texels] =
            ["materials", "texels"].map(|name| plan.scene_buffer(&format!("scene.{name}"), "alpha-masked surfaces"));
        fill::AlphaTested { materials, texels }
    });
    let animated = scene.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));
    let rows = rows(resolution, part);
    let constants = fill::Constants { rows };
    plan.pass(
        Part::Technique,
        "scene_voxels",
        Fill { grid, vertices, indices, voxels: bits, alpha_tested, animated, constants },
    )
    .clear(bits)
    .because(format!("occluders, on the screen or not{}", if part { "; none far from what is looked at" } else { "" },))
    .costs(ROW_COST)
    .over([scene.triangles.max(1), rows]);
    SceneVoxels { grid, voxels: bits }
}

/// The grid that the plan has already; `None` if it has none.
pub(super) fn planned_scene_voxels(plan: &FramePlan) -> Option<SceneVoxels> {
    let find = |name: &str| plan.resources.iter().position(|resource| resource.name == name).map(ResourceId);
    Some(SceneVoxels { grid: find("scene_grid")?, voxels: find("scene_cubes")? })
}

/// Whether the plan fills a voxel grid of the scene.
pub fn has_scene_voxels(plan: &FramePlan) -> bool {
    plan.passes.iter().any(|pass| pass.shader.file() == fill::FILE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_invocation_sets_more_points_than_drivers_loop() {
        assert_eq!([8, 128, 256, 512, 960].map(|width| rows(width, false)), [8, 8, 8, 32, 128]);
        assert_eq!([8, 128, 256, 512, 960].map(|width| rows(width, true)), [8, 8, 16, 64, 256]);
    }
}
