// variants: light, ambient, packed, float16
// Screen-space ray marching (Sousa et al. 2011): rays of random, cosine-distributed directions advance along the screen
// until one is behind the visible surface by less than the thickness. The hit surface lights the receiver. Without
// `light`, only ambient visibility is found: the share of rays that hit nothing. With `ambient`, those rays see the
// environment, unless a voxel of the scene is in the way: what is off the screen closes a room, too.
import package::common::division::Division;
import package::common::hemisphere::cosine_direction;
import package::common::math::{random3, spread2};
@if(ambient && light) import package::common::environment::{MAP, latlong};
@if(ambient && light) import package::scene_voxels::sees::sees_sky;
@if(ambient && light) import package::scene_voxels::sky_of_receiver::world_end;
import package::common::tile::tiled_pixel;
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::surfel_depth;
@if(light && packed) import package::common::surfel::with_radiance;
@if(light) import package::common::plane::plane_radiance;
@if(!light) import package::common::plane::black_plane;
@if(light && float16) import package::common::math::LARGEST_FLOAT16;
import package::common::slice::{
    Receiver, Screen, Slice, screen_of, receiver_of, side_of, strides_of, seen_at, plane_of, position_at, ray_of, back_of,
};
import package::common::streams::{RAY_STREAM, RAY_JITTER_STREAM};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    // Thickness of every surface: a constant part in scene units, and a part for each unit of depth.
    thickness: f32,
    thickness_slope: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
// Light in rgb and ambient visibility in a. With `packed`, surfels whose radiance is the light. Without `light`,
// ambient visibility alone.
@if(light && packed) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32uint, write>;
@if(light && !packed && !float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(light && !packed && float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba16float, write>;
@if(!light) @group(0) @binding(3) var gathered: texture_storage_2d<r32float, write>;

@if(ambient && light) @group(0) @binding(4) var<storage, read> environment: array<vec4f>;

override RAYS: u32;
override STEPS: u32;
override SPACING: u32;

const GOLDEN: f32 = 0.6180339887498949;

/// Light of one ray; the last component is 1 if it hit nothing.
fn march(receiver: Receiver, direction: vec3f, jitter: f32, screen: Screen) -> vec4f {
    // The ray lies in the slice through its direction, at a constant angle.
    let cosine = dot(direction, receiver.to_eye);
    let across = direction - cosine * receiver.to_eye;
    let sine = length(across);
    // A ray along the view ray crosses no texels.
    if sine < 1e-4 {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let slice = Slice(across / sine, 0.0, 0.0, 0.0, 0.0);
    let radius = params.radius / receiver.depth;
    let side = side_of(receiver, slice, 1.0, radius, screen);
    // Depth along the ray at a distance w is top / (top + w * slope). The ray ends where this is infinite or leaves the
    // radius.
    let top = receiver.ray_length * sine;
    let slope = side.along * cosine - side.towards_eye * sine;
    let furthest = top * radius / max(side.along * receiver.ray_length - slope * radius, 1e-30);
    let leaves = select(1e30, furthest, side.along * receiver.ray_length > slope * radius);
    let reach = min(side.reach, select(leaves, min(leaves, -0.999 * top / slope), slope < 0.0));
    let strides = strides_of(f32(STEPS), jitter, reach, screen.scale, SPACING);
    let thickness = params.thickness / receiver.depth;
    let thickness_slope = params.thickness_slope;
    var way = strides.way;
    for (var i = 0u; i < STEPS; i++) {
        let seen = seen_at(side, way);
        var words = textureLoad(planes, seen.texel, 0);
        @if(!light) { words = black_plane(words); }
        let plane = plane_of(receiver, side, words, seen.offset, way);
        let ray = ray_of(receiver, side, way);
        let position = position_at(receiver, ray, plane.here);
        let away = ray * inverseSqrt(dot(ray, ray));
        let back = back_of(position, away, thickness, thickness_slope);
        // The ray passes between front and back if they are on either side of it.
        let front_side = position.x * sine - position.y * cosine;
        let back_side = back.x * sine - back.y * cosine;
        if front_side >= 0.0 && back_side <= 0.0 && plane.own > 0.0 {
            @if(light) { return vec4f(select(vec3f(0.0), plane_radiance(words), plane.faces), 0.0); }
            @if(!light) { return vec4f(0.0); }
        }
        way = way * strides.factor + strides.addend;
    }
    return vec4f(0.0, 0.0, 0.0, 1.0);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let pixel = tiled_pixel(group.xy + division.workgroup, local);
    if any(pixel >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, pixel, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        @if(light && packed) { textureStore(gathered, pixel, vec4u(0u)); }
        @if(!light || !packed) { textureStore(gathered, pixel, vec4f(0.0)); }
        return;
    }
    let screen = screen_of(view.display_size, view.tan_half_fov, params.scale);
    let receiver = receiver_of(own, pixel, screen);
    let random = spread2(pixel, view.frame, RAY_STREAM, view.seed, false);
    let jitter = random3(pixel, view.frame, RAY_JITTER_STREAM, view.seed).x;
    var sum = vec4f(0.0);
    @if(ambient && light) let sky_end = world_end(receiver, view.view_to_world);
    for (var i = 0u; i < RAYS; i++) {
        // The rays of a pixel are stratified over the hemisphere.
        let position = fract(random + vec2f((f32(i) + 0.5) / f32(RAYS), GOLDEN * f32(i)));
        let direction = cosine_direction(receiver.normal, position);
        var found = march(receiver, direction, fract(jitter + GOLDEN * f32(i)), screen);
        @if(ambient && light) {
            let world = (view.view_to_world * vec4f(direction, 0.0)).xyz;
            if found.w > 0.0 && sees_sky(sky_end, world) {
                found += vec4f(environment[MAP + latlong(world, environment[0].xy)].rgb, 0.0);
            }
        }
        sum += found / f32(RAYS);
    }
    @if(light && float16) { sum = min(sum, vec4f(LARGEST_FLOAT16)); }
    @if(light && !packed) { textureStore(gathered, pixel, sum); }
    @if(light && packed) { textureStore(gathered, pixel, with_radiance(own, sum.rgb)); }
    @if(!light) { textureStore(gathered, pixel, vec4f(sum.w)); }
}
