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
    // Number of this frame since the cache exists. It stamps what is seen.
    epoch: u32,
    unused_0: u32,
    unused_1: u32,
}

@group(0) @binding(12) var<storage, read_write> counters: Counters;
