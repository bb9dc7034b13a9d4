// A pixel of the screen, in 32 bits.

/// The mirror direction hits no visible surface.
const NOTHING: u32 = 0xffffffffu;

fn pack_pixel(pixel: vec2u) -> u32 {
    return pixel.x | (pixel.y << 16u);
}

fn unpack_pixel(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}
