// Lights the links of all records again after the lights have changed. Nothing is traced.
import package::common::math::PI;
import package::common::scene::Light;
import package::radiance_cache::cells::records;
import package::radiance_cache::counters::{counters, stride_of};
import package::radiance_cache::lamps::reflected;
import package::radiance_cache::links::{NO_SURFACE, albedo_of, links, normal_of, unpack_position};

@group(0) @binding(7) var<storage, read> lights: array<Light>;

/// Links that a record keeps.
override LINKS: u32;
override LIGHTS: u32;

/// The mean light of the links, lit by the lights as they are now.
fn relit(slot: u32, count: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let link = links[slot * LINKS + i];
        if link.surface == NO_SURFACE {
            continue;
        }
        let position = unpack_position(link.position);
        let normal = normal_of(link.surface);
        var irradiance = vec3f(0.0);
        for (var light = 0u; light < LIGHTS; light++) {
            irradiance += reflected(lights[light], position, normal, normal);
        }
        sum += albedo_of(link.surface) / PI * irradiance;
    }
    return sum / f32(max(count, 1u));
}

@compute @workgroup_size(64)
fn relight(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    // After a change of the lights, all records are due.
    let count = select(0u, atomicLoad(&counters.due), counters.relight != 0u);
    for (var i = id.x; i < count; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        if records[slot].samples > 0.0 {
            let kept = min(records[slot].links, LINKS);
            records[slot].reflected = relit(slot, kept);
            records[slot].samples = f32(kept);
        }
    }
}
