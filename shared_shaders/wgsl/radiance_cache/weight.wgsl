// How much a record wants rays.

/// Samples of a record that only hits refer to after which it wants no more.
const ENOUGH_FOR_HITS: f32 = 96.0;

/// Share of the rays that a record gets, relative to others. `own` are its samples, `all` those of its children, too.
/// `visible` tells whether a surfel is inside.
fn weight_of(visible: bool, own: f32, all: f32) -> u32 {
    if visible {
        return select(select(select(1u, 2u, own < 128.0), 4u, own < 32.0), 8u, own < 8.0);
    }
    if own <= 0.0 && all <= 0.0 {
        return 4u;
    }
    return select(select(0u, 1u, all < ENOUGH_FOR_HITS), 2u, all < 16.0);
}

/// Rays that a new record gets at once, if the budget of new records allows it.
const FIRST_RAYS: f32 = 4.0;

/// Whether a record in the picture has hardly any rays yet.
fn is_new(visible: bool, own: f32) -> bool {
    return visible && own < FIRST_RAYS;
}
