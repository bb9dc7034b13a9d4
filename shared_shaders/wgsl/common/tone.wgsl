// Linear radiance to display values, and helpers of the shaders that show a texture. Twin of `metrics/src/tone.rs`,
// which explains the curve; a test compares the two.
import package::non_finite::tally::kinds;

/// Display-linear value up to which the image is proportional to radiance.
const SHOULDER_START: f32 = 0.8;

/// Linear 0..1 to sRGB 0..1 (IEC 61966-2-1).
fn srgb_encode(linear: vec3f) -> vec3f {
    let curve = 1.055 * pow(max(linear, vec3f(0.0031308)), vec3f(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * linear, linear <= vec3f(0.0031308));
}

/// sRGB 0..1 to linear 0..1, the inverse of [`srgb_encode`].
fn srgb_decode(encoded: vec3f) -> vec3f {
    let curve = pow((max(encoded, vec3f(0.04045)) + 0.055) / 1.055, vec3f(2.4));
    return select(curve, encoded / 12.92, encoded <= vec3f(0.04045));
}

/// Display value (sRGB-encoded, 0..1) of linear radiance.
fn tone_map(radiance: vec3f, exposure: f32) -> vec3f {
    // Bounded before the multiplication (stored radiance reaches 1e30), so that the product is finite and keeps its
    // hue.
    let exposed = clamp(radiance, vec3f(0.0), vec3f(1e30)) * min(exposure, 1e8);
    let peak = max(exposed.x, max(exposed.y, exposed.z));
    let room = 1.0 - SHOULDER_START;
    let bent = (1.0 - room * exp(-(peak - SHOULDER_START) / room)) / max(peak, SHOULDER_START);
    return srgb_encode(exposed * select(1.0, bent, peak > SHOULDER_START));
}

/// Contents of a texture. Twin of `Content` in `viewer/src/show.rs`.
const CONTENT_RADIANCE: u32 = 0u;
const CONTENT_NORMAL: u32 = 1u;
const CONTENT_DEPTH: u32 = 2u;
const CONTENT_REFLECTANCE: u32 = 3u;

/// Colour for a value of this kind. `range` is the depth shown as middle grey, scene units.
fn shown(content: u32, value: vec3f, exposure: f32, range: f32) -> vec3f {
    switch content {
        case CONTENT_NORMAL: {
            // Without a surface there is no normal: black.
            return select(0.5 + 0.5 * value, vec3f(0.0), all(value == vec3f(0.0)));
        }
        case CONTENT_DEPTH: {
            return vec3f(select(range / (range + value.x), 0.0, value.x == 0.0));
        }
        case CONTENT_REFLECTANCE: {
            return srgb_encode(clamp(value, vec3f(0.0), vec3f(1.0)));
        }
        default: {
            return tone_map(value, exposure);
        }
    }
}

/// Colours of invalid values. No curve above gives them to a whole surface.
const NOT_FINITE_COLOUR: vec3f = vec3f(1.0, 0.0, 1.0);
const CLAMPED_COLOUR: vec3f = vec3f(0.0, 1.0, 1.0);

/// The colour of a value; a marker colour if it is NaN, infinite or at `limit`, the largest number of its format.
fn marked(colour: vec3f, value: vec3f, limit: f32) -> vec3f {
    let bits = bitcast<vec3u>(value);
    let found = kinds(bits.x, limit) + kinds(bits.y, limit) + kinds(bits.z, limit);
    let finite = select(colour, CLAMPED_COLOUR, found.w > 0u);
    return select(finite, NOT_FINITE_COLOUR, found.x + found.y > 0u);
}
