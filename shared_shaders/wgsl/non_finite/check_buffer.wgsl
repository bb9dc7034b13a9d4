// Counts what should not be in a buffer of floats, as check_texture.wgsl does in a texture.
import package::non_finite::tally::{Tally, kinds, finite_magnitude};

@group(0) @binding(0) var<storage, read> values: array<u32>;
@group(0) @binding(1) var<storage, read_write> tally: Tally;

override LIMIT: f32;
// Invocations along x: a dispatch is two-dimensional, because a browser starts at most 65535 workgroups along one axis.
override ROW: u32;

@compute @workgroup_size(256)
fn non_finite(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if index >= arrayLength(&values) {
        return;
    }
    let bits = values[index];
    let found = kinds(bits, LIMIT);
    if any(found > vec4u(0u)) {
        atomicAdd(&tally.nan, found.x);
        atomicAdd(&tally.infinite, found.y);
        atomicAdd(&tally.negative, found.z);
        atomicAdd(&tally.clamped, found.w);
    }
    atomicMax(&tally.largest, finite_magnitude(bits));
}
