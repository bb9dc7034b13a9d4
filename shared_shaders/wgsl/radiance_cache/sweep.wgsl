// variants: lit, animated
// Removes the records that nothing has referred to for a while, all of them after a cut, and prepares the others for the
// next frame.
import package::common::math::pcg3d;
import package::temporal::previous_view::PreviousView;
import package::radiance_cache::cells::{BUCKET, LIFETIME, buckets, slots};
import package::radiance_cache::counters::{LIGHTS_CHANGED, OBJECTS_MOVED, counters, stamp};
import package::radiance_cache::totals::totals;

@group(0) @binding(1) var<uniform> previous: PreviousView;
@group(0) @binding(0) var<storage, read_write> mixed: array<vec4f>;
// `array<Light>` and `array<Object>` as words, for their hash.
@if(lit) @group(0) @binding(2) var<storage, read> lights: array<vec4u>;
@if(animated) @group(0) @binding(3) var<storage, read> objects: array<vec4u>;

@compute @workgroup_size(64)
fn sweep(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot == 0u {
        atomicStore(&counters.weights, 0u);
        atomicStore(&counters.new_records, 0u);
        atomicStore(&counters.rays, 0u);
        atomicStore(&counters.due, 0u);
        atomicStore(&counters.parents, 0u);
        atomicStore(&counters.pixels, 0u);
        var hash = vec3u(1u);
        var hash_of_objects = vec3u(1u);
        @if(lit) {
            for (var i = 0u; i < arrayLength(&lights); i++) {
                hash = pcg3d(hash ^ lights[i].xyz) ^ vec3u(lights[i].w);
            }
        }
        @if(animated) {
            // An object is two matrices. The first one is its pose.
            for (var i = 0u; i < arrayLength(&objects); i++) {
                if i % 8u < 4u {
                    hash_of_objects = pcg3d(hash_of_objects ^ objects[i].xyz) ^ vec3u(objects[i].w);
                }
            }
        }
        counters.changed = select(0u, LIGHTS_CHANGED, counters.lights != hash.x && previous.valid != 0u)
            | select(0u, OBJECTS_MOVED, counters.objects != hash_of_objects.x && previous.valid != 0u);
        counters.lights = hash.x;
        counters.objects = hash_of_objects.x;
        counters.slots = slots();
        counters.settled = select(min(counters.settled + 1u, 0xffffu), 0u, counters.changed != 0u);
    }
    if slot >= slots() {
        return;
    }
    atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].pixel, 0u);
    atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].hit, 0u);
    let age = stamp() - atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].seen);
    if previous.valid == 0u || age > LIFETIME {
        atomicStore(&buckets[slot / BUCKET].fingerprints[slot % BUCKET], 0u);
        atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].seen, 0u);
        atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].parent, 0u);
        atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].mark, 0u);
        for (var entry = slot; entry < arrayLength(&totals); entry += slots()) {
            totals[entry] = vec4f(0.0);
        }
        mixed[slot] = vec4f(0.0);
    }
}
