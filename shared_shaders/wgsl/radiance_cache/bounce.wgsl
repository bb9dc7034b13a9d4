// Further bounces: the mean over the links of a record of what their hits reflect. Each frame adds a bounce.
import package::common::math::LARGEST_RADIANCE;
import package::radiance_cache::cells::{NO_SLOT, LIFETIME, cells, records};
import package::radiance_cache::counters::stamp;
import package::radiance_cache::links::{albedo_of, links};

@group(0) @binding(2) var<storage, read> totals: array<vec4f>;

/// Links that a record keeps.
override LINKS: u32;

/// Age that a reference through a link has at least, frames. References that only come from each other thus get older
/// than LIFETIME.
const AGE_OF_LINKS: u32 = 8u;

@compute @workgroup_size(64)
fn bounce(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) || atomicLoad(&cells[slot].fingerprint) == 0u {
        return;
    }
    let seen = atomicLoad(&cells[slot].seen);
    if stamp() - seen + AGE_OF_LINKS >= LIFETIME {
        // The records that its links refer to are removed before this one. It may be seen again before it is removed.
        records[slot].links = 0u;
    }
    let count = min(records[slot].links, LINKS);
    if count == 0u {
        return;
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let link = links[slot * LINKS + i];
        let source = link.source;
        if source != NO_SLOT {
            sum += albedo_of(link.surface) * totals[source].rgb;
            if seen >= AGE_OF_LINKS {
                atomicMax(&cells[source].seen, seen - AGE_OF_LINKS);
            }
        }
    }
    records[slot].bounced = min(sum / f32(count), vec3f(LARGEST_RADIANCE));
}
