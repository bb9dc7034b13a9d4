// Whether two places of the scene see each other, by its grid of cubes.
import package::scene_voxels::grid::{Grid, word_index, grid_position};
import package::scene_voxels::march::{begin_walk, way_out, next_voxel};

@group(0) @binding(20) var<storage, read> grid: Grid;
@group(0) @binding(21) var<storage, read> voxels: array<u32>;

// A surface at either end of a ray: its place in cubes, its normal, and how far above its plane a ray is clear of the
// surface's own cubes, in cubes.
struct RayEnd {
    position: vec3f,
    normal: vec3f,
    clear: f32,
}

/// Surfaces bend: they rise this far above their planes, in cubes, at most.
const BEND: f32 = 0.3;
/// Share of what keeps a ray clear of its ends that lifts it off them along their normals; the rest of it is left out
/// of the ray itself. Lifts alone carry grazing rays over what stands near; rays that only begin later pass through it.
/// Where nothing of the ray would be left, its ends are lifted by the whole, and nothing is left out.
const LIFT: f32 = 0.5;

/// Place and normal in world space. A cube that a plane crosses reaches |n.x| + |n.y| + |n.z| above it at most, 1 along an
/// axis and 1.73 along a diagonal.
fn ray_end(position: vec3f, normal: vec3f) -> RayEnd {
    return RayEnd(grid_position(grid, position), normal, abs(normal.x) + abs(normal.y) + abs(normal.z) + BEND);
}

/// Share of the way to leave out at an end, from which the way rises by `slope` above the end's plane; the whole way or
/// more where it never gets clear of it.
fn left_out(clear: f32, slope: f32) -> f32 {
    return (1.0 - LIFT) * clear / max(slope, 1e-9);
}

/// Whether nothing in the grid stands between two surfaces.
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
        // So near or so grazing that nothing would be left: such pairs would all be free, and light would leak.
        start = receiver.position + receiver.clear * receiver.normal;
        goal = source.position + source.clear * source.normal;
    }
    var walk = begin_walk(start, goal);
    var blocked = false;
    // A segment crosses at most as many borders as there are cubes along the three axes.
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
    return !blocked;
}
