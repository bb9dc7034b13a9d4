// variants: light, wide, ambient
// Screen-space indirect light with a visibility bitmask (Therrien et al. 2023, Algorithm 1): along each slice every sample
// hides the sectors between its front and its back, a thickness farther from the eye, and lights the receiver through
// those that nothing hid before. Without `light` only openness is found. `wide` has up to 128 sectors; with `ambient` the
// environment lights it through those that stay open (section 3.2).
//
// Estimator `published`: sectors of equal angle, light weighted by both cosines, samples as points. `radiometric`: sectors
// of equal cosine-weighted solid angle, slices weighted by the projected normal, no cosine at the source (sectors are
// solid angles already), and each sample stands for its whole stride.
import package::common::math::{PI, random3, spread2};
import package::common::view::{View, SKY_DEPTH};
import package::common::plane::{plane_gradient, plane_inverse_depth, plane_radiance};
import package::common::surfel::surfel_depth;
import package::common::slice::{
    Screen, Receiver, Slice, Side, screen_of, receiver_of, slice_of, side_of, strides_of, plane_of, place_on, begin_of,
    Before, BEHIND_ALL, nearer_to_eye, is_within, back_of, direction_of, away, arc, arc_of_side, angle_of, ray_at,
};
@if(ambient) import package::common::environment::{IRRADIANCE, irradiance_factor, latlong, small_map};
import package::bitmask::sectors::{Mask, sectors, count_sectors};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    // Thickness of all that is seen: scene units, and for each unit of depth.
    thickness: f32,
    thickness_slope: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(5) var planes: texture_2d<u32>;
// Light in rgb, openness in a; or openness alone.
@if(light) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(!light) @group(0) @binding(3) var gathered: texture_storage_2d<r32float, write>;

@if(ambient && light) @group(0) @binding(4) var<storage, read> environment: array<vec4f>;

override SLICES: u32 = 1u;
override STEPS: u32 = 12u;
override SECTORS: u32 = 32u;
override SPACING: u32 = 1u;
override JITTER: bool = true;
override RADIOMETRIC: bool = true;
// Whether a filter averages successive frames, which then share out the random numbers between them.
override OVER_FRAMES: bool = false;

// How light of the environment is found: 0 from the normal, 1 from the bent normal, 2 through open sectors.
@if(ambient && light) override AMBIENT: u32 = 2u;
/// Directions of a slice that look the environment up (Figure 7).
@if(ambient && light) const DIRECTIONS: u32 = 4u;

// Streams of random numbers.
const SLICE_STREAM: u32 = 2048u;
const SECTOR_STREAM: u32 = 2049u;
// Successive slices of a pixel jitter their steps apart by the golden ratio.
const GOLDEN: f32 = 0.6180339887498949;

/// From angles on one side of a slice to sectors: `base + slope * measure`, where the measure is the angle or the arc.
struct Scale {
    base: f32,
    slope: f32,
    // Sine of the normal's angle, as seen from this side: the surface's plane stands at the cosine -sin_angle.
    sin_angle: f32,
}

fn scale_of(slice: Slice, sign: f32) -> Scale {
    if RADIOMETRIC {
        let count = f32(SECTORS) / (slice.cos_angle + slice.angle * slice.sin_angle);
        return Scale(arc_of_side(slice, -1.0) * count, sign * count, sign * slice.sin_angle);
    }
    let count = f32(SECTORS) / PI;
    return Scale((0.5 * PI - slice.angle) * count, sign * count, sign * slice.sin_angle);
}

/// Place among the sectors of a direction (cosine, sine); sector i covers i..i+1.
fn sector_of(scale: Scale, slice: Slice, direction: vec2f) -> f32 {
    let above = direction.x > -scale.sin_angle;
    let cosine = select(-scale.sin_angle, direction.x, above);
    var measure = angle_of(cosine);
    if RADIOMETRIC {
        measure = arc(measure, cosine, select(slice.cos_angle, direction.y, above), slice.cos_angle, scale.sin_angle);
    }
    return scale.base + scale.slope * measure;
}

/// What a slice knows as its steps go on.
struct State {
    mask: Mask,
    @if(light) light: vec3f,
}

fn walk(
    state: ptr<function, State>,
    receiver: Receiver,
    slice: Slice,
    sign: f32,
    jitter: f32,
    rounding: f32,
    screen: Screen,
) {
    let unit = 1.0 / receiver.depth;
    let radius = params.radius * unit;
    let side = side_of(receiver, slice, sign, radius, screen);
    let scale = scale_of(slice, sign);
    let last = vec2i(textureDimensions(planes)) - 1;
    let inverse_scale = 1.0 / screen.scale;
    let strides = strides_of(f32(STEPS), jitter, side.reach, screen.scale, SPACING);
    var before = Before(0.0, 1.0);
    var begin = 0.0;
    var end = strides.end;
    var way = strides.way;
    for (var i = 0u; i < STEPS; i++) {
        let texel = min(vec2i((receiver.pixel + way * side.step) * inverse_scale), last);
        let words = textureLoad(planes, texel, 0);
        let plane = plane_of(receiver, side, words, texel, screen);
        var nearest: vec3f;
        var farthest: vec3f;
        // A place between the two, in the same coordinates.
        var middle: vec3f;
        if RADIOMETRIC {
            let near = place_on(plane, receiver, side, begin_of(plane, begin, way, before));
            let far = place_on(plane, receiver, side, end);
            middle = near + far;
            nearest = nearer_to_eye(near, far);
            farthest = middle - nearest;
        } else {
            middle = place_on(plane, receiver, side, way);
            nearest = middle;
            farthest = middle;
        }
        // The back lies farther from the eye by the thickness of what is there.
        let back = back_of(farthest, away(receiver, side, way), params.thickness * unit, params.thickness_slope);
        let a = sector_of(scale, slice, direction_of(nearest.xy));
        let b = sector_of(scale, slice, direction_of(back));
        // Half a sector is a sector (the paper's criterion "round"), or each part of one by chance.
        let first = i32(min(a, b) + rounding);
        let hidden = sectors(first, select(first, i32(max(a, b) + rounding), is_within(middle, radius)));
        @if(light) {
            let fresh = count_sectors(hidden & ~(*state).mask);
            var weight = select(0.0, fresh, plane.faces);
            if !RADIOMETRIC {
                weight = fresh * cosines(receiver, words, texel, screen);
            }
            (*state).light += weight * plane_radiance(words);
        }
        (*state).mask |= hidden;
        before = Before(way, select(BEHIND_ALL, plane.own, plane.own > 0.0));
        begin = end;
        end = end * strides.factor + strides.addend;
        way = way * strides.factor + strides.addend;
    }
}

/// What a surface that faces `normal` receives of the environment.
@if(ambient && light)
fn irradiance(normal: vec3f) -> vec3f {
    let n = (view.view_to_world * vec4f(normal, 0.0)).xyz;
    var sum = vec3f(0.0);
    for (var i = 0u; i < 9u; i++) {
        sum += irradiance_factor(i, n) * environment[IRRADIANCE + i].rgb;
    }
    return max(sum, vec3f(0.0));
}

/// Light of the environment, or with the bent normal the sum of open directions: of all subregions of a slice, each
/// weighted by its open sectors.
@if(ambient && light)
fn outside(mask: Mask, receiver: Receiver, slice: Slice, rounding: f32) -> vec3f {
    let above = scale_of(slice, 1.0);
    let below = scale_of(slice, -1.0);
    let first = small_map(environment[0]);
    var sum = vec3f(0.0);
    var begin = 0;
    for (var i = 0u; i < DIRECTIONS; i++) {
        let end_angle = slice.angle + PI * (f32(i + 1u) / f32(DIRECTIONS) - 0.5);
        let middle = end_angle - 0.5 * PI / f32(DIRECTIONS);
        var scale = below;
        if end_angle > 0.0 {
            scale = above;
        }
        var end = i32(floor(sector_of(scale, slice, vec2f(cos(end_angle), abs(sin(end_angle)))) + rounding));
        end = select(end, i32(SECTORS), i + 1u == DIRECTIONS);
        let open = count_sectors(sectors(begin, end) & ~mask);
        begin = end;
        let direction = cos(middle) * receiver.to_eye + sin(middle) * slice.tangent;
        if AMBIENT == 2u {
            let world = (view.view_to_world * vec4f(direction, 0.0)).xyz;
            sum += open * environment[first + latlong(world, environment[0].zw)].rgb;
        } else {
            sum += open * direction;
        }
    }
    return sum;
}

/// The cosines at both ends of the way to a sample (Algorithm 1, line 23).
@if(light)
fn cosines(receiver: Receiver, words: vec4u, texel: vec2i, screen: Screen) -> f32 {
    let ray = ray_at(screen, (vec2f(texel) + 0.5) * screen.scale);
    let inverse = plane_inverse_depth(words) * receiver.depth;
    let toward = vec3f(ray, -1.0) - vec3f(receiver.ray, -1.0) * inverse;
    // One over depth is dot(v, ray) for a vector v against the plane's normal.
    let against = plane_gradient(words) * receiver.depth / screen.ray_scale;
    let v = vec3f(against, dot(against, ray) - inverse);
    let lengths = max(dot(toward, toward) * sqrt(dot(v, v)), 1e-30);
    return max(dot(receiver.normal, toward), 0.0) * max(dot(v, toward), 0.0) / lengths;
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
    let random = spread2(id.xy, view.frame, SLICE_STREAM, view.seed, OVER_FRAMES);
    let chance = random3(id.xy, view.frame, SECTOR_STREAM, view.seed).x;
    var open = 1.0;
    @if(light) var light = vec3f(0.0);
    @if(ambient && light) var around = vec3f(0.0);
    for (var i = 0u; i < SLICES; i++) {
        let slice = slice_of(receiver, PI / f32(SLICES) * (f32(i) + random.x));
        // Each slice's sectors are rounded by another number.
        let rounding = select(0.5, fract(chance + GOLDEN * f32(i)), RADIOMETRIC);
        let jitter = select(0.5, fract(random.y + GOLDEN * f32(i)), JITTER);
        var state: State;
        walk(&state, receiver, slice, 1.0, jitter, rounding, screen);
        walk(&state, receiver, slice, -1.0, select(0.5, fract(jitter + 0.5), JITTER), rounding, screen);
        // Cosine-weighted solid angle of the slice; its mean over all azimuths is 1.
        let weight = select(1.0, slice.weight * (slice.cos_angle + slice.angle * slice.sin_angle), RADIOMETRIC);
        let share = weight / f32(SLICES * SECTORS);
        // What is hidden is taken from 1, so that the weights of single slices bring no noise to what is open.
        open -= share * count_sectors(state.mask);
        @if(light) { light += share * state.light; }
        @if(ambient && light) {
            if AMBIENT != 0u {
                around += share * outside(state.mask, receiver, slice, rounding);
            }
        }
    }
    @if(ambient && light) {
        if AMBIENT == 0u {
            around = irradiance(receiver.normal) * max(open, 0.0);
        }
        if AMBIENT == 1u {
            let bent = around * inverseSqrt(max(dot(around, around), 1e-30));
            around = irradiance(bent) * max(open, 0.0);
        }
        light += around;
    }
    // Weights of single slices may hide more than everything, rounding may open more.
    open = saturate(open);
    @if(light) { textureStore(gathered, id.xy, vec4f(max(light, vec3f(0.0)), open)); }
    @if(!light) { textureStore(gathered, id.xy, vec4f(open)); }
}
