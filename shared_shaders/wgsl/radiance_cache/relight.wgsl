// variants: lit, animated
// Lights the links of all records again after lights or objects have changed. Nothing is traced. Links to animated surfaces,
// and those that pass an object, are dropped: new rays replace them.
@if(lit) import package::common::math::{LARGEST_RADIANCE, PI};
@if(lit) import package::common::scene::Light;
@if(animated) import package::common::scene::Object;
@if(lit) import package::radiance_cache::lamps::reflected;
import package::radiance_cache::cells::records;
@if(animated) import package::radiance_cache::cells::{centre_of, place_of_slot};
@if(animated) import package::radiance_cache::counters::OBJECTS_MOVED;
import package::radiance_cache::counters::{LIGHTS_CHANGED, counters, stride_of};
@if(animated) import package::radiance_cache::links::MOVES;
import package::radiance_cache::links::{
    Link, NO_SURFACE, albedo_of, links, normal_of, pack_luminance, pack_source, source_of, unpack_luminance, unpack_position,
};

@if(lit) @group(0) @binding(7) var<storage, read> lights: array<Light>;
// The objects, and the boxes of all but the first one at rest.
@if(animated) @group(0) @binding(5) var<storage, read> objects: array<Object>;
@if(animated) @group(0) @binding(6) var<storage, read> boxes: array<ObjectBox>;

/// Box of an object at rest, world space.
struct ObjectBox {
    low: vec3f,
    high: vec3f,
}

/// Links that a record keeps.
override LINKS: u32;
override LIGHTS: u32;
/// Rays that a record counts for at most while objects move: emission and the sky are in no link, so they have to be found
/// again.
@if(animated)
override RAYS_IN_MOTION: f32;

/// A point of the world in this frame, in the world at rest of an object.
@if(animated)
fn at_rest(object: Object, position: vec3f) -> vec3f {
    let x = object.to_world[0].xyz;
    let y = object.to_world[1].xyz;
    let z = object.to_world[2].xyz;
    let offset = position - object.to_world[3].xyz;
    let volume = dot(x, cross(y, z));
    return vec3f(dot(offset, cross(y, z)), dot(offset, cross(z, x)), dot(offset, cross(x, y))) / select(1e-30, volume, volume != 0.0);
}

/// Whether the straight line between two points passes through the box of an object.
@if(animated)
fn passes_object(start: vec3f, end: vec3f) -> bool {
    for (var i = 1u; i < arrayLength(&objects); i++) {
        let origin = at_rest(objects[i], start);
        let along = at_rest(objects[i], end) - origin;
        let inverse = 1.0 / select(along, vec3f(1e-30), abs(along) < vec3f(1e-30));
        let a = (boxes[i - 1u].low - origin) * inverse;
        let b = (boxes[i - 1u].high - origin) * inverse;
        let near = min(a, b);
        let far = max(a, b);
        if max(max(near.x, near.y), max(near.z, 0.0)) <= min(min(far.x, far.y), min(far.z, 1.0)) {
            return true;
        }
    }
    return false;
}

/// What remains of the links of a record.
struct Remaining {
    count: u32,
    // Light of lamps that the hits reflect now: the sum.
    light: vec3f,
    // Sums of r + g + b of it: before, now, and of the smaller and the larger of both.
    before: f32,
    now: f32,
    smaller: f32,
    larger: f32,
}

/// Light of lamps that the hit of a link reflects.
@if(lit)
fn light_at(link: Link) -> vec3f {
    var irradiance = vec3f(0.0);
    if link.surface != NO_SURFACE {
        let position = unpack_position(link.position);
        let normal = normal_of(link.surface);
        for (var i = 0u; i < LIGHTS; i++) {
            irradiance += reflected(lights[i], position, normal, normal);
        }
    }
    return min(albedo_of(link.surface) / PI * irradiance, vec3f(LARGEST_RADIANCE));
}

/// Lights the links of a record again, and drops those that are no longer true.
fn relit(slot: u32, count: u32) -> Remaining {
    var remaining = Remaining();
    for (var i = 0u; i < count; i++) {
        var link = links[slot * LINKS + i];
        @if(animated) {
            if (counters.changed & OBJECTS_MOVED) != 0u && link.surface != NO_SURFACE {
                let is_animated = (link.position.y & MOVES) != 0u;
                if is_animated || passes_object(centre_of(place_of_slot(slot)), unpack_position(link.position)) {
                    continue;
                }
            }
        }
        @if(lit) {
            let light = light_at(link);
            let word = pack_luminance(light);
            let before = unpack_luminance(link.source_and_light >> 20u);
            let now = unpack_luminance(word);
            remaining.light += light;
            remaining.before += before;
            remaining.now += now;
            remaining.smaller += min(before, now);
            remaining.larger += max(before, now);
            link.source_and_light = pack_source(source_of(link), word);
        }
        links[slot * LINKS + remaining.count] = link;
        remaining.count += 1u;
    }
    return remaining;
}

/// The mean light of lamps of a record after a change, and the rays that it counts for.
fn mean_after(slot: u32, remaining: Remaining) -> vec4f {
    let before = records[slot].reflected;
    let samples = records[slot].samples;
    let count = f32(max(remaining.count, 1u));
    if remaining.larger == 0.0 {
        // No link says anything about the light of this record.
        return vec4f(before, select(samples, min(samples, count), (counters.changed & LIGHTS_CHANGED) != 0u));
    }
    let mean = remaining.light / count;
    // Where little has changed, the mean over all rays so far, in proportion, has less noise than that over the links.
    var scaled = before * (remaining.now / max(remaining.before, 1e-30));
    if (counters.changed & LIGHTS_CHANGED) != 0u {
        // Light may have another colour now.
        scaled = mean * (dot(scaled, vec3f(1.0)) / max(dot(mean, vec3f(1.0)), 1e-30));
    }
    let similarity = remaining.smaller / remaining.larger;
    return vec4f(mix(mean, scaled, similarity), mix(min(samples, count), samples, similarity));
}

@compute @workgroup_size(64)
fn relight(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    // After a change, all records are due.
    let due = select(0u, atomicLoad(&counters.due), counters.changed != 0u);
    for (var i = id.x; i < due; i += stride_of(workgroups)) {
        let slot = counters.lists[i];
        if records[slot].samples > 0.0 {
            let count = min(records[slot].links, LINKS);
            let remaining = relit(slot, count);
            var mean = vec4f(records[slot].reflected, records[slot].samples);
            @if(lit) { mean = mean_after(slot, remaining); }
            @if(animated) {
                if (counters.changed & OBJECTS_MOVED) != 0u {
                    mean.w = min(mean.w, RAYS_IN_MOTION);
                }
                if remaining.count < count {
                    records[slot].links = remaining.count;
                    mean.w = min(mean.w, f32(remaining.count));
                }
            }
            records[slot].reflected = mean.rgb;
            records[slot].samples = mean.w;
        }
    }
}
