// Visibility of lights by their shadow maps.
import package::common::scene::Light;

@group(0) @binding(20) var<storage, read> layers: array<ShadowLayer>;
@group(0) @binding(21) var maps: texture_depth_2d_array;

// One layer of the shadow maps. A point light or a wide spot light has six layers. A directional light has one, and
// coarser ones around it if the scene is much larger than what is looked at. Twin of `ShadowEntry` in
// renderer/src/scene/shadow_views.rs.
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

const NO_LAYER: u32 = 0xffffffffu;

/// Cube face that a direction points to: +x, -x, +y, -y, +z, -z.
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
const OFFSET: f32 = 0.7;

/// A position in a layer: in texels from the corner of the map, and its depth.
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
fn to_texels(ndc: vec2f, size: f32) -> vec2f {
    return (ndc * vec2f(0.5, -0.5) + 0.5) * size - 0.5;
}

/// The receiver's plane in one layer. `texel` is the width of a texel at the receiver.
fn in_layer(layer: u32, position: vec3f, plane: vec3f, texel: f32, size: f32) -> MapPosition {
    let world_to_clip = layers[layer].world_to_clip;
    let packed_corner = layers[layer].corner;
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
    let map_layer = layers[layer].map & 0xffffu;
    return MapPosition(to_texels(ndc.xy, size), ndc.z, map_layer, corner, slope * vec2f(2.0, -2.0) / size);
}

/// Three texels of a row: 1 where the receiver's plane is at least as close to the light.
fn lit_row(place: MapPosition, columns: vec3f, row: f32) -> vec3f {
    let own = place.depth + place.slope.x * (columns - place.at.x) + place.slope.y * (row - place.at.y);
    let occluders = vec3f(
        textureLoad(maps, vec2u(vec2f(columns.x, row)) + place.corner, place.layer, 0),
        textureLoad(maps, vec2u(vec2f(columns.y, row)) + place.corner, place.layer, 0),
        textureLoad(maps, vec2u(vec2f(columns.z, row)) + place.corner, place.layer, 0),
    );
    return select(vec3f(0.0), vec3f(1.0), own >= occluders);
}

/// Visibility of the light, 0..1: comparisons of 3x3 texels, weighted by a quadratic B-spline. Each texel is compared
/// with the depth of the receiver's plane at that texel, so that a slope does not shadow itself. `plane` is the
/// geometric normal.
fn shadow(light: Light, position: vec3f, plane: vec3f, toward_light: vec3f, distance: f32) -> f32 {
    if dot(plane, toward_light) <= 0.0 {
        // The surface faces away from the light.
        return 0.0;
    }
    let size = f32(layers[light.shadow_layer].map >> 16u);
    var layer = light.shadow_layer;
    let scale = select(1.0, distance, distance > 0.0);
    if light.shadow_faces == 6u {
        // The face of the offset position, because the offset may cross a seam.
        layer += cube_face(position + plane * (OFFSET * layers[layer].texel_width * scale) - light.vector);
    }
    var place = in_layer(layer, position, plane, layers[layer].texel_width * scale, size);
    if distance <= 0.0 {
        // The finest layer that contains the filter's footprint.
        while any(place.at < vec2f(1.0)) || any(place.at > vec2f(size - 2.0)) {
            layer = layers[layer].coarser;
            if layer == NO_LAYER {
                return 1.0;
            }
            place = in_layer(layer, position, plane, layers[layer].texel_width, size);
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
