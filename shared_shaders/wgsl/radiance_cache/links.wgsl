// Links: what the rays of a record have hit. A record keeps the newest LINKS ones.

struct Link {
    // The hit, world space; the direction of a link to the sky.
    position: vec3f,
    // Its normal, octahedral.
    normal: u32,
    // Its albedo, three times 8 bits, and the kind of light: LINK_ constants.
    albedo: u32,
    // Slot of the record whose light the hit reflects; NO_SLOT if there is none.
    source: u32,
    // Radiance that leaves the hit after direct light.
    radiance: vec2u,
}

/// A ray of this frame, and then its link.
struct TracedRay {
    // Slot of the record.
    slot: u32,
    // Number of the ray among those of its record in this frame.
    index: u32,
    // Random word, by which one of the hits inside a cell is chosen.
    random: u32,
    unused: u32,
    link: Link,
}

@group(0) @binding(13) var<storage, read_write> links: array<Link>;
@group(0) @binding(14) var<storage, read_write> rays: array<TracedRay>;

/// Reflects lights.
const LINK_SURFACE: u32 = 0u;
/// Its radiance does not depend on lights: sky, emitters, receive-only surfaces.
const LINK_CONSTANT: u32 = 0x01000000u;
