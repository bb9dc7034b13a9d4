// Ground-truth ambient occlusion (Jimenez et al. 2016): ambient visibility between the horizons of both sides of each
// slice. Surfaces are infinitely thick. With FALLS, the weight of occluders decreases towards the radius.
import package::common::division::Division;
import package::common::math::{most, spread2};
import package::common::tile::tiled_pixel;
import package::common::view::{View, SKY_DEPTH};
import package::common::plane::black_plane;
import package::common::surfel::surfel_depth;
import package::common::slice::{
    Screen, Receiver, Slice, Side, Strides, TexelPosition, screen_of, receiver_of, slice_of, side_of, strides_of, seen_at, plane_of,
    position_at, ray_of, arc_to,
};
import package::common::streams::SLICE_STREAM;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    // Share of the radius, at its end, over which the weight of an occluder decreases from 1 to 0.
    falloff: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<r32float, write>;

override SLICES: u32;
override STEPS: u32;
override SPACING: u32;
override JITTER: bool;
// Whether the weights have a falloff.
override FALLS: bool;

const GOLDEN: f32 = 0.6180339887498949;

/// One side of a slice: the position of its next sample, and the cosine of its horizon so far. The horizon begins at
/// the plane of the surface.
struct Walk {
    side: Side,
    strides: Strides,
    way: f32,
    lowest: f32,
    horizon: f32,
}

fn begin_walk(receiver: Receiver, slice: Slice, radius: f32, sign: f32, jitter: f32, screen: Screen) -> Walk {
    let side = side_of(receiver, slice, sign, radius, screen);
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    let lowest = -sign * slice.sin_angle;
    return Walk(side, strides, strides.way, lowest, lowest);
}

/// Adds the texel of the walk's sample and advances the walk. `fade` is the inverse of the length over which weights
/// decrease.
fn take(walk: ptr<function, Walk>, receiver: Receiver, radius: f32, fade: f32, seen: TexelPosition, words: vec4u) {
    let side = (*walk).side;
    let lowest = (*walk).lowest;
    let plane = plane_of(receiver, side, words, seen.offset, (*walk).way);
    let position = position_at(receiver, ray_of(receiver, side, (*walk).way), plane.here);
    var cosine = position.x * inverseSqrt(dot(position.xy, position.xy));
    if FALLS {
        let distance = length(position.xy) / most(position.z, 1e-15);
        cosine = mix(lowest, cosine, saturate((radius - distance) * fade));
    }
    (*walk).horizon = most(select(lowest, cosine, plane.own > 0.0), (*walk).horizon);
    (*walk).way = (*walk).way * (*walk).strides.factor + (*walk).strides.addend;
}

/// Arc between the direction to the eye and the horizon of a side.
fn open_arc(walk: Walk, slice: Slice) -> f32 {
    let horizon = vec2f(walk.horizon, sqrt(max(1.0 - walk.horizon * walk.horizon, 1e-12)));
    return arc_to(horizon, slice, walk.side.sign);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let pixel = tiled_pixel(group.xy + division.workgroup, local);
    if any(pixel >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, pixel, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(gathered, pixel, vec4f(0.0));
        return;
    }
    let screen = screen_of(view.display_size, view.tan_half_fov, params.scale);
    let receiver = receiver_of(own, pixel, screen);
    let random = spread2(pixel, view.frame, SLICE_STREAM, view.seed, false);
    let radius = params.radius / receiver.depth;
    let fade = 1.0 / max(radius * params.falloff, 1e-30);
    var open = 1.0;
    for (var i = 0u; i < SLICES; i++) {
        let slice = slice_of(receiver, (f32(i) + random.x) / f32(SLICES));
        let jitter = select(0.5, fract(random.y + GOLDEN * f32(i)), JITTER);
        let other = select(0.5, fract(jitter + 0.5), JITTER);
        var right = begin_walk(receiver, slice, radius, 1.0, jitter, screen);
        var left = begin_walk(receiver, slice, radius, -1.0, other, screen);
        for (var step = 0u; step < STEPS; step++) {
            // Both fetches come first, so that their latencies overlap.
            let seen_right = seen_at(right.side, right.way);
            let seen_left = seen_at(left.side, left.way);
            let words_right = black_plane(textureLoad(planes, seen_right.texel, 0));
            let words_left = black_plane(textureLoad(planes, seen_left.texel, 0));
            take(&right, receiver, radius, fade, seen_right, words_right);
            take(&left, receiver, radius, fade, seen_left, words_left);
        }
        let arcs = open_arc(right, slice) + open_arc(left, slice);
        // The occluded part is subtracted from 1, so that the weights of single slices add no noise to open receivers.
        let all = slice.cos_angle + slice.angle * slice.sin_angle;
        open -= slice.weight * (all - arcs) / f32(SLICES);
    }
    // The weights of single slices may occlude more than everything, and rounding may open more.
    textureStore(gathered, pixel, vec4f(saturate(open)));
}
