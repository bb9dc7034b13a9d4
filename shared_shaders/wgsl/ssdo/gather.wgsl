// Screen-space directional occlusion, its indirect light (Ritschel et al. 2009, section 3.2): points inside a
// hemisphere are projected to the screen. The visible surface in front of a point occludes it and sends light.
import package::common::division::Division;
import package::common::hemisphere::hemisphere_point;
import package::common::math::{PI, spread2};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position, surfel_radiance};
import package::common::view::{View, SKY_DEPTH, pixel_of};
import package::common::streams::SSDO_STREAM;
import package::reflective_shadow_maps::light_surface::LightSurface;
import package::reflective_shadow_maps::transfer::transfer;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
    // Brightness of the `published` weighting.
    intensity: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;

override SAMPLES: u32;
// Each sample is a disc of its share of the hemisphere's base (true), or follows Lambru's Equation 3, a mean without
// units (false).
override RADIOMETRIC: bool;

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
        let random = spread2(id, view.frame, SSDO_STREAM, view.seed, false);
        // A sample's share of the disc below the hemisphere.
        let area = PI * params.radius * params.radius / f32(SAMPLES);
        for (var i = 0u; i < SAMPLES; i++) {
            let point = position + params.radius * hemisphere_point(normal, i, SAMPLES, random);
            let pixel = pixel_of(point, view.tan_half_fov, view.display_size);
            let texel = vec2i(floor(pixel / params.scale));
            let on_screen = point.z < 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < view.display_size);
            let words = textureLoad(surfels, select(vec2i(0), texel, on_screen), 0);
            let depth = surfel_depth(words);
            let sender = surfel_position(words, vec2u(max(texel, vec2i(0))), params.scale, view.display_size, view.tan_half_fov);
            let hidden = on_screen && depth > SKY_DEPTH && depth < -point.z && distance(sender, position) < params.radius;
            var factor = 0.0;
            if RADIOMETRIC {
                factor = transfer(position, normal, LightSurface(sender, area, surfel_normal(words), 1.0, vec3f(0.0)));
            } else {
                let toward = sender - position;
                let square = max(dot(toward, toward), 1e-12 * params.radius * params.radius);
                let cosines = max(dot(normal, toward), 0.0) * max(-dot(surfel_normal(words), toward), 0.0) / square;
                factor = params.intensity * cosines / (square * f32(SAMPLES));
            }
            sum += select(vec4f(0.0), vec4f(surfel_radiance(words), 1.0) * factor, hidden);
        }
    }
    // Discs of many samples may overlap. The form factors of a hemisphere sum to at most 1.
    textureStore(gathered, id, vec4f(sum.rgb / max(sum.w, 1.0), 1.0));
}
