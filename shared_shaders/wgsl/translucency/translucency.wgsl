// variants: further
// Light of one light that passes through translucent surfaces from their far side (Lambru et al., section 3.4). It
// travels straight from the entry point in the light's map, is absorbed over the distance inside (Beer-Lambert), and
// leaves like from a diffuse surface. Occluders in front of the body count as inside it. With `further`, adds to the
// previous maps.
import package::common::math::{LARGEST_RADIANCE, PI};
import package::common::scene::{Material, Light, light_incidence};
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
import package::common::shadow_view::ShadowView;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> shadow_view: ShadowView;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@group(0) @binding(4) var material: texture_2d<u32>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var<uniform> source: Light;
@group(0) @binding(7) var rsm_position: texture_2d<f32>;
@if(further) @group(0) @binding(8) var partial_sum: texture_2d<f32>;
@group(0) @binding(9) var transmitted: texture_storage_2d<rgba32float, write>;

// Cube faces are wider than a right angle by this factor (renderer/src/scene/shadow.rs). Each position belongs to one
// of them.
const FACE: f32 = 1.01;

@compute @workgroup_size(8, 8)
fn transmit(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(transmitted)) {
        return;
    }
    var sum = vec3f(0.0);
    @if(further) { sum = textureLoad(partial_sum, id.xy, 0).rgb; }
    let d = textureLoad(depth, id.xy, 0).x;
    let surface = materials[textureLoad(material, id.xy, 0).x];
    if d > SKY_DEPTH && any(surface.translucency > vec3f(0.0)) {
        let in_view = view_position(uv_of_texel(id.xy, 1.0, view.display_size), d, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let n = normalize((view.view_to_world * vec4f(textureLoad(normal, id.xy, 0).xyz, 0.0)).xyz);
        let incidence = light_incidence(source, position);
        let cosine = -dot(n, incidence.direction);
        let clip = shadow_view.world_to_clip * vec4f(position, 1.0);
        let ndc = clip.xy / max(clip.w, 1e-30);
        let edge = select(1.0, 1.0 / FACE, source.shadow_faces == 6u);
        if cosine > 0.0 && clip.w > 0.0 && all(abs(ndc) <= vec2f(edge)) {
            let size = vec2f(textureDimensions(rsm_position));
            let texel = vec2u(min((ndc * vec2f(0.5, -0.5) + 0.5) * size, size - 1.0));
            let entry = textureLoad(rsm_position, texel, 0);
            // If the map shows nothing, the surface is a sheet at its edge.
            let inside = select(0.0, max(dot(entry.xyz - position, incidence.direction), 0.0), entry.w > 0.0);
            let left = exp(-surface.absorption * inside);
            sum += surface.translucency * left * min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * (cosine / PI);
        }
    }
    textureStore(transmitted, id.xy, vec4f(min(sum, vec3f(LARGEST_RADIANCE)), 1.0));
}
