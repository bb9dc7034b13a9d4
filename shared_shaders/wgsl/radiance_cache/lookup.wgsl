// Finds records in passes that do not change the table.
import package::radiance_cache::cells::{BUCKET, NO_SLOT, Place, buckets_of, fingerprint_of, hash_of};

/// `Bucket` of radiance_cache/cells.wgsl, as vectors.
struct FrozenBucket {
    fingerprints: array<vec4u, 2>,
    cells: array<vec4u, 12>,
}

@group(0) @binding(10) var<storage, read> buckets: array<FrozenBucket>;

/// The slot of a fingerprint in a bucket; NO_SLOT if it is not there. All eight are compared at once, without a branch.
fn slot_in(bucket: u32, fingerprint: vec4u) -> u32 {
    let first = select(vec4u(NO_SLOT), vec4u(0u, 1u, 2u, 3u), buckets[bucket].fingerprints[0] == fingerprint);
    let second = select(vec4u(NO_SLOT), vec4u(4u, 5u, 6u, 7u), buckets[bucket].fingerprints[1] == fingerprint);
    let both = min(first, second);
    let i = min(min(both.x, both.y), min(both.z, both.w));
    return select(NO_SLOT, bucket * BUCKET + i, i < BUCKET);
}

/// The slot of a cell; NO_SLOT if it has none.
fn find(place: Place) -> u32 {
    let hash = hash_of(place);
    let both = buckets_of(hash, arrayLength(&buckets));
    let fingerprint = vec4u(fingerprint_of(hash));
    return min(slot_in(both.x, fingerprint), slot_in(both.y, fingerprint));
}
