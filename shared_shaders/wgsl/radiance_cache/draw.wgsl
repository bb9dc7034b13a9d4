// Draws the rays of this frame: each record gets its share of the budget, rounded at random.
import package::common::math::{random_words, unit_numbers};
import package::common::streams::CACHE_SHARE_STREAM;
import package::common::view::View;
import package::radiance_cache::cells::{BUCKET, buckets, hash_of, place_of_slot};
import package::radiance_cache::counters::{counters, stride_of};
import package::radiance_cache::links::rays;
import package::radiance_cache::weight::{FIRST_RAYS, is_new, is_settled, weight_of};
import package::radiance_cache::turn::INTERVAL;

struct Params {
    // Rays of a frame.
    budget: f32,
    // Further rays for new records.
    budget_of_new: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;

/// Rays that a record wants in each frame, for its weight. If all get these, the budget is not used up.
const RAYS_OF_WEIGHT: f32 = 0.5;
/// Most rays of a record in a frame.
const MOST: f32 = 64.0;

/// Rays of a record in this frame.
fn rays_of(slot: u32) -> u32 {
    let weight = weight_of(slot);
    if weight == 0u {
        return 0u;
    }
    let wanted = min(RAYS_OF_WEIGHT * f32(weight * select(1u, INTERVAL, is_settled(slot))), MOST);
    var share = min(params.budget * f32(weight) / f32(max(atomicLoad(&counters.weights), 1u)), wanted);
    if is_new(slot) {
        let each = params.budget_of_new / f32(max(atomicLoad(&counters.new_records), 1u));
        share = max(share, min(each, FIRST_RAYS));
    }
    // The random number belongs to the cell, so that it does not depend on the order in which slots were taken.
    let words = random_words(hash_of(place_of_slot(slot)).xy, view.frame, CACHE_SHARE_STREAM, view.seed);
    return u32(share + unit_numbers(words).x);
}

@compute @workgroup_size(64)
fn draw(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let due = atomicLoad(&counters.due);
    for (var i = id.x; i < due; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        let count = rays_of(slot);
        atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].rays, 0u);
        if count > 0u {
            let first = min(atomicAdd(&counters.rays, count), arrayLength(&rays));
            let end = min(first + count, arrayLength(&rays));
            atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].rays, first | ((end - first) << 24u));
            for (var ray = first; ray < end; ray++) {
                rays[ray].slot = slot;
                rays[ray].index = ray - first;
            }
        }
    }
}
