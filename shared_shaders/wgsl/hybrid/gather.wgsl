// variants: near, far, visibility, recompute, float16
// Hybrid diffuse light (Lambru et al., section 3.1). With `near`, light from the screen within a radius (SSDO). With
// `far`, light from the reflective shadow maps beyond it. The two domains share no pair of points, so they add up. With
// `recompute`, only for display pixels whose surface the coarse texels hardly show (Dachsbacher & Stamminger 2005,
// section 4.3); other pixels keep the interpolated light.
@if(near) import package::common::math::GOLDEN_ROTATION;
import package::common::division::Division;
import package::common::form_factor::MIN_COS_BETA;
import package::common::math::{LARGEST_RADIANCE, PI, spread2};
@if(far && visibility) import package::common::math::largest;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position, surfel_radiance};
import package::common::view::{View, SKY_DEPTH};
@if(recompute) import package::common::view::{uv_of_texel, view_position};
@if(float16) import package::common::math::LARGEST_FLOAT16;
@if(far) import package::common::streams::FAR_STREAM;
@if(near) import package::common::streams::NEAR_STREAM;
import package::reflective_shadow_maps::light_surface::LightSurface;
import package::reflective_shadow_maps::transfer::transfer;
@if(far && visibility) import package::scene_voxels::candidates::{Candidates, with_candidate, next_choice};
@if(far && visibility) import package::scene_voxels::sees::{RayEnd, ray_end, sees};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Near-field distance, scene units.
    radius: f32,
    // Number of virtual point lights in the list, and the share of them that one receiver reads: 1 / stride.
    virtual_point_lights: u32,
    stride: u32,
    // Smallest weight of coarse texels that counts as showing a pixel's surface.
    @if(recompute) least_weight: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@if(!float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(3) var gathered: texture_storage_2d<rgba16float, write>;
@if(far) @group(0) @binding(4) var<storage, read> virtual_point_lights: array<LightSurface>;

@if(recompute) @group(0) @binding(7) var depth: texture_2d<f32>;
@if(recompute) @group(0) @binding(8) var normal: texture_2d<f32>;
// Light, and in a the weight of the coarse texels.
@if(recompute) @group(0) @binding(9) var interpolated: texture_2d<f32>;

// Number of successive lights of which one is chosen by its contribution and tested for visibility.
@if(far && visibility) override SAMPLES_PER_RAY: u32;
// Number of samples of the near part.
@if(near) override NEAR_SAMPLES: u32;
// Whether a temporal filter averages successive frames. The directions are then stratified over frames.
override OVER_FRAMES: bool;

/// Light of nearby sources whose form factors sum to `w`. A hemisphere has a sum of at most 1. More is the noise of few
/// samples that stand for many, and is divided out.
@if(near)
fn within_hemisphere(light: vec4f) -> vec3f {
    return light.rgb / max(light.w, 1.0);
}

/// Light from surfaces on the screen within the radius. Samples cover evenly the largest disc that a sphere of the
/// radius around the receiver can have on the screen.
@if(near)
fn light_from_near(position: vec3f, normal: vec3f, id: vec2u) -> vec3f {
    let size = vec2f(textureDimensions(surfels));
    let pixel = 2.0 * view.tan_half_fov / view.display_size;
    let texel = pixel.y * params.scale;
    // The sphere looks larger towards the eye than at its centre.
    let nearest = max(-position.z - params.radius, -0.25 * position.z);
    let reach = min(params.radius / (nearest * texel), length(size));
    let random = spread2(id, view.frame, NEAR_STREAM, view.seed, OVER_FRAMES);
    let angle = 2.0 * PI * random.y;
    var direction = vec2f(cos(angle), sin(angle));
    var centre = vec2f(id) + 0.5;
    @if(recompute) { centre /= params.scale; }
    // Screen area of a sample, full-resolution pixels, times the area of a pixel at depth 1.
    let area = PI * reach * reach * params.scale * params.scale / f32(NEAR_SAMPLES) * pixel.x * pixel.y;
    // The disc of one texel bounds the form factor. A sample stands for several texels.
    let disc = pixel.x * pixel.y * params.scale * params.scale;
    // Light, and the sum of form factors.
    var sum = vec4f(0.0);
    for (var i = 0u; i < NEAR_SAMPLES; i++) {
        let point = centre + reach * sqrt((f32(i) + random.x) / f32(NEAR_SAMPLES)) * direction;
        direction = vec2f(
            direction.x * GOLDEN_ROTATION.x - direction.y * GOLDEN_ROTATION.y,
            direction.x * GOLDEN_ROTATION.y + direction.y * GOLDEN_ROTATION.x,
        );
        let words = textureLoad(surfels, vec2i(floor(point)), 0);
        let on_screen = all(point >= vec2f(0.0)) && all(point * params.scale < view.display_size);
        let d = surfel_depth(words);
        let at = surfel_position(words, vec2u(max(point, vec2f(0.0))), params.scale, view.display_size, view.tan_half_fov);
        let n = surfel_normal(words);
        let ray = at / max(d, 1e-30);
        // Equation 2 of Soler et al. 2009.
        let surface = LightSurface(at, disc * d * d / max(-dot(n, ray), MIN_COS_BETA), n, 1.0, vec3f(0.0));
        let inside = on_screen && d > SKY_DEPTH && distance(at, position) < params.radius;
        let factor = transfer(position, normal, surface);
        sum += select(vec4f(0.0), vec4f(surfel_radiance(words), 1.0) * factor, inside);
    }
    return within_hemisphere(sum * (area / disc));
}

/// The end of a ray. Position and normal are in view space.
@if(far && visibility)
fn ray_end_of_view(position: vec3f, normal: vec3f) -> RayEnd {
    return ray_end(
        (view.view_to_world * vec4f(position, 1.0)).xyz,
        (view.view_to_world * vec4f(normal, 0.0)).xyz,
    );
}

/// Contribution of a virtual point light without occluders.
@if(far)
fn light_from(i: u32, position: vec3f, normal: vec3f) -> vec3f {
    let surface = virtual_point_lights[i];
    var factor = transfer(position, normal, surface) * surface.factor;
    @if(near) {
        factor = select(factor, 0.0, distance(surface.position, position) < params.radius);
    }
    return surface.radiance * factor;
}

/// Light from virtual point lights beyond the radius: every `stride`-th light of the list, from an offset that differs
/// between neighbours.
@if(far)
fn light_from_far(position: vec3f, normal: vec3f, id: vec2u) -> vec3f {
    let random = spread2(id, view.frame, FAR_STREAM, view.seed, OVER_FRAMES);
    var sum = vec3f(0.0);
    let first = u32(random.x * f32(params.stride));
    @if(!visibility) {
        for (var i = first; i < params.virtual_point_lights; i += params.stride) {
            sum += light_from(i, position, normal);
        }
    }
    @if(visibility) {
        let here = ray_end_of_view(position, normal);
        var choice = random.y;
        for (var start = first; start < params.virtual_point_lights; start += params.stride * SAMPLES_PER_RAY) {
            var candidates = Candidates(0.0, start, choice);
            for (var j = 0u; j < SAMPLES_PER_RAY; j++) {
                let i = start + j * params.stride;
                if i < params.virtual_point_lights {
                    candidates = with_candidate(candidates, i, largest(light_from(i, position, normal)));
                }
            }
            if candidates.strength > 0.0 {
                let surface = virtual_point_lights[candidates.picked];
                if sees(here, ray_end_of_view(surface.position, surface.normal)) {
                    sum += surface.radiance * (candidates.strength / largest(surface.radiance));
                }
            }
            choice = next_choice(candidates.choice);
        }
    }
    return sum * f32(params.stride);
}

/// All light of a surface. `id` is its texel or pixel.
fn light_at(position: vec3f, normal: vec3f, id: vec2u) -> vec3f {
    var sum = vec3f(0.0);
    @if(near) { sum += light_from_near(position, normal, id); }
    @if(far) { sum += light_from_far(position, normal, id); }
    return sum;
}

@if(!recompute)
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    var sum = vec3f(0.0);
    if surfel_depth(own) > SKY_DEPTH {
        let position = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov);
        sum = light_at(position, surfel_normal(own), id);
    }
    // The largest radiance times the lights that one stands for stays finite.
    textureStore(gathered, id, vec4f(min(sum, vec3f(LARGEST_RADIANCE)), 1.0));
}

@if(recompute)
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(gathered)) {
        return;
    }
    var result = textureLoad(interpolated, id, 0);
    if result.w < params.least_weight {
        let d = textureLoad(depth, id, 0).x;
        let position = view_position(uv_of_texel(id, 1.0, view.display_size), d, view.tan_half_fov);
        result = vec4f(light_at(position, normalize(textureLoad(normal, id, 0).xyz), id), 1.0);
    }
    @if(float16) { result = min(result, vec4f(LARGEST_FLOAT16)); }
    textureStore(gathered, id, result);
}
