// Sources of light with an area: emitting triangles and the sky. Points on them are drawn by their power.
import package::common::math::largest;
import package::truth::sky::draw_sky;
import package::truth::params::params;
import package::truth::traversal::{
    Ray, Crossing, triangles, texel_coordinates, attributes_at, is_present,
};
import package::truth::surface::{MATERIAL, materials, scaled_normal, unit_or};

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

/// Density over area at which points on a triangle are drawn, seen from a distance, as a density over solid angle.
/// `along` leads from the receiver to the point; `cosine` is that of its direction with the triangle's normal.
fn emitter_density(emission: vec3f, along: vec3f, cosine: f32) -> f32 {
    // Relative to the scene's radius, because squares of tiny or huge lengths leave the range of float32.
    let distance = along / max(params.scene_radius, 1e-30);
    return largest(emission) * params.emitter_density * dot(distance, distance) / max(abs(cosine), 1e-12);
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
    let material = materials[attributes_at(slot, weights).material & MATERIAL];
    let emission = material.emission * params.radiance_scale;
    var radiance = emission;
    if cosine == 0.0 || (mask.x != 0u && !is_present(slot, crossing)) {
        radiance = vec3f(0.0);
    }
    let facing = select(normal, -normal, cosine > 0.0);
    return Source(to_source, false, facing, radiance, emitter_density(emission, to_source, cosine));
}

/// A direction to the sky.
fn sky_source(random: vec2f) -> Source {
    let sky = draw_sky(random);
    return Source(sky.direction, true, -sky.direction, sky.radiance * params.radiance_scale, sky.density);
}

/// A point on a source for a receiver at `position`. With both kinds of source, each is drawn half of the time.
fn draw_source(position: vec3f, random: vec3u, emitters_too: bool, sky_too: bool) -> Source {
    // 24 bits fill the mantissa of a float32.
    let numbers = vec2f(random.yz >> vec2u(8u)) * 5.9604644775390625e-8;
    if !emitters_too {
        return sky_source(numbers);
    }
    if !sky_too {
        return draw_emitter(position, random.x, numbers);
    }
    // The highest bit chooses the kind; the others are the number.
    if random.x >= 0x80000000u {
        return sky_source(numbers);
    }
    return draw_emitter(position, random.x << 1u, numbers);
}
