// Small functions that many passes use.

const PI: f32 = 3.14159265358979;

/// The largest float16 number. Values stored as float16 are clamped to it, so that none becomes infinite.
const LARGEST_FLOAT16: f32 = 65504.0;
/// Upper bound of stored radiance: the sum over a whole screen stays within float32.
const LARGEST_RADIANCE: f32 = 1e30;

/// 1.5 * 2^23. Floats of this size are whole numbers, so adding it rounds a smaller number to the nearest whole number.
const WHOLE: f32 = 12582912.0;
const WHOLE_BITS: i32 = 0x4b400000;

/// Cosine and sine of the golden angle. Directions that rotate by it fill the circle evenly, whatever their number (Vogel
/// 1979).
const GOLDEN_ROTATION: vec2f = vec2f(-0.7373688780783197, 0.6754902942615238);

/// The whole number nearest to `x`, |x| < 2^22. It takes two instructions; a saturating conversion takes up to four.
fn nearest_whole(x: f32) -> i32 {
    return bitcast<i32>(x + WHOLE) - WHOLE_BITS;
}

/// The whole number nearest to each component, as `nearest_whole`.
fn nearest_whole2(x: vec2f) -> vec2i {
    return bitcast<vec2i>(x + WHOLE) - WHOLE_BITS;
}

/// The smaller of two numbers, by one comparison. `min` would also have to handle NaN.
fn least(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

/// The larger of two numbers, by one comparison.
fn most(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

/// The largest channel.
fn largest(light: vec3f) -> f32 {
    return max(light.x, max(light.y, light.z));
}

/// Octahedral map of a unit vector to the square -1..1 (Cigolle et al. 2014).
fn octahedral_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(p, folded, n.z < 0.0);
}

/// The direction that `octahedral_encode` was given, for an `e` multiplied by `one`. Its length is between 0.57 and 1
/// times `one`. This suffices where only ratios matter, and saves a square root.
fn octahedral_direction(e: vec2f, one: f32) -> vec3f {
    let z = one - abs(e.x) - abs(e.y);
    let fold = vec2f(max(-z, 0.0));
    return vec3f(e + select(fold, -fold, e >= vec2f(0.0)), z);
}

/// Inverse of `octahedral_encode`; unit length.
fn octahedral_decode(e: vec2f) -> vec3f {
    return normalize(octahedral_direction(e, 1.0));
}

/// PCG in three dimensions (Jarzynski & Olano 2020): hashes three words to three words.
fn pcg3d(value: vec3u) -> vec3u {
    var v = value * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

/// The only source of random numbers: three random words from a hash of pixel, frame, stream (see common/streams.wgsl)
/// and seed.
fn random_words(pixel: vec2u, frame: u32, stream: u32, seed: u32) -> vec3u {
    return pcg3d(vec3u(pixel.x | (pixel.y << 16u), frame, stream ^ (seed * 0x9E3779B9u)));
}

/// Random words as numbers, uniform in [0, 1). 24 bits fill the mantissa of a float32 exactly, so 1.0 is never reached.
fn unit_numbers(words: vec3u) -> vec3f {
    return vec3f(words >> vec3u(8u)) * 5.9604644775390625e-8;
}

/// Three random numbers, uniform in [0, 1): see `random_words`.
fn random3(pixel: vec2u, frame: u32, stream: u32, seed: u32) -> vec3f {
    return unit_numbers(random_words(pixel, frame, stream, seed));
}

/// Two random numbers for each pixel that are also stratified over neighbouring pixels: the R2 lattice (Roberts 2018)
/// from a random start. The numbers of one pixel are uniform over frames. The numbers of a 3x3 neighbourhood cancel in
/// a filter, where independent numbers would leave low-frequency noise. With `over_frames` they are stratified over
/// successive frames as well, for a temporal filter. Without it, frames are independent.
fn spread2(pixel: vec2u, frame: u32, stream: u32, seed: u32, over_frames: bool) -> vec2f {
    var start = random3(vec2u(0u), select(frame, 0u, over_frames), stream, seed);
    if over_frames {
        // The R2 lattice again, over frames, in 32 bits that wrap like `fract`. The two numbers are swapped relative to
        // those over pixels, so that no frame repeats the numbers that a neighbour had in the previous frame.
        start += unit_numbers(vec3u(frame * vec2u(2447445414u, 3242174889u), 0u));
    }
    // 1 / g and 1 / g^2 of the plastic number g. The second row is the first one rotated, so that the two numbers of a
    // pixel are not correlated.
    let lattice = mat2x2f(0.7548776662466927, 0.5698402909980532, 0.5698402909980532, 0.2451223337533073);
    return fract(start.xy + lattice * vec2f(pixel));
}
