// Points on surfaces, and rays that leave them.
import package::common::scene::{Material, NO_TEXTURE};
import package::common::scene_textures::{sample_pixel, sample_texture};
import package::truth::traversal::{Ray, Hit, triangles, texel_coordinates, cross_triangle, attributes_at};

@group(0) @binding(5) var<storage, read> materials: array<Material>;

/// Offset of a ray from its surface, relative to the larger of |position| and the scene's radius: 64 rounding steps of
/// float32.
const OFFSET: f32 = 7.62939453125e-6;
/// Bits of a triangle's material for receive-only surfaces and for animated ones. Twins of renderer/src/scene/bvh/tree.rs.
const RECEIVE_ONLY: u32 = 0x80000000u;
const MOVES: u32 = 0x40000000u;
/// Bits of the index of the material.
const MATERIAL: u32 = 0x3fffffffu;

/// A point on a surface. Its normals face the ray that found it.
struct Surface {
    position: vec3f,
    // Shading normal.
    normal: vec3f,
    geometric_normal: vec3f,
    albedo: vec3f,
    emission: vec3f,
    material: u32,
    // Whether it sends light to other surfaces.
    sends: bool,
    // Whether it is animated.
    moves: bool,
}

/// The unit vector, or `fallback` for a vector without a direction.
fn unit_or(v: vec3f, fallback: vec3f) -> vec3f {
    let square = dot(v, v);
    return select(fallback, v * inverseSqrt(square), square > 1e-30 && square < 1e30);
}

/// A normal of the triangle with these edges, not of unit length. Edges are scaled by their length, because the cross
/// product of tiny ones would vanish.
fn scaled_normal(edge_1: vec3f, edge_2: vec3f) -> vec3f {
    let size = max(max(abs(edge_1.x), abs(edge_1.y)), max(abs(edge_1.z), 1e-30));
    return cross(edge_1 / size, edge_2 / size);
}

fn surface_at(hit: Hit, ray: Ray) -> Surface {
    let corner = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u)).xyz);
    let edge_1 = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u + 1u)).xyz);
    let edge_2 = bitcast<vec3f>(textureLoad(triangles, texel_coordinates(hit.slot * 3u + 2u)).xyz);
    let weights = cross_triangle(hit.slot, ray).weights;
    let on_it = attributes_at(hit.slot, weights);
    var geometric = unit_or(scaled_normal(edge_1, edge_2), -normalize(ray.direction));
    geometric = select(geometric, -geometric, dot(geometric, ray.direction) > 0.0);
    var normal = unit_or(on_it.normal, geometric);
    normal = select(normal, -normal, dot(normal, ray.direction) > 0.0);
    let index = on_it.material & MATERIAL;
    let material = materials[index];
    var albedo = material.albedo;
    if material.albedo_texture != NO_TEXTURE {
        albedo *= sample_texture(material.albedo_texture, on_it.uv).rgb;
    }
    return Surface(
        corner + edge_1 * weights.x + edge_2 * weights.y,
        normal,
        geometric,
        saturate(albedo),
        material.emission,
        index,
        (on_it.material & RECEIVE_ONLY) == 0u,
        (on_it.material & MOVES) != 0u,
    );
}

/// Albedo of the surface that a pixel shows: the mean of its texture over the pixel. `right` and `below` are directions
/// through the next pixels, from the same eye.
fn albedo_of_pixel(hit: Hit, ray: Ray, right: vec3f, below: vec3f) -> vec3f {
    let at = attributes_at(hit.slot, cross_triangle(hit.slot, ray).weights);
    let material = materials[at.material & MATERIAL];
    if material.albedo_texture == NO_TEXTURE {
        return saturate(material.albedo);
    }
    let across = attributes_at(hit.slot, cross_triangle(hit.slot, Ray(ray.origin, right)).weights).uv - at.uv;
    let down = attributes_at(hit.slot, cross_triangle(hit.slot, Ray(ray.origin, below)).weights).uv - at.uv;
    return saturate(material.albedo * sample_pixel(material.albedo_texture, at.uv, across, down).rgb);
}

/// The offset of a ray from a surface of a scene with this radius, scene units.
fn offset_length(position: vec3f, scene_radius: f32) -> f32 {
    let a = abs(position);
    return OFFSET * max(max(max(a.x, a.y), max(a.z, scene_radius)), 1e-30);
}

/// A ray from a surface, offset to the side that it leads to.
fn ray_from(position: vec3f, geometric_normal: vec3f, direction: vec3f, scene_radius: f32) -> Ray {
    let offset = offset_length(position, scene_radius);
    return Ray(position + geometric_normal * select(-offset, offset, dot(geometric_normal, direction) >= 0.0), direction);
}
