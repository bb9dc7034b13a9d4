// The mirror lobe of glossy surfaces, and the screen region that its light comes from (Soler & Hoel 2010, section 4).
import package::common::math::PI;

/// Weight of light from a direction by the modified Phong lobe (Lafortune and Willems 1994): its BRDF Ks (s + 2) / (2
/// pi) cos^s relative to the diffuse 1 / pi of the form factor, without Ks. `cosine` is that of the angle to the mirror
/// direction.
fn phong_lobe(cosine: f32, exponent: f32) -> f32 {
    return 0.5 * (exponent + 2.0) * pow(clamp(cosine, 0.0, 1.0), exponent);
}

/// Screen direction, y downwards, in which points along a view-space direction appear from a point seen along `ray`
/// (ray.z = -1).
fn screen_direction(direction: vec3f, ray: vec3f) -> vec2f {
    return (direction.xy + ray.xy * direction.z) * vec2f(1.0, -1.0);
}

/// The paper's alpha: density of directions outside the lobe.
const ALPHA: f32 = 0.1;
/// Wider lobes are sampled like this one, because their Gaussian would wrap around the circle more than once.
const WIDEST_EXPONENT: f32 = 1.0;

/// Standard deviation of the paper's Gaussian exp(-s t^2 / (2 pi)), radians.
fn lobe_deviation(exponent: f32) -> f32 {
    return sqrt(PI / max(exponent, WIDEST_EXPONENT));
}

/// Inverse of the error function on -1..1, to the precision of float32 (Giles 2012).
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

/// An angle relative to the mirror direction, -pi..pi, sampled in proportion to f = alpha + exp(-s t^2 / (2 pi)) from a
/// number in 0..1.
fn draw_angle(number: f32, exponent: f32) -> f32 {
    let deviation = lobe_deviation(exponent);
    // Integrals of alpha and of the Gaussian over the circle.
    let flat_area = 2.0 * PI * ALPHA;
    let share = flat_area / (flat_area + deviation * sqrt(2.0 * PI));
    let even = 2.0 * PI * (number / share) - PI;
    let x = clamp(2.0 * (number - share) / (1.0 - share) - 1.0, -0.9999999, 0.9999999);
    let near = deviation * sqrt(2.0) * inverse_error_function(x);
    let angle = select(near, even, number < share);
    return angle - 2.0 * PI * round(angle / (2.0 * PI));
}

/// Inverse of the density of this angle in `draw_angle`, relative to a uniform density.
fn inverse_density(angle: f32, exponent: f32) -> f32 {
    let deviation = lobe_deviation(exponent);
    let t = vec3f(angle - 2.0 * PI, angle, angle + 2.0 * PI) / deviation;
    // The Gaussian wraps around the circle.
    let gaussian = exp(-0.5 * t * t);
    let f = ALPHA + gaussian.x + gaussian.y + gaussian.z;
    return (2.0 * PI * ALPHA + deviation * sqrt(2.0 * PI)) / (2.0 * PI * f);
}

/// Screen region that the lobe's light comes from, as far as it is known before any fetch.
///
/// A point in a direction w from the receiver appears on the screen in a direction that does not depend on its
/// distance, so screen directions are directions w rotated around the view ray. Around the view ray the lobe, seen at
/// the angle phi to it, is as wide as 1 / (sqrt(s + 1) sin(phi)). No point in the direction w appears farther away than
/// the vanishing point of w.
struct LobeOnScreen {
    // Unit screen direction of the mirror direction, y downwards.
    heading: vec2f,
    // Width of the sampled directions: 1 is uniform, 0 is the mirror direction alone.
    spread: f32,
    // Squared distance to the farthest vanishing point of the lobe, in units of the view ray at z = -1.
    reach_square: f32,
}

/// Lower bound of the sampled width, so that densities stay finite.
const LEAST_SPREAD: f32 = 1e-3;
/// A vanishing point at infinity: wider than any screen.
const ENDLESS: f32 = 1e6;

fn lobe_on_screen(mirror: vec3f, ray: vec3f, exponent: f32) -> LobeOnScreen {
    let forward = normalize(ray);
    let cosine = dot(mirror, forward);
    let across = mirror - forward * cosine;
    let sine = length(across);
    let deviation = inverseSqrt(exponent + 1.0);
    let heading = screen_direction(mirror, ray);
    var lobe: LobeOnScreen;
    // A mirror direction along the view ray has no screen direction. Any direction is valid.
    lobe.heading = select(vec2f(1.0, 0.0), normalize(heading), dot(heading, heading) > 1e-20);
    // A Cauchy distribution fits a Gaussian best where it is narrower by the square root of two.
    let width = 0.7071067811865476 * deviation / max(sine, 1e-6);
    lobe.spread = clamp(tanh(0.5 * min(width, 20.0)), LEAST_SPREAD, 1.0);
    // Two standard deviations beyond the mirror direction, away from the view ray.
    let angle = acos(clamp(cosine, -1.0, 1.0)) + 2.0 * deviation;
    let farthest = forward * cos(angle) + across / max(sine, 1e-6) * sin(angle);
    let gone = screen_direction(farthest, ray) / max(-farthest.z, 1e-6);
    lobe.reach_square = select(ENDLESS, min(dot(gone, gone), ENDLESS), angle < PI && farthest.z < 0.0);
    return lobe;
}

/// A screen direction sampled around the lobe's heading from a number in 0..1, and the inverse of its density, relative
/// to a uniform density. The distribution is a wrapped Cauchy. It has the peak of the Gaussian, its tails never end, so
/// that no weight exceeds 1 / spread, and its inverse and its density are rational.
fn draw_heading(number: f32, lobe: LobeOnScreen) -> vec3f {
    let half_turn = PI * (number - 0.5);
    let c = cos(half_turn);
    let s = lobe.spread * sin(half_turn);
    let norm = 1.0 / (c * c + s * s);
    let rotated = vec2f(c * c - s * s, 2.0 * c * s) * norm;
    let direction = vec2f(
        lobe.heading.x * rotated.x - lobe.heading.y * rotated.y,
        lobe.heading.x * rotated.y + lobe.heading.y * rotated.x,
    );
    return vec3f(direction, lobe.spread * norm);
}

/// Share of the samples within the reach of the lobe.
const WITHIN_REACH: f32 = 0.9;

/// A squared distance between `inner` and `outer`, sampled from a number in 0..1, and the inverse of its density,
/// relative to a uniform density between `inner` and `ring`. On the screen the lobe's solid angle decreases with the
/// inverse square of the distance; `soft` keeps this finite. Few samples fall beyond `reach`.
fn draw_square(number: f32, inner: f32, outer: f32, ring: f32, reach: f32, soft: f32) -> vec2f {
    let boundary = clamp(reach, inner, outer);
    var share = WITHIN_REACH;
    share = select(share, 0.0, boundary <= inner);
    share = select(share, 1.0, boundary >= outer);
    let within = number < share;
    let low = select(boundary, inner, within) + soft;
    let high = select(outer, boundary, within) + soft;
    let part = select(1.0 - share, share, within);
    let x = select((number - share) / max(1.0 - share, 1e-6), number / max(share, 1e-6), within);
    let octaves = log2(high / low);
    let square = low * exp2(x * octaves);
    return vec2f(square - soft, square * octaves * 0.6931471805599453 / (part * (ring - inner)));
}
