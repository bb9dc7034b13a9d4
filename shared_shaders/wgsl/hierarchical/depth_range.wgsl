// Nearest and farthest depth of the finest level's surfels. The slices of the froxel grid span this range.
import package::common::surfel::surfel_depth;
import package::common::view::SKY_DEPTH;

@group(0) @binding(0) var surfels: texture_2d<u32>;
// The bits of positive floats order like whole numbers. The buffer holds the complement of the nearest depth, then the
// farthest depth. Both are maxima, so a buffer of zeros is the initial value.
@group(0) @binding(1) var<storage, read_write> depth_range: array<atomic<u32>>;

// Width of the square of texels that one invocation reads: few atomics, but enough invocations.
const SQUARE: u32 = 8u;

@compute @workgroup_size(8, 8)
fn find_depth_range(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfels);
    let first = id.xy * SQUARE;
    var nearest = 0u;
    var farthest = 0u;
    for (var i = 0u; i < SQUARE * SQUARE; i++) {
        let texel = first + vec2u(i % SQUARE, i / SQUARE);
        if all(texel < size) {
            let depth = surfel_depth(textureLoad(surfels, texel, 0));
            if depth > SKY_DEPTH {
                nearest = max(nearest, ~bitcast<u32>(depth));
                farthest = max(farthest, bitcast<u32>(depth));
            }
        }
    }
    if farthest > 0u {
        atomicMax(&depth_range[0], nearest);
        atomicMax(&depth_range[1], farthest);
    }
}
