// The order of workgroups for passes with a large footprint: rows of screen tiles that are 16 workgroups (128 pixels)
// wide. What one row of workgroups fetched is then still in the cache for the next one. Rows across the whole screen
// would need a cache for as many rows of pixels as the footprint is high.
//
// Workgroups of 8x8 are dispatched with all rows of a tile along x and tiles along y (`tiled` in
// renderer/src/gi/slices.rs).

/// The pixel of an invocation. It is outside the image beyond the right edge.
fn tiled_pixel(group: vec2u, local: vec3u) -> vec2u {
    return vec2u(group.y * 16u + (group.x & 15u), group.x >> 4u) * 8u + local.xy;
}
