// Lambru et al., Equation 3.
import package::reflective_shadow_maps::light_surface::LightSurface;

/// What a sample adds to their mean for each unit of its light: cos+ cos'+ / r^2, which has the unit of one over an
/// area. No nearer than its texel is wide, where the printed form has no bound, and never so much that light overflows.
fn equation_3(position: vec3f, normal: vec3f, surface: LightSurface) -> f32 {
    let toward = surface.position - position;
    let square = max(max(dot(toward, toward), surface.area), 1e-30);
    return min(max(dot(normal, toward), 0.0) * max(-dot(surface.normal, toward), 0.0) / square / square, 1e20);
}
