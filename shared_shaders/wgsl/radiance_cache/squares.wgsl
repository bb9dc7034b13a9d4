// The pixels that stand for squares of pixels.
import package::common::math::random_words;
import package::common::streams::CACHE_PIXEL_STREAM;
import package::common::view::View;

/// Width of a square, pixels. Twin of `SQUARE` in techniques/src/radiance_cache.rs.
const SQUARE: u32 = 4u;
/// Frames in which every pixel of a square is looked at once.
const FRAMES_OF_SQUARE: u32 = SQUARE * SQUARE;

/// Number of squares in a row of a picture of this width.
fn squares_across(width: u32) -> u32 {
    return (width + SQUARE - 1u) / SQUARE;
}

/// The pixel that stands for a square in this frame: each of them once in 16 frames, from a random start.
fn pixel_of_square(square: vec2u, size: vec2u, view: View) -> vec2u {
    let turn = random_words(square, view.frame >> 4u, CACHE_PIXEL_STREAM, view.seed).x + 5u * view.frame;
    return min(square * SQUARE + vec2u(turn & 3u, (turn >> 2u) & 3u), size - 1u);
}
