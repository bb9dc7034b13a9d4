//! The texel pool: all textures of a scene in one array of words, in the layout of `common/texture_pool.wgsl`. A texture
//! is a header (width, height) and one word per texel, rows from the top, level after level.
//!
//! On a device the words are the texels of an array of textures, because many devices bind only 128 MiB of a buffer.

use halflight_frame_graph::ExternalSize;
use halflight_metrics::tone::srgb_decode;
use halflight_scenes::Texture;

/// Words of a texture's header: width and height.
pub(crate) const HEADER: u32 = 2;

/// Index of each texture's header in the pool.
pub(crate) fn headers(textures: &[Texture]) -> impl Iterator<Item = u32> {
    textures.iter().scan(0, |end, texture| {
        let start = *end;
        *end += HEADER + texels(texture) as u32;
        Some(start)
    })
}

/// Words in a row of the pool's texture. Twin of `texel_word` in `common/scene_textures.wgsl`.
pub(super) const POOL_WIDTH: u32 = 1 << 12;
/// Rows in a layer: few, because the last layer may be almost empty, and enough for 2^28 words in 256 layers.
pub(super) const POOL_ROWS: u32 = 1 << 8;

/// Rows and layers of the texture for this many words.
fn rows_and_layers(words: u64) -> (u32, u32) {
    let rows = words.max(1).div_ceil(POOL_WIDTH.into());
    let layers = rows.div_ceil(POOL_ROWS.into());
    (rows.min(POOL_ROWS.into()) as u32, u32::try_from(layers).unwrap_or(u32::MAX))
}

/// Size of the pool on a device.
pub(super) fn size(textures: &[Texture]) -> ExternalSize {
    let (rows, layers) = rows_and_layers(words(textures));
    ExternalSize {
        bytes: 4 * u64::from(POOL_WIDTH) * u64::from(rows) * u64::from(layers),
        element: 4,
        elements: "texels in all textures",
        texture: Some(([POOL_WIDTH, rows], layers)),
    }
}

/// Widths and heights of a texture's levels: each half of the one before, rounded down, until a single texel is left.
fn levels(texture: &Texture) -> impl Iterator<Item = [u32; 2]> {
    std::iter::successors(Some([texture.width, texture.height]), |&[width, height]| {
        (width > 1 || height > 1).then(|| [(width / 2).max(1), (height / 2).max(1)])
    })
}

/// Texels of all levels of a texture.
fn texels(texture: &Texture) -> u64 {
    levels(texture).map(|[width, height]| u64::from(width) * u64::from(height)).sum()
}

/// Words of the pool.
pub(crate) fn words(textures: &[Texture]) -> u64 {
    textures.iter().map(|texture| u64::from(HEADER) + texels(texture)).sum()
}

/// All textures in one array of words. Returns the start of each texture.
pub(crate) fn texel_pool(textures: &[Texture]) -> (Vec<u32>, Vec<u32>) {
    // Linear value for each sRGB code.
    let linear: [f32; 256] = std::array::from_fn(|code| srgb_decode(code as f32 / 255.0));
    let mut pool = Vec::with_capacity(words(textures) as usize);
    for texture in textures {
        pool.extend([texture.width, texture.height]);
        let decoded = |&[r, g, b, a]: &[u8; 4]| {
            let [r, g, b] = [r, g, b].map(|code| linear[code as usize]);
            [r, g, b, f32::from(a) / 255.0]
        };
        let rgba = texture.rgba.as_chunks::<4>().0;
        pool.extend(rgba.iter().map(|texel| word(&decoded(texel))));
        // Level 0 is not kept as numbers: of large textures that would take much memory.
        let mut last: Option<Vec<[f32; 4]>> = None;
        for (size, smaller) in levels(texture).zip(levels(texture).skip(1)) {
            let level = match &last {
                None => resampled(|index| decoded(&rgba[index]), size, smaller),
                Some(level) => resampled(|index| level[index], size, smaller),
            };
            pool.extend(level.iter().map(word));
            last = Some(level);
        }
    }
    (headers(textures).collect(), pool)
}

/// A texel as a word: square roots of the linear channels, 10 bits each, and alpha, 0 or 3. Twin of `decode_texel` in
/// `common/scene.wgsl`.
fn word(&[r, g, b, a]: &[f32; 4]) -> u32 {
    let root = |value: f32| (value.sqrt() * 1023.0).round() as u32;
    let alpha = if a >= 0.5 { 3 } else { 0 };
    root(r) | root(g) << 10 | root(b) << 20 | alpha << 30
}

/// An image in a smaller size: each texel is the mean of the area that it covers, where odd sizes cut texels.
fn resampled(texel: impl Fn(usize) -> [f32; 4], size: [u32; 2], smaller: [u32; 2]) -> Vec<[f32; 4]> {
    let [columns, rows] = [0, 1].map(|axis| shares(size[axis], smaller[axis]));
    let mut out = Vec::with_capacity(smaller[0] as usize * smaller[1] as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0; 4];
            for &(y, height) in row {
                for &(x, width) in column {
                    let texel = texel(y * size[0] as usize + x);
                    (0..4).for_each(|channel| sum[channel] += width * height * texel[channel]);
                }
            }
            out.push(sum);
        }
    }
    out
}

/// For each texel of a smaller row those that it covers, and their shares of it.
fn shares(from: u32, to: u32) -> Vec<Vec<(usize, f32)>> {
    let (from, to) = (u64::from(from), u64::from(to));
    // In units of a part of both, so that sums of shares are 1.
    let covered = |i: u64| {
        let (start, end) = (i * from, (i + 1) * from);
        let texels = start / to..end.div_ceil(to);
        texels.map(move |x| (x as usize, ((end.min((x + 1) * to) - start.max(x * to)) as f32 / from as f32))).collect()
    };
    (0..to).map(covered).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32, rgba: Vec<u8>) -> Texture {
        Texture { width, height, rgba, ..Texture::default() }
    }

    /// Linear values of a word, after `decode_texel` in `common/scene.wgsl`.
    fn decoded(word: u32) -> [f32; 4] {
        let channel = |shift: u32| ((word >> shift & 1023) as f32 / 1023.0).powi(2);
        [channel(0), channel(10), channel(20), (word >> 30) as f32 / 3.0]
    }

    #[test]
    fn levels_have_the_mean_of_the_texture() {
        // Black and white texels in linear light, not in sRGB: the mean of two is 0.5.
        let rgba = (0..4).flat_map(|i| if i % 2 == 0 { [0, 0, 0, 255] } else { [255, 255, 255, 255] }).collect();
        let (starts, words) = texel_pool(&[texture(2, 2, rgba)]);
        assert_eq!((starts, words.len(), words[0], words[1]), (vec![0], 2 + 4 + 1, 2, 2));
        // A step of the root at 0.5 is 0.0014.
        assert!(decoded(words[6]).iter().zip([0.5, 0.5, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 7e-4), "{words:?}");
    }

    #[test]
    fn odd_sizes_lose_no_texel() {
        let rgba = (0..5 * 3).flat_map(|i| [(i * 17) as u8, 255, 0, 255]).collect();
        let odd = texture(5, 3, rgba);
        assert_eq!(levels(&odd).collect::<Vec<_>>(), [[5, 3], [2, 1], [1, 1]]);
        let (_, words) = texel_pool(std::slice::from_ref(&odd));
        assert_eq!(words.len() as u64, super::words(std::slice::from_ref(&odd)));
        let mean = (0..5 * 3).map(|i| srgb_decode((i * 17) as f32 / 255.0)).sum::<f32>() / 15.0;
        let [red, green, blue, _] = decoded(words[words.len() - 1]);
        assert!((red - mean).abs() < 7e-4 && green == 1.0 && blue == 0.0, "{red} {green} {blue}, not {mean}");
    }

    #[test]
    fn shares_cover_a_row_once() {
        for (from, to) in [(5, 2), (7, 3), (8, 4), (1, 1), (3, 1)] {
            let mut sums = vec![0.0; from as usize];
            for texel in shares(from, to) {
                assert!((texel.iter().map(|(_, share)| share).sum::<f32>() - 1.0).abs() < 1e-6);
                texel.iter().for_each(|&(x, share)| sums[x] += share);
            }
            let even = to as f32 / from as f32;
            assert!(sums.iter().all(|sum| (sum - even).abs() < 1e-6), "{from} to {to}: {sums:?}");
        }
    }
}
