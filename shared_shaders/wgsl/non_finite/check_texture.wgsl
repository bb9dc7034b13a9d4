// variants: words
// Counts NaN, infinite, negative and clamped values in a texture. With `words`, texels are whole numbers whose first
// word is a float: the depth of a surfel or of a history.
import package::non_finite::tally::{Tally, kinds, finite_magnitude};

@if(!words) @group(0) @binding(0) var values: texture_2d<f32>;
@if(words) @group(0) @binding(0) var values: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> tally: Tally;

// The largest number that passes store in this format.
override LIMIT: f32;
// Channels of the format. A load fills in the others.
override CHANNELS: u32;

var<workgroup> nan: atomic<u32>;
var<workgroup> infinite: atomic<u32>;
var<workgroup> negative: atomic<u32>;
var<workgroup> clamped: atomic<u32>;
var<workgroup> largest: atomic<u32>;

@if(!words)
fn bits_at(texel: vec2u) -> vec4u {
    return bitcast<vec4u>(textureLoad(values, texel, 0));
}

@if(words)
fn bits_at(texel: vec2u) -> vec4u {
    return textureLoad(values, texel, 0);
}

@compute @workgroup_size(16, 16)
fn non_finite(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if all(id.xy < textureDimensions(values)) {
        let bits = bits_at(id.xy);
        var sum = vec4u(0u);
        var most = 0u;
        for (var channel = 0u; channel < CHANNELS; channel++) {
            sum += kinds(bits[channel], LIMIT);
            most = max(most, finite_magnitude(bits[channel]));
        }
        // Most texels have nothing to report.
        if any(sum > vec4u(0u)) {
            atomicAdd(&nan, sum.x);
            atomicAdd(&infinite, sum.y);
            atomicAdd(&negative, sum.z);
            atomicAdd(&clamped, sum.w);
        }
        atomicMax(&largest, most);
    }
    workgroupBarrier();
    if local == 0u {
        atomicAdd(&tally.nan, atomicLoad(&nan));
        atomicAdd(&tally.infinite, atomicLoad(&infinite));
        atomicAdd(&tally.negative, atomicLoad(&negative));
        atomicAdd(&tally.clamped, atomicLoad(&clamped));
        atomicMax(&tally.largest, atomicLoad(&largest));
    }
}
