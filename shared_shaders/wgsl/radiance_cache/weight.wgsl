// How much a record wants rays.
import package::radiance_cache::cells::{HITS, cells, records};

/// Samples of a record that only hits refer to after which it wants no more.
const ENOUGH_FOR_HITS: f32 = 96.0;
/// Rays that a new record gets at once, if the budget of new records allows it.
const FIRST_RAYS: f32 = 4.0;

/// Whether a pixel that was looked at in this frame is inside the cell.
fn is_visible(slot: u32) -> bool {
    return atomicLoad(&cells[slot].pixel) != 0u;
}

/// Share of the rays that a record gets, relative to others. Empty slots, records without a position yet and coarser records,
/// which collect the rays of finer ones, get none.
fn weight_of(slot: u32) -> u32 {
    if atomicLoad(&cells[slot].fingerprint) == 0u {
        return 0u;
    }
    let samples = records[slot].samples;
    if is_visible(slot) {
        return select(select(select(1u, 2u, samples < 128.0), 4u, samples < 32.0), 8u, samples < 8.0);
    }
    if (records[slot].level_and_bin & HITS) == 0u || records[slot].normal == 0u {
        return 0u;
    }
    return select(select(select(0u, 1u, samples < ENOUGH_FOR_HITS), 2u, samples < 16.0), 4u, samples <= 0.0);
}

/// Whether a record in the picture has hardly any rays yet.
fn is_new(slot: u32) -> bool {
    return is_visible(slot) && records[slot].samples < FIRST_RAYS;
}
