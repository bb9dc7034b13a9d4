// The sky as a source from which directions are drawn, by its radiance.
import package::common::math::PI;
import package::common::environment::{MAP, latlong, sky_rows};

// Layout as in `common/environment.wgsl`.
@group(0) @binding(8) var<storage, read> environment: array<vec4f>;

/// A direction to the sky.
struct DrawnSky {
    // Unit vector.
    direction: vec3f,
    radiance: vec3f,
    // Density over solid angle at which it is drawn.
    density: f32,
}

/// Radiance of the sky.
fn sky_radiance(direction: vec3f) -> vec3f {
    return environment[MAP + latlong(direction, environment[0].xy)].rgb;
}

/// Share of the row and of all rows that end with texel `index` of the sky, and with the one before.
fn sky_shares(index: u32) -> vec4f {
    let width = u32(environment[0].x);
    let row = index / width;
    let rows = sky_rows(environment[0]);
    var before = vec2f(0.0);
    if index % width > 0u {
        before.x = environment[MAP + index - 1u].w;
    }
    if row > 0u {
        before.y = environment[rows + row - 1u].x;
    }
    return vec4f(environment[MAP + index].w, environment[rows + row].x, before);
}

/// Solid angle of a texel in this row of the sky.
fn sky_texel_angle(row: u32) -> f32 {
    let size = environment[0].xy;
    // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), without cancellation.
    return 2.0 * PI / size.x * 2.0 * sin((f32(row) + 0.5) * PI / size.y) * sin(0.5 * PI / size.y);
}

/// Density over solid angle at which the sky is drawn in texel `index`.
fn sky_texel_density(index: u32) -> f32 {
    let shares = sky_shares(index);
    let share = (shares.x - shares.z) * (shares.y - shares.w);
    return share / sky_texel_angle(index / u32(environment[0].x));
}

/// Density over solid angle at which the sky is drawn in this direction.
fn sky_density(direction: vec3f) -> f32 {
    return sky_texel_density(latlong(direction, environment[0].xy));
}

/// A direction to the sky. A row is drawn by its share, a texel by its share of the row, and the position in the texel
/// evenly over its solid angle.
fn draw_sky(random: vec2f) -> DrawnSky {
    let size = environment[0].xy;
    let rows = sky_rows(environment[0]);
    var first = 0u;
    var count = u32(size.y) - 1u;
    while count > 0u {
        let half = count / 2u;
        let beyond = environment[rows + first + half].x <= random.x;
        first = select(first, first + half + 1u, beyond);
        count = select(half, count - half - 1u, beyond);
    }
    let row = first;
    let start = MAP + row * u32(size.x);
    first = 0u;
    count = u32(size.x) - 1u;
    while count > 0u {
        let half = count / 2u;
        let beyond = environment[start + first + half].w <= random.y;
        first = select(first, first + half + 1u, beyond);
        count = select(half, count - half - 1u, beyond);
    }
    let index = row * u32(size.x) + first;
    let shares = sky_shares(index);
    // What is left of the random numbers is the position in the texel.
    let rest = saturate((random - shares.wz) / max(shares.yx - shares.wz, vec2f(1e-30)));
    let longitude = ((f32(first) + rest.y) / size.x - 0.5) * 2.0 * PI;
    let top = cos(f32(row) * PI / size.y);
    let bottom = cos(f32(row + 1u) * PI / size.y);
    let height = mix(top, bottom, rest.x);
    let radius = sqrt(max(1.0 - height * height, 0.0));
    let direction = vec3f(radius * sin(longitude), height, -radius * cos(longitude));
    return DrawnSky(direction, environment[MAP + index].rgb, sky_texel_density(index));
}
