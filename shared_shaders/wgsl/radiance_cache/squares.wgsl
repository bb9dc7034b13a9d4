// The pixels that stand for squares of 4 x 4 pixels.
import package::common::math::random_words;
import package::common::streams::CACHE_SEEK_STREAM;
import package::common::view::View;

/// The pixel that stands for a square in this frame: each of them once in 16 frames, from a random start.
fn pixel_of_square(square: vec2u, size: vec2u, view: View) -> vec2u {
    let turn = random_words(square, view.frame >> 4u, CACHE_SEEK_STREAM + 1u, view.seed).x + 5u * view.frame;
    return min(square * 4u + vec2u(turn & 3u, (turn >> 2u) & 3u), size - 1u);
}
