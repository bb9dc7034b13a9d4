// Traversal of a segment through the grid, voxel by voxel (Amanatides & Woo 1987).

struct Walk {
    voxel: vec3i,
    stride: vec3i,
    // Fractions of the segment at the next voxel boundary along each axis, and between two such boundaries.
    crossing: vec3f,
    spacing: vec3f,
}

/// The traversal between two positions, both in voxels.
fn begin_walk(start: vec3f, goal: vec3f) -> Walk {
    let way = goal - start;
    let spacing = 1.0 / max(abs(way), vec3f(1e-9));
    let voxel = floor(start);
    let ahead = select(start - voxel, voxel + 1.0 - start, way >= vec3f(0.0));
    return Walk(vec3i(voxel), select(vec3i(-1), vec3i(1), way >= vec3f(0.0)), ahead * spacing, spacing);
}

/// Fraction at which the traversal leaves its voxel.
fn way_out(walk: Walk) -> f32 {
    return min(walk.crossing.x, min(walk.crossing.y, walk.crossing.z));
}

/// The traversal advanced by one voxel.
fn next_voxel(walk: Walk) -> Walk {
    let c = walk.crossing;
    let along_x = c.x <= c.y && c.x <= c.z;
    let along_y = !along_x && c.y <= c.z;
    let axis = vec3<bool>(along_x, along_y, !along_x && !along_y);
    return Walk(
        walk.voxel + select(vec3i(0), walk.stride, axis),
        walk.stride,
        walk.crossing + select(vec3f(0.0), walk.spacing, axis),
        walk.spacing,
    );
}
