// Points on emitting triangles, drawn by their power.
import package::common::math::largest;
import package::truth::traversal::{Crossing, attributes_at, is_present, texel_coordinates, triangles};
import package::truth::surface::{MATERIAL, materials, scaled_normal, unit_or};

// A header of two texels: number of emitting triangles | `density`; `radius` | 0, as bit patterns. Then, for each emitting
// triangle: cumulative power up to and including it, as a share of 2^32 less 1 | its slot in `triangles`. Rows are those of
// the BVH's textures. Twin of renderer/src/scene/bvh/emitters.rs.
@group(0) @binding(18) var emitters: texture_2d<u32>;

const HEADER: u32 = 2u;

/// What is known about all emitting triangles together.
struct Emitters {
    // Number of them.
    count: u32,
    // Density of drawn points over area, for an emission of 1: areas are in units of the square of `radius`.
    density: f32,
    // Half the diagonal of the scene's bounding box.
    radius: f32,
}

fn all_emitters() -> Emitters {
    let words = textureLoad(emitters, vec2u(0u), 0).xy;
    return Emitters(words.x, bitcast<f32>(words.y), bitcast<f32>(textureLoad(emitters, vec2u(1u, 0u), 0).x));
}

fn emitter_at(index: u32) -> vec2u {
    return textureLoad(emitters, texel_coordinates(index + HEADER), 0).xy;
}

/// A point on an emitting triangle that was drawn for a receiver.
struct EmitterPoint {
    // From the receiver to the point, not of unit length.
    along: vec3f,
    // Unit normal, facing the receiver.
    normal: vec3f,
    // Emission; 0 where no point exists.
    emission: vec3f,
    // Density over the solid angle at the receiver.
    density: f32,
}

/// Density over area at which points on a triangle are drawn, seen from a distance, as a density over solid angle.
/// `along` leads from the receiver to the point; `cosine` is that of its direction with the triangle's normal.
fn emitter_density(all: Emitters, emission: vec3f, along: vec3f, cosine: f32) -> f32 {
    // Relative to the scene's radius, because squares of tiny or huge lengths leave the range of float32.
    let distance = along / max(all.radius, 1e-30);
    return largest(emission) * all.density * dot(distance, distance) / max(abs(cosine), 1e-12);
}

/// A point on an emitting triangle, drawn by power and evenly over its area.
fn draw_emitter(all: Emitters, position: vec3f, word: u32, random: vec2f) -> EmitterPoint {
    var first = 0u;
    var count = max(all.count, 1u) - 1u;
    while count > 0u {
        let half = count / 2u;
        let beyond = emitter_at(first + half).x < word;
        first = select(first, first + half + 1u, beyond);
        count = select(half, count - half - 1u, beyond);
    }
    let slot = emitter_at(first).y;
    let a = textureLoad(triangles, texel_coordinates(slot * 3u));
    let b = textureLoad(triangles, texel_coordinates(slot * 3u + 1u));
    let c = textureLoad(triangles, texel_coordinates(slot * 3u + 2u));
    let edge_1 = bitcast<vec3f>(b.xyz);
    let edge_2 = bitcast<vec3f>(c.xyz);
    let root = sqrt(random.x);
    let weights = vec2f(root * (1.0 - random.y), root * random.y);
    let mask = vec2u(b.w, c.w);
    let crossing = Crossing(0.0, weights, mask);
    let along = bitcast<vec3f>(a.xyz) - position + edge_1 * weights.x + edge_2 * weights.y;
    let towards = unit_or(along / max(all.radius, 1e-30), vec3f(0.0));
    let normal = unit_or(scaled_normal(edge_1, edge_2), vec3f(0.0));
    let cosine = dot(normal, towards);
    var emission = materials[attributes_at(slot, weights).material & MATERIAL].emission;
    let density = emitter_density(all, emission, along, cosine);
    if cosine == 0.0 || (mask.x != 0u && !is_present(slot, crossing)) {
        emission = vec3f(0.0);
    }
    return EmitterPoint(along, select(normal, -normal, cosine > 0.0), emission, density);
}
