// Textures of the scene's materials, all in one texture of words: more than fit a storage buffer of a browser.
import package::common::scene::NO_TEXTURE;
import package::common::texture_pool::{texture_footprint, filter_footprint};

@group(0) @binding(22) var texels: texture_2d_array<u32>;

/// The word of this index. Twin of `POOL_WIDTH` and `POOL_ROWS` in renderer/src/scene/texel_pool.rs: 2^12 words in a row,
/// 2^8 rows in a layer.
fn texel_word(index: u32) -> u32 {
    return textureLoad(texels, vec2u(index & 0xfffu, (index >> 12u) & 0xffu), index >> 20u, 0).x;
}

/// The filtered value of the texture whose header is at `start`.
fn sample_texture(start: u32, uv: vec2f) -> vec4f {
    let footprint = texture_footprint(start, vec2u(texel_word(start), texel_word(start + 1u)), uv);
    let i = footprint.indices;
    return filter_footprint(vec4u(texel_word(i.x), texel_word(i.y), texel_word(i.z), texel_word(i.w)), footprint.weights);
}

/// Whether an alpha texture masks out the surface here; false for NO_TEXTURE.
fn is_hole(alpha_texture: u32, uv: vec2f) -> bool {
    return alpha_texture != NO_TEXTURE && sample_texture(alpha_texture, uv).a < 0.5;
}
