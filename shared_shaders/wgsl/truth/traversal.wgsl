// Ray-triangle intersection through a compressed 8-wide BVH (Ylitie, Karras and Laine 2017).
//
// Nodes are five texels of four words, the layout of obvhs' CwBvhNode:
//   0  corner of the box x, y, z | exponents of x, y, z and the mask of inner children, 8 bits each
//   1  first child node | first triangle | contents of each of the eight children, 8 bits each
//   2  for x: lower planes of the children (8 x 8 bits) | upper planes
//   3  for y
//   4  for z
// All data is in read-only storage textures, the fastest resource to fetch from under lavapipe: 1.3 times as many rays
// per second as sampled textures, 1.6 times as many as storage buffers. Rows are 2^ROW_BITS texels long.
import package::common::scene::decode_texel;
import package::common::scene_textures::texel_word;

@group(0) @binding(1) var nodes: texture_storage_2d<rgba32uint, read>;

// Three texels per triangle, in the order of the BVH's leaves, as bit patterns of float32:
//   0  first corner
//   1  edge to the second corner | first texel of the alpha mask in `texels`, 0 for none
//   2  edge to the third corner | width of the mask, and height in the upper half
@group(0) @binding(2) var triangles: texture_storage_2d<rgba32uint, read>;

// Four texels per triangle:
//   0  normal of the first corner | its u
//   1  normal of the second corner | v of the first
//   2  normal of the third corner | index of the material
//   3  texture coordinates of the second corner | of the third
@group(0) @binding(3) var attributes: texture_storage_2d<rgba32uint, read>;

const ROW_BITS: u32 = 12u;

/// End of an unlimited ray; also the distance of a miss.
const FAR: f32 = 1e30;

/// Groups of unvisited nodes on the stack: one per level. Eight-wide trees of millions of triangles are ten levels
/// deep; the builder refuses deeper trees.
const MAX_DEPTH: u32 = 24u;

struct Ray {
    origin: vec3f,
    // Not necessarily of unit length. Distances are in units of its length.
    direction: vec3f,
}

struct Hit {
    // FAR for a miss.
    distance: f32,
    // Index into `triangles`.
    slot: u32,
}

fn texel_coordinates(texel: u32) -> vec2u {
    return vec2u(texel & ((1u << ROW_BITS) - 1u), texel >> ROW_BITS);
}

/// Intersection of a ray with the plane of a triangle.
struct Crossing {
    distance: f32,
    // Barycentric coordinates of the second and third corner.
    weights: vec2f,
    // First texel and size of the mask.
    mask: vec2u,
}

/// After Möller and Trumbore (1997).
fn cross_triangle(slot: u32, ray: Ray) -> Crossing {
    let a = textureLoad(triangles, texel_coordinates(slot * 3u));
    let b = textureLoad(triangles, texel_coordinates(slot * 3u + 1u));
    let c = textureLoad(triangles, texel_coordinates(slot * 3u + 2u));
    let edge_1 = bitcast<vec3f>(b.xyz);
    let edge_2 = bitcast<vec3f>(c.xyz);
    let p = cross(ray.direction, edge_2);
    let inverse = 1.0 / dot(edge_1, p);
    let s = ray.origin - bitcast<vec3f>(a.xyz);
    let q = cross(s, edge_1);
    return Crossing(
        dot(edge_2, q) * inverse,
        vec2f(dot(s, p), dot(ray.direction, q)) * inverse,
        vec2u(b.w, c.w),
    );
}

/// Interpolated attributes of a triangle.
struct Attributes {
    normal: vec3f,
    uv: vec2f,
    material: u32,
}

fn attributes_at(slot: u32, weights: vec2f) -> Attributes {
    let a = textureLoad(attributes, texel_coordinates(slot * 4u));
    let b = textureLoad(attributes, texel_coordinates(slot * 4u + 1u));
    let c = textureLoad(attributes, texel_coordinates(slot * 4u + 2u));
    let d = bitcast<vec4f>(textureLoad(attributes, texel_coordinates(slot * 4u + 3u)));
    let first = 1.0 - weights.x - weights.y;
    return Attributes(
        bitcast<vec3f>(a.xyz) * first + bitcast<vec3f>(b.xyz) * weights.x + bitcast<vec3f>(c.xyz) * weights.y,
        bitcast<vec2f>(vec2u(a.w, b.w)) * first + d.xy * weights.x + d.zw * weights.y,
        c.w,
    );
}

/// Whether the triangle exists at this point, by the nearest texel of its alpha mask.
fn is_present(slot: u32, crossing: Crossing) -> bool {
    let size = vec2u(crossing.mask.y & 0xffffu, crossing.mask.y >> 16u);
    let texel = min(vec2u(fract(attributes_at(slot, crossing.weights).uv) * vec2f(size)), size - 1u);
    return decode_texel(texel_word(crossing.mask.x + texel.y * size.x + texel.x)).a >= 0.5;
}

fn bytes(word: u32) -> vec4u {
    return (vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u);
}

/// Four children of a node: bits 24 to 31 mark inner children that are hit, ordered so that the highest bit is the
/// nearest one in the ray's octant. Bits 0 to 23 mark triangles of leaves that are hit.
fn intersect_children(
    kinds: u32,
    near: vec3u,
    far: vec3u,
    scale: vec3f,
    base: vec3f,
    octant: u32,
    reach: f32,
) -> u32 {
    let kind = bytes(kinds);
    let x = vec4f(bytes(near.x)) * scale.x + base.x;
    let y = vec4f(bytes(near.y)) * scale.y + base.y;
    let z = vec4f(bytes(near.z)) * scale.z + base.z;
    let start = max(max(x, y), max(z, vec4f(0.0)));
    let u = vec4f(bytes(far.x)) * scale.x + base.x;
    let v = vec4f(bytes(far.y)) * scale.y + base.y;
    let w = vec4f(bytes(far.z)) * scale.z + base.z;
    let end = min(min(u, v), min(w, vec4f(reach)));
    let is_node = (kind & vec4u(24u)) == vec4u(24u);
    let bit = (kind ^ select(vec4u(0u), vec4u(octant), is_node)) & vec4u(31u);
    // The factor covers the rounding of the six products (Ize 2013).
    let bits = select(vec4u(0u), (kind >> vec4u(5u)) << bit, start <= end * 1.0000005);
    return bits.x | bits.y | bits.z | bits.w;
}

/// The nearest triangle before `reach`, or, with `any`, the first one found. Rays pass through the masked parts of
/// triangles if the scene has `holes`.
fn traverse(ray: Ray, reach: f32, any: bool, holes: bool) -> Hit {
    var hit = Hit(FAR, 0u);
    var end = reach;
    let tiny = abs(ray.direction) < vec3f(1e-20);
    let inverse = 1.0 / select(ray.direction, vec3f(1e-20), tiny);
    let backward = inverse < vec3f(0.0);
    let octant = select(4u, 0u, backward.x) | select(2u, 0u, backward.y) | select(1u, 0u, backward.z);
    // A group: index of the first child node; in bits 24 to 31 the children still to visit, in bits 0 to 7 the children
    // that are nodes.
    var stack: array<vec2u, MAX_DEPTH>;
    var top = 0u;
    var group = vec2u(0u, 0x80000000u);
    // First triangle of a node's leaves, and bits of those still to test.
    var pending = vec2u(0u);
    loop {
        // Visit nodes until there are triangles to test. Lanes of a wave then wait for each other here, not at every
        // step.
        loop {
            if pending.y != 0u {
                break;
            }
            if group.y < 0x1000000u {
                if top == 0u {
                    break;
                }
                top -= 1u;
                group = stack[top];
            }
            let bit = firstLeadingBit(group.y);
            group.y ^= 1u << bit;
            if group.y >= 0x1000000u {
                stack[top] = group;
                top += 1u;
            }
            let child = (bit - 24u) ^ octant;
            let node = (group.x + countOneBits(group.y & ((1u << child) - 1u) & 255u)) * 5u;
            let corner = textureLoad(nodes, texel_coordinates(node));
            let first = textureLoad(nodes, texel_coordinates(node + 1u));
            let x = textureLoad(nodes, texel_coordinates(node + 2u));
            let y = textureLoad(nodes, texel_coordinates(node + 3u));
            let z = textureLoad(nodes, texel_coordinates(node + 4u));
            let exponents = vec3u(corner.w, corner.w >> 8u, corner.w >> 16u) & vec3u(255u);
            let scale = bitcast<vec3f>(exponents << vec3u(23u)) * inverse;
            let base = (bitcast<vec3f>(corner.xyz) - ray.origin) * inverse;
            // Near and far planes of children 0 to 3, then of 4 to 7.
            let x_sides = select(x.xzyw, x.zxwy, backward.x);
            let y_sides = select(y.xzyw, y.zxwy, backward.y);
            let z_sides = select(z.xzyw, z.zxwy, backward.z);
            let near = vec3u(x_sides.x, y_sides.x, z_sides.x);
            let far = vec3u(x_sides.y, y_sides.y, z_sides.y);
            let near_2 = vec3u(x_sides.z, y_sides.z, z_sides.z);
            let far_2 = vec3u(x_sides.w, y_sides.w, z_sides.w);
            let hits = intersect_children(first.z, near, far, scale, base, octant, end)
                | intersect_children(first.w, near_2, far_2, scale, base, octant, end);
            group = vec2u(first.x, (hits & 0xff000000u) | (corner.w >> 24u));
            pending = vec2u(first.y, hits & 0xffffffu);
        }
        if pending.y == 0u {
            break;
        }
        // Alpha masks are tested outside the loop, because a wave that branches by masking would fetch masks for every
        // triangle.
        var doubtful = Crossing(FAR, vec2f(), vec2u());
        var slot = 0u;
        loop {
            let bit = firstTrailingBit(pending.y);
            pending.y ^= 1u << bit;
            slot = pending.x + bit;
            let crossing = cross_triangle(slot, ray);
            let inside = crossing.weights.x >= 0.0 && crossing.weights.y >= 0.0
                && crossing.weights.x + crossing.weights.y <= 1.0;
            if inside && crossing.distance > 0.0 && crossing.distance < end {
                if holes && crossing.mask.x != 0u {
                    doubtful = crossing;
                    break;
                }
                end = crossing.distance;
                hit = Hit(end, slot);
            }
            if pending.y == 0u {
                break;
            }
        }
        if holes && doubtful.mask.x != 0u && is_present(slot, doubtful) {
            end = doubtful.distance;
            hit = Hit(end, slot);
        }
        if any && hit.distance < FAR {
            break;
        }
    }
    return hit;
}
