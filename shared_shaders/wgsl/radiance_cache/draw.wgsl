// Draws the rays of this frame: each record gets its share of the budget, rounded at random.
import package::common::math::random_words;
import package::common::streams::CACHE_SHARE_STREAM;
import package::common::view::View;
import package::radiance_cache::cells::{cells, hash_of, place_of_slot, records};
import package::radiance_cache::counters::counters;
import package::radiance_cache::links::rays;
import package::radiance_cache::weight::{FIRST_RAYS, is_new, weight_of};

struct Params {
    // Rays of a frame.
    budget: f32,
    // Further rays for new records.
    budget_of_new: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;

/// Most rays of a record in a frame.
const MOST: f32 = 64.0;

@compute @workgroup_size(64)
fn draw(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) {
        return;
    }
    records[slot].rays = 0u;
    let weight = weight_of(slot);
    if weight == 0u {
        return;
    }
    var share = min(params.budget * f32(weight) / f32(max(atomicLoad(&counters.weights), 1u)), MOST);
    if is_new(slot) {
        let each = params.budget_of_new / f32(max(atomicLoad(&counters.new_records), 1u));
        share = max(share, min(each, FIRST_RAYS));
    }
    // The random number belongs to the cell, so that it does not depend on the order in which slots were taken.
    let words = random_words(hash_of(place_of_slot(slot)).xy, view.frame, CACHE_SHARE_STREAM, view.seed);
    let count = u32(share + f32(words.x >> 8u) * 5.9604644775390625e-8);
    if count == 0u {
        return;
    }
    let first = atomicAdd(&counters.rays, count);
    let end = min(first + count, arrayLength(&rays));
    if first >= end {
        return;
    }
    records[slot].rays = first | ((end - first) << 24u);
    for (var ray = first; ray < end; ray++) {
        rays[ray].slot = slot;
        rays[ray].index = ray - first;
    }
}
