// Light from a disc to a receiver (Soler et al. 2009, Equation 4).
import package::common::math::PI;
import package::reflective_shadow_maps::light_surface::LightSurface;

/// Contribution of the disc to `indirect` per unit of its radiance: cos+ R^2 / (r^2 + R^2), R^2 = cos'+ ds / pi.
fn transfer(position: vec3f, normal: vec3f, surface: LightSurface) -> f32 {
    let toward = surface.position - position;
    let square = max(dot(toward, toward), 1e-36);
    let inverse = inverseSqrt(square);
    let receiver_cosine = max(dot(normal, toward) * inverse, 0.0);
    let disc = max(-dot(surface.normal, toward) * inverse, 0.0) * surface.area / PI;
    return receiver_cosine * disc / (square + disc);
}

/// The same for a receiver and a disc that face each other: an upper bound for any orientation.
fn nearness(position: vec3f, surface: LightSurface) -> f32 {
    let toward = surface.position - position;
    let disc = surface.area / PI;
    return disc / max(dot(toward, toward) + disc, 1e-36);
}
