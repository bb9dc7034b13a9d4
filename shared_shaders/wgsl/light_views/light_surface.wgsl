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

/// Normal and radiance in 96 bits, as a surfel has them.
fn pack_light(normal: vec3f, radiance: vec3f) -> vec4u {
    return vec4u(pack2x16snorm(octahedral_encode(normal)), pack_radiance(radiance), 0u);
}

fn unpack_light(place: vec4f, words: vec4u) -> LightSurface {
    let normal = octahedral_decode(unpack2x16snorm(words.x));
    return LightSurface(place.xyz, place.w, normal, unpack_radiance(words.y, words.z));
}
