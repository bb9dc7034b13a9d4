// Sums the weights of all records, which share the rays of a frame.
import package::radiance_cache::cells::{cells, records};
import package::radiance_cache::counters::counters;
import package::radiance_cache::weight::{is_new, weight_of};

@group(0) @binding(2) var<storage, read> totals: array<vec4f>;

@compute @workgroup_size(64)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) || atomicLoad(&cells[slot].fingerprint) == 0u {
        return;
    }
    let weight = weight_of(atomicLoad(&cells[slot].pixel) != 0u, records[slot].samples, totals[slot].w);
    if weight > 0u {
        atomicAdd(&counters.weights, weight);
    }
    if is_new(atomicLoad(&cells[slot].pixel) != 0u, records[slot].samples) {
        atomicAdd(&counters.new_records, 1u);
    }
}
