// The two basic equations (Soler et al. 2009).
import package::common::math::PI;

/// Lower bound of cos beta in Equation 2, which grows without bound for surfaces seen edge-on. At silhouettes the error
/// of the shading normals is larger than this bound.
const MIN_COS_BETA: f32 = 0.02;

/// Keeps the quotient finite where a point meets itself (0 / 0) without changing any other. In units of the receiver's
/// depth, neighbouring pixels of a 16384-pixel image are farther apart than 1e-5.
const SMALLEST: f32 = 1e-36;

/// The factor of Equation 2 that is the same for every pixel: K = 4 tan(fh/2) tan(fv/2) / (W H), for one
/// full-resolution pixel of area.
fn pixel_area_factor(tan_half_fov: vec2f, display_size: vec2f) -> f32 {
    return 4.0 * tan_half_fov.x * tan_half_fov.y / (display_size.x * display_size.y);
}

/// Soler 2009, Equations 3 and 4: what one sample adds to `indirect` for each unit of radiance.
///
/// `toward` points from the receiver to the source (view space). The source is at `ray * depth`, with ray.z = -1.
/// `area` is K dP of Equation 2, so that the area of the source is ds = area d^2 / max(-dot(n, ray), eps).
///
///     Equation 4:  cos+ R^2 / (r^2 + R^2),   R^2 = cos'+ ds / pi
///     Equation 3:  cos+ R^2 / r^2
///
/// Numerator and denominator are multiplied by r and by max(-dot(n, ray), eps), so that one square root and one
/// division serve both equations. The length of `source_normal` cancels. `normal_length` has to match it only within a
/// factor of two, because it scales eps alone. Lengths may be in any unit. Callers use the receiver's depth as the
/// unit, which keeps every product inside float32.
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
    // Surfaces that face away have a zero numerator. A few products cost less than a branch.
    let receiver_cosine = max(dot(receiver_normal, toward), 0.0);
    let source_cosine = max(-dot(source_normal, toward), 0.0);
    let square = dot(toward, toward);
    let distance = sqrt(square);
    let slant = max(-dot(source_normal, ray), MIN_COS_BETA * normal_length);
    let source = source_cosine * (area * (1.0 / PI)) * (depth * depth);
    let denominator = distance * (distance * square * slant + select(0.0, source, point_to_disc));
    // The denominator is zero only where a point meets itself, and the numerator is zero there too.
    return receiver_cosine * source / max(denominator, SMALLEST);
}
