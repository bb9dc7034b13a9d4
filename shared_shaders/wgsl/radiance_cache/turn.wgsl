// What a record does once in a few frames.
import package::radiance_cache::cells::{BUCKET, buckets};
import package::radiance_cache::counters::stamp;

/// A record that is settled is due once in so many frames.
const INTERVAL: u32 = 4u;

/// Whether it is the turn of a record, which does not depend on the order in which slots were taken.
fn is_turn_of(slot: u32) -> bool {
    return (atomicLoad(&buckets[slot / BUCKET].fingerprints[slot % BUCKET]) + stamp()) % INTERVAL == 0u;
}
