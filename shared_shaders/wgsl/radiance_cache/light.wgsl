// Light of the records at a surface.
import package::radiance_cache::cells::{COARSER_LEVELS, NO_SLOT, Place, parent_of};
import package::radiance_cache::lookup::find;

// Light of each record, mixed with that of coarser ones; w is 0 without any.
@group(0) @binding(15) var<storage, read> mixed: array<vec4f>;

/// Light of cell `first`, otherwise of cell `next` or of a coarser one around it; w is 0 without any.
fn light_of(first: Place, next: Place) -> vec4f {
    var place = first;
    var light = vec4f(0.0);
    for (var i = 0u; i <= COARSER_LEVELS + 1u && light.w == 0.0; i++) {
        let slot = find(place);
        if slot != NO_SLOT {
            light = mixed[slot];
        }
        place = parent_of(place);
        if i == 0u {
            place = next;
        }
    }
    return light;
}
