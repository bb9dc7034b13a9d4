// Numbers of the whole cache.

struct Counters {
    // Sum of the weights of all records that want rays.
    weights: atomic<u32>,
    // Records that the camera sees for the first time, or almost.
    new_records: atomic<u32>,
    // Rays of this frame.
    rays: atomic<u32>,
    // Hash of the lights, and whether it has changed since the last frame.
    lights: u32,
    relight: u32,
    // Frames since the cache exists: see `stamp`.
    epoch: u32,
    unused_0: u32,
    unused_1: u32,
}

@group(0) @binding(12) var<storage, read_write> counters: Counters;

/// The number with which this frame marks what it refers to. Empty slots have 0.
fn stamp() -> u32 {
    return counters.epoch + 1u;
}
