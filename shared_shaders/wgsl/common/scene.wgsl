// Scene data as passes read it. The Rust twin is renderer/src/scene/buffers.rs.
import package::common::math::octahedral_decode;

struct Vertex {
    position: vec3f,
    material: u32,
    uv: vec2f,
    // Octahedral, two signed 16-bit numbers.
    normal: u32,
    // Index into `objects` of the object that animates it; 0 for static geometry. Position and normal are those at
    // rest.
    object: u32,
}

/// An animated object in this frame. The first one is the static world.
struct Object {
    // World at rest to world in this frame.
    to_world: mat4x4f,
    // View space of this frame to view space of the previous frame, for points of the object.
    view_to_previous: mat4x4f,
}

struct Material {
    albedo: vec3f,
    // Index of the first word of a texture header in `texels`, or NO_TEXTURE.
    albedo_texture: u32,
    emission: vec3f,
    alpha_texture: u32,
    specular: vec3f,
    phong_exponent: f32,
    // Share of the light on the far side that passes through.
    translucency: vec3f,
    unused_0: f32,
    // Absorption per scene unit of the path inside.
    absorption: vec3f,
    unused_1: f32,
}

struct Light {
    // Directional: unit direction of travel. Point and spot: world position.
    vector: vec3f,
    kind: u32,
    // Directional: irradiance at normal incidence. Point and spot: radiant intensity.
    intensity: vec3f,
    // First layer of the shadow map.
    shadow_layer: u32,
    // Spot: unit axis, direction of travel.
    axis: vec3f,
    // Spot: angle of the edge and angle of full intensity, radians.
    half_angle: f32,
    full_intensity_half_angle: f32,
    // Layers of the shadow map: 1, or 6 for the faces of a cube.
    shadow_faces: u32,
    unused_1: f32,
    unused_2: f32,
}

const LIGHT_DIRECTIONAL: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const LIGHT_SPOT: u32 = 2u;

const NO_TEXTURE: u32 = 0xffffffffu;

/// Direction of a surface normal under a transform. Uses the cofactors, which equal the inverse transpose up to a
/// factor and need no division.
fn transform_normal(matrix: mat4x4f, normal: vec3f) -> vec3f {
    let a = matrix[0].xyz;
    let b = matrix[1].xyz;
    let c = matrix[2].xyz;
    return cross(b, c) * normal.x + cross(c, a) * normal.y + cross(a, b) * normal.z;
}

fn vertex_normal(vertex: Vertex) -> vec3f {
    return octahedral_decode(unpack2x16snorm(vertex.normal));
}

/// A texel stores the square root of the linear value in 10 bits a channel, so that dark tones keep their precision,
/// and alpha in 2 bits.
fn decode_texel(word: u32) -> vec4f {
    let root = vec3f(vec3u(word, word >> 10u, word >> 20u) & vec3u(1023u)) / 1023.0;
    return vec4f(root * root, f32(word >> 30u) / 3.0);
}

/// Light that arrives at `position` from one light without occluders.
struct Incidence {
    // Unit direction towards the light.
    direction: vec3f,
    // Distance to the light; negative for a directional light.
    distance: f32,
    // Irradiance on a surface that faces the light.
    irradiance: vec3f,
}

fn light_incidence(light: Light, position: vec3f) -> Incidence {
    if light.kind == LIGHT_DIRECTIONAL {
        return Incidence(-light.vector, -1.0, light.intensity);
    }
    let offset = light.vector - position;
    let square = dot(offset, offset);
    // A point on the light itself gets nothing, because the limit is unbounded.
    if square <= 0.0 {
        return Incidence(vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0));
    }
    let distance = sqrt(square);
    let direction = offset / distance;
    var intensity = light.intensity;
    if light.kind == LIGHT_SPOT {
        let angle = acos(clamp(dot(-direction, light.axis), -1.0, 1.0));
        let width = light.half_angle - light.full_intensity_half_angle;
        // A cone without a soft edge is a step.
        let fade = select(f32(angle <= light.half_angle), (light.half_angle - angle) / width, width > 1e-6);
        intensity *= saturate(fade);
    }
    return Incidence(direction, distance, intensity / square);
}
