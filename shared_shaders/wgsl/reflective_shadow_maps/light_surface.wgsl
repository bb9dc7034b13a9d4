// What one texel of a reflective shadow map shows (Dachsbacher & Stamminger 2005): a small disc that sends on what one
// light sends to it.
import package::common::math::{octahedral_encode, octahedral_decode};
import package::common::surfel::{pack_radiance, unpack_radiance};

struct LightSurface {
    // World space in a map, view space of the camera once it was collected.
    position: vec3f,
    // Area of the surface that the texel covers, scene units squared; 0 where the light reaches nothing.
    area: f32,
    normal: vec3f,
    // Surfaces that it stands for; more or less than 1 once it was chosen for others.
    factor: f32,
    // Radiance that it sends on, the same in every direction.
    radiance: vec3f,
}

/// Area, normal and radiance in 128 bits, normal and radiance as a surfel has them. Zeros read as no surface.
fn pack_light(area: f32, normal: vec3f, radiance: vec3f) -> vec4u {
    return vec4u(bitcast<u32>(area), pack2x16snorm(octahedral_encode(normal)), pack_radiance(radiance));
}

fn unpack_light(position: vec3f, words: vec4u) -> LightSurface {
    let normal = octahedral_decode(unpack2x16snorm(words.y));
    return LightSurface(position, bitcast<f32>(words.x), normal, 1.0, unpack_radiance(words.z, words.w));
}
