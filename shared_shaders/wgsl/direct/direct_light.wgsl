// variants: lit, emitters
// Radiance that leaves each visible surface after direct light, diffuse part, plus emission.
import package::common::division::Division;
import package::common::math::{LARGEST_RADIANCE, PI};
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
@if(lit) import package::common::scene::{Light, light_incidence};
@if(emitters) import package::common::scene::Material;

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var normal: texture_2d<f32>;
@group(0) @binding(3) var albedo: texture_2d<f32>;
@group(0) @binding(4) var direct: texture_storage_2d<rgba32float, write>;
@if(lit) @group(0) @binding(5) var<storage, read> lights: array<Light>;
@if(lit) @group(0) @binding(6) var<storage, read> shadow_layers: array<ShadowLayer>;
@if(lit) @group(0) @binding(7) var shadow_maps: texture_depth_2d_array;
@if(emitters) @group(0) @binding(8) var material: texture_2d<u32>;
@if(emitters) @group(0) @binding(9) var<storage, read> materials: array<Material>;

// One layer of the shadow maps. A point light or a wide spot light has six layers. A directional light has one, and
// coarser ones around it if the scene is much larger than what is looked at. Twin of `ShadowEntry` in
// renderer/src/scene/shadow_views.rs.
@if(lit)
struct ShadowLayer {
    world_to_clip: mat4x4f,
    // Width of a shadow texel: scene units (directional), otherwise per unit of distance.
    texel_width: f32,
    // Index of the next coarser layer of the light.
    coarser: u32,
    // Layer of the texture in the lower 16 bits, width of the map in the upper 16 bits, texels.
    map: u32,
    // Upper left corner of the map in that layer, texels: x in the lower 16 bits, y in the upper 16 bits.
    corner: u32,
}

@if(lit)
const NO_LAYER: u32 = 0xffffffffu;

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

/// Offset of the receiver along its geometric normal, in shadow texels. It covers the rise of curved surfaces above the
/// tangent plane within the filter's footprint. Of 0.25 to 2, it gives the least error against path-traced light.
@if(lit)
const OFFSET: f32 = 0.7;

/// A position in a layer: in texels from the corner of the map, and its depth.
@if(lit)
struct MapPosition {
    at: vec2f,
    depth: f32,
    // Of the texture.
    layer: u32,
    corner: vec2u,
    // Change of depth on the receiver's plane per texel.
    slope: vec2f,
}

/// Position in the texels of a map, whose first row is at the top.
@if(lit)
fn to_texels(ndc: vec2f, size: f32) -> vec2f {
    return (ndc * vec2f(0.5, -0.5) + 0.5) * size - 0.5;
}

/// The receiver's plane in one layer. `texel` is the width of a texel at the receiver.
@if(lit)
fn in_layer(layer: u32, position: vec3f, plane: vec3f, texel: f32, size: f32) -> MapPosition {
    let world_to_clip = shadow_layers[layer].world_to_clip;
    let packed_corner = shadow_layers[layer].corner;
    let corner = vec2u(packed_corner & 0xffffu, packed_corner >> 16u);
    let clip = world_to_clip * vec4f(position + plane * (OFFSET * texel), 1.0);
    let ndc = clip.xyz / clip.w;
    // Derivatives along two directions of the plane. A projection takes planes to planes, so depth is linear in them.
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(plane.x) > 0.7);
    let tangent = normalize(cross(plane, other));
    let along_a = world_to_clip * vec4f(tangent, 0.0);
    let along_b = world_to_clip * vec4f(cross(plane, tangent), 0.0);
    let a = (along_a.xyz - ndc * along_a.w) / clip.w;
    let b = (along_b.xyz - ndc * along_b.w) / clip.w;
    let area = a.x * b.y - a.y * b.x;
    let slope = vec2f(a.z * b.y - b.z * a.y, b.z * a.x - a.z * b.x) / area;
    let map_layer = shadow_layers[layer].map & 0xffffu;
    return MapPosition(to_texels(ndc.xy, size), ndc.z, map_layer, corner, slope * vec2f(2.0, -2.0) / size);
}

/// Three texels of a row: 1 where the receiver's plane is at least as close to the light.
@if(lit)
fn lit_row(place: MapPosition, columns: vec3f, row: f32) -> vec3f {
    let own = place.depth + place.slope.x * (columns - place.at.x) + place.slope.y * (row - place.at.y);
    let occluders = vec3f(
        textureLoad(shadow_maps, vec2u(vec2f(columns.x, row)) + place.corner, place.layer, 0),
        textureLoad(shadow_maps, vec2u(vec2f(columns.y, row)) + place.corner, place.layer, 0),
        textureLoad(shadow_maps, vec2u(vec2f(columns.z, row)) + place.corner, place.layer, 0),
    );
    return select(vec3f(0.0), vec3f(1.0), own >= occluders);
}

/// Visibility of the light, 0..1: comparisons of 3x3 texels, weighted by a quadratic B-spline. Each texel is compared
/// with the depth of the receiver's plane at that texel, so that a slope does not shadow itself. `plane` is the
/// geometric normal.
@if(lit)
fn shadow(light: Light, position: vec3f, plane: vec3f, toward_light: vec3f, distance: f32) -> f32 {
    if dot(plane, toward_light) <= 0.0 {
        // The surface faces away from the light.
        return 0.0;
    }
    let size = f32(shadow_layers[light.shadow_layer].map >> 16u);
    var layer = light.shadow_layer;
    let scale = select(1.0, distance, distance > 0.0);
    if light.shadow_faces == 6u {
        // The face of the offset position, because the offset may cross a seam.
        layer += cube_face(position + plane * (OFFSET * shadow_layers[layer].texel_width * scale) - light.vector);
    }
    var place = in_layer(layer, position, plane, shadow_layers[layer].texel_width * scale, size);
    if distance <= 0.0 {
        // The finest layer that contains the filter's footprint.
        while any(place.at < vec2f(1.0)) || any(place.at > vec2f(size - 2.0)) {
            layer = shadow_layers[layer].coarser;
            if layer == NO_LAYER {
                return 1.0;
            }
            place = in_layer(layer, position, plane, shadow_layers[layer].texel_width, size);
        }
    }
    let middle = floor(place.at + 0.5);
    let f = place.at - middle;
    let across = vec3f(0.5 * (0.5 - f.x) * (0.5 - f.x), 0.75 - f.x * f.x, 0.5 * (0.5 + f.x) * (0.5 + f.x));
    let down = vec3f(0.5 * (0.5 - f.y) * (0.5 - f.y), 0.75 - f.y * f.y, 0.5 * (0.5 + f.y) * (0.5 + f.y));
    // Texels beyond the edge of a cube face stand for those of its neighbour.
    let last = vec3f(size - 1.0);
    let columns = clamp(middle.x + vec3f(-1.0, 0.0, 1.0), vec3f(0.0), last);
    let rows = clamp(middle.y + vec3f(-1.0, 0.0, 1.0), vec3f(0.0), last);
    return down.x * dot(across, lit_row(place, columns, rows.x))
        + down.y * dot(across, lit_row(place, columns, rows.y))
        + down.z * dot(across, lit_row(place, columns, rows.z));
}

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
    textureStore(direct, id, vec4f(min(radiance, vec3f(LARGEST_RADIANCE)), 1.0));
}
