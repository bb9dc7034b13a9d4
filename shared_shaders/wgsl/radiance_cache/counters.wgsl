// Numbers of the whole cache, and lists of what a frame has to do.
//
// Invocations that have nothing to do cost as much as others on a software adapter. So a pass over a list has few
// invocations, and each takes every `stride`-th entry.

struct Counters {
    // Sum of the weights of all records that want rays.
    weights: atomic<u32>,
    // Records that the camera sees for the first time, or almost.
    new_records: atomic<u32>,
    // Rays of this frame.
    rays: atomic<u32>,
    // Hashes of the lights and of the poses of objects, and which of them have changed since the last frame.
    lights: u32,
    objects: u32,
    changed: u32,
    // Frames since the cache exists: see `stamp`.
    epoch: u32,
    // Lengths of the lists.
    due: atomic<u32>,
    parents: atomic<u32>,
    pixels: atomic<u32>,
    // Frames since the lights or the objects changed.
    settled: u32,
    // Number of slots of the table.
    slots: u32,
    // Slots of the records that are due | coarser records whose children were seen lately | pixels whose surface no coarse texel shows.
    lists: array<u32>,
}

@group(0) @binding(12) var<storage, read_write> counters: Counters;

/// Bits of `changed`.
const LIGHTS_CHANGED: u32 = 1u;
const OBJECTS_MOVED: u32 = 2u;

/// The number with which this frame marks what it refers to. Empty slots have 0.
fn stamp() -> u32 {
    return counters.epoch + 1u;
}

/// Number of invocations of a dispatch of workgroups of 64.
fn stride_of(workgroups: vec3u) -> u32 {
    return workgroups.x * 64u;
}

/// First entry of the list of coarser records.
fn first_parent() -> u32 {
    return counters.slots;
}

/// First entry of the list of pixels.
fn first_pixel() -> u32 {
    return 2u * counters.slots;
}

/// Length that the list of pixels may have. Further pixels keep the light of the nearest surfel.
fn most_pixels() -> u32 {
    return arrayLength(&counters.lists) - first_pixel();
}
