// Shows a level of the froxel grid. Red is the number of set slices in the column, green the nearness of the first one,
// blue the distance of the last one.
import package::common::froxels::{SLICES, WORDS, WORD_SLICES};

struct Params {
    // Fields of the other display shaders; only the divisor is used here.
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
        // Most columns have only a few of 128 slices. The square root makes them visible.
        let colour = vec3f(sqrt(f32(filled) / SLICES), 1.0 - f32(first) / SLICES, f32(last + 1) / SLICES);
        textureStore(display, id.xy, vec4f(select(vec3f(0.0), colour, filled > 0u), 1.0));
    }
}
