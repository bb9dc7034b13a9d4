// The visibility bitmask (Therrien et al. 2023): one bit for each sector of a slice, 1 where the sector is occluded.
@if(wide) alias Mask = vec4u;
@if(!wide) alias Mask = u32;

/// Bits from `n` upwards, n in 0..32.
@if(!wide)
fn bits_from(n: i32) -> u32 {
    // WGSL shifts by 32 like by 0.
    return select(0u, 0xffffffffu << u32(n), n < 32);
}

/// Bits below `n` of a word whose first sector is `base`.
@if(wide)
fn bits_under(n: i32, base: i32) -> u32 {
    let count = u32(clamp(n - base, 0, 32));
    // WGSL shifts by 32 like by 0.
    return select((1u << (count & 31u)) - 1u, 0xffffffffu, count == 32u);
}

/// Sectors `first` to `end`, `end` excluded; none if `end` is not greater than `first`.
@if(!wide)
fn sectors(first: i32, end: i32) -> Mask {
    return bits_from(first) & ~bits_from(end);
}

@if(wide)
fn sectors(first: i32, end: i32) -> Mask {
    return vec4u(
        bits_under(end, 0) & ~bits_under(first, 0),
        bits_under(end, 32) & ~bits_under(first, 32),
        bits_under(end, 64) & ~bits_under(first, 64),
        bits_under(end, 96) & ~bits_under(first, 96),
    );
}

@if(!wide)
fn count_sectors(mask: Mask) -> f32 {
    return f32(countOneBits(mask));
}

@if(wide)
fn count_sectors(mask: Mask) -> f32 {
    let bits = countOneBits(mask);
    return f32(bits.x + bits.y + bits.z + bits.w);
}
