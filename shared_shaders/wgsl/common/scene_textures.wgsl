// Textures of the scene's materials, all in one texture of words: more than fit a storage buffer of a browser.
import package::common::scene::NO_TEXTURE;
import package::common::texture_pool::{Level, next_level, texture_level, texture_footprint, filter_footprint};

@group(0) @binding(22) var texels: texture_2d_array<u32>;

/// The word of this index. Twin of `POOL_WIDTH` and `POOL_ROWS` in renderer/src/scene/texel_pool.rs: 2^12 words in a row,
/// 2^8 rows in a layer.
fn texel_word(index: u32) -> u32 {
    return textureLoad(texels, vec2u(index & 0xfffu, (index >> 12u) & 0xffu), index >> 20u, 0).x;
}

/// The bilinear value of a level.
fn sample_level(level: Level, uv: vec2f) -> vec4f {
    let footprint = texture_footprint(level, uv);
    let i = footprint.indices;
    return filter_footprint(vec4u(texel_word(i.x), texel_word(i.y), texel_word(i.z), texel_word(i.w)), footprint.weights);
}

/// Width and height of the texture whose header is at `start`.
fn texture_size(start: u32) -> vec2u {
    return vec2u(texel_word(start), texel_word(start + 1u));
}

/// The bilinear value of level 0 of the texture whose header is at `start`.
fn sample_texture(start: u32, uv: vec2f) -> vec4f {
    return sample_level(texture_level(start, texture_size(start), 0u), uv);
}

/// Longest side of a pixel over its shorter one that is resolved. The usual limit of hardware is 16; each sample fetches eight
/// texels here.
const MOST_RATIO: f32 = 4.0;
/// Longest side of a pixel, texels, squared.
const MOST_SQUARE: f32 = 1e18;

/// The mean of a texture over a pixel, whose sides are `across` and `down` in texture coordinates. Trilinear samples
/// along the longer side, from the levels whose texels are as large as the shorter one.
fn sample_pixel(start: u32, uv: vec2f, across: vec2f, down: vec2f) -> vec4f {
    let size = texture_size(start);
    let sides = mat2x2f(across * vec2f(size), down * vec2f(size));
    // In texels. A pixel that sees its surface edge-on has sides without end, or that are not numbers.
    let found = vec2f(dot(sides[0], sides[0]), dot(sides[1], sides[1]));
    let bounded = found < vec2f(MOST_SQUARE);
    let squares = select(vec2f(MOST_SQUARE), found, bounded);
    let along = select(vec2f(0.0), select(down, across, squares.x >= squares.y), all(bounded));
    let longer = sqrt(max(squares.x, squares.y));
    let shorter = sqrt(min(squares.x, squares.y));
    let texel = max(max(shorter, longer / MOST_RATIO), 1.0);
    // The longer side in texels of the chosen level, at least 1.
    let length = max(longer / texel, 1.0);
    let wanted = min(log2(texel), f32(firstLeadingBit(max(size.x, size.y))));
    let finer = u32(wanted);
    let share = wanted - f32(finer);
    let fine = texture_level(start, size, finer);
    // Not read where the finer one is the last.
    let coarse = next_level(fine);
    // One sample for each texel of that length. Those at its ends count for the part of them inside, so that the mean does not
    // jump where their number changes.
    let reach = ceil(0.5 * length - 0.5);
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var tap = -reach; tap <= reach; tap += 1.0) {
        let at = uv + along * (tap / length);
        var value = sample_level(fine, at);
        if share > 0.0 {
            value = mix(value, sample_level(coarse, at), share);
        }
        let weight = min(0.5 * length + 0.5 - abs(tap), 1.0);
        sum += weight * value;
        weights += weight;
    }
    return sum / weights;
}

/// Whether an alpha texture masks out the surface here; false for NO_TEXTURE.
fn is_hole(alpha_texture: u32, uv: vec2f) -> bool {
    return alpha_texture != NO_TEXTURE && sample_texture(alpha_texture, uv).a < 0.5;
}
