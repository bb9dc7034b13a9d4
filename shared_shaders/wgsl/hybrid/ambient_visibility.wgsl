// variants: light
// Ambient visibility (1 = open, 0 = closed; ambient occlusion is 1 minus it) from several views (Lambru et al., section
// 3.3). Each view classifies points of the hemisphere as open or closed (Mittring 2007); views are weighted by their
// reliability (after Vardis et al. 2013). The screen comes first. With `light`, adds the view of one light.
import package::common::division::Division;
import package::common::hemisphere::hemisphere_point;
import package::common::math::spread2;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH, pixel_of};
@if(light) import package::reflective_shadow_maps::light_surface::unpack_light;
@if(light) import package::common::shadow_view::ShadowView;
import package::common::streams::AMBIENT_VISIBILITY_STREAM;
@if(light) import package::reflective_shadow_maps::projection::{source_of, light_ray, area_across};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    samples: u32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@if(light) @group(0) @binding(14) var<uniform> shadow_view: ShadowView;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@if(light) @group(0) @binding(3) var rsm_position: texture_2d<f32>;
@if(light) @group(0) @binding(4) var light: texture_2d<u32>;
@if(light) @group(0) @binding(5) var partial_sum: texture_2d<f32>;
// Sum of weighted ambient visibility, and sum of weights.
@group(0) @binding(6) var views: texture_storage_2d<rg32float, write>;

// Points this close to the surface, in radii, count as in front of it, because depth is rounded.
const BIAS: f32 = 0.01;
// An occluder more than this in front of a point, in radii, is the silhouette of another object: the view cannot
// classify the point.
const SILHOUETTE: f32 = 2.0;

/// 1 for open, -1 for closed, 0 for unknown. `behind` is the distance of the point behind the visible surface, along
/// the view's ray.
fn judge(behind: f32) -> f32 {
    return select(select(0.0, -1.0, behind < SILHOUETTE * params.radius), 1.0, behind <= 0.0);
}

@compute @workgroup_size(8, 8)
fn sample_view(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    var sum = vec2f(0.0);
    @if(light) { sum = textureLoad(partial_sum, id, 0).xy; }
    if surfel_depth(own) > SKY_DEPTH {
        let normal = surfel_normal(own);
        let position = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov)
            + BIAS * params.radius * normal;
        let random = spread2(id, view.frame, AMBIENT_VISIBILITY_STREAM, view.seed, false);
        @if(light) let source = source_of(shadow_view.world_to_clip);
        @if(light) let size = vec2f(textureDimensions(rsm_position));
        // Number of open and of closed samples.
        var open = 0.0;
        var closed = 0.0;
        for (var i = 0u; i < params.samples; i++) {
            let point = position + params.radius * hemisphere_point(normal, i, params.samples, random);
            var verdict = 0.0;
            @if(!light) {
                let pixel = pixel_of(point, view.tan_half_fov, view.display_size);
                let on_screen = point.z < 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < view.display_size);
                let texel = select(vec2i(0), vec2i(floor(pixel / params.scale)), on_screen);
                let depth = surfel_depth(textureLoad(surfels, texel, 0));
                // Everything in front of the sky is open.
                let behind = select(-1.0, -point.z - depth, depth > SKY_DEPTH);
                verdict = select(0.0, judge(behind), on_screen);
            }
            @if(light) {
                let world = (view.view_to_world * vec4f(point, 1.0)).xyz;
                let clip = shadow_view.world_to_clip * vec4f(world, 1.0);
                let uv = clip.xy / max(clip.w, 1e-30) * vec2f(0.5, -0.5) + 0.5;
                let inside = clip.w > 0.0 && all(uv >= vec2f(0.0)) && all(uv < vec2f(1.0));
                let at = select(vec2i(0), vec2i(floor(uv * size)), inside);
                let surface = unpack_light(textureLoad(rsm_position, at, 0).xyz, textureLoad(light, at, 0));
                let ray = light_ray(source, world);
                // A surface that slopes away from the light within a texel does not occlude itself.
                let slack = sqrt(max(area_across(shadow_view.world_to_clip, ray, size.x), 0.0));
                let behind = select(-1.0, dot(world - surface.position, ray.direction) - slack, surface.area > 0.0);
                verdict = select(0.0, judge(behind), inside);
            }
            open += max(verdict, 0.0);
            closed += max(-verdict, 0.0);
        }
        // A view along the surface, or of its back, sees little of the space in front of it.
        var facing = 0.0;
        @if(!light) { facing = -dot(normal, normalize(position)); }
        @if(light) {
            let world = (view.view_to_world * vec4f(position, 1.0)).xyz;
            let world_normal = (view.view_to_world * vec4f(normal, 0.0)).xyz;
            facing = -dot(world_normal, light_ray(source, world).direction);
        }
        let known = open + closed;
        // Unknown samples may differ from known ones, so the weight is the square of the known share.
        let share = known / f32(params.samples);
        let weight = max(facing, 0.0) * share * share;
        sum += weight * vec2f(open / max(known, 1.0), 1.0);
    }
    textureStore(views, id, vec4f(sum, 0.0, 0.0));
}
