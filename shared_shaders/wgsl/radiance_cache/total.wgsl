// The light of each record with all bounces.
import package::radiance_cache::cells::{cells, light_of_record, records};

@group(0) @binding(2) var<storage, read_write> totals: array<vec4f>;

@compute @workgroup_size(64)
fn total(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) {
        return;
    }
    var sum = vec4f(0.0);
    if atomicLoad(&cells[slot].fingerprint) != 0u && records[slot].samples > 0.0 {
        sum = vec4f(light_of_record(slot), records[slot].samples);
    }
    totals[slot] = sum;
}
