// variants: lit, emitters, float16
// Radiance that leaves each visible surface after direct light, diffuse part, plus emission.
import package::common::division::Division;
import package::common::math::{LARGEST_RADIANCE, PI};
@if(float16) import package::common::math::LARGEST_FLOAT16;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
@if(lit) import package::common::scene::{Light, light_incidence};
@if(lit) import package::common::shadow_maps::shadow;
@if(emitters) import package::common::scene::Material;

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var normal: texture_2d<f32>;
@group(0) @binding(3) var albedo: texture_2d<f32>;
@if(!float16) @group(0) @binding(4) var direct: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(4) var direct: texture_storage_2d<rgba16float, write>;
@if(lit) @group(0) @binding(5) var<storage, read> lights: array<Light>;
@if(emitters) @group(0) @binding(8) var material: texture_2d<u32>;
@if(emitters) @group(0) @binding(9) var<storage, read> materials: array<Material>;

@if(lit)
override LIGHTS: u32;

/// A neighbouring pixel.
@if(lit)
struct Neighbour {
    // Position relative to the pixel.
    step: vec3f,
    // Difference between the inverse depth and that of the plane through this neighbour and the next one in its
    // direction, relative; large without surfaces. The inverse depth is linear on a plane.
    bend: f32,
}

/// Largest `bend` of a surface. Curved surfaces in pixels of an image have much less.
@if(lit)
const MOST_BEND: f32 = 0.005;
/// Smallest cosine between the geometric and the shading normal of one surface.
@if(lit)
const LEAST_COSINE: f32 = 0.7;

/// Inverse depth of a pixel; 0 without a surface.
@if(lit)
fn inverse_depth(at: vec2i) -> f32 {
    let inside = all(at >= vec2i(0)) && all(at < vec2i(textureDimensions(depth)));
    let d = textureLoad(depth, select(vec2i(0), at, inside), 0).x;
    return select(0.0, 1.0 / d, inside && d > SKY_DEPTH);
}

@if(lit)
fn neighbour(id: vec2u, offset: vec2i, position: vec3f) -> Neighbour {
    let at = vec2i(id) + offset;
    let inverse = inverse_depth(at);
    let next = inverse_depth(at + offset);
    if inverse <= 0.0 || next <= 0.0 {
        return Neighbour(vec3f(0.0), 1.0);
    }
    let uv = uv_of_texel(vec2u(at), 1.0, view.display_size);
    let other = view_position(uv, 1.0 / inverse, view.tan_half_fov);
    return Neighbour(other - position, abs((next - 2.0 * inverse) * position.z - 1.0));
}

/// Step to the next pixel on the same surface in one direction of the screen: the flatter of the two; 0 if both are on
/// other surfaces.
@if(lit)
fn flatter(id: vec2u, offset: vec2i, position: vec3f) -> vec3f {
    let ahead = neighbour(id, offset, position);
    let behind = neighbour(id, -offset, position);
    let step = select(ahead.step, -behind.step, behind.bend < ahead.bend);
    return select(vec3f(0.0), step, min(ahead.bend, behind.bend) < MOST_BEND);
}

/// Normal of the visible triangle, from the depths of neighbouring pixels; view space, facing the eye. The shading
/// normal where these see other surfaces.
@if(lit)
fn geometric_normal(id: vec2u, position: vec3f, shading: vec3f) -> vec3f {
    let normal = cross(flatter(id, vec2i(1, 0), position), flatter(id, vec2i(0, -1), position));
    let square = dot(normal, normal);
    let unit = normal * inverseSqrt(max(square, 1e-36));
    return select(shading, unit, square > 1e-36 && dot(unit, shading) > LEAST_COSINE);
}

@compute @workgroup_size(8, 8)
fn direct_light(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(direct)) {
        return;
    }
    let d = textureLoad(depth, id, 0).x;
    var radiance = vec3f(0.0);
    if d > SKY_DEPTH {
        let in_view = view_position(uv_of_texel(id, 1.0, view.display_size), d, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let shading = textureLoad(normal, id, 0).xyz;
        let n = normalize((view.view_to_world * vec4f(shading, 0.0)).xyz);
        @if(lit) {
            let plane = normalize((view.view_to_world * vec4f(geometric_normal(id, in_view, shading), 0.0)).xyz);
            for (var i = 0u; i < LIGHTS; i++) {
                let light = lights[i];
                let incidence = light_incidence(light, position);
                let cosine = dot(n, incidence.direction);
                if cosine > 0.0 && any(incidence.irradiance > vec3f(0.0)) {
                    let lit = shadow(light, position, plane, incidence.direction, incidence.distance);
                    radiance += min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * (cosine * lit);
                }
            }
            radiance *= textureLoad(albedo, id, 0).rgb / PI;
        }
        @if(emitters) {
            radiance += materials[textureLoad(material, id, 0).x].emission;
        }
    }
    @if(!float16) { radiance = min(radiance, vec3f(LARGEST_RADIANCE)); }
    @if(float16) { radiance = min(radiance, vec3f(LARGEST_FLOAT16)); }
    textureStore(direct, id, vec4f(radiance, 1.0));
}
