// Sums the weights of all records, which share the rays of a frame.
import package::radiance_cache::cells::cells;
import package::radiance_cache::counters::counters;
import package::radiance_cache::weight::{is_new, weight_of};

@compute @workgroup_size(64)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) {
        return;
    }
    let weight = weight_of(slot);
    if weight > 0u {
        atomicAdd(&counters.weights, weight);
    }
    if is_new(slot) {
        atomicAdd(&counters.new_records, 1u);
    }
}
