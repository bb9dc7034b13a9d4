// variants: visibility, near, lit, emitters
// Indirect light that each texel of level 0 receives from the reflective shadow maps: the gather of Soler et al. 2009
// in the lights' views instead of the camera's. The rings are centred at the receiver's position in the map. The ring
// of level k is sampled in texels of level k. All rings together cover the whole map, with a sample density of one over
// the squared distance.
//
// `lit`: the scene has lights. With `emitters`, points on emitting surfaces send light too, to both sides. With `near`,
// pairs within the near-field distance are left to the screen, whose light is added.
@if(lit) import package::common::math::GOLDEN_ROTATION;
import package::common::division::Division;
import package::common::math::{LARGEST_RADIANCE, PI, spread2};
@if(visibility) import package::common::math::largest;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::common::streams::LIGHT_STREAM;
@if(visibility) import package::common::streams::LIGHT_VISIBILITY_STREAM;
@if(lit) import package::reflective_shadow_maps::light_pyramid::{level_start, unpack_texel};
import package::reflective_shadow_maps::light_surface::LightSurface;
@if(emitters) import package::reflective_shadow_maps::light_surface::unpack_light;
import package::reflective_shadow_maps::transfer::transfer;
@if(visibility) import package::scene_voxels::candidates::{Candidates, with_candidate, next_choice};
@if(visibility) import package::scene_voxels::sees::{ray_end, sees};

struct Params {
    // Width of a texel of `surfels` in full-resolution pixels.
    scale: f32,
    // Width of a map at its finest level, texels, and number of maps.
    size: u32,
    views: u32,
    // First level to gather, and the level after the last one.
    first_level: u32,
    end_level: u32,
    // Squares of the rings' inner and outer radius, in texels of their level. Level 0 is a whole disc.
    inner_square: f32,
    outer_square: f32,
    // Near-field distance, scene units.
    near_field_distance: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(lit) @group(0) @binding(4) var<storage, read> light_pyramid: array<vec4u>;
// World to clip space of each map.
@if(lit) @group(0) @binding(5) var<storage, read> light_projections: array<mat4x4f>;
@if(near) @group(0) @binding(6) var near_light: texture_2d<f32>;
// Points on emitters, two surfaces each, world space.
@if(emitters) @group(0) @binding(7) var<storage, read> emitter_positions: array<vec4f>;
@if(emitters) @group(0) @binding(8) var<storage, read> emitter_lights: array<vec4u>;

// Samples per level and map.
@if(lit) override LIGHT_SAMPLES: u32;
// Number of successive samples of which one is chosen by its contribution and tested for visibility.
@if(visibility) override SAMPLES_PER_RAY: u32;
// Whether a temporal filter averages successive frames. The directions are then stratified over frames.
override OVER_FRAMES: bool;

// The golden angle (Vogel 1979).
@if(lit) const GOLDEN_ANGLE: f32 = 2.399963229728653;

@if(lit) const LEVELS: u32 = 8u;

/// Form factor of a surface: its contribution per unit of radiance, without occluders.
fn factor_of(position: vec3f, normal: vec3f, surface: LightSurface) -> f32 {
    let factor = transfer(position, normal, surface);
    @if(near) { return select(factor, 0.0, distance(surface.position, position) < params.near_field_distance); }
    @if(!near) { return factor; }
}

/// Position in the map, 0..1; for positions outside the map, the nearest position on its edge.
@if(lit)
fn position_in(world_to_clip: mat4x4f, position: vec3f) -> vec2f {
    let clip = world_to_clip * vec4f(position, 1.0);
    let extent = max(max(abs(clip.x), abs(clip.y)), 1e-30);
    // Behind the light only the direction is known.
    let ndc = select(clip.xy / extent, clamp(clip.xy / max(clip.w, 1e-30), vec2f(-1.0), vec2f(1.0)), clip.w > 0.0);
    return ndc * vec2f(0.5, -0.5) + 0.5;
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(gathered, id, vec4f(0.0));
        return;
    }
    let in_view = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov);
    let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
    let normal = normalize((view.view_to_world * vec4f(surfel_normal(own), 0.0)).xyz);
    var sum = vec3f(0.0);
    @if(visibility) let here = ray_end(position, normal);
    @if(visibility) var choice = spread2(id, view.frame, LIGHT_VISIBILITY_STREAM, view.seed, OVER_FRAMES).x;
    @if(lit) {
        let step = 1.0 / f32(LIGHT_SAMPLES);
        // Samples of each map that share a ray.
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
                @if(visibility) var candidates = Candidates(0.0, start, choice);
                for (var i = 0u; i < params.views; i++) {
                    let centre = position_in(light_projections[i], position) * f32(width);
                    let random = spread2(id, view.frame, LIGHT_STREAM + i * LEVELS + level, view.seed, OVER_FRAMES);
                    let angle = 2.0 * PI * random.y + GOLDEN_ANGLE * f32(first);
                    var direction = vec2f(cos(angle), sin(angle));
                    let end = min(first + share, LIGHT_SAMPLES);
                    for (var j = first; j < end; j++) {
                        // Stratified over the area of the ring.
                        let point = centre + sqrt(inner + extent * step * (f32(j) + random.x)) * direction;
                        direction = vec2f(
                            direction.x * GOLDEN_ROTATION.x - direction.y * GOLDEN_ROTATION.y,
                            direction.x * GOLDEN_ROTATION.y + direction.y * GOLDEN_ROTATION.x,
                        );
                        let inside = all(point >= vec2f(0.0)) && all(point < vec2f(f32(width)));
                        let at = vec2u(clamp(point, vec2f(0.0), vec2f(f32(width - 1u))));
                        let index = start + (i * width + at.y) * width + at.x;
                        let surface = unpack_texel(light_pyramid[2u * index], light_pyramid[2u * index + 1u]);
                        let factor = select(0.0, factor_of(position, normal, surface) * texels, inside);
                        @if(!visibility) { sum += surface.radiance * factor; }
                        @if(visibility) {
                            candidates = with_candidate(candidates, index, largest(surface.radiance) * factor);
                        }
                    }
                }
                @if(visibility) {
                    if candidates.strength > 0.0 {
                        let index = 2u * candidates.picked;
                        let source = unpack_texel(light_pyramid[index], light_pyramid[index + 1u]);
                        if sees(here, ray_end(source.position, source.normal)) {
                            sum += source.radiance * (candidates.strength / largest(source.radiance));
                        }
                    }
                    choice = next_choice(candidates.choice);
                }
            }
        }
    }
    @if(emitters) {
        // Successive points lie on successive parts of the emitters. Each point has two surfaces.
        let count = arrayLength(&emitter_positions);
        @if(visibility) let share = min(2u * SAMPLES_PER_RAY, count);
        @if(!visibility) let share = count;
        for (var first = 0u; first < count; first += share) {
            @if(visibility) var candidates = Candidates(0.0, first, choice);
            let end = min(first + share, count);
            for (var i = first; i < end; i++) {
                let surface = unpack_light(emitter_positions[i].xyz, emitter_lights[i]);
                let factor = factor_of(position, normal, surface);
                @if(!visibility) { sum += surface.radiance * factor; }
                @if(visibility) { candidates = with_candidate(candidates, i, largest(surface.radiance) * factor); }
            }
            @if(visibility) {
                if candidates.strength > 0.0 {
                    let index = candidates.picked;
                    let source = unpack_light(emitter_positions[index].xyz, emitter_lights[index]);
                    if sees(here, ray_end(source.position, source.normal)) {
                        sum += source.radiance * (candidates.strength / largest(source.radiance));
                    }
                }
                choice = next_choice(candidates.choice);
            }
        }
    }
    @if(near) { sum += textureLoad(near_light, id, 0).rgb; }
    // Many samples near the largest radiance, each standing for many texels, must stay finite.
    textureStore(gathered, id, vec4f(min(sum, vec3f(LARGEST_RADIANCE)), 1.0));
}
