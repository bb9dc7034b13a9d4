// variants: ambient
// Horizon-based indirect lighting (Mayaux 2018): along each side of a slice, a sample above the horizon so far lights the
// receiver through the angle between the two. What lies under the horizon is hidden: the depth buffer is a height field. With `ambient` the
// environment adds what a surface of the normal receives, times openness.
// Light in rgb, openness in a.
import package::common::math::{PI, spread2};
@if(ambient) import package::common::environment::{IRRADIANCE, irradiance_factor};
import package::common::view::{View, SKY_DEPTH};
import package::common::plane::plane_radiance;
import package::common::surfel::surfel_depth;
import package::common::slice::{
    NEAREST, is_within,     Screen, Receiver, Slice, screen_of, receiver_of, slice_of, side_of, strides_of, plane_of, place_on, direction_of,
    arc_to,
};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;

@if(ambient) @group(0) @binding(4) var<storage, read> environment: array<vec4f>;

override SLICES: u32 = 1u;
override STEPS: u32 = 12u;
override SPACING: u32 = 1u;
override JITTER: bool = true;

// Streams of random numbers, and what sets successive slices apart: those of the bitmask, so that both see the same samples.
const SLICE_STREAM: u32 = 2048u;
const GOLDEN: f32 = 0.6180339887498949;

/// Light of one side, and in the last component the arc that stays open.
fn walk(receiver: Receiver, slice: Slice, sign: f32, jitter: f32, screen: Screen) -> vec4f {
    let radius = params.radius / receiver.depth;
    let side = side_of(receiver, slice, sign, radius, screen);
    let last = vec2i(textureDimensions(planes)) - 1;
    let inverse_scale = 1.0 / screen.scale;
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    let lowest = -sign * slice.sin_angle;
    var horizon = lowest;
    var open = arc_to(vec2f(lowest, slice.cos_angle), slice, sign);
    var light = vec3f(0.0);
    var way = strides.way;
    for (var i = 0u; i < STEPS; i++) {
        let texel = min(vec2i((receiver.pixel + way * side.step) * inverse_scale), last);
        let words = textureLoad(planes, texel, 0);
        let plane = plane_of(receiver, side, words, texel, screen);
        let place = place_on(plane, receiver, side, max(way, NEAREST));
        let direction = direction_of(place.xy);
        if direction.x > horizon && is_within(place, radius) {
            let left = arc_to(direction, slice, sign);
            // The approximation of acos does not fall everywhere that it should: never less than nothing.
            light += select(0.0, max(open - left, 0.0), plane.faces) * plane_radiance(words);
            open = left;
            horizon = direction.x;
        }
        way = way * strides.factor + strides.addend;
    }
    return vec4f(light, open);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id.xy, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(gathered, id.xy, vec4f(0.0));
        return;
    }
    let screen = screen_of(view.display_size, view.tan_half_fov, params.scale);
    let receiver = receiver_of(own, id.xy, screen);
    let random = spread2(id.xy, view.frame, SLICE_STREAM, view.seed, false);
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    for (var i = 0u; i < SLICES; i++) {
        let slice = slice_of(receiver, PI / f32(SLICES) * (f32(i) + random.x));
        let jitter = select(0.5, fract(random.y + GOLDEN * f32(i)), JITTER);
        let other = select(0.5, fract(jitter + 0.5), JITTER);
        let both = walk(receiver, slice, 1.0, jitter, screen) + walk(receiver, slice, -1.0, other, screen);
        let all = slice.cos_angle + slice.angle * slice.sin_angle;
        sum += slice.weight / f32(SLICES) * (both - vec4f(0.0, 0.0, 0.0, all));
    }
    @if(ambient) {
        let world = (view.view_to_world * vec4f(receiver.normal, 0.0)).xyz;
        for (var i = 0u; i < 9u; i++) {
            let part = irradiance_factor(i, world) * environment[IRRADIANCE + i].rgb;
            sum += vec4f(part * max(sum.w, 0.0), 0.0);
        }
        // The polynomial may dip under zero where the sky is dark.
        sum = max(sum, vec4f(0.0));
    }
    // Weights of single slices may hide more than everything, rounding may open more.
    textureStore(gathered, id.xy, vec4f(max(sum.rgb, vec3f(0.0)), saturate(sum.w)));
}
