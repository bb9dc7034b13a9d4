// Replaces the light of the records of this frame by their next light.
import package::radiance_cache::counters::{counters, stride_of};
import package::radiance_cache::totals::{layer_of, layers, next_layer_of, totals};

@compute @workgroup_size(64)
fn publish(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let due = atomicLoad(&counters.due);
    for (var i = id.x; i < due; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        for (var layer = 0u; layer < layers(); layer++) {
            totals[layer_of(layer) + slot] = totals[next_layer_of(layer) + slot];
        }
    }
}
