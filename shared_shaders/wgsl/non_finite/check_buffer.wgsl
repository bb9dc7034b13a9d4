// Counts invalid values in a buffer of floats, like check_texture.wgsl in a texture.
import package::non_finite::tally::{Tally, kinds, finite_magnitude};

@group(0) @binding(0) var<storage, read> values: array<u32>;
@group(0) @binding(1) var<storage, read_write> tally: Tally;

override LIMIT: f32;
// Invocations along x. The dispatch is two-dimensional, because WebGPU guarantees only 65535 workgroups along one axis.
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
