// variants: lit, environment, emitting
// Traces the rays of this frame and finds the light at their ends.
import package::common::math::{LARGEST_RADIANCE, PI, octahedral_decode, random3, random_words, unit_numbers};
import package::common::hemisphere::cosine_direction;
import package::common::streams::{CACHE_ALBEDO_STREAM, CACHE_DIRECTION_STREAM, CACHE_HIT_STREAM};
@if(environment) import package::common::streams::CACHE_SKY_STREAM;
@if(emitting) import package::common::streams::CACHE_EMITTER_STREAM;
import package::common::view::View;
@if(environment) import package::truth::sky::{draw_sky, sky_density, sky_radiance};
@if(lit) import package::common::scene::Light;
@if(lit) import package::radiance_cache::lamps::reflected;
@if(emitting) import package::truth::emitters::{Emitters, all_emitters, draw_emitter, emitter_density};
@if(emitting) import package::truth::surface::offset_length;
import package::truth::surface::{surface_at, ray_from};
import package::truth::traversal::{FAR, Ray, traverse};
import package::radiance_cache::cells::{
    BUCKET, NO_SLOT, buckets, records, find_or_insert, hash_of, level_of_hits_at, place_of_hit, place_of_slot,
};
import package::radiance_cache::counters::{counters, stamp, stride_of};
import package::radiance_cache::pixels::{PixelSurface, surface_of_pixel};
import package::radiance_cache::squares::{pixel_of_square, squares_across};
import package::radiance_cache::links::{
    MOVES, NO_SURFACE, Link, pack_luminance, pack_position, pack_source, pack_surface, rays,
};

struct Params {
    // Half the diagonal of the scene's bounding box.
    scene_radius: f32,
}

// Bindings 1 to 3 belong to truth::traversal, 5 to truth::surface, 8 to truth::sky, 9 to 14 to modules of this folder, 20 to 22
// to common.
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(4) var<uniform> params: Params;
@group(0) @binding(6) var depth: texture_2d<f32>;
@group(0) @binding(17) var normal: texture_2d<f32>;
@if(lit) @group(0) @binding(7) var<storage, read> lights: array<Light>;

override LIGHTS: u32;
/// Whether any triangle is alpha-masked.
override HOLES: bool;
/// Whether the sky is uneven, so that directions are drawn from it as well.
override DRAW_SKY: bool;
/// Whether further bounces are taken.
override BOUNCES: bool;

/// Where the rays of a record start in this frame: at the pixel that was chosen, otherwise at its own position.
fn origin_of(slot: u32) -> PixelSurface {
    let square = atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].pixel) & 0xffffffu;
    if square == 0u {
        return PixelSurface(records[slot].position, octahedral_decode(unpack2x16snorm(records[slot].normal)));
    }
    let size = textureDimensions(depth);
    let across = squares_across(size.x);
    let pixel = pixel_of_square(vec2u((square - 1u) % across, (square - 1u) / across), size, view);
    return surface_of_pixel(pixel, textureLoad(depth, pixel, 0).x, textureLoad(normal, pixel, 0).xyz, view);
}

/// Light of a direction that is drawn from the sky by its power, weighted against rays drawn from the cosine by the balance
/// heuristic (Veach 1997, Section 9.2.2).
@if(environment)
fn sky_by_power(origin: PixelSurface, random: vec2u) -> vec3f {
    let sky = draw_sky(unit_numbers(vec3u(random, 0u)).xy);
    let density = dot(origin.normal, sky.direction) / PI;
    if density <= 0.0 || all(sky.radiance <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    let ray = ray_from(origin.position, origin.normal, sky.direction, params.scene_radius);
    if traverse(ray, FAR, true, HOLES).distance < FAR {
        return vec3f(0.0);
    }
    return min(sky.radiance * (density / (density + sky.density)), vec3f(LARGEST_RADIANCE));
}

/// Light of a point that is drawn from the emitters by its power, weighted in the same way.
@if(emitting)
fn emitter_by_power(emitters_of_scene: Emitters, origin: PixelSurface, random: vec3u) -> vec3f {
    let point = draw_emitter(emitters_of_scene, origin.position, random.x, unit_numbers(random).yz);
    let distance = length(point.along);
    let density = dot(origin.normal, point.along) / (PI * max(distance, 1e-30));
    if emitters_of_scene.count == 0u || density <= 0.0 || all(point.emission <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    // From offset point to offset point: the unnormalized direction ends at a distance of 1.
    let start = ray_from(origin.position, origin.normal, point.along, params.scene_radius);
    let end = origin.position + point.along + point.normal * offset_length(origin.position + point.along, params.scene_radius);
    if traverse(Ray(start.origin, end - start.origin), 1.0, true, HOLES).distance < FAR {
        return vec3f(0.0);
    }
    return min(point.emission * (density / (density + point.density)), vec3f(LARGEST_RADIANCE));
}

/// Two numbers of sample `index` of a cell: the R2 lattice (Roberts 2018) from a random start.
fn sample_at(start: vec2u, index: u32) -> vec2f {
    return unit_numbers(vec3u(start + index * vec2u(3242174889u, 2447445414u), 0u)).xy;
}

fn trace_ray(number: u32) {
    let slot = rays[number].slot;
    let index = rays[number].index + records[slot].links;
    // Random numbers belong to the cell, so that they do not depend on the order in which slots were taken.
    let cell = hash_of(place_of_slot(slot)).xy;
    let start = random_words(cell, 0u, CACHE_DIRECTION_STREAM, view.seed).xy;
    let random = max(random_words(cell, index, CACHE_HIT_STREAM, view.seed).x, 1u);
    let origin = origin_of(slot);
    let direction = cosine_direction(origin.normal, sample_at(start, index));
    let ray = ray_from(origin.position, origin.normal, direction, params.scene_radius);
    let hit = traverse(ray, FAR, false, HOLES);
    var link = Link(vec2u(0u), NO_SURFACE, 0u);
    var source = NO_SLOT;
    // Light of lamps, and light that does not depend on them.
    var reflected_light = vec3f(0.0);
    var own_light = vec3f(0.0);
    @if(environment) {
        if DRAW_SKY {
            own_light = sky_by_power(origin, random_words(cell, index, CACHE_SKY_STREAM, view.seed).xy);
        }
    }
    @if(emitting) let emitters_of_scene = all_emitters();
    @if(emitting) {
        own_light += emitter_by_power(emitters_of_scene, origin, random_words(cell, index, CACHE_EMITTER_STREAM, view.seed));
    }
    if hit.distance == FAR {
        @if(environment) {
            var weight = 1.0;
            if DRAW_SKY {
                let density = dot(origin.normal, direction) / PI;
                weight = density / max(density + sky_density(direction), 1e-30);
            }
            own_light += sky_radiance(direction) * weight;
        }
    } else {
        let surface = surface_at(hit, ray);
        if surface.sends {
            var emission = surface.emission;
            @if(emitting) {
                if emitters_of_scene.count > 0u && any(emission > vec3f(0.0)) {
                    let cosine = dot(surface.geometric_normal, direction);
                    let density = dot(origin.normal, direction) / PI;
                    let by_power = emitter_density(emitters_of_scene, emission, direction * hit.distance, cosine);
                    emission *= density / max(density + by_power, 1e-30);
                }
            }
            own_light += emission;
            link.position = pack_position(surface.position) | vec2u(0u, select(0u, MOVES, surface.moves));
            link.surface = pack_surface(
                surface.geometric_normal,
                surface.albedo,
                random3(cell, index, CACHE_ALBEDO_STREAM, view.seed),
            );
            @if(lit) {
                var sum = vec3f(0.0);
                for (var i = 0u; i < LIGHTS; i++) {
                    sum += reflected(lights[i], surface.position, surface.normal, surface.geometric_normal);
                }
                reflected_light = min(surface.albedo / PI * sum, vec3f(LARGEST_RADIANCE));
            }
            if BOUNCES {
                let distance = length(surface.position - view.view_to_world[3].xyz);
                let level = level_of_hits_at(distance, view);
                source = find_or_insert(place_of_hit(surface.position, surface.normal, level));
                if source != NO_SLOT {
                    atomicMax(&buckets[source / BUCKET].cells[source % BUCKET].hit, random);
                    atomicMax(&buckets[source / BUCKET].cells[source % BUCKET].seen, stamp());
                }
            }
        }
    }
    link.source_and_light = pack_source(source, pack_luminance(reflected_light));
    rays[number].random = random;
    rays[number].reflected = reflected_light;
    rays[number].own = min(own_light, vec3f(LARGEST_RADIANCE));
    rays[number].link = link;
}

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let count = min(atomicLoad(&counters.rays), arrayLength(&rays));
    for (var number = id.x; number < count; number += stride_of(workgroups)) {
        trace_ray(number);
    }
}
