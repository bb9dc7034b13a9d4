// Sources of light with an area: emitting triangles and the sky. Points on them are drawn by their power.
import package::common::math::{PI, largest};
import package::common::environment::{MAP, latlong, sky_rows};
import package::truth::params::params;
import package::truth::traversal::{
    Ray, Crossing, triangles, texel_coordinates, attributes_at, is_present,
};
import package::truth::surface::{RECEIVE_ONLY, materials, scaled_normal, unit_or};

// Layout as in `common/environment.wgsl`.
@group(0) @binding(9) var<storage, read> environment: array<vec4f>;
// For each emitting triangle: cumulative power up to and including it, as a share of 2^32 less 1; its slot in
// `triangles`. Twin of renderer/src/truth/sources.rs.
@group(0) @binding(10) var<storage, read> emitters: array<vec2u>;

/// A point on a source that was drawn for a receiver.
struct Source {
    // From the receiver to the point for an emitter, not of unit length; a unit vector for the sky.
    to_source: vec3f,
    is_sky: bool,
    // Unit normal of the emitter, facing the receiver.
    normal: vec3f,
    // Radiance towards the receiver; 0 where no point exists.
    radiance: vec3f,
    // Density over the solid angle at the receiver.
    density: f32,
}

/// Radiance of the sky.
fn sky_radiance(direction: vec3f) -> vec3f {
    return environment[MAP + latlong(direction, environment[0].xy)].rgb * params.radiance_scale;
}

/// Density over area at which points on a triangle are drawn, seen from a distance, as a density over solid angle.
/// `along` leads from the receiver to the point; `cosine` is that of its direction with the triangle's normal.
fn emitter_density(emission: vec3f, along: vec3f, cosine: f32) -> f32 {
    // Relative to the scene's radius, because squares of tiny or huge lengths leave the range of float32.
    let distance = along / max(params.scene_radius, 1e-30);
    return largest(emission) * params.emitter_density * dot(distance, distance) / max(abs(cosine), 1e-12);
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
fn draw_sky(random: vec2f) -> Source {
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
    return Source(direction, true, -direction, environment[MAP + index].rgb * params.radiance_scale, sky_texel_density(index));
}

/// A point on an emitting triangle, drawn by power and evenly over its area.
fn draw_emitter(position: vec3f, word: u32, random: vec2f) -> Source {
    var first = 0u;
    var count = params.emitter_count - 1u;
    while count > 0u {
        let half = count / 2u;
        let beyond = emitters[first + half].x < word;
        first = select(first, first + half + 1u, beyond);
        count = select(half, count - half - 1u, beyond);
    }
    let slot = emitters[first].y;
    let a = textureLoad(triangles, texel_coordinates(slot * 3u));
    let b = textureLoad(triangles, texel_coordinates(slot * 3u + 1u));
    let c = textureLoad(triangles, texel_coordinates(slot * 3u + 2u));
    let edge_1 = bitcast<vec3f>(b.xyz);
    let edge_2 = bitcast<vec3f>(c.xyz);
    let root = sqrt(random.x);
    let weights = vec2f(root * (1.0 - random.y), root * random.y);
    let mask = vec2u(b.w, c.w);
    let crossing = Crossing(0.0, weights, mask);
    let to_source = bitcast<vec3f>(a.xyz) - position + edge_1 * weights.x + edge_2 * weights.y;
    let towards = unit_or(to_source / max(params.scene_radius, 1e-30), vec3f(0.0));
    let normal = unit_or(scaled_normal(edge_1, edge_2), vec3f(0.0));
    let cosine = dot(normal, towards);
    let material = materials[attributes_at(slot, weights).material & ~RECEIVE_ONLY];
    let emission = material.emission * params.radiance_scale;
    var radiance = emission;
    if cosine == 0.0 || (mask.x != 0u && !is_present(slot, crossing)) {
        radiance = vec3f(0.0);
    }
    let facing = select(normal, -normal, cosine > 0.0);
    return Source(to_source, false, facing, radiance, emitter_density(emission, to_source, cosine));
}

/// A point on a source for a receiver at `position`. With both kinds of source, each is drawn half of the time.
fn draw_source(position: vec3f, random: vec3u, emitters_too: bool, sky_too: bool) -> Source {
    // 24 bits fill the mantissa of a float32.
    let numbers = vec2f(random.yz >> vec2u(8u)) * 5.9604644775390625e-8;
    if !emitters_too {
        return draw_sky(numbers);
    }
    if !sky_too {
        return draw_emitter(position, random.x, numbers);
    }
    // The highest bit chooses the kind; the others are the number.
    if random.x >= 0x80000000u {
        return draw_sky(numbers);
    }
    return draw_emitter(position, random.x << 1u, numbers);
}
