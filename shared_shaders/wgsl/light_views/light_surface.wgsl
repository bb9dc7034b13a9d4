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
    // Radiance that it sends on, the same in every direction.
    radiance: vec3f,
}

/// Normal and radiance in 96 bits, as a surfel has them; the first word is a float, the factor of the radiance.
fn pack_light(normal: vec3f, radiance: vec3f) -> vec4u {
    return vec4u(bitcast<u32>(1.0), pack2x16snorm(octahedral_encode(normal)), pack_radiance(radiance));
}

fn with_factor(words: vec4u, factor: f32) -> vec4u {
    return vec4u(bitcast<u32>(factor), words.yzw);
}

fn factor_of(words: vec4u) -> f32 {
    return bitcast<f32>(words.x);
}

fn unpack_light(place: vec4f, words: vec4u) -> LightSurface {
    let normal = octahedral_decode(unpack2x16snorm(words.y));
    return LightSurface(place.xyz, place.w, normal, unpack_radiance(words.z, words.w));
}
