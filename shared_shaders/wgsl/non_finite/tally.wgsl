// What a scan counts of one texture or buffer. Bits decide: a compiler may take for granted that no number is NaN.

struct Tally {
    nan: atomic<u32>,
    infinite: atomic<u32>,
    negative: atomic<u32>,
    // At the largest number that its format is given: light that was clamped on its way in.
    clamped: atomic<u32>,
    // Bits of the largest magnitude; as whole numbers they sort like the numbers that they stand for.
    largest: atomic<u32>,
}

const SIGN: u32 = 0x80000000u;
const INFINITY: u32 = 0x7f800000u;

/// One for each thing that a number may be: NaN, infinite, negative, clamped.
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

/// Bits of a number's magnitude; 0 where it is no finite number.
fn finite_magnitude(bits: u32) -> u32 {
    let magnitude = bits & ~SIGN;
    return select(0u, magnitude, magnitude < INFINITY);
}
