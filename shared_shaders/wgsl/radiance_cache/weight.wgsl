// How much a record wants rays.
import package::radiance_cache::cells::{BUCKET, HITS, buckets, is_taken, records};
import package::radiance_cache::counters::counters;
import package::radiance_cache::totals::{shown, totals};
import package::radiance_cache::turn::{INTERVAL, is_turn_of};

/// Samples of a record that only hits refer to after which it wants no more.
const ENOUGH_FOR_HITS: f32 = 96.0;
/// Samples of a record in the picture after which it wants no more.
const ENOUGH: f32 = 512.0;
/// Rays below which a record is new.
const RAYS_OF_NEW: f32 = 16.0;
/// Rays that a new record gets at once, if the budget of new records allows it.
const FIRST_RAYS: f32 = 4.0;

/// Whether a pixel that was looked at in this frame is inside the cell.
fn is_visible(slot: u32) -> bool {
    return atomicLoad(&buckets[slot / BUCKET].cells[slot % BUCKET].pixel) != 0u;
}

/// Share of the rays that a record gets, relative to others. Empty slots, records without a position yet and coarser records,
/// which collect the rays of finer ones, get none.
fn weight_of(slot: u32) -> u32 {
    if !is_taken(slot) {
        return 0u;
    }
    let samples = records[slot].samples;
    if is_visible(slot) {
        return select(select(select(select(0u, 1u, samples < ENOUGH), 2u, samples < 128.0), 4u, samples < 32.0), 8u, samples < 8.0);
    }
    if (records[slot].level_and_bin & HITS) == 0u || records[slot].normal == 0u {
        return 0u;
    }
    return select(select(select(0u, 1u, samples < ENOUGH_FOR_HITS), 2u, samples < 16.0), 4u, samples <= 0.0);
}

/// Rays of a record, or of a coarse one and those inside, after which it is settled.
const RAYS_OF_SETTLED: f32 = 16.0;
/// Frames after a change of the lights in which no record is settled: about as many bounces as can be told apart.
const FRAMES_OF_CHANGE: u32 = 16u;

fn is_settled(slot: u32) -> bool {
    return totals[shown() + slot].w >= RAYS_OF_SETTLED && counters.settled >= FRAMES_OF_CHANGE;
}

/// Whether a record takes part in this frame.
fn is_due(slot: u32) -> bool {
    return !is_settled(slot) || is_turn_of(slot);
}

/// Whether a record in the picture has hardly any rays yet.
fn is_new(slot: u32) -> bool {
    return is_visible(slot) && records[slot].samples < RAYS_OF_NEW;
}
