// The direction of a glossy surface's reflection ray.
import package::common::hemisphere::tangents_of;
import package::common::math::{PI, spread2};
import package::common::streams::REFLECTION_STREAM;

/// The mirror direction of the ray to a position in view space. With `lobe`, a direction sampled from the Phong lobe
/// around it with density (s + 1) / (2 pi) cos^s; it is the same in every pass of a frame.
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
    // The logarithm of a number in (0, 1]. Narrow lobes have cosines close to 1, whose distance from 1 needs precision.
    let logarithm = log(1.0 - random.x) / (max(exponent, 0.0) + 1.0);
    let height = exp(logarithm);
    // 1 - exp(2 l), without cancellation.
    let square = select(1.0 - height * height, -2.0 * logarithm, logarithm > -1e-3);
    let across = sqrt(max(square, 0.0));
    let angle = 2.0 * PI * random.y;
    return normalize(across * (tangents_of(mirror) * vec2f(cos(angle), sin(angle))) + height * mirror);
}
