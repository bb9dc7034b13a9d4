// Lists the records that are due, and sums the weights by which they share the rays of a frame.
import package::radiance_cache::cells::{BUCKET, buckets, is_taken, slots};
import package::radiance_cache::counters::{counters, first_parent, stamp};
import package::radiance_cache::squares::FRAMES_OF_SQUARE;
import package::radiance_cache::weight::{is_due, is_new, weight_of};

@compute @workgroup_size(64)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= slots() || !is_taken(slot) || !is_due(slot) {
        return;
    }
    counters.lists[atomicAdd(&counters.due, 1u)] = slot;
    // After that many frames every pixel has been looked at.
    let parent = atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].parent);
    if parent > 0u && stamp() - parent < FRAMES_OF_SQUARE {
        counters.lists[first_parent() + atomicAdd(&counters.parents, 1u)] = slot;
    }
    let weight = weight_of(slot);
    if weight > 0u {
        atomicAdd(&counters.weights, weight);
    }
    if is_new(slot) {
        atomicAdd(&counters.new_records, 1u);
    }
}
