// The binary voxel grid over what the camera sees (Soler & Hoel 2010, section 4, after Eisemann and Décoret 2008):
// 128 slices of depth for each texel of a level, one bit each, in four words of 32 slices: the layers of a texture, or,
// while it is made, neighbours in a buffer, where word w of texel (x, y) stands at (y * width + x) * 4 + w.

/// Slices of the grid, and those of one word.
const SLICES: f32 = 128.0;
const WORD_SLICES: i32 = 32;
/// Binary logarithm of WORD_SLICES.
const WORD_SHIFT: u32 = 5u;
const WORDS: i32 = 4;

// Slices reach from the nearest to the farthest visible surface: no segment between two visible points leaves that
// range. Each is thicker than the one before it by the same factor, as the columns grow with depth too: voxels keep
// their shape. (The paper's are equally thick; with those, nearby occluders drown in slices many times as deep as wide.)
struct Slices {
    // Binary logarithm of the depth where slice 0 begins, and slices in one octave.
    begin: f32,
    per_octave: f32,
}

/// The slices between the two depths that `depth_range.wgsl` found; it stores the bits of the farthest one and the
/// complement of the bits of the nearest one.
fn slices_of_range(nearest_complement: u32, farthest: u32) -> Slices {
    let nearest = bitcast<f32>(~nearest_complement);
    let end = bitcast<f32>(farthest);
    // Where nothing is visible both depths are useless and so is the grid, but its numbers stay finite.
    if !(end > 0.0) {
        return Slices(0.0, 1.0);
    }
    let begin = log2(nearest);
    // A wall that faces the camera has no extent in depth; its slices stay thicker than depth is precise.
    return Slices(begin, SLICES * 0.9999 / max(log2(end) - begin, 2e-3));
}

/// Place of a depth among the slices; slice i covers i..i+1. Outside the range it is under 0 or over 128, also for what
/// lies behind the camera.
fn slice_of_depth(depth: f32, slices: Slices) -> f32 {
    let octave = select(-1e6, log2(depth), depth > 0.0);
    return clamp((octave - slices.begin) * slices.per_octave, -1e6, 1e6);
}

/// Thickness of a slice for each unit of its depth.
fn slice_thickness(slices: Slices) -> f32 {
    return exp2(1.0 / slices.per_octave) - 1.0;
}

/// Bits of a word that stand for slices `first` to `last`, both included; either may lie in another word.
fn slice_mask(first: i32, last: i32, word: i32) -> u32 {
    let base = word * WORD_SLICES;
    let low = max(first - base, 0);
    let high = min(last - base, WORD_SLICES - 1);
    let mask = (0xffffffffu << u32(low)) & (0xffffffffu >> u32(WORD_SLICES - 1 - high));
    return select(0u, mask, low <= high && low < WORD_SLICES && high >= 0);
}
