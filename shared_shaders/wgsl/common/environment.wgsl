// Light from outside the scene: `environment`, a buffer of vec4f.
//
//   0         sizes: map, small map
//   1..9      irradiance over pi as a polynomial of the normal (Ramamoorthi & Hanrahan 2001)
//   MAP..     the map, rows from the top. The fourth number of a texel is the cumulative share of its row's light, up to
//             and including it, weighted by solid angle; 1 for the last one
//   then      the small map, which averages squares of it
//   then      for each row of the map, the cumulative share of all light, up to and including it
//
// WGSL cannot pass a buffer to a function, so these functions return indices into it. Directions are in world space.
import package::common::math::PI;

const IRRADIANCE: u32 = 1u;
const MAP: u32 = 10u;

/// Texel of a map of this size that contains a direction: longitude along rows, latitude along columns.
fn latlong(direction: vec3f, size: vec2f) -> u32 {
    let longitude = atan2(direction.x, -direction.z) / (2.0 * PI) + 0.5;
    let latitude = acos(clamp(direction.y * inverseSqrt(max(dot(direction, direction), 1e-30)), -1.0, 1.0)) / PI;
    let texel = min(vec2u(vec2f(longitude, latitude) * size), vec2u(size) - 1u);
    return texel.y * u32(size.x) + texel.x;
}

/// First texel of the small map.
fn small_map(sizes: vec4f) -> u32 {
    return MAP + u32(sizes.x) * u32(sizes.y);
}

/// First row of the cumulative shares of light.
fn sky_rows(sizes: vec4f) -> u32 {
    return small_map(sizes) + u32(sizes.z) * u32(sizes.w);
}

/// Basis function of coefficient `i` for a surface with this unit normal.
fn irradiance_factor(i: u32, n: vec3f) -> f32 {
    switch i {
        case 0u: { return 1.0; }
        case 1u: { return n.y; }
        case 2u: { return n.z; }
        case 3u: { return n.x; }
        case 4u: { return n.x * n.y; }
        case 5u: { return n.y * n.z; }
        case 6u: { return 3.0 * n.z * n.z - 1.0; }
        case 7u: { return n.x * n.z; }
        default: { return n.x * n.x - n.y * n.y; }
    }
}
