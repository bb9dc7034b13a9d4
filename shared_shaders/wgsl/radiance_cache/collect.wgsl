// Coarse records collect the light of their children: the mean over all rays. One run serves the even or the odd levels.
import package::radiance_cache::counters::stamp;
import package::radiance_cache::cells::{NO_SLOT, Place, cells, find, level_of, light_of_record, place_of_slot, records};

struct Params {
    // 0 for even levels, 1 for odd ones.
    parity: u32,
}

@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<storage, read_write> totals: array<vec4f>;

@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) || atomicLoad(&cells[slot].parent) != stamp() {
        return;
    }
    let place = place_of_slot(slot);
    if (u32(level_of(place.level_and_bin)) & 1u) != params.parity {
        return;
    }
    let samples = records[slot].samples;
    var sum = vec4f(light_of_record(slot) * samples, samples);
    for (var i = 0u; i < 8u; i++) {
        let child = find(Place(
            place.coordinates * 2 + vec3i(vec3u(i, i >> 1u, i >> 2u) & vec3u(1u)),
            place.level_and_bin - 256u,
        ));
        if child != NO_SLOT {
            let light = totals[child];
            sum += vec4f(light.rgb * light.w, light.w);
        }
    }
    totals[slot] = vec4f(sum.rgb / max(sum.w, 1e-6), sum.w);
}
