// The surface of one texel of a reflective shadow map (Dachsbacher & Stamminger 2005): a small disc that reflects the
// light it receives from one light.
import package::common::math::{octahedral_encode, octahedral_decode};
import package::common::surfel::{pack_radiance, unpack_radiance};

struct LightSurface {
    // World space in a map; the camera's view space in the list of virtual point lights.
    position: vec3f,
    // Area of the surface that the texel covers, scene units squared; 0 if the light reaches nothing.
    area: f32,
    normal: vec3f,
    // Number of surfaces that it stands for; 1 before virtual point lights are chosen.
    factor: f32,
    // Radiance that it sends, equal in all directions.
    radiance: vec3f,
}

/// Area, normal and radiance in 128 bits. Normal and radiance are packed like those of a surfel. Zeros are no surface.
fn pack_light(area: f32, normal: vec3f, radiance: vec3f) -> vec4u {
    return vec4u(bitcast<u32>(area), pack2x16snorm(octahedral_encode(normal)), pack_radiance(radiance));
}

fn unpack_light(position: vec3f, words: vec4u) -> LightSurface {
    let normal = octahedral_decode(unpack2x16snorm(words.y));
    return LightSurface(position, bitcast<f32>(words.x), normal, 1.0, unpack_radiance(words.z, words.w));
}
