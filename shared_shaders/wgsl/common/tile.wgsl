// The order of workgroups for passes that look far around each pixel: down tiles of the screen that are 16 workgroups (128
// pixels) wide, so that what one row of workgroups fetched is still in the cache for the next. Row by row over the whole
// screen, the cache would have to hold as many rows of pixels as such a pass looks up and down.
//
// Workgroups of 8x8 are dispatched with all rows of a tile along x and tiles along y (`tiled` in renderer/src/slices.rs).

/// The pixel of an invocation; those beyond the right edge have none.
fn tiled_pixel(group: vec3u, local: vec3u) -> vec2u {
    return vec2u(group.y * 16u + (group.x & 15u), group.x >> 4u) * 8u + local.xy;
}
