// Coarse records collect the light of their children: the mean over all rays. One run serves the even or the odd levels.
import package::radiance_cache::counters::{counters, first_parent, stride_of};
import package::radiance_cache::cells::{NO_SLOT, Place, level_of, place_of_slot};
import package::radiance_cache::lookup::find;
import package::radiance_cache::totals::{shown, totals};

struct Params {
    // 0 for even levels, 1 for odd ones.
    parity: u32,
}

@group(0) @binding(1) var<uniform> params: Params;

/// Light of a record and of its children; w is the number of all their rays.
fn with_children(slot: u32, place: Place) -> vec4f {
    let own = totals[shown() + slot];
    var sum = vec4f(own.rgb * own.w, own.w);
    for (var i = 0u; i < 8u; i++) {
        let child = find(Place(
            place.coordinates * 2 + vec3i(vec3u(i, i >> 1u, i >> 2u) & vec3u(1u)),
            place.level_and_bin - 256u,
        ));
        if child != NO_SLOT {
            let light = totals[shown() + child];
            sum += vec4f(light.rgb * light.w, light.w);
        }
    }
    return vec4f(sum.rgb / max(sum.w, 1e-6), sum.w);
}

@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let count = atomicLoad(&counters.parents);
    for (var i = id.x; i < count; i += stride_of(workgroups)) {
        let slot = counters.lists[first_parent() + i];
        let place = place_of_slot(slot);
        if (u32(level_of(place.level_and_bin)) & 1u) == params.parity {
            totals[shown() + slot] = with_children(slot, place);
        }
    }
}
