// Links: what the rays of a record have hit. A record keeps the newest LINKS ones.
import package::common::math::{octahedral_decode, octahedral_encode};
import package::radiance_cache::cells::{NO_SLOT, grid};

/// What a ray has hit, in 128 bits.
struct Link {
    // Position in the box of the scene, 3 x 21 bits | whether the surface is animated, 1 bit.
    position: vec2u,
    // Normal, octahedral, 2 x 8 bits | square root of the albedo, 3 x 5 bits; NO_SURFACE for the sky.
    surface: u32,
    // Slot of the record whose light the hit reflects, 20 bits, all of them set if there is none | light of lamps that the
    // hit reflects, 12 bits: see `pack_luminance`.
    source_and_light: u32,
}

/// A ray of this frame and what it found.
struct TracedRay {
    // Slot of the record.
    slot: u32,
    // Number of the ray among those of its record in this frame.
    index: u32,
    // Random word, by which one of the hits inside a cell is chosen.
    random: u32,
    unused: u32,
    // Light of lamps that the hit reflects.
    reflected: vec3f,
    unused_1: u32,
    // Light that does not depend on lamps: of the sky and of emitters.
    own: vec3f,
    unused_2: u32,
    link: Link,
}

@group(0) @binding(13) var<storage, read_write> links: array<Link>;
@group(0) @binding(14) var<storage, read_write> rays: array<TracedRay>;

/// `surface` of a link to the sky.
const NO_SURFACE: u32 = 0x80000000u;

/// Bit of the second word of a position for animated surfaces.
const MOVES: u32 = 0x80000000u;

/// Largest number of 20 bits.
const LARGEST_20: u32 = 0xfffffu;

/// A radiance in 12 bits, by its logarithm: 0, or 2^-40 to 2^45 in steps of 1.5 %.
fn pack_luminance(radiance: vec3f) -> u32 {
    let sum = radiance.r + radiance.g + radiance.b;
    return select(0u, u32(clamp((log2(max(sum, 1e-30)) + 40.0) * 48.0, 1.0, 4095.0)), sum > 0.0);
}

fn unpack_luminance(word: u32) -> f32 {
    return select(0.0, exp2(f32(word) / 48.0 - 40.0), word > 0u);
}

fn pack_source(slot: u32, luminance: u32) -> u32 {
    return min(slot, LARGEST_20) | (luminance << 20u);
}

/// Slot of the record whose light the hit reflects; NO_SLOT if there is none.
fn source_of(link: Link) -> u32 {
    let slot = link.source_and_light & LARGEST_20;
    return select(slot, NO_SLOT, slot == LARGEST_20);
}

/// Largest number of 21 bits.
const LARGEST_21: f32 = 2097151.0;

fn pack_position(position: vec3f) -> vec2u {
    let part = vec3u(clamp((position - grid.low) / grid.size, vec3f(0.0), vec3f(1.0)) * LARGEST_21 + 0.5);
    return vec2u(part.x | (part.y << 21u), (part.y >> 11u) | (part.z << 10u));
}

fn unpack_position(words: vec2u) -> vec3f {
    let part = vec3u(words.x & 0x1fffffu, (words.x >> 21u) | ((words.y & 0x3ffu) << 11u), (words.y >> 10u) & 0x1fffffu);
    return grid.low + vec3f(part) * (grid.size / LARGEST_21);
}

/// `random` are three numbers, 0..1, that round the albedo, so that its mean over links is right.
fn pack_surface(normal: vec3f, albedo: vec3f, random: vec3f) -> u32 {
    let n = vec2u((octahedral_encode(normal) * 0.5 + 0.5) * 255.0 + 0.5);
    let root = vec3u(sqrt(saturate(albedo)) * 31.0 + random * 0.9999);
    return n.x | (n.y << 8u) | (root.x << 16u) | (root.y << 21u) | (root.z << 26u);
}

fn normal_of(surface: u32) -> vec3f {
    return octahedral_decode(vec2f(vec2u(surface, surface >> 8u) & vec2u(255u)) * (2.0 / 255.0) - 1.0);
}

fn albedo_of(surface: u32) -> vec3f {
    let root = vec3f(vec3u(surface >> 16u, surface >> 21u, surface >> 26u) & vec3u(31u)) / 31.0;
    return root * root;
}
