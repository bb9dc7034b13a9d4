// variants: light, wide, ambient, packed, float16
// Screen-space indirect light with a visibility bitmask (Therrien et al. 2023, Algorithm 1). Each sample along a slice
// occludes the sectors between its front and its back; the back is one thickness farther from the eye. The sample
// lights the receiver through those sectors that were not occluded before. Without `light`, only ambient visibility is
// found. `wide` has up to 128 sectors. With `ambient`, the environment lights the receiver through the sectors that
// stay open (section 3.2), where no voxel of the scene is in the way: what is off the screen closes a room, too.
//
// Estimator `published`: sectors of equal angle, light weighted by both cosines, samples are points. Estimator
// `radiometric`: sectors of equal cosine-weighted solid angle, slices weighted by the length of the projected normal,
// no cosine at the source (sectors are solid angles already), and each sample stands for its whole stride.
import package::common::division::Division;
import package::common::math::{PI, nearest_whole, random3, spread2};
import package::common::tile::tiled_pixel;
import package::common::view::{View, SKY_DEPTH};
@if(light) import package::common::plane::{plane_gradient, plane_inverse_depth, plane_radiance};
@if(!light) import package::common::plane::black_plane;
@if(light && float16) import package::common::math::LARGEST_FLOAT16;
import package::common::surfel::surfel_depth;
@if(light && packed) import package::common::surfel::with_radiance;
import package::common::slice::{
    Screen, Receiver, Slice, Side, Strides, TexelPosition, screen_of, receiver_of, slice_of, side_of, strides_of, seen_at, plane_of,
    position_at, position_on, ray_of, ray_at, begin_of, Before, BEHIND_ALL, NEAREST, is_within, back_of, arc_of_side, angle_of,
};
@if(ambient) import package::common::environment::{IRRADIANCE, irradiance_factor, latlong, small_map};
@if(ambient && light) import package::scene_voxels::sees::{RayEnd, sees_sky};
@if(ambient && light) import package::scene_voxels::sky_of_receiver::world_end;
import package::common::streams::{SLICE_STREAM, SECTOR_STREAM};
import package::bitmask::sectors::{Mask, sectors, count_sectors};

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

override SLICES: u32;
override STEPS: u32;
override SECTORS: u32;
override SPACING: u32;
override JITTER: bool;
override RADIOMETRIC: bool;
// Whether a temporal filter averages successive frames. The random numbers are then stratified over frames.
override OVER_FRAMES: bool;

// Source of environment light: one of `AMBIENT_...`.
@if(ambient && light) override AMBIENT: u32;
@if(ambient && light) const AMBIENT_NORMAL: u32 = 0u;
@if(ambient && light) const AMBIENT_BENT_NORMAL: u32 = 1u;
@if(ambient && light) const AMBIENT_BITMASK: u32 = 2u;
/// Directions of a slice in which the environment is looked up (Figure 7).
@if(ambient && light) const DIRECTIONS: u32 = 4u;
/// Directions that are tried to find an open one in a subregion. If only half of it is open, one in 256 is missed.
@if(ambient && light) const TRIES: u32 = 8u;

// The step jitter of successive slices of a pixel differs by the golden ratio.
const GOLDEN: f32 = 0.6180339887498949;

/// Keeps sector 0 from becoming -1 where rounding makes an angle negative.
const LEAST_CHANCE: f32 = 1e-3;

/// Maps positions on one side of a slice to sectors: `base - of_cosine cos 2h + of_angle h - of_sine sin 2h` of their
/// angle h. The result is the angle itself or `arc`.
struct Scale {
    base: f32,
    of_cosine: f32,
    of_sine: f32,
    of_angle: f32,
    // The plane of the surface, given by its normal. Positions below it do not count.
    end: f32,
    cos_angle: f32,
    sin_angle: f32,
}

/// Sector i covers i - 0.5..i + 0.5, as `nearest_whole` takes it. `rounding` is added to all sectors.
fn scale_of(slice: Slice, sign: f32, rounding: f32) -> Scale {
    let sin_angle = sign * slice.sin_angle;
    let lowest = rounding - 0.5;
    let end = select(0.0, f32(SECTORS), sign > 0.0) + lowest;
    if RADIOMETRIC {
        let count = f32(SECTORS) / (slice.cos_angle + slice.angle * slice.sin_angle);
        let of_cosine = sign * 0.25 * count * slice.cos_angle;
        let of_sine = sign * 0.25 * count * sin_angle;
        let base = arc_of_side(slice, -1.0) * count + lowest + of_cosine;
        return Scale(base, of_cosine, of_sine, 2.0 * of_sine, end, slice.cos_angle, sin_angle);
    }
    let count = f32(SECTORS) / PI;
    return Scale((0.5 * PI - slice.angle) * count + lowest, 0.0, 0.0, sign * count, end, slice.cos_angle, sin_angle);
}

fn sector_of(scale: Scale, position: vec2f) -> f32 {
    let h = angle_of(position);
    var sector = scale.base + scale.of_angle * h.angle;
    if RADIOMETRIC {
        sector += -scale.of_cosine * h.cosine - scale.of_sine * h.sine;
    }
    return select(scale.end, sector, position.x * scale.cos_angle + position.y * scale.sin_angle > 0.0);
}

/// State of a slice while its steps are taken.
struct State {
    mask: Mask,
    @if(light) light: vec3f,
}

/// One side of a slice, with the positions of its next stride and sample.
struct Walk {
    side: Side,
    scale: Scale,
    strides: Strides,
    begin: f32,
    end: f32,
    way: f32,
    before: Before,
}

/// Values that all samples of a receiver share. Lengths are in units of the receiver's depth.
struct Reach {
    radius: f32,
    thickness: f32,
    thickness_slope: f32,
}

fn begin_walk(receiver: Receiver, slice: Slice, reach: Reach, sign: f32, jitter: f32, rounding: f32, screen: Screen) -> Walk {
    let side = side_of(receiver, slice, sign, reach.radius, screen);
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    let scale = scale_of(slice, sign, rounding);
    return Walk(side, scale, strides, NEAREST, strides.end, strides.way, Before(NEAREST, 1.0));
}

/// Adds the texel of the walk's sample and advances the walk.
fn take(
    state: ptr<function, State>,
    walk: ptr<function, Walk>,
    receiver: Receiver,
    reach: Reach,
    seen: TexelPosition,
    words: vec4u,
    screen: Screen,
) {
    let side = (*walk).side;
    let way = (*walk).way;
    let end = (*walk).end;
    let plane = plane_of(receiver, side, words, seen.offset, way);
    let ray = ray_of(receiver, side, way);
    let position = position_at(receiver, ray, plane.here);
    var nearest = position;
    var farthest = position;
    if RADIOMETRIC {
        // The angle from the eye decreases along a plane whose front faces the receiver and increases along others.
        let start = begin_of(plane, (*walk).begin, way, (*walk).before);
        nearest = position_on(plane, receiver, side, select(start, end, plane.faces));
        farthest = position_on(plane, receiver, side, select(end, start, plane.faces));
    }
    // The back is farther from the eye by the thickness.
    let back = back_of(farthest, ray * inverseSqrt(dot(ray, ray)), reach.thickness, reach.thickness_slope);
    // At least half a sector counts as a sector (the paper's criterion "round"), or, randomized, any part of one.
    let near_end = sector_of((*walk).scale, nearest.xy);
    let far_end = sector_of((*walk).scale, back);
    let first = nearest_whole(select(far_end, near_end, side.sign > 0.0));
    let last = nearest_whole(select(near_end, far_end, side.sign > 0.0));
    let hidden = sectors(first, select(first, last, is_within(position, reach.radius)));
    @if(light) {
        let fresh = count_sectors(hidden & ~(*state).mask);
        var weight = select(0.0, fresh, plane.faces);
        if !RADIOMETRIC {
            weight = fresh * cosines(receiver, words, seen.texel, screen);
        }
        (*state).light += weight * plane_radiance(words);
    }
    (*state).mask |= hidden;
    (*walk).before = Before(way, select(BEHIND_ALL, plane.own, plane.own > 0.0));
    (*walk).begin = end;
    (*walk).end = end * (*walk).strides.factor + (*walk).strides.addend;
    (*walk).way = way * (*walk).strides.factor + (*walk).strides.addend;
}

/// Environment light that a surface with this normal receives.
@if(ambient && light)
fn irradiance(normal: vec3f) -> vec3f {
    let n = (view.view_to_world * vec4f(normal, 0.0)).xyz;
    var sum = vec3f(0.0);
    for (var i = 0u; i < 9u; i++) {
        sum += irradiance_factor(i, n) * environment[IRRADIANCE + i].rgb;
    }
    return max(sum, vec3f(0.0));
}

/// What is open in a slice, each subregion weighted by its open sectors.
@if(ambient && light)
struct Outside {
    // Light of the sky; with the bent normal, the sum of open directions.
    sum: vec3f,
    // The sectors that are open to the sky, and those that are open on the screen.
    seen: f32,
    open: f32,
}

@if(ambient && light)
fn outside(mask: Mask, receiver: Receiver, end_of_ray: RayEnd, slice: Slice, rounding: f32, chance: f32) -> Outside {
    let above = scale_of(slice, 1.0, rounding);
    let below = scale_of(slice, -1.0, rounding);
    let first = small_map(environment[0]);
    var result = Outside();
    var begin = 0;
    for (var i = 0u; i < DIRECTIONS; i++) {
        let end_angle = slice.angle + PI * (f32(i + 1u) / f32(DIRECTIONS) - 0.5);
        var scale = below;
        if end_angle > 0.0 {
            scale = above;
        }
        var end = nearest_whole(sector_of(scale, vec2f(cos(end_angle), abs(sin(end_angle)))));
        end = select(end, i32(SECTORS), i + 1u == DIRECTIONS);
        let open = count_sectors(sectors(begin, end) & ~mask);
        begin = end;
        if open <= 0.0 {
            continue;
        }
        // Any open direction of the subregion, so that no window lies between them.
        var angle = 0.0;
        var is_open = false;
        for (var k = 0u; k < TRIES && !is_open; k++) {
            angle = end_angle - PI / f32(DIRECTIONS) * fract(chance + GOLDEN * f32(i * TRIES + k));
            var own = below;
            if angle > 0.0 {
                own = above;
            }
            let sector = nearest_whole(sector_of(own, vec2f(cos(angle), abs(sin(angle)))));
            is_open = count_sectors(sectors(sector, sector + 1) & ~mask) > 0.0;
        }
        let direction = cos(angle) * receiver.to_eye + sin(angle) * slice.tangent;
        let world = (view.view_to_world * vec4f(direction, 0.0)).xyz;
        result.open += open;
        if !is_open || !sees_sky(end_of_ray, world) {
            continue;
        }
        result.seen += open;
        if AMBIENT == AMBIENT_BITMASK {
            result.sum += open * environment[first + latlong(world, environment[0].zw)].rgb;
        } else {
            result.sum += open * direction;
        }
    }
    return result;
}

/// Cosines at both ends of the segment to a sample (Algorithm 1, line 23).
@if(light)
fn cosines(receiver: Receiver, words: vec4u, texel: vec2i, screen: Screen) -> f32 {
    let ray = ray_at(screen, (vec2f(texel) + 0.5) * screen.scale);
    let inverse = plane_inverse_depth(words) * receiver.depth;
    let toward = vec3f(ray, -1.0) - vec3f(receiver.ray, -1.0) * inverse;
    // The inverse depth is dot(v, ray) for a vector v opposite to the plane's normal.
    let against = plane_gradient(words) * receiver.depth * screen.inverse_scale * screen.inverse_ray_scale;
    let v = vec3f(against, dot(against, ray) - inverse);
    let lengths = max(dot(toward, toward) * sqrt(dot(v, v)), 1e-30);
    return max(dot(receiver.normal, toward), 0.0) * max(dot(v, toward), 0.0) / lengths;
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
    let random = spread2(pixel, view.frame, SLICE_STREAM, view.seed, OVER_FRAMES);
    let chance = random3(pixel, view.frame, SECTOR_STREAM, view.seed).x;
    let unit = 1.0 / receiver.depth;
    let reach = Reach(params.radius * unit, params.thickness * unit, params.thickness_slope);
    var open = 1.0;
    @if(light) var light = vec3f(0.0);
    @if(ambient && light) let end_of_ray = world_end(receiver, view.view_to_world);
    @if(ambient && light) var sky = Outside();
    for (var i = 0u; i < SLICES; i++) {
        let slice = slice_of(receiver, (f32(i) + random.x) / f32(SLICES));
        // Each slice rounds its sectors by another random number.
        let rounding = select(0.5, max(fract(chance + GOLDEN * f32(i)), LEAST_CHANCE), RADIOMETRIC);
        let jitter = select(0.5, fract(random.y + GOLDEN * f32(i)), JITTER);
        // With its value: Chromium does not reset a variable without one in a loop.
        var state = State();
        var right = begin_walk(receiver, slice, reach, 1.0, jitter, rounding, screen);
        let other = select(0.5, fract(jitter + 0.5), JITTER);
        var left = begin_walk(receiver, slice, reach, -1.0, other, rounding, screen);
        for (var step = 0u; step < STEPS; step++) {
            // Both fetches come first, so that their latencies overlap.
            let seen_right = seen_at(right.side, right.way);
            let seen_left = seen_at(left.side, left.way);
            var words_right = textureLoad(planes, seen_right.texel, 0);
            var words_left = textureLoad(planes, seen_left.texel, 0);
            @if(!light) {
                words_right = black_plane(words_right);
                words_left = black_plane(words_left);
            }
            take(&state, &right, receiver, reach, seen_right, words_right, screen);
            take(&state, &left, receiver, reach, seen_left, words_left, screen);
        }
        // Cosine-weighted solid angle of the slice. Its mean over all azimuths is 1.
        let weight = select(1.0, slice.weight * (slice.cos_angle + slice.angle * slice.sin_angle), RADIOMETRIC);
        let share = weight / f32(SLICES * SECTORS);
        // The occluded part is subtracted from 1, so that the weights of single slices add no noise to open receivers.
        open -= share * count_sectors(state.mask);
        @if(light) { light += share * state.light; }
        @if(ambient && light) {
            let found = outside(state.mask, receiver, end_of_ray, slice, rounding, jitter);
            sky.sum += share * found.sum;
            sky.seen += share * found.seen;
            sky.open += share * found.open;
        }
    }
    @if(ambient && light) {
        var around = sky.sum;
        let seen = max(open, 0.0) * sky.seen / max(sky.open, 1e-30);
        if AMBIENT == AMBIENT_NORMAL {
            around = irradiance(receiver.normal) * seen;
        }
        if AMBIENT == AMBIENT_BENT_NORMAL {
            let bent = around * inverseSqrt(max(dot(around, around), 1e-30));
            around = irradiance(bent) * seen;
        }
        light += around;
    }
    // The weights of single slices may occlude more than everything, and rounding may open more.
    open = saturate(open);
    @if(light && float16) { light = min(light, vec3f(LARGEST_FLOAT16)); }
    @if(light && !packed) { textureStore(gathered, pixel, vec4f(max(light, vec3f(0.0)), open)); }
    @if(light && packed) { textureStore(gathered, pixel, with_radiance(own, max(light, vec3f(0.0)))); }
    @if(!light) { textureStore(gathered, pixel, vec4f(open)); }
}
