// The mirror lobe of glossy surfaces, and the screen directions in which its light comes (Soler & Hoel 2010, section 4).
import package::common::math::PI;

/// What the modified Phong lobe (Lafortune and Willems 1994) makes of light from a direction: its BRDF
/// Ks (s + 2) / (2 pi) cos^s against the diffuse 1 / pi that the form factor stands for, without Ks. `cosine` is that of
/// the angle to the mirror direction.
fn phong_lobe(cosine: f32, exponent: f32) -> f32 {
    return 0.5 * (exponent + 2.0) * pow(clamp(cosine, 0.0, 1.0), exponent);
}

/// Direction on the screen, y downwards, in which points along a view-space direction appear from a point that is seen
/// along `ray` (ray.z = -1).
fn screen_direction(direction: vec3f, ray: vec3f) -> vec2f {
    return (direction.xy + ray.xy * direction.z) * vec2f(1.0, -1.0);
}

/// The paper's alpha: how often directions are drawn that the lobe does not ask for.
const ALPHA: f32 = 0.1;
/// Wider lobes are drawn as this one: their gaussian would reach around the circle more than once.
const WIDEST_EXPONENT: f32 = 1.0;

/// Standard deviation of the paper's gaussian exp(-s t^2 / (2 pi)), radians.
fn lobe_deviation(exponent: f32) -> f32 {
    return sqrt(PI / max(exponent, WIDEST_EXPONENT));
}

/// Inverse of the error function on -1..1, to float32's precision (Giles 2012).
fn inverse_error_function(x: f32) -> f32 {
    let w = -log(max((1.0 - x) * (1.0 + x), 1e-30));
    let a = w - 2.5;
    var p = 2.81022636e-08;
    p = 3.43273939e-07 + p * a;
    p = -3.5233877e-06 + p * a;
    p = -4.39150654e-06 + p * a;
    p = 0.00021858087 + p * a;
    p = -0.00125372503 + p * a;
    p = -0.00417768164 + p * a;
    p = 0.246640727 + p * a;
    p = 1.50140941 + p * a;
    let b = sqrt(w) - 3.0;
    var q = -0.000200214257;
    q = 0.000100950558 + q * b;
    q = 0.00134934322 + q * b;
    q = -0.00367342844 + q * b;
    q = 0.00573950773 + q * b;
    q = -0.0076224613 + q * b;
    q = 0.00943887047 + q * b;
    q = 1.00167406 + q * b;
    q = 2.83297682 + q * b;
    return select(q, p, w < 5.0) * x;
}

/// An angle away from the mirror direction's, drawn in proportion to f = alpha + exp(-s t^2 / (2 pi)) from a number
/// in 0..1, in -pi..pi.
fn draw_angle(number: f32, exponent: f32) -> f32 {
    let deviation = lobe_deviation(exponent);
    // Areas under alpha and under the gaussian, all around the circle.
    let flat_area = 2.0 * PI * ALPHA;
    let share = flat_area / (flat_area + deviation * sqrt(2.0 * PI));
    let even = 2.0 * PI * (number / share) - PI;
    let x = clamp(2.0 * (number - share) / (1.0 - share) - 1.0, -0.9999999, 0.9999999);
    let near = deviation * sqrt(2.0) * inverse_error_function(x);
    let angle = select(near, even, number < share);
    return angle - 2.0 * PI * round(angle / (2.0 * PI));
}

/// One over the density with which `draw_angle` gives this angle, relative to an even one.
fn inverse_density(angle: f32, exponent: f32) -> f32 {
    let deviation = lobe_deviation(exponent);
    let t = vec3f(angle - 2.0 * PI, angle, angle + 2.0 * PI) / deviation;
    // The gaussian wraps around the circle.
    let gaussian = exp(-0.5 * t * t);
    let f = ALPHA + gaussian.x + gaussian.y + gaussian.z;
    return (2.0 * PI * ALPHA + deviation * sqrt(2.0 * PI)) / (2.0 * PI * f);
}
