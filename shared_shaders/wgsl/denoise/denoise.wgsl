// variants: ambient_visibility, packed, float16
// One pass of a spatial filter over noisy light; with `ambient_visibility`, over one number per texel; with `packed`,
// over surfels whose radiance is the light. It has 3x3 taps, `spacing` texels apart, with joint bilateral weights from
// depth and normal. Passes with spacings 1, 2 and 4 widen the filter at equal cost (Dammertz et al. 2010).
import package::common::division::Division;
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
@if(packed && !ambient_visibility) import package::common::surfel::{surfel_radiance, with_radiance};
import package::hierarchical::bilateral::{surface_weight, inverse_tolerance};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Texels between taps.
    spacing: u32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@if(!packed || ambient_visibility) @group(0) @binding(3) var noisy: texture_2d<f32>;
@if(packed && !ambient_visibility) @group(0) @binding(4) var smoothed: texture_storage_2d<rgba32uint, write>;
@if(!ambient_visibility && !packed && !float16) @group(0) @binding(4) var smoothed: texture_storage_2d<rgba32float, write>;
@if(!ambient_visibility && !packed && float16) @group(0) @binding(4) var smoothed: texture_storage_2d<rgba16float, write>;
@if(ambient_visibility) @group(0) @binding(4) var smoothed: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn denoise(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let size = vec2i(textureDimensions(surfels));
    if any(vec2i(id) >= size) {
        return;
    }
    let words = textureLoad(surfels, id, 0);
    if surfel_depth(words) <= SKY_DEPTH {
        @if(packed && !ambient_visibility) { textureStore(smoothed, id, vec4u(0u)); }
        @if(!packed || ambient_visibility) { textureStore(smoothed, id, vec4f(0.0)); }
        return;
    }
    let normal = surfel_normal(words);
    let position = surfel_position(words, id, params.scale, view.display_size, view.tan_half_fov);
    let width = params.scale * f32(params.spacing);
    let tolerance = inverse_tolerance(surfel_depth(words), width, view.tan_half_fov.y, view.display_size.y);
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var i = 0; i < 9; i++) {
        let offset = vec2i(i % 3, i / 3) - 1;
        let tap = vec2i(id) + offset * i32(params.spacing);
        if any(tap < vec2i(0)) || any(tap >= size) {
            continue;
        }
        let other = textureLoad(surfels, tap, 0);
        if surfel_depth(other) <= SKY_DEPTH {
            continue;
        }
        let tap_position = surfel_position(other, vec2u(tap), params.scale, view.display_size, view.tan_half_fov);
        // The kernel is flat, so that the stratified random numbers of its nine taps cancel.
        let distance = dot(normal, tap_position - position) * tolerance;
        let weight = surface_weight(distance, dot(normal, surfel_normal(other)));
        @if(packed && !ambient_visibility) { sum += weight * vec4f(surfel_radiance(other), 0.0); }
        @if(!packed || ambient_visibility) { sum += weight * textureLoad(noisy, tap, 0); }
        weights += weight;
    }
    // The centre tap has weight 1.
    let mean = sum / max(weights, 1e-4);
    @if(packed && !ambient_visibility) { textureStore(smoothed, id, with_radiance(words, mean.rgb)); }
    @if(!packed || ambient_visibility) { textureStore(smoothed, id, mean); }
}
