// Sources of light with an area: emitting triangles and the sky. Points on them are drawn by their power.
import package::common::math::unit_numbers;
import package::truth::emitters::{Emitters, draw_emitter};
import package::truth::sky::draw_sky;
import package::truth::params::params;

/// A point on a source that was drawn for a receiver.
struct Source {
    // From the receiver to the point for an emitter, not of unit length; a unit vector for the sky.
    to_source: vec3f,
    is_sky: bool,
    // Unit normal of the emitter, facing the receiver.
    normal: vec3f,
    // Radiance towards the receiver; 0 where no point exists.
    radiance: vec3f,
    // Density over the solid angle at the receiver.
    density: f32,
}

fn all_emitters_of_scene() -> Emitters {
    return Emitters(params.emitter_count, params.emitter_density, params.scene_radius);
}

/// A point on an emitting triangle.
fn emitter_source(position: vec3f, word: u32, random: vec2f) -> Source {
    let point = draw_emitter(all_emitters_of_scene(), position, word, random);
    return Source(point.along, false, point.normal, point.emission * params.radiance_scale, point.density);
}

/// A direction to the sky.
fn sky_source(random: vec2f) -> Source {
    let sky = draw_sky(random);
    return Source(sky.direction, true, -sky.direction, sky.radiance * params.radiance_scale, sky.density);
}

/// A point on a source for a receiver at `position`. With both kinds of source, each is drawn half of the time.
fn draw_source(position: vec3f, random: vec3u, emitters_too: bool, sky_too: bool) -> Source {
    let numbers = unit_numbers(random).yz;
    if !emitters_too {
        return sky_source(numbers);
    }
    if !sky_too {
        return emitter_source(position, random.x, numbers);
    }
    // The highest bit chooses the kind; the others are the number.
    if random.x >= 0x80000000u {
        return sky_source(numbers);
    }
    return emitter_source(position, random.x << 1u, numbers);
}
