// The binary froxel grid of the view frustum (Soler & Hoel 2010, section 4, after Eisemann and Décoret 2008): 128 depth
// slices for each texel of a level, one bit each, in four words of 32 slices. The words are the layers of a texture.
// While the grid is built they are neighbours in a buffer: word w of texel (x, y) is at (y * width + x) * 4 + w.

/// Slices of the grid, and slices of one word.
const SLICES: f32 = 128.0;
const WORD_SLICES: i32 = 32;
/// Binary logarithm of WORD_SLICES.
const WORD_SHIFT: u32 = 5u;
const WORDS: i32 = 4;

// The slices span the range from the nearest to the farthest visible surface. No segment between two visible points
// leaves that range. The thickness of slices grows by a constant factor, like the width of froxels does with depth, so
// that froxels keep their shape. (The paper's slices are equally thick. With those, nearby occluders fill slices that
// are many times as deep as wide.)
struct Slices {
    // Binary logarithm of the depth at which slice 0 begins, and slices per octave.
    begin: f32,
    per_octave: f32,
}

/// The slices between the two depths of `depth_range.wgsl`, which stores the bits of the farthest depth and the
/// complement of the bits of the nearest one.
fn slices_of_range(nearest_complement: u32, farthest: u32) -> Slices {
    let nearest = bitcast<f32>(~nearest_complement);
    let end = bitcast<f32>(farthest);
    // Without visible surfaces both depths and the grid are meaningless, but the numbers stay finite.
    if !(end > 0.0) {
        return Slices(0.0, 1.0);
    }
    let begin = log2(nearest);
    // A wall that faces the camera has no extent in depth. Its slices stay thicker than the precision of depth.
    return Slices(begin, SLICES * 0.9999 / max(log2(end) - begin, 2e-3));
}

/// Position of a depth among the slices; slice i covers i..i+1. Outside the range it is below 0 or above 128; behind
/// the camera it is below 0.
fn slice_of_depth(depth: f32, slices: Slices) -> f32 {
    let octave = select(-1e6, log2(depth), depth > 0.0);
    return clamp((octave - slices.begin) * slices.per_octave, -1e6, 1e6);
}

/// Thickness of a slice per unit of its depth.
fn slice_thickness(slices: Slices) -> f32 {
    return exp2(1.0 / slices.per_octave) - 1.0;
}

/// Bits of a word for slices `first` to `last`, both included. Either may be in another word.
fn slice_mask(first: i32, last: i32, word: i32) -> u32 {
    let base = word * WORD_SLICES;
    let low = max(first - base, 0);
    let high = min(last - base, WORD_SLICES - 1);
    let mask = (0xffffffffu << u32(low)) & (0xffffffffu >> u32(WORD_SLICES - 1 - high));
    return select(0u, mask, low <= high && low < WORD_SLICES && high >= 0);
}
