// Light of the records at a surface.
import package::common::view::View;
import package::radiance_cache::cells::{
    COARSER_LEVELS, NO_SLOT, Place, find, level_at, level_of_hits_at, parent_of, place_of, place_of_hit,
};

// Light of each record, mixed with that of coarser ones; w is 0 without any.
@group(0) @binding(15) var<storage, read> mixed: array<vec4f>;

/// Light at a surface: that of cell `first`, otherwise of the surface's own cell or a coarser one around it, otherwise of a
/// record that hits refer to; w is 0 without any.
fn light_of_surface(first: Place, position: vec3f, normal: vec3f, distance: f32, view: View) -> vec4f {
    var place = first;
    var light = vec4f(0.0);
    // One loop, because a software adapter evaluates every alternative that is not in a loop.
    for (var i = 0u; i < COARSER_LEVELS + 3u && light.w == 0.0; i++) {
        let slot = find(place);
        if slot != NO_SLOT {
            light = mixed[slot];
        }
        if i == 0u {
            place = place_of(position, normal, level_at(distance, view));
        } else if i <= COARSER_LEVELS {
            place = parent_of(place);
        } else {
            place = place_of_hit(position, normal, level_of_hits_at(distance, view));
        }
    }
    return light;
}
