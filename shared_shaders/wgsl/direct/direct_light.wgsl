// variants: lit, emitters
// Radiance that leaves each visible surface after direct light, diffuse part, plus emission.
import package::common::math::{LARGEST_RADIANCE, PI};
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
@if(lit) import package::common::scene::{Light, light_incidence};
@if(emitters) import package::common::scene::Material;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var normal: texture_2d<f32>;
@group(0) @binding(3) var albedo: texture_2d<f32>;
@group(0) @binding(4) var direct: texture_storage_2d<rgba32float, write>;
@if(lit) @group(0) @binding(5) var<storage, read> lights: array<Light>;
@if(lit) @group(0) @binding(6) var<storage, read> shadow_layers: array<ShadowLayer>;
@if(lit) @group(0) @binding(7) var shadow_maps: texture_depth_2d_array;
@if(lit) @group(0) @binding(8) var shadow_sampler: sampler_comparison;
@if(emitters) @group(0) @binding(9) var material: texture_2d<u32>;
@if(emitters) @group(0) @binding(10) var<storage, read> materials: array<Material>;

// One layer of the shadow maps. A directional or spot light has one layer, a point light six.
@if(lit)
struct ShadowLayer {
    world_to_clip: mat4x4f,
    // Width of a shadow texel: scene units (directional), otherwise per unit of distance.
    texel_width: f32,
    unused_0: f32,
    unused_1: f32,
    unused_2: f32,
}

@if(lit)
override LIGHTS: u32;

/// Cube face that a direction points to: +x, -x, +y, -y, +z, -z.
@if(lit)
fn cube_face(direction: vec3f) -> u32 {
    let a = abs(direction);
    if a.x >= a.y && a.x >= a.z {
        return select(0u, 1u, direction.x < 0.0);
    }
    if a.y >= a.z {
        return select(2u, 3u, direction.y < 0.0);
    }
    return select(4u, 5u, direction.z < 0.0);
}

/// Visibility of the light, 0..1: 3x3 bilinear comparisons with binomial weights.
@if(lit)
fn shadow(light: Light, position: vec3f, surface_normal: vec3f, distance: f32) -> f32 {
    var layer = light.shadow_layer;
    if light.shadow_faces == 6u {
        layer += cube_face(position - light.vector);
    }
    let entry = shadow_layers[layer];
    // An offset of two texels along the normal clears the filter's footprint on any slope. It avoids acne without a
    // depth bias, which would detach shadows from thin walls at grazing angles.
    let texel = entry.texel_width * select(1.0, distance, distance > 0.0);
    let clip = entry.world_to_clip * vec4f(position + surface_normal * (2.0 * texel), 1.0);
    let ndc = clip.xyz / clip.w;
    let uv = ndc.xy * vec2f(0.5, -0.5) + 0.5;
    if any(uv < vec2f(0.0)) || any(uv > vec2f(1.0)) {
        return 1.0;
    }
    let step = 1.0 / vec2f(textureDimensions(shadow_maps));
    var sum = 0.0;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let weight = f32((2 - abs(x)) * (2 - abs(y)));
            let at = uv + vec2f(f32(x), f32(y)) * step;
            sum += weight * textureSampleCompareLevel(shadow_maps, shadow_sampler, at, layer, ndc.z);
        }
    }
    return sum / 16.0;
}

@compute @workgroup_size(8, 8)
fn direct_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    let d = textureLoad(depth, id.xy, 0).x;
    var radiance = vec3f(0.0);
    if d > SKY_DEPTH {
        let in_view = view_position(uv_of_texel(id.xy, 1.0, view.display_size), d, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let n = normalize((view.view_to_world * vec4f(textureLoad(normal, id.xy, 0).xyz, 0.0)).xyz);
        @if(lit) {
            for (var i = 0u; i < LIGHTS; i++) {
                let light = lights[i];
                let incidence = light_incidence(light, position);
                let cosine = dot(n, incidence.direction);
                if cosine > 0.0 && any(incidence.irradiance > vec3f(0.0)) {
                    radiance += min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * (cosine * shadow(light, position, n, incidence.distance));
                }
            }
            radiance *= textureLoad(albedo, id.xy, 0).rgb / PI;
        }
        @if(emitters) {
            radiance += materials[textureLoad(material, id.xy, 0).x].emission;
        }
    }
    textureStore(direct, id.xy, vec4f(min(radiance, vec3f(LARGEST_RADIANCE)), 1.0));
}
