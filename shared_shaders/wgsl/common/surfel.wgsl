// A surfel: the surface of one texel of the pyramid in 128 bits, so that a gather needs one fetch per sample.
//
//   word 0  planar depth, float32, SKY_DEPTH without a surface
//   word 1  view-space normal, octahedral, 2 x 16 bits
//   word 2  radiance red 12 | green 12 | blue low 8
//   word 3  radiance blue high 4 | shared exponent 8 | pixel offset x 9 | pixel offset y 9
//
// At full resolution, where no pass reads radiance, textures have the first two words alone (Rg32Uint). Reading one
// fills the others with 0 and 1: a black surface without an offset.
//
// The pixel offset names the full-resolution pixel, inside the texel's square, whose surface is kept. The position is
// reconstructed through that pixel, not through the texel's centre. The coarse level of a slanted plane thus stays
// exactly on that plane, and the plane does not light itself.
import package::common::math::{LARGEST_RADIANCE, octahedral_encode, octahedral_decode, octahedral_direction};
import package::common::view::view_position;

struct Surfel {
    depth: f32,
    normal: vec3f,
    radiance: vec3f,
    // Full-resolution pixel, relative to the texel's first pixel.
    offset: vec2u,
}

// Radiance has 12-bit mantissas with a shared exponent: the whole range of float32 at a relative error of 2^-13 of the
// largest channel. Radiance below 2^-115 is black.
const EXPONENT_BIAS: u32 = 11u;

fn pack_radiance(radiance: vec3f) -> vec2u {
    let bounded = clamp(radiance, vec3f(0.0), vec3f(LARGEST_RADIANCE));
    let exponent = (bitcast<u32>(max(bounded.x, max(bounded.y, bounded.z))) >> 23u) & 255u;
    if exponent <= EXPONENT_BIAS {
        return vec2u(0u);
    }
    // 2^(138 - exponent) scales the largest channel to 2048..4096.
    let scale = bitcast<f32>((265u - exponent) << 23u);
    let mantissa = min(vec3u(bounded * scale + 0.5), vec3u(4095u));
    return vec2u(
        mantissa.x | (mantissa.y << 12u) | (mantissa.z << 24u),
        (mantissa.z >> 8u) | ((exponent - EXPONENT_BIAS) << 4u),
    );
}

fn unpack_radiance(word_2: u32, word_3: u32) -> vec3f {
    let scale = bitcast<f32>(((word_3 >> 4u) & 255u) << 23u);
    return vec3f(vec3u(word_2 & 4095u, (word_2 >> 12u) & 4095u, (word_2 >> 24u) | ((word_3 & 15u) << 8u))) * scale;
}

fn pack_surfel(surfel: Surfel) -> vec4u {
    let radiance = pack_radiance(surfel.radiance);
    return vec4u(
        bitcast<u32>(surfel.depth),
        pack2x16snorm(octahedral_encode(surfel.normal)),
        radiance.x,
        radiance.y | (surfel.offset.x << 12u) | (surfel.offset.y << 21u),
    );
}

fn surfel_depth(words: vec4u) -> f32 {
    return bitcast<f32>(words.x);
}

fn surfel_normal(words: vec4u) -> vec3f {
    return octahedral_decode(unpack2x16snorm(words.y));
}

/// The value that `pack2x16snorm` stores for 1.
const SNORM_16: f32 = 32767.0;

/// The normal with a length between 0.57 and 1 times SNORM_16. Whole numbers need no rescaling.
fn surfel_direction(words: vec4u) -> vec3f {
    return octahedral_direction(vec2f(vec2i(vec2u(words.y << 16u, words.y)) >> vec2u(16u)), SNORM_16);
}

fn surfel_radiance(words: vec4u) -> vec3f {
    return unpack_radiance(words.z, words.w);
}

/// The same surface with other radiance.
fn with_radiance(words: vec4u, radiance: vec3f) -> vec4u {
    let packed = pack_radiance(radiance);
    return vec4u(words.xy, packed.x, packed.y | (words.w & ~4095u));
}

fn surfel_offset(words: vec4u) -> vec2u {
    return (vec2u(words.w) >> vec2u(12u, 21u)) & vec2u(511u);
}

/// Centre of the kept pixel, in full-resolution pixels.
fn surfel_pixel(words: vec4u, texel: vec2u, scale: f32) -> vec2f {
    return vec2f(texel) * scale + vec2f(surfel_offset(words)) + 0.5;
}

/// View-space position of the kept surface.
fn surfel_position(words: vec4u, texel: vec2u, scale: f32, display_size: vec2f, tan_half_fov: vec2f) -> vec3f {
    return view_position(surfel_pixel(words, texel, scale) / display_size, surfel_depth(words), tan_half_fov);
}
