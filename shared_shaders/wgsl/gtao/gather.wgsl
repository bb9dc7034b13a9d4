// Ground-truth ambient occlusion (Jimenez et al. 2016): openness between the horizons of both sides of each slice, where
// everything that is seen reaches back without end. With FALLOFF occluders lose their weight towards the radius.
import package::common::math::{PI, spread2};
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::surfel_depth;
import package::common::slice::{
    NEAREST,     Screen, Receiver, Slice, screen_of, receiver_of, slice_of, side_of, strides_of, plane_of, place_on, direction_of, arc_to,
};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    // Part of the radius, at its end, over which an occluder's weight falls from 1 to 0; 0 for no end.
    falloff: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<r32float, write>;

override SLICES: u32 = 1u;
override STEPS: u32 = 12u;
override SPACING: u32 = 1u;
override JITTER: bool = true;

// Streams of random numbers, and what sets successive slices apart: those of the bitmask, so that both see the same samples.
const SLICE_STREAM: u32 = 2048u;
const GOLDEN: f32 = 0.6180339887498949;

/// Arc between the direction to the eye and the horizon of one side.
fn open_side(receiver: Receiver, slice: Slice, sign: f32, jitter: f32, screen: Screen) -> f32 {
    let radius = params.radius / receiver.depth;
    let side = side_of(receiver, slice, sign, radius, screen);
    let last = vec2i(textureDimensions(planes)) - 1;
    let inverse_scale = 1.0 / screen.scale;
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    let fade = 1.0 / max(radius * params.falloff, 1e-30);
    let lowest = -sign * slice.sin_angle;
    var horizon = lowest;
    var way = strides.way;
    for (var i = 0u; i < STEPS; i++) {
        let texel = min(vec2i((receiver.pixel + way * side.step) * inverse_scale), last);
        let words = textureLoad(planes, texel, 0);
        let plane = plane_of(receiver, side, words, texel, screen);
        let place = place_on(plane, receiver, side, max(way, NEAREST));
        var cosine = direction_of(place.xy).x;
        if params.falloff > 0.0 {
            let distance = length(place.xy) / max(place.z, 1e-15);
            cosine = mix(lowest, cosine, saturate((radius - distance) * fade));
        }
        horizon = max(horizon, select(lowest, cosine, plane.own > 0.0));
        way = way * strides.factor + strides.addend;
    }
    return arc_to(vec2f(horizon, sqrt(max(1.0 - horizon * horizon, 0.0))), slice, sign);
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
    var open = 1.0;
    for (var i = 0u; i < SLICES; i++) {
        let slice = slice_of(receiver, PI / f32(SLICES) * (f32(i) + random.x));
        let jitter = select(0.5, fract(random.y + GOLDEN * f32(i)), JITTER);
        let other = select(0.5, fract(jitter + 0.5), JITTER);
        let arcs = open_side(receiver, slice, 1.0, jitter, screen) + open_side(receiver, slice, -1.0, other, screen);
        // What is hidden is taken from 1, so that the weights of single slices bring no noise to what is open.
        let all = slice.cos_angle + slice.angle * slice.sin_angle;
        open -= slice.weight * (all - arcs) / f32(SLICES);
    }
    // Weights of single slices may hide more than everything, rounding may open more.
    textureStore(gathered, id.xy, vec4f(saturate(open)));
}
