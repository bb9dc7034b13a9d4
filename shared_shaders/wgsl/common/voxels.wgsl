// The binary voxel grid over what the camera sees (Soler & Hoel 2010, section 4, after Eisemann and Décoret 2008):
// 128 slices of depth for each texel of a level, one bit each, in four words of 32 slices: the layers of a texture, or,
// while it is made, neighbours in a buffer, where word w of texel (x, y) stands at (y * width + x) * 4 + w.

/// Slices of the grid, and those of one word.
const SLICES: f32 = 128.0;
const WORD_SLICES: i32 = 32;
const WORDS: i32 = 4;

// Slices are equally thick and reach from the nearest to the farthest visible surface: no segment between two visible
// points leaves that range.
struct Slices {
    // Depth where slice 0 begins, scene units, and slices in one unit.
    begin: f32,
    per_unit: f32,
}

/// The slices between the two depths that `depth_range.wgsl` found; it stores the bits of the farthest one and the
/// complement of the bits of the nearest one.
fn slices_of_range(nearest_complement: u32, farthest: u32) -> Slices {
    let begin = bitcast<f32>(~nearest_complement);
    let end = bitcast<f32>(farthest);
    // A wall that faces the camera has no extent in depth; its slices stay thicker than depth is precise.
    let extent = max(end - begin, 1e-3 * end);
    // Where nothing is visible both depths are useless and so is the grid, but its numbers stay finite.
    if !(end > 0.0) {
        return Slices(0.0, 1.0);
    }
    return Slices(begin, SLICES * 0.9999 / extent);
}

/// Place of a depth among the slices; slice i covers i..i+1. Outside the range it is under 0 or over 128.
fn slice_of_depth(depth: f32, slices: Slices) -> f32 {
    return clamp((depth - slices.begin) * slices.per_unit, -1e6, 1e6);
}

/// Bits of a word that stand for slices `first` to `last`, both included; either may lie in another word.
fn slice_mask(first: i32, last: i32, word: i32) -> u32 {
    let base = word * WORD_SLICES;
    let low = max(first - base, 0);
    let high = min(last - base, WORD_SLICES - 1);
    let mask = (0xffffffffu << u32(low)) & (0xffffffffu >> u32(WORD_SLICES - 1 - high));
    return select(0u, mask, low <= high && low < WORD_SLICES && high >= 0);
}
