// variants: kept, linked
// Adds the rays of this frame to the records and finds the next light of each record: what the hits reflect of lamps, what
// does not depend on lamps, and further bounces, the mean over the links of what their hits reflect of the light of other
// records. With `kept`, links are kept; with `linked`, there are further bounces.
import package::common::math::LARGEST_RADIANCE;
import package::radiance_cache::cells::{BUCKET, buckets, records};
@if(linked) import package::radiance_cache::cells::{LIFETIME, NO_SLOT};
@if(linked) import package::radiance_cache::counters::stamp;
import package::radiance_cache::counters::{counters, stride_of};
@if(kept || linked) import package::radiance_cache::links::links;
@if(linked) import package::radiance_cache::links::{albedo_of, source_of};
@if(linked) import package::radiance_cache::turn::{INTERVAL, is_turn_of};
import package::radiance_cache::links::rays;
import package::radiance_cache::totals::{layer_of, next_layer_of, totals};

/// Links that a record keeps.
override LINKS: u32;
/// Number of bounces; 0 for all.
override BOUNCES: u32;
/// Rays whose mean a record keeps. More would follow changes of other records too slowly.
const MOST_SAMPLES: f32 = 1024.0;
/// Age that a reference through a link has at least, frames. References that only come from each other thus get older
/// than LIFETIME.
const AGE_OF_LINKS: u32 = 8u;

/// Adds the rays of this frame to the means of a record.
fn add_rays(slot: u32) {
    let words = atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].rays);
    let first = words & 0xffffffu;
    let count = words >> 24u;
    let before = records[slot].links;
    var reflected = vec3f(0.0);
    var own = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        reflected += rays[first + i].reflected;
        own += rays[first + i].own;
        @if(kept || linked) { links[slot * LINKS + (before + i) % LINKS] = rays[first + i].link; }
    }
    if count > 0u {
        let samples = records[slot].samples;
        let all = samples + f32(count);
        records[slot].reflected = (records[slot].reflected * samples + reflected) / all;
        records[slot].own = (records[slot].own * samples + own) / all;
        records[slot].samples = min(all, MOST_SAMPLES);
        records[slot].links = before + count;
    }
}

/// What the hits of the links reflect of a layer of the last frame. Each frame adds a bounce.
@if(linked)
fn bounced(slot: u32, count: u32, layer: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let link = links[slot * LINKS + i];
        let source = source_of(link);
        if source != NO_SLOT {
            sum += albedo_of(link.surface) * totals[layer_of(layer) + source].rgb;
        }
    }
    return min(sum / f32(max(count, 1u)), vec3f(LARGEST_RADIANCE));
}

/// Keeps the records that the links refer to.
@if(linked)
fn keep_sources(slot: u32, seen: u32, count: u32) {
    for (var i = 0u; i < count; i++) {
        let source = source_of(links[slot * LINKS + i]);
        if source != NO_SLOT {
            atomicMax(&buckets[source / BUCKET].cells[source % BUCKET].seen, max(seen, AGE_OF_LINKS) - AGE_OF_LINKS);
        }
    }
}

@compute @workgroup_size(64)
fn update(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let due = atomicLoad(&counters.due);
    for (var i = id.x; i < due; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        add_rays(slot);
        let first = records[slot].reflected + records[slot].own;
        let samples = records[slot].samples;
        @if(linked) {
            let seen = atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].seen);
            if stamp() - seen + AGE_OF_LINKS + INTERVAL >= LIFETIME {
                // The records that its links refer to are removed before this one. It may be seen again before it is removed.
                records[slot].links = 0u;
            }
            let count = min(records[slot].links, LINKS);
            // Once in INTERVAL frames, like the records that are settled.
            keep_sources(slot, seen, select(0u, count, is_turn_of(slot)));
            for (var layer = 0u; layer < max(BOUNCES, 1u); layer++) {
                var light = first;
                if count > 0u && (BOUNCES == 0u || layer > 0u) {
                    light += bounced(slot, count, max(layer, 1u) - 1u);
                }
                totals[next_layer_of(layer) + slot] = vec4f(light, samples);
            }
        }
        @if(!linked) { totals[next_layer_of(0u) + slot] = vec4f(first, samples); }
    }
}
