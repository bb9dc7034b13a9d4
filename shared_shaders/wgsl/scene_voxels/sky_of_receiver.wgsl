// Whether the receiver of a slice sees the sky, by the scene's voxel grid.
import package::common::slice::Receiver;
import package::scene_voxels::sees::{RayEnd, ray_end};

/// The receiver as the end of a ray in world space.
fn world_end(receiver: Receiver, view_to_world: mat4x4f) -> RayEnd {
    let position = vec3f(receiver.ray, -1.0) * receiver.depth;
    return ray_end(
        (view_to_world * vec4f(position, 1.0)).xyz,
        normalize((view_to_world * vec4f(receiver.normal, 0.0)).xyz),
    );
}
