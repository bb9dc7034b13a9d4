// variants: ambient, packed, float16
// Horizon-based indirect lighting (Mayaux 2018): along each side of a slice, a sample above the horizon so far lights
// the receiver through the angle between the two. Everything below the horizon is occluded, because the depth buffer is
// taken as a height field. With `ambient`, the environment adds the irradiance of the normal times ambient visibility,
// less the sides on which a voxel of the scene is in the way: what is off the screen closes a room, too. Light is in rgb,
// ambient visibility in a.
import package::common::division::Division;
import package::common::math::{most, spread2};
@if(ambient) import package::common::environment::{IRRADIANCE, irradiance_factor};
@if(ambient) import package::scene_voxels::sees::{RayEnd, sees_sky};
@if(ambient) import package::scene_voxels::sky_of_receiver::world_end;
import package::common::tile::tiled_pixel;
import package::common::view::{View, SKY_DEPTH};
@if(float16) import package::common::math::LARGEST_FLOAT16;
import package::common::plane::plane_radiance;
import package::common::surfel::surfel_depth;
@if(packed) import package::common::surfel::with_radiance;
import package::common::slice::{
    Screen, Receiver, Slice, Side, Strides, TexelPosition, screen_of, receiver_of, slice_of, side_of, strides_of, seen_at, plane_of,
    position_at, ray_of, is_within, arc_of_side, arc_to,
};
import package::common::streams::SLICE_STREAM;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
// With `packed`, surfels whose radiance is the light.
@if(packed) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32uint, write>;
@if(!packed && !float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(!packed && float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba16float, write>;

@if(ambient) @group(0) @binding(4) var<storage, read> environment: array<vec4f>;

override SLICES: u32;
override STEPS: u32;
override SPACING: u32;
override JITTER: bool;

const GOLDEN: f32 = 0.6180339887498949;

/// One side of a slice: the position of its next sample, the cosine of its horizon so far, the arc above the horizon,
/// and the light found below it.
struct Walk {
    side: Side,
    strides: Strides,
    way: f32,
    horizon: f32,
    open: f32,
    light: vec3f,
}

fn begin_walk(receiver: Receiver, slice: Slice, radius: f32, sign: f32, jitter: f32, screen: Screen) -> Walk {
    let side = side_of(receiver, slice, sign, radius, screen);
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    return Walk(side, strides, strides.way, -sign * slice.sin_angle, arc_of_side(slice, sign), vec3f(0.0));
}

/// Adds the texel of the walk's sample and advances the walk.
fn take(walk: ptr<function, Walk>, receiver: Receiver, slice: Slice, radius: f32, seen: TexelPosition, words: vec4u) {
    let side = (*walk).side;
    let plane = plane_of(receiver, side, words, seen.offset, (*walk).way);
    let position = position_at(receiver, ray_of(receiver, side, (*walk).way), plane.here);
    let cosine = position.x * inverseSqrt(dot(position.xy, position.xy));
    let rises = cosine > (*walk).horizon && is_within(position, radius);
    let left = select((*walk).open, arc_to(position.xy, slice, side.sign), rises);
    // The approximated angle is not monotonic everywhere, so negative differences are clamped.
    (*walk).light += select(0.0, most((*walk).open - left, 0.0), plane.faces) * plane_radiance(words);
    (*walk).open = left;
    (*walk).horizon = select((*walk).horizon, cosine, rises);
    (*walk).way = (*walk).way * (*walk).strides.factor + (*walk).strides.addend;
}

/// Whether a direction of a side's open arc sees the sky.
@if(ambient)
fn side_sees_sky(walk: Walk, receiver: Receiver, slice: Slice, end_of_ray: RayEnd, sign: f32, chance: f32) -> bool {
    let angle = chance * acos(clamp(walk.horizon, -1.0, 1.0));
    let direction = cos(angle) * receiver.to_eye + sign * sin(angle) * slice.tangent;
    return sees_sky(end_of_ray, (view.view_to_world * vec4f(direction, 0.0)).xyz);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let pixel = tiled_pixel(group.xy + division.workgroup, local);
    if any(pixel >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, pixel, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        @if(packed) { textureStore(gathered, pixel, vec4u(0u)); }
        @if(!packed) { textureStore(gathered, pixel, vec4f(0.0)); }
        return;
    }
    let screen = screen_of(view.display_size, view.tan_half_fov, params.scale);
    let receiver = receiver_of(own, pixel, screen);
    let random = spread2(pixel, view.frame, SLICE_STREAM, view.seed, false);
    let radius = params.radius / receiver.depth;
    var sum = vec4f(0.0, 0.0, 0.0, 1.0);
    @if(ambient) let end_of_ray = world_end(receiver, view.view_to_world);
    // Arcs that are open to the sky, and on the screen.
    @if(ambient) var to_sky = 0.0;
    @if(ambient) var on_screen = 0.0;
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
            let words_right = textureLoad(planes, seen_right.texel, 0);
            let words_left = textureLoad(planes, seen_left.texel, 0);
            take(&right, receiver, slice, radius, seen_right, words_right);
            take(&left, receiver, slice, radius, seen_left, words_left);
        }
        let both = vec4f(right.light + left.light, right.open + left.open);
        let all = slice.cos_angle + slice.angle * slice.sin_angle;
        sum += slice.weight / f32(SLICES) * (both - vec4f(0.0, 0.0, 0.0, all));
        @if(ambient) {
            let arcs = max(vec2f(right.open, left.open), vec2f(0.0)) * slice.weight;
            let seen = vec2<bool>(
                side_sees_sky(right, receiver, slice, end_of_ray, 1.0, jitter),
                side_sees_sky(left, receiver, slice, end_of_ray, -1.0, other),
            );
            to_sky += dot(select(vec2f(0.0), arcs, seen), vec2f(1.0));
            on_screen += arcs.x + arcs.y;
        }
    }
    @if(ambient) {
        let world = (view.view_to_world * vec4f(receiver.normal, 0.0)).xyz;
        let seen = max(sum.w, 0.0) * to_sky / max(on_screen, 1e-30);
        for (var i = 0u; i < 9u; i++) {
            let part = irradiance_factor(i, world) * environment[IRRADIANCE + i].rgb;
            sum += vec4f(part * seen, 0.0);
        }
        // The polynomial may be negative where the sky is dark.
        sum = max(sum, vec4f(0.0));
    }
    @if(float16) { sum = min(sum, vec4f(LARGEST_FLOAT16)); }
    // The weights of single slices may occlude more than everything, and rounding may open more.
    @if(packed) { textureStore(gathered, pixel, with_radiance(own, max(sum.rgb, vec3f(0.0)))); }
    @if(!packed) { textureStore(gathered, pixel, vec4f(max(sum.rgb, vec3f(0.0)), saturate(sum.w))); }
}
