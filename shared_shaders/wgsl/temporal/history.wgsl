// History of one pixel in 128 bits, so that a tap is one fetch.
//
//   word 0  planar depth, float32, SKY_DEPTH without a surface
//   word 1  view-space normal, octahedral, 2 x 10 bits | object 4 | shared exponent 8
//   word 2  light red 18 | green low 14
//   word 3  green high 4 | light blue 18 | number of averaged frames 10
//
// Light has 18 bits a channel with a shared exponent. A running average of 1000 frames still changes by a thousandth of
// a frame's noise, where float16 would not change at all. Normal and object only distinguish surfaces: 10 bits are a
// sixth of a degree, and one in sixteen pairs of objects is not distinguished.
import package::common::math::{octahedral_encode, octahedral_direction};

/// Upper bound of the number of averaged frames.
const MOST_FRAMES: u32 = 1023u;

struct History {
    depth: f32,
    normal: vec3f,
    object: u32,
    light: vec3f,
    frames: u32,
}

// Exponents, biased by 127, for which both the factor and its inverse are normal numbers: light from 2e-33 to 4e31,
// above LARGEST_RADIANCE.
const LEAST_EXPONENT: u32 = 18u;
const MOST_EXPONENT: u32 = 232u;
const LARGEST_MANTISSA: u32 = 262143u;

/// An octahedral coordinate in 10 bits.
fn pack_coordinate(v: f32) -> u32 {
    return u32(clamp(round(v * 511.0), -511.0, 511.0) + 511.0);
}

fn unpack_coordinate(word: u32) -> f32 {
    return (f32(word & 1023u) - 511.0) / 511.0;
}

fn pack_history(history: History) -> vec4u {
    let e = octahedral_encode(history.normal);
    let largest = max(history.light.r, max(history.light.g, history.light.b));
    let exponent = clamp(bitcast<u32>(max(largest, 0.0)) >> 23u, LEAST_EXPONENT, MOST_EXPONENT);
    // 2^(17 - (exponent - 127)) scales the largest channel to 18 bits.
    let scale = bitcast<f32>((271u - exponent) << 23u);
    let m = min(vec3u(max(history.light, vec3f(0.0)) * scale + 0.5), vec3u(LARGEST_MANTISSA));
    return vec4u(
        bitcast<u32>(history.depth),
        pack_coordinate(e.x) | (pack_coordinate(e.y) << 10u) | ((history.object & 15u) << 20u) | (exponent << 24u),
        m.x | (m.y << 18u),
        (m.y >> 14u) | (m.z << 4u) | (min(history.frames, MOST_FRAMES) << 22u),
    );
}

fn history_depth(words: vec4u) -> f32 {
    return bitcast<f32>(words.x);
}

/// The normal with a length between 0.57 and 1.
fn history_direction(words: vec4u) -> vec3f {
    return octahedral_direction(vec2f(unpack_coordinate(words.y), unpack_coordinate(words.y >> 10u)), 1.0);
}

fn history_object(words: vec4u) -> u32 {
    return (words.y >> 20u) & 15u;
}

fn history_light(words: vec4u) -> vec3f {
    // The word of a pixel without a surface is 0, which is below the smallest exponent.
    let scale = bitcast<f32>((max(words.y >> 24u, LEAST_EXPONENT) - 17u) << 23u);
    let mantissas = vec3u(
        words.z & LARGEST_MANTISSA,
        (words.z >> 18u) | ((words.w & 15u) << 14u),
        (words.w >> 4u) & LARGEST_MANTISSA,
    );
    return vec3f(mantissas) * scale;
}

fn history_frames(words: vec4u) -> u32 {
    return words.w >> 22u;
}
