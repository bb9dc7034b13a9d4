// Whether two places of the scene see each other, by its grid of cubes.
import package::scene_voxels::grid::{Grid, word_index, grid_position};
import package::scene_voxels::march::{CLEAR, begin_walk, way_out, next_cube};

@group(0) @binding(20) var<storage, read> grid: Grid;
@group(0) @binding(21) var<storage, read> cubes: array<u32>;

/// Where a ray to or from a surface begins, in cubes; place and normal in world space.
fn clear_of(position: vec3f, normal: vec3f) -> vec3f {
    return grid_position(grid, position + normal * (CLEAR * grid.width));
}

/// Whether nothing in the grid stands between two places, in cubes.
fn sees(start: vec3f, goal: vec3f) -> bool {
    var walk = begin_walk(start, goal);
    var blocked = false;
    // A segment crosses at most as many borders as there are cubes along the three axes.
    let most = grid.size.x + grid.size.y + grid.size.z;
    for (var i = 0u; i < most && !blocked; i++) {
        let inside = all(walk.cube >= vec3i(0)) && all(walk.cube < vec3i(grid.size));
        if inside {
            let cube = vec3u(walk.cube);
            blocked = ((cubes[word_index(grid, cube)] >> (cube.x & 31u)) & 1u) != 0u;
        }
        if way_out(walk) >= 1.0 {
            break;
        }
        walk = next_cube(walk);
    }
    return !blocked;
}
