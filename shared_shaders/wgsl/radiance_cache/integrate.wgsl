// variants: lit, kept
// Adds the rays of this frame to the records. With `kept` or `lit`, their links are kept, and with `lit` they are lit again where
// lights have changed.
import package::common::math::PI;
@if(lit) import package::common::scene::Light;
@if(lit) import package::radiance_cache::relight::reflected;
import package::radiance_cache::cells::{cells, records};
import package::radiance_cache::counters::counters;
@if(lit) import package::radiance_cache::links::{NO_SURFACE, albedo_of, normal_of, unpack_position};
@if(kept || lit) import package::radiance_cache::links::links;
import package::radiance_cache::links::rays;

@if(lit) @group(0) @binding(7) var<storage, read> lights: array<Light>;

/// Links that a record keeps.
override LINKS: u32;
override LIGHTS: u32;
/// Rays whose mean a record keeps. More would follow changes of other records too slowly.
const MOST_SAMPLES: f32 = 1024.0;

/// The mean light of the links, lit by the lights as they are now.
@if(lit)
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
fn integrate(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= arrayLength(&cells) || atomicLoad(&cells[slot].fingerprint) == 0u {
        return;
    }
    var reflected_light = records[slot].reflected;
    var samples = records[slot].samples;
    @if(lit) {
        if counters.relight != 0u && samples > 0.0 {
            let kept = min(records[slot].links, LINKS);
            reflected_light = relit(slot, kept);
            samples = f32(kept);
        }
    }
    let first = records[slot].rays & 0xffffffu;
    let count = records[slot].rays >> 24u;
    var sum = vec3f(0.0);
    var own = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        sum += rays[first + i].reflected;
        own += rays[first + i].own;
        @if(kept || lit) { links[slot * LINKS + (records[slot].links + i) % LINKS] = rays[first + i].link; }
    }
    if count > 0u {
        reflected_light = (reflected_light * samples + sum) / (samples + f32(count));
        records[slot].own = (records[slot].own * samples + own) / (samples + f32(count));
        samples = min(samples + f32(count), MOST_SAMPLES);
        records[slot].links += count;
    }
    records[slot].reflected = reflected_light;
    records[slot].samples = samples;
}
