// Mixes the light of each record with that of the coarser ones that contain it.
import package::radiance_cache::cells::{COARSER_LEVELS, NO_SLOT, grid, parent_of, place_of_slot};
import package::radiance_cache::counters::{counters, stride_of};
import package::radiance_cache::lookup::find;
import package::radiance_cache::totals::{shown, totals};

// Mixed light of each record; w is 0 without any.
@group(0) @binding(0) var<storage, read_write> mixed: array<vec4f>;

@compute @workgroup_size(64)
fn mix_levels(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    if id.x == 0u {
        // No pass after this one marks anything.
        counters.epoch += 1u;
    }
    let due = atomicLoad(&counters.due);
    for (var i = id.x; i < due; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        // From the finest level to the coarsest: what is left of the weight goes to the next one.
        var light = vec3f(0.0);
        var left = 1.0;
        var last = vec3f(0.0);
        var is_known = false;
        var found = totals[shown() + slot];
        var place = place_of_slot(slot);
        for (var level = 0u; level <= COARSER_LEVELS; level++) {
            if found.w > 0.0 {
                let share = found.w / (found.w + grid.trusted);
                light += left * share * found.rgb;
                left *= 1.0 - share;
                last = found.rgb;
                is_known = true;
            }
            place = parent_of(place);
            found = vec4f(0.0);
            if level < COARSER_LEVELS {
                let parent = find(place);
                if parent != NO_SLOT {
                    found = totals[shown() + parent];
                }
            }
        }
        // The coarsest one takes the rest.
        mixed[slot] = vec4f(light + left * last, select(0.0, 1.0, is_known));
    }
}
