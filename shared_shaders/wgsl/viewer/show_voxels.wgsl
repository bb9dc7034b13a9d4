// Shows a level of the voxel grid: of each column, red how many of its slices are set, green how near the first one is,
// blue how far away the last one.
import package::common::froxels::{SLICES, WORDS, WORD_SLICES};

struct Params {
    // The other pictures' fields; only the divisor counts here.
    content: u32,
    divisor: u32,
    exposure: f32,
    range: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var image: texture_2d_array<u32>;
@group(0) @binding(2) var display: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(display)) {
        var filled = 0u;
        var first = i32(SLICES);
        var last = -1;
        for (var word = 0; word < WORDS; word++) {
            let bits = textureLoad(image, id.xy / params.divisor, word, 0).x;
            filled += countOneBits(bits);
            if bits != 0u {
                first = min(first, word * WORD_SLICES + i32(firstTrailingBit(bits)));
                last = word * WORD_SLICES + i32(firstLeadingBit(bits));
            }
        }
        // A few slices of 128 are what most columns have: the root brings them out.
        let colour = vec3f(sqrt(f32(filled) / SLICES), 1.0 - f32(first) / SLICES, f32(last + 1) / SLICES);
        textureStore(display, id.xy, vec4f(select(vec3f(0.0), colour, filled > 0u), 1.0));
    }
}
