// All textures of a scene in one array of words, filtered in the shader: textures of any size with one binding, and the
// same values in the rasterizer and the path tracer. The functions take fetched words, because WGSL cannot pass a binding
// to a function. A shader that binds `texels` calls `texture_footprint`, loads the four words and calls
// `filter_footprint`.
import package::common::scene::decode_texel;

struct Footprint {
    // Indices of the four texels: (x0, y0), (x1, y0), (x0, y1), (x1, y1).
    indices: vec4u,
    // Weights towards x1 and y1.
    weights: vec2f,
}

/// Texels around `uv` in a texture whose header (width, height) is at `start`; the texture repeats.
fn texture_footprint(start: u32, size: vec2u, uv: vec2f) -> Footprint {
    // `fract` before scaling keeps precision for coordinates far from the origin.
    let position = fract(uv) * vec2f(size) - 0.5;
    let base = floor(position);
    let low = (vec2i(base) + vec2i(size)) % vec2i(size);
    let high = (low + 1) % vec2i(size);
    let row = vec2u(vec2i(low.y, high.y)) * size.x + start + 2u;
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
