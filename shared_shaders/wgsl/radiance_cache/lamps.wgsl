// Light of lamps at hits, by the shadow maps.
import package::common::scene::{Light, light_incidence};
import package::common::shadow_maps::shadow;
import package::common::math::LARGEST_RADIANCE;

/// Irradiance of one light on a surface.
fn reflected(light: Light, position: vec3f, normal: vec3f, geometric_normal: vec3f) -> vec3f {
    let incidence = light_incidence(light, position);
    let cosine = dot(normal, incidence.direction);
    if cosine <= 0.0 || all(incidence.irradiance <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    let lit = shadow(light, position, geometric_normal, incidence.direction, incidence.distance);
    return min(incidence.irradiance, vec3f(LARGEST_RADIANCE)) * (cosine * lit);
}
