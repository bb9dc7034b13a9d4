// Area of a sample of a pattern (Lambru et al., section 3.1, Figure 2): points distributed evenly over the volume of a
// hemisphere, or of the shell around it, which a view projects to the surfaces it sees.
import package::common::math::PI;

/// The half shell between two radii above a surface. The inner radius is in units of the outer one, 0 for a hemisphere.
struct Pattern {
    normal: vec3f,
    inner: f32,
    outer: f32,
}

/// A sample whose ray crosses less of its pattern than this, in units of the radius, is a rounding error.
const LEAST_CHORD: f32 = 1e-3;

/// Samples nearer than a millionth of the radius to the origin of the rays count as at it.
const LARGEST_INVERSE: f32 = 1e6;

/// Integral over s in low..high of (1 + q s)^2: the widening of a beam relative to s = 0, with q the inverse of its
/// distance there.
fn beam(low: f32, high: f32, q: f32) -> f32 {
    return (high - low) * (1.0 + q * (high + low) + q * q * (high * high + high * low + low * low) / 3.0);
}

/// Area across a view's rays that a sample of the pattern stands for, in scene units squared, if its surface is at the
/// sample's distance. All samples that the view projects to one position of its image lie on one ray. Their expected
/// number is the length of the ray inside the pattern, and the area is its inverse. Sums are then those over all of the
/// view's image, whatever the pattern.
///
/// `offset` is the sample relative to the receiver, in units of the radius. `direction` is that of the view's ray
/// through it. `inverse_distance` is the inverse of its distance from the origin of the rays, per unit of the radius; 0
/// for parallel rays.
fn sample_area(pattern: Pattern, offset: vec3f, direction: vec3f, inverse_distance: f32, samples: u32) -> f32 {
    let inverse = min(inverse_distance, LARGEST_INVERSE);
    let along = dot(offset, direction);
    let across = offset - along * direction;
    let square = dot(across, across);
    // In front of the receiver's plane, and behind the origin of the rays.
    let height = dot(offset, pattern.normal);
    let slope = dot(direction, pattern.normal);
    let plane = -height / select(slope, 1e-30, abs(slope) < 1e-30);
    let low = max(select(-4.0, plane, slope > 0.0), select(-4.0, -1.0 / max(inverse, 0.25), inverse > 0.25));
    let high = select(4.0, plane, slope < 0.0);
    let half = sqrt(max(1.0 - square, 0.0));
    let inner_half = sqrt(max(pattern.inner * pattern.inner - square, 0.0));
    let whole = beam(max(-along - half, low), max(min(-along + half, high), max(-along - half, low)), inverse);
    let start = max(-along - inner_half, low);
    let hole = select(0.0, beam(start, max(min(-along + inner_half, high), start), inverse), inner_half > 0.0);
    let volume = 2.0 * PI / 3.0 * (1.0 - pattern.inner * pattern.inner * pattern.inner);
    let share = volume / (max(whole - hole, LEAST_CHORD) * f32(samples));
    return share * pattern.outer * pattern.outer;
}
