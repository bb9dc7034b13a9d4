// A binary grid of cubes over the whole scene, seen or not: 32 cubes in a row along x are one word.

struct Grid {
    // Lower corner, world space, and width of a cube, scene units.
    origin: vec3f,
    width: f32,
    // Cubes along the axes; along x a multiple of 32.
    size: vec3u,
    unused: u32,
}

/// Index of the word that holds a cube.
fn word_index(grid: Grid, voxel: vec3u) -> u32 {
    return ((voxel.z * grid.size.y + voxel.y) * grid.size.x + voxel.x) >> 5u;
}

/// In cubes, from the grid's corner.
fn grid_position(grid: Grid, world: vec3f) -> vec3f {
    return (world - grid.origin) / grid.width;
}
