// All textures of a scene in one array of words, filtered in the shader: textures of any size with one binding, and the
// same values in the rasterizer and the path tracer. The functions take fetched words, because WGSL cannot pass a binding
// to a function. A shader that binds `texels` calls `texture_footprint`, loads the four words and calls
// `filter_footprint`.
//
// A texture is a header (width and height of level 0), the texels of level 0, then those of its other levels. Each level has
// half the width and height of the one before, rounded down and at least 1; the last one has a single texel.
import package::common::scene::decode_texel;

struct Footprint {
    // Indices of the four texels: (x0, y0), (x1, y0), (x0, y1), (x1, y1).
    indices: vec4u,
    // Weights towards x1 and y1.
    weights: vec2f,
}

/// Words of a texture's header: width and height.
const HEADER: u32 = 2u;

/// A level of a texture.
struct Level {
    // Index of its first texel.
    first: u32,
    // Width and height, texels.
    size: vec2u,
}

/// The level after another one, whose texels are twice as wide.
fn next_level(level: Level) -> Level {
    return Level(level.first + level.size.x * level.size.y, max(level.size / 2u, vec2u(1u)));
}

/// A level of the texture whose header is at `start`, with `size` texels in level 0.
fn texture_level(start: u32, size: vec2u, index: u32) -> Level {
    var level = Level(start + HEADER, size);
    for (var i = 0u; i < index; i++) {
        level = next_level(level);
    }
    return level;
}

/// Texels around `uv` in a level; the texture repeats.
fn texture_footprint(level: Level, uv: vec2f) -> Footprint {
    let size = level.size;
    // `fract` before scaling keeps precision for coordinates far from the origin.
    let position = fract(uv) * vec2f(size) - 0.5;
    let base = floor(position);
    // Between -1 and the last texel. Divisions of whole numbers are slow.
    let found = vec2i(base);
    let end = vec2i(size);
    let low = select(found, end - 1, found < vec2i(0));
    let high = select(low + 1, vec2i(0), low + 1 >= end);
    let row = vec2u(vec2i(low.y, high.y)) * size.x + level.first;
    let column = vec2u(vec2i(low.x, high.x));
    return Footprint(
        vec4u(row.x + column.x, row.x + column.y, row.y + column.x, row.y + column.y),
        position - base,
    );
}

fn filter_footprint(words: vec4u, weights: vec2f) -> vec4f {
    let top = mix(decode_texel(words.x), decode_texel(words.y), weights.x);
    let bottom = mix(decode_texel(words.z), decode_texel(words.w), weights.x);
    return mix(top, bottom, weights.y);
}
