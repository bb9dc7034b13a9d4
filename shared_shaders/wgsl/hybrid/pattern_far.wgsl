// variants: published, further, visibility
// Far light by the paper's pattern (Lambru et al., section 3.1): points in the shell between a small and a large
// hemisphere, projected into one reflective shadow map. Each point stands for the area of its share of the pattern;
// with `published`, for Equation 3. With `visibility`, one of several samples is tested for occluders and stands for
// all of them. With `further`, adds to the previous maps.
import package::common::division::Division;
import package::common::hemisphere::shell_point;
import package::common::math::{LARGEST_RADIANCE, spread2};
@if(visibility) import package::common::math::largest;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
@if(published) import package::hybrid::equation_3::equation_3;
@if(!published) import package::hybrid::pattern::{Pattern, sample_area};
import package::reflective_shadow_maps::light_surface::unpack_light;
import package::common::shadow_view::ShadowView;
import package::common::streams::PATTERN_FAR_STREAM;
@if(visibility) import package::common::streams::PATTERN_FAR_VISIBILITY_STREAM;
@if(!published) import package::reflective_shadow_maps::projection::{source_of, light_ray, area_across};
@if(!published) import package::reflective_shadow_maps::transfer::transfer;
@if(visibility) import package::scene_voxels::candidates::{Candidates, with_candidate, next_choice};
@if(visibility) import package::scene_voxels::sees::{RayEnd, ray_end, sees};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Radii of the small and of the large hemisphere, scene units.
    inner: f32,
    outer: f32,
    samples: u32,
    // Brightness of a sample of the `published` weighting: its intensity over the number of samples of all patterns
    // (Equations 2 and 5).
    weight: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(14) var<uniform> shadow_view: ShadowView;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var rsm_position: texture_2d<f32>;
@group(0) @binding(4) var light: texture_2d<u32>;
@if(further) @group(0) @binding(5) var partial_sum: texture_2d<f32>;
@group(0) @binding(6) var gathered: texture_storage_2d<rgba32float, write>;

// Number of successive samples of which one is chosen by its contribution and tested for visibility.
@if(visibility) override SAMPLES_PER_RAY: u32;

/// Contribution of these candidates to the receiver `here`.
@if(visibility)
fn light_of(candidates: Candidates, here: RayEnd) -> vec3f {
    if candidates.strength <= 0.0 {
        return vec3f(0.0);
    }
    let width = textureDimensions(rsm_position).x;
    let at = vec2u(candidates.picked % width, candidates.picked / width);
    let source = unpack_light(textureLoad(rsm_position, at, 0).xyz, textureLoad(light, at, 0));
    let free = sees(here, ray_end(source.position, source.normal));
    return select(vec3f(0.0), source.radiance * (candidates.strength / largest(source.radiance)), free);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    var sum = vec3f(0.0);
    @if(further) { sum = textureLoad(partial_sum, id, 0).rgb; }
    if surfel_depth(own) > SKY_DEPTH {
        let in_view = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let normal = normalize((view.view_to_world * vec4f(surfel_normal(own), 0.0)).xyz);
        let size = vec2f(textureDimensions(rsm_position));
        // All faces around a point light project the same points.
        let random = spread2(id, view.frame, PATTERN_FAR_STREAM + shadow_view.light, view.seed, false);
        let inner = params.inner / params.outer;
        @if(!published) let source = source_of(shadow_view.world_to_clip);
        @if(visibility) let here = ray_end(position, normal);
        @if(visibility) let stream = PATTERN_FAR_VISIBILITY_STREAM + shadow_view.light;
        @if(visibility) var candidates =
            Candidates(0.0, 0u, spread2(id, view.frame, stream, view.seed, false).x);
        for (var i = 0u; i < params.samples; i++) {
            let offset = shell_point(normal, inner, i, params.samples, random);
            let point = position + params.outer * offset;
            let clip = shadow_view.world_to_clip * vec4f(point, 1.0);
            // The map shows nothing behind a spot light or a cube face.
            let texel = (clip.xy / max(clip.w, 1e-30) * vec2f(0.5, -0.5) + 0.5) * size;
            let inside = clip.w > 0.0 && all(texel >= vec2f(0.0)) && all(texel < size);
            let at = select(vec2i(0), vec2i(floor(texel)), inside);
            let surface = unpack_light(textureLoad(rsm_position, at, 0).xyz, textureLoad(light, at, 0));
            var counts = inside && surface.area > 0.0;
            var factor = 0.0;
            @if(published) { factor = params.weight * equation_3(position, normal, surface); }
            @if(!published) {
                // Nearer surfaces belong to the small hemisphere. Farther ones do not count.
                let away = distance(surface.position, position);
                counts = counts && away >= params.inner && away < params.outer;
                let ray = light_ray(source, point);
                let inverse = select(0.0, params.outer / ray.distance, ray.distance > 0.0);
                let pattern = Pattern(normal, inner, params.outer);
                let area = sample_area(pattern, offset, ray.direction, inverse, params.samples);
                let texels = area / max(area_across(shadow_view.world_to_clip, ray, size.x), 1e-36);
                // No sample stands for more than the whole map.
                factor = transfer(position, normal, surface) * min(texels, size.x * size.y);
            }
            factor = select(0.0, factor, counts);
            @if(!visibility) { sum += surface.radiance * factor; }
            @if(visibility) {
                let index = u32(at.y) * textureDimensions(rsm_position).x + u32(at.x);
                candidates = with_candidate(candidates, index, largest(surface.radiance) * factor);
                if (i + 1u) % SAMPLES_PER_RAY == 0u || i + 1u == params.samples {
                    sum += light_of(candidates, here);
                    candidates = Candidates(0.0, 0u, next_choice(candidates.choice));
                }
            }
        }
    }
    textureStore(gathered, id, vec4f(min(sum, vec3f(LARGEST_RADIANCE)), 1.0));
}
