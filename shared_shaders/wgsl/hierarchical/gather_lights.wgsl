// variants: visibility, near
// Indirect light that each texel of level 0 receives from what the lights see, wherever it is: the gather of Soler et al.
// 2009, in the lights' views instead of the camera's. Rings lie around the place where a light sees the receiver; the
// ring of level k is sampled in texels of level k, and all rings together cover the whole view, so that samples are as dense as
// one over the square of the distance in it. With `near`, pairs closer than a border are left to the screen, whose light
// is added.
import package::common::math::{LARGEST_RADIANCE, PI, spread2};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::light_views::light_pyramid::{level_start, unpack_texel};
@if(visibility) import package::light_views::light_pyramid::largest;
import package::light_views::transfer::transfer;
@if(visibility) import package::scene_voxels::sees::{clear_of, sees};

struct Params {
    // Width of a texel of `surfels` in full-resolution pixels.
    scale: f32,
    // Texels along a side of a light's view, at its finest level, and number of views.
    size: u32,
    views: u32,
    // First level that is gathered, and the one after the last.
    first_level: u32,
    end_level: u32,
    // Squares of the rings' inner and outer radius, texels of their level; level 0 is a whole disc.
    inner_square: f32,
    outer_square: f32,
    // Border between near and far, scene units.
    border: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var<storage, read> light_pyramid: array<vec4u>;
// World to clip space of each view.
@group(0) @binding(5) var<storage, read> light_projections: array<mat4x4f>;
@if(near) @group(0) @binding(6) var near_light: texture_2d<f32>;

// Samples of each level of each view.
override LIGHT_SAMPLES: u32 = 64u;
// Successive samples of which one is picked, by what it would bring, and tested for visibility.
@if(visibility) override SAMPLES_PER_RAY: u32 = 16u;
// Whether a filter averages successive frames, which then share out the directions between them.
override OVER_FRAMES: bool = false;

// The golden angle, its cosine and sine (Vogel 1979).
const GOLDEN_ANGLE: f32 = 2.399963229728653;
const TURN: vec2f = vec2f(-0.7373688780783197, 0.6754902942615238);

// Streams of random numbers: eight for each view.
const STREAM: u32 = 5120u;
const LEVELS: u32 = 8u;

/// Where a view shows a place, 0..1 over the view; for what it does not show, the nearest place of its border.
fn place_in(world_to_clip: mat4x4f, position: vec3f) -> vec2f {
    let clip = world_to_clip * vec4f(position, 1.0);
    let extent = max(max(abs(clip.x), abs(clip.y)), 1e-30);
    // Behind a lamp only the direction is left.
    let ndc = select(clip.xy / extent, clamp(clip.xy / max(clip.w, 1e-30), vec2f(-1.0), vec2f(1.0)), clip.w > 0.0);
    return ndc * vec2f(0.5, -0.5) + 0.5;
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
    let in_view = surfel_position(own, id.xy, params.scale, view.display_size, view.tan_half_fov);
    let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
    let normal = normalize((view.view_to_world * vec4f(surfel_normal(own), 0.0)).xyz);
    let step = 1.0 / f32(LIGHT_SAMPLES);
    var sum = vec3f(0.0);
    @if(visibility) let here = clear_of(position, normal);
    @if(visibility) var choice = spread2(id.xy, view.frame, STREAM - 1u, view.seed, OVER_FRAMES).x;
    // Samples of every view that share a ray.
    @if(visibility) let share = (SAMPLES_PER_RAY + params.views - 1u) / params.views;
    @if(!visibility) let share = LIGHT_SAMPLES;
    for (var level = params.first_level; level < params.end_level; level++) {
        let width = params.size >> level;
        let start = level_start(level, params.size, params.views);
        let inner = select(params.inner_square, 0.0, level == 0u);
        let extent = params.outer_square - inner;
        // Texels that a sample stands for: its share of the ring.
        let texels = PI * extent * step;
        for (var first = 0u; first < LIGHT_SAMPLES; first += share) {
            @if(visibility) var strength_of_all = 0.0;
            @if(visibility) var picked = start;
            for (var i = 0u; i < params.views; i++) {
                let centre = place_in(light_projections[i], position) * f32(width);
                let random = spread2(id.xy, view.frame, STREAM + i * LEVELS + level, view.seed, OVER_FRAMES);
                let angle = 2.0 * PI * random.y + GOLDEN_ANGLE * f32(first);
                var direction = vec2f(cos(angle), sin(angle));
                let end = min(first + share, LIGHT_SAMPLES);
                for (var j = first; j < end; j++) {
                    // Stratified over the ring's area.
                    let point = centre + sqrt(inner + extent * step * (f32(j) + random.x)) * direction;
                    direction = vec2f(
                        direction.x * TURN.x - direction.y * TURN.y,
                        direction.x * TURN.y + direction.y * TURN.x,
                    );
                    let inside = all(point >= vec2f(0.0)) && all(point < vec2f(f32(width)));
                    let at = vec2u(clamp(point, vec2f(0.0), vec2f(f32(width - 1u))));
                    let index = start + (i * width + at.y) * width + at.x;
                    let surface = unpack_texel(light_pyramid[2u * index], light_pyramid[2u * index + 1u]);
                    var factor = select(0.0, transfer(position, normal, surface), inside);
                    @if(near) {
                        factor = select(factor, 0.0, distance(surface.position, position) < params.border);
                    }
                    @if(!visibility) { sum += surface.radiance * (factor * texels); }
                    @if(visibility) {
                        // One sample of these few is picked, in proportion to what it would bring, and stands for them where
                        // it is seen (resampled importance sampling, Talbot et al. 2005).
                        let strength = largest(surface.radiance) * factor * texels;
                        let before = strength_of_all;
                        strength_of_all += strength;
                        // One number serves all choices: what is left of it after each one is as random as before.
                        let threshold = choice * strength_of_all;
                        let pick = threshold < strength;
                        let left = select(threshold - strength, threshold, pick)
                            / max(select(before, strength, pick), 1e-36);
                        choice = select(choice, min(left, 0.99999994), strength > 0.0);
                        picked = select(picked, index, pick);
                    }
                }
            }
            @if(visibility) {
                if strength_of_all > 0.0 {
                    let source = unpack_texel(light_pyramid[2u * picked], light_pyramid[2u * picked + 1u]);
                    if sees(here, clear_of(source.position, source.normal)) {
                        sum += source.radiance * (strength_of_all / largest(source.radiance));
                    }
                }
                // The golden ratio's steps fill the line evenly.
                choice = fract(choice + 0.6180339887498949);
            }
        }
    }
    @if(near) { sum += textureLoad(near_light, id.xy, 0).rgb; }
    // Light at the end of what radiance may be, from many samples that stand for many texels each, stays a number.
    textureStore(gathered, id.xy, vec4f(min(sum, vec3f(LARGEST_RADIANCE)), 1.0));
}
