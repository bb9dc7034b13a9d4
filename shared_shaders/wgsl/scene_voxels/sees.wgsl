// Visibility between two positions of the scene, and of the sky, by the scene's voxel grid.
import package::scene_voxels::grid::{Grid, word_index, grid_position};
import package::scene_voxels::march::{begin_walk, way_out, next_voxel};

@group(0) @binding(20) var<storage, read> grid: Grid;
@group(0) @binding(21) var<storage, read> voxels: array<u32>;

// One end of a ray: position in voxels, normal, and the height above the surface's plane, in voxels, at which the ray
// is clear of the surface's own voxels.
struct RayEnd {
    position: vec3f,
    normal: vec3f,
    clear: f32,
}

/// Curved surfaces rise at most this far above their tangent planes, in voxels.
const BEND: f32 = 0.3;
/// Share of the clearance that offsets the ends along their normals. The rest is left out of the ray itself. Offsets
/// alone carry grazing rays over nearby occluders; rays that begin later pass through nearby occluders. If nothing of
/// the ray would be left, its ends are offset by the whole clearance, and nothing is left out.
const LIFT: f32 = 0.5;

/// Position and normal in world space. A voxel that a plane crosses reaches at most |n.x| + |n.y| + |n.z| above it: 1
/// along an axis and 1.73 along a diagonal.
fn ray_end(position: vec3f, normal: vec3f) -> RayEnd {
    return RayEnd(grid_position(grid, position), normal, abs(normal.x) + abs(normal.y) + abs(normal.z) + BEND);
}

/// Share of the ray to leave out at an end from which the ray rises by `slope` above the end's plane. At least 1 if the
/// ray never clears it.
fn left_out(clear: f32, slope: f32) -> f32 {
    return (1.0 - LIFT) * clear / max(slope, 1e-9);
}

/// Whether the grid has no occluder between two surfaces.
fn sees(receiver: RayEnd, source: RayEnd) -> bool {
    var start = receiver.position + LIFT * receiver.clear * receiver.normal;
    var goal = source.position + LIFT * source.clear * source.normal;
    let way = goal - start;
    let first = left_out(receiver.clear, dot(way, receiver.normal));
    let last = 1.0 - left_out(source.clear, -dot(way, source.normal));
    if first < last {
        goal = start + last * way;
        start += first * way;
    } else {
        // The pair is so close or so grazing that nothing would be left. Without this all such pairs would be visible,
        // and light would leak.
        start = receiver.position + receiver.clear * receiver.normal;
        goal = source.position + source.clear * source.normal;
    }
    return !is_blocked(start, goal);
}

/// Whether the grid has no occluder between a surface and the sky in this direction (a unit vector).
fn sees_sky(receiver: RayEnd, direction: vec3f) -> bool {
    if dot(direction, receiver.normal) <= 0.0 {
        return false;
    }
    // Nothing of the ray is left out, because a ray that begins later passes through nearby walls: a closed room is
    // exactly dark.
    let lifted = receiver.position + receiver.clear * receiver.normal;
    // Where the ray leaves the grid.
    let side = select(vec3f(0.0), vec3f(grid.size), direction > vec3f(0.0));
    let ends = (side - lifted) / select(direction, vec3f(1e-9), abs(direction) < vec3f(1e-9));
    let end = min(ends.x, min(ends.y, ends.z));
    return end <= 0.0 || !is_blocked(lifted, lifted + end * direction);
}

/// Whether an occupied voxel lies between two positions, in voxels.
fn is_blocked(start: vec3f, goal: vec3f) -> bool {
    var walk = begin_walk(start, goal);
    var blocked = false;
    // A segment crosses at most as many boundaries as there are voxels along the three axes.
    let most = grid.size.x + grid.size.y + grid.size.z;
    for (var i = 0u; i < most && !blocked; i++) {
        let inside = all(walk.voxel >= vec3i(0)) && all(walk.voxel < vec3i(grid.size));
        if inside {
            let voxel = vec3u(walk.voxel);
            blocked = ((voxels[word_index(grid, voxel)] >> (voxel.x & 31u)) & 1u) != 0u;
        }
        if way_out(walk) >= 1.0 {
            break;
        }
        walk = next_voxel(walk);
    }
    return blocked;
}
