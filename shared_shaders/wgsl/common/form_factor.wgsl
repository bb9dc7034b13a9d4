// The two equations everything rests on (Soler et al. 2009).
import package::common::math::PI;

/// Surfaces seen closer to edge-on than this (the cosine of beta) count as tilted by it: Equation 2
/// grows without bound there, while the shading normals of a silhouette are off by more than this.
const MIN_COS_BETA: f32 = 0.02;

/// Keeps 0 / 0 from a point's own texel apart from every true quotient: in units of the receiver's
/// depth, neighbouring pixels of a 16384-pixel image are farther apart than 1e-5.
const SMALLEST: f32 = 1e-36;

/// The part of Equation 2 that is the same for every pixel: K = 4 tan(fh/2) tan(fv/2) / (W H), for
/// one full-resolution pixel of area.
fn pixel_area_factor(tan_half_fov: vec2f, display_size: vec2f) -> f32 {
    return 4.0 * tan_half_fov.x * tan_half_fov.y / (display_size.x * display_size.y);
}

/// Soler 2009, Equations 3 and 4: what one sample adds to `indirect` for each unit of radiance.
///
/// `toward` leads from the receiver to the source (view space), which stands at `ray * depth` where
/// ray.z = -1; `area` is K dP of Equation 2, so that the source's surface is
/// ds = area d^2 / max(-dot(n, ray), eps).
///
///     Equation 4:  cos+ R^2 / (r^2 + R^2),   R^2 = cos'+ ds / pi
///     Equation 3:  cos+ R^2 / r^2
///
/// Both sides are multiplied by r and by max(-dot(n, ray), eps), so one square root and one division
/// serve both equations, and the length of `source_normal` cancels: it need be `normal_length` only
/// within a factor of two, for eps. Other lengths may be in any unit; callers take the receiver's depth,
/// which keeps every product inside float32.
fn form_factor(
    receiver_normal: vec3f,
    toward: vec3f,
    ray: vec3f,
    depth: f32,
    source_normal: vec3f,
    normal_length: f32,
    area: f32,
    point_to_disc: bool,
) -> f32 {
    // Surfaces that face away get a zero numerator instead of a branch: a handful of products costs
    // less than a mask around them.
    let receiver_cosine = max(dot(receiver_normal, toward), 0.0);
    let source_cosine = max(-dot(source_normal, toward), 0.0);
    let square = dot(toward, toward);
    let distance = sqrt(square);
    let slant = max(-dot(source_normal, ray), MIN_COS_BETA * normal_length);
    let source = source_cosine * (area * (1.0 / PI)) * (depth * depth);
    let denominator = distance * (distance * square * slant + select(0.0, source, point_to_disc));
    // Zero only where a point meets itself, and there the numerator is zero too.
    return receiver_cosine * source / max(denominator, SMALLEST);
}
