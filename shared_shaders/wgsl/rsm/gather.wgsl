// variants: further
// Indirect light from one reflective shadow map (Dachsbacher & Stamminger 2005, section 3.3): samples of the texels
// around the receiver's position in the map, dense nearby and sparse far away. With `further`, adds to the previous
// maps.
import package::common::division::Division;
import package::common::math::{PI, spread2};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light};
import package::common::shadow_view::ShadowView;
import package::common::streams::RSM_STREAM;
import package::reflective_shadow_maps::transfer::transfer;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Largest distance of a sample in the map, as a share of the map's width.
    map_radius: f32,
    // Random-number stream: index of the map.
    index: u32,
    // Brightness of the `published` weighting.
    intensity: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(7) var<uniform> shadow_view: ShadowView;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var rsm_position: texture_2d<f32>;
@group(0) @binding(4) var light: texture_2d<u32>;
@if(further) @group(0) @binding(5) var partial_sum: texture_2d<f32>;
@group(0) @binding(6) var gathered: texture_storage_2d<rgba32float, write>;

override SAMPLES: u32;
// Each sample stands for a number of texels (true), or, as printed, is weighted by its squared distance, between
// points, without units (false).
override RADIOMETRIC: bool;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    var sum = vec3f(0.0);
    @if(further) { sum = textureLoad(partial_sum, id, 0).rgb; }
    let in_view = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov);
    let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
    let clip = shadow_view.world_to_clip * vec4f(position, 1.0);
    // The map shows nothing behind a spot light or a cube face.
    if surfel_depth(own) > SKY_DEPTH && clip.w > 0.0 {
        let normal = normalize((view.view_to_world * vec4f(surfel_normal(own), 0.0)).xyz);
        let size = vec2f(textureDimensions(rsm_position));
        let centre = (clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * size;
        let random = spread2(id, view.frame, RSM_STREAM + params.index, view.seed, false);
        let reach = params.map_radius * size.x;
        for (var i = 0u; i < SAMPLES; i++) {
            let share = (f32(i) + random.x) / f32(SAMPLES);
            let angle = 2.0 * PI * fract(random.y + f32(i) * 0.6180339887498949);
            let texel = centre + reach * share * vec2f(cos(angle), sin(angle));
            let inside = all(texel >= vec2f(0.0)) && all(texel < size);
            let at = select(vec2i(0), vec2i(floor(texel)), inside);
            let surface = unpack_light(textureLoad(rsm_position, at, 0).xyz, textureLoad(light, at, 0));
            var factor = 0.0;
            if RADIOMETRIC {
                // The density of samples decreases with their distance: one stands for 2 pi reach^2 share / SAMPLES
                // texels.
                factor = transfer(position, normal, surface) * (2.0 * PI * reach * reach * share / f32(SAMPLES));
            } else {
                let toward = surface.position - position;
                let square = max(dot(toward, toward), surface.area);
                let cosines = max(dot(normal, toward), 0.0) * max(-dot(surface.normal, toward), 0.0) / square;
                factor = params.intensity * share * share * cosines / (square * f32(SAMPLES));
            }
            sum += select(vec3f(0.0), surface.radiance * factor, inside && surface.area > 0.0);
        }
    }
    textureStore(gathered, id, vec4f(sum, 1.0));
}
