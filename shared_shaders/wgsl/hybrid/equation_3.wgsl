// Lambru et al., Equation 3.
import package::reflective_shadow_maps::light_surface::LightSurface;

/// Contribution of a sample to the mean, per unit of its light: cos+ cos'+ / r^2, in units of one over an area. The
/// distance is at least the texel width, because the printed form is unbounded, and the result is limited so that light
/// stays finite.
fn equation_3(position: vec3f, normal: vec3f, surface: LightSurface) -> f32 {
    let toward = surface.position - position;
    let square = max(max(dot(toward, toward), surface.area), 1e-30);
    return min(max(dot(normal, toward), 0.0) * max(-dot(surface.normal, toward), 0.0) / square / square, 1e20);
}
