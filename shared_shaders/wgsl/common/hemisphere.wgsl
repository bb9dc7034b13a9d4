// Directions and points in the hemisphere above a surface. Screen-space methods sample points inside it (Ritschel et al.
// 2009; Mittring 2007).
import package::common::math::PI;

/// Two unit vectors that are perpendicular to a unit vector and to each other, without a branch (Duff et al. 2017).
fn tangents_of(normal: vec3f) -> mat2x3f {
    let side = select(-1.0, 1.0, normal.z >= 0.0);
    let a = -1.0 / (side + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = vec3f(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    return mat2x3f(tangent, vec3f(b, side + normal.y * normal.y * a, -normal.y));
}

/// Point `i` of `count` inside the unit hemisphere around `normal`, distributed evenly over its volume. `random`
/// rotates and shifts the whole set.
fn hemisphere_point(normal: vec3f, i: u32, count: u32, random: vec2f) -> vec3f {
    return shell_point(normal, 0.0, i, count, random);
}

/// The same for the half shell between a hemisphere of radius `inner` (0..1) and the unit hemisphere.
fn shell_point(normal: vec3f, inner: f32, i: u32, count: u32, random: vec2f) -> vec3f {
    // Heights follow the golden ratio, directions the golden angle, distances are stratified. No two of them are
    // correlated.
    let stratum = (f32(i) + random.x) / f32(count);
    let height = fract(random.y + f32(i) * 0.6180339887498949);
    let angle = 2.0 * PI * fract(random.x + f32(i) * 0.38196601125);
    let across = sqrt(max(1.0 - height * height, 0.0));
    let direction = across * (tangents_of(normal) * vec2f(cos(angle), sin(angle))) + height * normal;
    // The volume within r grows with its cube.
    return direction * pow(mix(inner * inner * inner, 1.0, stratum), 1.0 / 3.0);
}

/// A direction around `normal` with a cosine-weighted density.
fn cosine_direction(normal: vec3f, random: vec2f) -> vec3f {
    let helper = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.x) > 0.7);
    let tangent = normalize(cross(helper, normal));
    let radius = sqrt(random.x);
    let angle = 2.0 * PI * random.y;
    return radius * cos(angle) * tangent + radius * sin(angle) * cross(normal, tangent)
        + sqrt(max(1.0 - random.x, 0.0)) * normal;
}
