// variants: published
// Near light by the paper's pattern (Lambru et al., section 3.1; Ritschel et al. 2009): points inside a small
// hemisphere, projected to the screen. Each point stands for the area of its share of the pattern. With `published` it
// counts if the visible surface occludes it, by Equation 3: a mean between points, without units.
import package::common::division::Division;
import package::common::form_factor::MIN_COS_BETA;
import package::common::hemisphere::hemisphere_point;
import package::common::math::{LARGEST_RADIANCE, spread2};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position, surfel_radiance};
import package::common::view::{View, SKY_DEPTH, pixel_of};
import package::common::streams::PATTERN_NEAR_STREAM;
@if(published) import package::hybrid::equation_3::equation_3;
@if(!published) import package::hybrid::pattern::{Pattern, sample_area};
import package::reflective_shadow_maps::light_surface::LightSurface;
@if(!published) import package::reflective_shadow_maps::transfer::transfer;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Radius of the hemisphere, scene units.
    radius: f32,
    samples: u32,
    // Brightness of a sample of the `published` weighting: its intensity over the number of samples of all patterns
    // (Equations 2 and 5).
    weight: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    // Light, and the sum of form factors.
    var sum = vec4f(0.0);
    if surfel_depth(own) > SKY_DEPTH {
        let position = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov);
        let normal = surfel_normal(own);
        let random = spread2(id, view.frame, PATTERN_NEAR_STREAM, view.seed, false);
        // Solid angle of a texel in the middle of the screen.
        let pixel = 2.0 * view.tan_half_fov / view.display_size * params.scale;
        let texel_angle = pixel.x * pixel.y;
        for (var i = 0u; i < params.samples; i++) {
            let offset = hemisphere_point(normal, i, params.samples, random);
            let point = position + params.radius * offset;
            let at = pixel_of(point, view.tan_half_fov, view.display_size);
            let texel = vec2i(floor(at / params.scale));
            let on_screen = point.z < 0.0 && all(at >= vec2f(0.0)) && all(at < view.display_size);
            let words = textureLoad(surfels, select(vec2i(0), texel, on_screen), 0);
            let depth = surfel_depth(words);
            let sender =
                surfel_position(words, vec2u(max(texel, vec2i(0))), params.scale, view.display_size, view.tan_half_fov);
            let sender_normal = surfel_normal(words);
            // Equation 2 of Soler et al. 2009.
            let slant = max(-dot(sender_normal, sender / max(depth, 1e-30)), MIN_COS_BETA);
            let surface = LightSurface(sender, texel_angle * depth * depth / slant, sender_normal, 1.0, vec3f(0.0));
            let within = on_screen && depth > SKY_DEPTH && distance(sender, position) < params.radius;
            var factor = 0.0;
            @if(published) {
                let hidden = depth < -point.z;
                factor = select(0.0, params.weight * equation_3(position, normal, surface), within && hidden);
            }
            @if(!published) {
                let away = max(length(point), 1e-30);
                let ray = point / away;
                let pattern = Pattern(normal, 0.0, params.radius);
                let area = sample_area(pattern, offset, ray, params.radius / away, params.samples);
                // The solid angle of a texel decreases away from the middle of the screen.
                let cosine = max(-ray.z, 1e-3);
                let texels = area / max(texel_angle * cosine * cosine * cosine * away * away, 1e-36);
                // No sample stands for more than the whole screen.
                let all_texels = f32(textureDimensions(surfels).x * textureDimensions(surfels).y);
                factor = select(0.0, transfer(position, normal, surface) * min(texels, all_texels), within);
            }
            sum += vec4f(surfel_radiance(words), 1.0) * factor;
        }
    }
    @if(published) { sum.w = 1.0; }
    // Discs of many samples may overlap. The form factors of a hemisphere sum to at most 1.
    textureStore(gathered, id, vec4f(min(sum.rgb / max(sum.w, 1.0), vec3f(LARGEST_RADIANCE)), 1.0));
}
