// Counts of the NaN/Inf check for one texture or buffer. The bits decide, because a compiler may assume that no number
// is NaN.

struct Tally {
    nan: atomic<u32>,
    infinite: atomic<u32>,
    negative: atomic<u32>,
    // Values at the largest number of the format: radiance that was clamped on store.
    clamped: atomic<u32>,
    // Bits of the largest magnitude. As whole numbers they order like the floats.
    largest: atomic<u32>,
}

const SIGN: u32 = 0x80000000u;
const INFINITY: u32 = 0x7f800000u;

/// 1 for each class that the number belongs to: NaN, infinite, negative, clamped.
fn kinds(bits: u32, limit: f32) -> vec4u {
    let magnitude = bits & ~SIGN;
    let below_zero = (bits & SIGN) != 0u && magnitude > 0u && magnitude <= INFINITY;
    let clamped = (bits & SIGN) == 0u && magnitude >= bitcast<u32>(limit) && magnitude < INFINITY;
    return select(
        vec4u(0u),
        vec4u(1u),
        vec4<bool>(magnitude > INFINITY, magnitude == INFINITY, below_zero, clamped),
    );
}

/// Bits of a number's magnitude; 0 if it is not finite.
fn finite_magnitude(bits: u32) -> u32 {
    let magnitude = bits & ~SIGN;
    return select(0u, magnitude, magnitude < INFINITY);
}
