// Light of the records at a surface.
import package::common::view::View;
import package::radiance_cache::cells::{
    COARSER_LEVELS, NO_SLOT, Place, find, grid, level_at, level_of_hits_at, parent_of, place_of, place_of_hit,
};

// Mean incident light of each record and, in w, the number of its rays: with all bounces, and with the records inside.
@group(0) @binding(15) var<storage, read> totals: array<vec4f>;

/// Light of a cell, mixed with that of the coarser ones that contain it; w is 0 without any.
fn light_of_cell(place: Place) -> vec4f {
    let place_1 = parent_of(place);
    let place_2 = parent_of(place_1);
    let slots = vec4u(find(parent_of(place_2)), find(place_2), find(place_1), find(place));
    var light = vec4f(0.0);
    for (var i = 0u; i <= COARSER_LEVELS; i++) {
        if slots[i] != NO_SLOT {
            let found = totals[slots[i]];
            let share = select(found.w / (found.w + grid.trusted), 1.0, light.w == 0.0);
            light = select(light, vec4f(mix(light.rgb, found.rgb, share), 1.0), found.w > 0.0);
        }
    }
    return light;
}

/// Light at a surface: that of its own cell, otherwise of a record that hits refer to; w is 0 without any.
fn light_of_surface(position: vec3f, normal: vec3f, distance: f32, view: View) -> vec4f {
    let own = light_of_cell(place_of(position, normal, level_at(distance, view)));
    if own.w > 0.0 {
        return own;
    }
    return light_of_cell(place_of_hit(position, normal, level_of_hits_at(distance, view)));
}
