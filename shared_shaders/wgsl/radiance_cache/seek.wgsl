// Finds or makes the records of what the camera sees: one surfel of every square of 2 x 2 is looked at in each frame.
import package::common::math::random_words;
import package::common::streams::CACHE_SEEK_STREAM;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::radiance_cache::cells::{
    NO_SLOT, cells, find_or_insert, level_at, parent_of, place_of,
};
import package::radiance_cache::counters::counters;

struct Params {
    // Width of a surfel in full-resolution pixels.
    scale: f32,
    // Width of a cell, full-resolution pixels.
    spacing: f32,
    // Unit of the grid, scene units.
    unit: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;

@compute @workgroup_size(8, 8)
fn seek(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfels);
    let random = random_words(id.xy, view.frame, CACHE_SEEK_STREAM, view.seed);
    // Every surfel of the square in four frames.
    let turn = random_words(id.xy, view.frame >> 2u, CACHE_SEEK_STREAM, view.seed).x + view.frame;
    let texel = min(id.xy * 2u + vec2u(turn & 1u, (turn >> 1u) & 1u), size - 1u);
    if any(id.xy * 2u >= size) {
        return;
    }
    let words = textureLoad(surfels, texel, 0);
    let depth = surfel_depth(words);
    if depth <= SKY_DEPTH {
        return;
    }
    let in_view = surfel_position(words, texel, params.scale, view.display_size, view.tan_half_fov);
    let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
    let normal = normalize((view.view_to_world * vec4f(surfel_normal(words), 0.0)).xyz);
    var place = place_of(position, normal, level_at(depth, params.spacing, params.unit, view), params.unit);
    var slot = find_or_insert(place);
    if slot != NO_SLOT {
        // 24 bits for the surfel: up to 2^24 surfels.
        let number = texel.y * size.x + texel.x + 1u;
        atomicMax(&cells[slot].surfel, (random.z & 0xff000000u) | (number & 0xffffffu));
    }
    // The two coarser levels collect the light of the finer ones.
    for (var i = 0u; i < 3u; i++) {
        if slot != NO_SLOT && atomicExchange(&cells[slot].seen, counters.epoch) == counters.epoch {
            return;
        }
        if i < 2u {
            place = parent_of(place);
            slot = find_or_insert(place);
        }
    }
}
