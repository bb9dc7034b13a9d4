// A binary voxel grid over what is looked at, on the screen or not: 32 voxels in a row along x are one word.

struct Grid {
    // Lower corner, world space, and width of a voxel, scene units.
    origin: vec3f,
    width: f32,
    // Voxels along the axes; a multiple of 32 along x.
    size: vec3u,
    unused: u32,
}

/// Index of the word that holds a voxel.
fn word_index(grid: Grid, voxel: vec3u) -> u32 {
    return ((voxel.z * grid.size.y + voxel.y) * grid.size.x + voxel.x) >> 5u;
}

/// Position in voxels, from the grid's corner.
fn grid_position(grid: Grid, world: vec3f) -> vec3f {
    return (world - grid.origin) / grid.width;
}
