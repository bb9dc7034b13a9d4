// The direction in which a glossy surface is asked what it shows.
import package::common::math::{PI, spread2};
import package::common::streams::REFLECTION_STREAM;

/// The mirror direction of the ray to a place in view space; or with `lobe` one drawn from the Phong lobe around it
/// with the density (s + 1) / (2 pi) cos^s, the same one in every pass of a frame.
fn reflected(
    position: vec3f,
    normal: vec3f,
    exponent: f32,
    lobe: bool,
    id: vec2u,
    frame: u32,
    seed: u32,
    over_frames: bool,
) -> vec3f {
    let mirror = reflect(normalize(position), normal);
    if !lobe {
        return mirror;
    }
    let random = spread2(id, frame, REFLECTION_STREAM, seed, over_frames);
    // The logarithm of a number in (0, 1]: sharp lobes have cosines next to 1, whose distance from it is what counts.
    let logarithm = log(1.0 - random.x) / (max(exponent, 0.0) + 1.0);
    let height = exp(logarithm);
    // 1 - exp(2 l), without the difference of two numbers next to each other.
    let square = select(1.0 - height * height, -2.0 * logarithm, logarithm > -1e-3);
    let across = sqrt(max(square, 0.0));
    let angle = 2.0 * PI * random.y;
    // An orthonormal basis without a branch but for the sign (Duff et al. 2017).
    let side = select(-1.0, 1.0, mirror.z >= 0.0);
    let a = -1.0 / (side + mirror.z);
    let b = mirror.x * mirror.y * a;
    let tangent = vec3f(1.0 + side * mirror.x * mirror.x * a, side * b, -side * mirror.x);
    let bitangent = vec3f(b, side + mirror.y * mirror.y * a, -mirror.y);
    return normalize(across * (cos(angle) * tangent + sin(angle) * bitangent) + height * mirror);
}
