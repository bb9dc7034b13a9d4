//! The texel pool: all textures of a scene in one buffer of words, in the layout of `common/texture_pool.wgsl`. A texture
//! is a header (width, height) and one word per texel, rows from the top.

use halflight_scenes::Texture;

/// Words of a texture's header: width and height.
pub(crate) const HEADER: u32 = 2;

/// Index of each texture's header in the pool.
pub(crate) fn headers(textures: &[Texture]) -> impl Iterator<Item = u32> {
    textures.iter().scan(0, |end, texture| {
        let start = *end;
        *end += HEADER + texture.width * texture.height;
        Some(start)
    })
}

/// Words of the pool.
pub(super) fn words(textures: &[Texture]) -> u64 {
    textures.iter().map(|texture| u64::from(HEADER) + u64::from(texture.width) * u64::from(texture.height)).sum()
}

/// All textures in one array of words. Returns the start of each texture.
pub(super) fn texel_pool(textures: &[Texture]) -> (Vec<u32>, Vec<u32>) {
    // Square root of the linear value, in 10 bits, for each sRGB code.
    let root: [u32; 256] = std::array::from_fn(|code| {
        let v = code as f32 / 255.0;
        let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        (linear.sqrt() * 1023.0).round() as u32
    });
    let root = &root;
    let words = textures.iter().flat_map(|texture| {
        let texels = texture.rgba.as_chunks::<4>().0.iter().map(move |&[r, g, b, a]| {
            let alpha = if a >= 128 { 3 } else { 0 };
            root[r as usize] | root[g as usize] << 10 | root[b as usize] << 20 | alpha << 30
        });
        [texture.width, texture.height].into_iter().chain(texels)
    });
    (headers(textures).collect(), words.collect())
}
