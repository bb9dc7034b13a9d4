//! Image files to texels.

use std::io::Cursor;

use image::{DynamicImage, ImageError, ImageFormat, ImageReader};

use super::faces::decoded;
use crate::Texture;

/// Number of texels that any file may have: 4,096 x 4,096.
const MOST_FREE: u64 = 1 << 24;

/// Texels for each byte of a larger file. A uniform PNG file of one bit per texel has some 8,000; a larger uniform file
/// than [`MOST_FREE`] that has more can only be WebP.
const DENSEST: u64 = 1 << 14;

/// The image, with a note if it is not whole; or why it cannot be used. `path` only tells the format of a file without a
/// signature.
pub(super) fn decode(bytes: &[u8], path: &str) -> Result<(DynamicImage, Option<String>), String> {
    let reader = || {
        let mut image =
            ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
        if image.format().is_none() {
            // TGA files have no signature; only the file name identifies them.
            if let Ok(format) = ImageFormat::from_path(path) {
                image.set_format(format);
            }
        }
        Ok::<_, String>(image)
    };
    let undecoded = |error: ImageError| format!("cannot be decoded ({error})");
    // A damaged size must not become an allocation.
    let (width, height) = reader()?.into_dimensions().map_err(undecoded)?;
    let texels = u64::from(width) * u64::from(height);
    if texels > MOST_FREE && texels / DENSEST > bytes.len() as u64 {
        return Err(format!("cannot be decoded ({} bytes do not hold {width} x {height} texels)", bytes.len()));
    }
    let image = reader()?;
    let cut_off = image.format() == Some(ImageFormat::Jpeg) && !has_end(bytes);
    let image = image.decode().map_err(undecoded)?;
    if image.width() == 0 || image.height() == 0 {
        return Err("has no pixels".into());
    }
    // The decoder fills what is missing with grey.
    Ok((image, cut_off.then(|| "is cut off; its missing part is grey".into())))
}

/// Whether a JPEG file has its end marker after its last scan. Without it the file was cut off.
fn has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    let mut scanned = false;
    // A marker is 0xff and a byte that is neither 0 (a data byte 0xff) nor 0xff (padding).
    while let Some(offset) = bytes.get(at..).and_then(|rest| rest.iter().position(|&byte| byte == 0xff)) {
        at += offset + 1;
        match bytes.get(at) {
            Some(0xd9) if scanned => return true,
            // Restart markers and data.
            Some(0 | 0xff | 0x01 | 0xd0..=0xd9) => {}
            Some(&marker) => {
                scanned |= marker == 0xda;
                let length = bytes.get(at + 1..at + 3).map_or(0, |b| usize::from(u16::from_be_bytes([b[0], b[1]])));
                at += 1 + length;
            }
            None => return false,
        }
    }
    false
}

/// A magenta and grey checker of 8 x 8 squares.
pub(super) fn checker(name: &str) -> Texture {
    const SIZE: u32 = 64;
    let texel = |i: u32| {
        if (i % SIZE / 8 + i / SIZE / 8).is_multiple_of(2) { [255, 0, 255, 255] } else { [128, 128, 128, 255] }
    };
    Texture {
        name: format!("replacement for {name}"),
        width: SIZE,
        height: SIZE,
        rgba: (0..SIZE * SIZE).flat_map(texel).collect(),
    }
}

/// An image in linear colours with smaller copies of itself, for means over parts of it. It repeats in both directions.
pub(super) struct Pyramid {
    levels: Vec<Level>,
    uniform: bool,
    stored: [f32; 3],
}

struct Level {
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
}

impl Pyramid {
    pub fn new(image: &DynamicImage) -> Self {
        let rgb = image.to_rgb8();
        let curve: Vec<f32> = (0..=255).map(decoded).collect();
        let texels: Vec<_> = rgb.pixels().map(|pixel| pixel.0.map(|x| curve[usize::from(x)])).collect();
        let uniform = texels.iter().all(|texel| *texel == texels[0]);
        let sum = |i: usize| rgb.pixels().map(|pixel| u64::from(pixel.0[i])).sum::<u64>();
        let count = 255 * u64::from(rgb.width()) * u64::from(rgb.height());
        let stored = std::array::from_fn(|i| (sum(i) as f64 / count as f64) as f32);
        let mut levels = vec![Level { size: [rgb.width() as usize, rgb.height() as usize], texels }];
        while let Some(smaller) = levels.last().and_then(Level::halved) {
            levels.push(smaller);
        }
        Self { levels, uniform, stored }
    }

    /// Whether all its texels are equal.
    pub fn is_uniform(&self) -> bool {
        self.uniform
    }

    /// The mean over the whole image.
    pub fn mean_of_all(&self) -> [f32; 3] {
        self.levels[self.levels.len() - 1].texels[0]
    }

    /// The mean of the stored values, 0..1, over the whole image.
    pub fn mean_of_stored(&self) -> [f32; 3] {
        self.stored
    }

    /// The mean over a triangle in texture space, v pointing down. Triangles of under 32 texels are sampled as stored, at
    /// the centres of 1 to 4,096 equal parts; larger ones in a smaller copy.
    pub fn mean(&self, triangle: [[f32; 2]; 3]) -> [f32; 3] {
        if self.uniform {
            return self.levels[0].texels[0];
        }
        let [a, b, c] = triangle.map(|uv| uv.map(f64::from));
        let edge = |a: [f64; 2], b: [f64; 2], size: [usize; 2]| {
            f64::hypot((b[0] - a[0]) * size[0] as f64, (b[1] - a[1]) * size[1] as f64)
        };
        let longest = |level: &Level| edge(a, b, level.size).max(edge(b, c, level.size)).max(edge(c, a, level.size));
        let level =
            self.levels.iter().find(|level| longest(level) <= 32.0).unwrap_or(&self.levels[self.levels.len() - 1]);
        let parts = ((2.0 * longest(level)).ceil()).clamp(1.0, 64.0) as usize;
        let mut sum = [0.0_f64; 3];
        for i in 0..parts {
            for j in 0..parts - i {
                // The part with its right angle at (i, j), and the one opposite to it.
                for third in [1.0 / 3.0, 2.0 / 3.0] {
                    if third > 0.5 && i + j + 1 >= parts {
                        continue;
                    }
                    let (s, t) = ((i as f64 + third) / parts as f64, (j as f64 + third) / parts as f64);
                    let at = |k: usize| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]);
                    let texel = level.texel([at(0), at(1)]);
                    sum.iter_mut().zip(texel).for_each(|(sum, x)| *sum += f64::from(x));
                }
            }
        }
        sum.map(|x| (x / (parts * parts) as f64) as f32)
    }
}

impl Level {
    /// The texel at this position; the image repeats.
    fn texel(&self, uv: [f64; 2]) -> [f32; 3] {
        let index = |i: usize| ((uv[i].rem_euclid(1.0) * self.size[i] as f64) as usize).min(self.size[i] - 1);
        self.texels[index(1) * self.size[0] + index(0)]
    }

    /// The same image with half as many rows and columns, rounded up; `None` for a single texel. Every texel counts by its
    /// area, so the mean stays the same.
    fn halved(&self) -> Option<Self> {
        let [width, height] = self.size;
        let size = [width.div_ceil(2), height.div_ceil(2)];
        if size == self.size {
            return None;
        }
        let (columns, rows) = (overlaps(width, size[0]), overlaps(height, size[1]));
        let mean = |i: usize| {
            let mut sum = [0.0_f64; 3];
            for &(y, weight_y) in &rows[i / size[0]] {
                for &(x, weight_x) in &columns[i % size[0]] {
                    let texel = self.texels[y * width + x];
                    sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += weight_x * weight_y * f64::from(v));
                }
            }
            sum.map(|x| x as f32)
        };
        let texels = (0..size[0] * size[1]).map(mean).collect();
        Some(Self { size, texels })
    }
}

/// For each of `to` equal parts of a row, the texels of `from` that it covers and their shares of it.
fn overlaps(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let length = from as f64 / to as f64;
    let part = |i: usize| {
        let (start, end) = (i as f64 * length, (i + 1) as f64 * length);
        let covered = |k: usize| (end.min((k + 1) as f64) - start.max(k as f64)).max(0.0) / length;
        (start as usize..from.min(end.ceil() as usize)).map(|k| (k, covered(k))).collect()
    };
    (0..to).map(part).collect()
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    fn encoded(size: u32, format: ImageFormat) -> Vec<u8> {
        // Noise, so that no format makes it small.
        let image = RgbImage::from_fn(size, size, |x, y| {
            Rgb([(x * 37 + y * 101) as u8, (x * y * 13) as u8, ((x * 7) ^ (y * 59)) as u8])
        });
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::from(image).write_to(&mut bytes, format).expect("a small image");
        bytes.into_inner()
    }

    #[test]
    fn every_image_that_is_cut_off_is_noticed() {
        use ImageFormat::{Bmp, Jpeg, Png, Tga, WebP};
        for (format, name) in [(Jpeg, "a.jpg"), (Png, "a.png"), (Bmp, "a.bmp"), (Tga, "a.tga"), (WebP, "a.webp")] {
            let bytes = encoded(64, format);
            assert!(matches!(decode(&bytes, name), Ok((_, None))), "{name} is whole");
            for share in [0, 1, 2, 5, 8, 9] {
                let part = &bytes[..bytes.len() * share / 10];
                match decode(part, name) {
                    Ok((_, note)) => assert!(note.is_some_and(|note| note.contains("cut off")), "{name} {share}"),
                    Err(why) => assert!(why.contains("cannot be decoded"), "{name} {share}: {why}"),
                }
            }
        }
        // A JPEG file may have anything behind its end.
        let longer = [&encoded(64, Jpeg)[..], b"trailer"].concat();
        assert!(matches!(decode(&longer, "a.jpg"), Ok((_, None))));
    }

    #[test]
    fn a_size_that_the_file_cannot_hold_is_refused() {
        let mut bytes = encoded(8, ImageFormat::Bmp);
        bytes[18..26].copy_from_slice(&[8192_u32, 8192].map(u32::to_le_bytes).concat());
        let why = decode(&bytes, "a.bmp").expect_err("it is damaged");
        assert!(why.contains("bytes do not hold 8192 x 8192 texels"), "{why}");
    }

    #[test]
    fn the_contents_tell_the_format_and_not_the_name() {
        assert!(decode(&encoded(8, ImageFormat::Png), "a.jpg").is_ok());
        assert!(decode(&encoded(8, ImageFormat::Jpeg), "a").is_ok());
        assert!(decode(b"not an image", "a.png").is_err());
    }

    #[test]
    fn every_kind_of_pixel_becomes_eight_bits() {
        use image::{GrayAlphaImage, GrayImage, ImageBuffer, Luma, LumaA};
        let deep: ImageBuffer<Rgb<u16>, Vec<u16>> = ImageBuffer::from_pixel(2, 2, Rgb([65535, 257 * 100, 0]));
        for (image, wanted) in [
            (DynamicImage::from(GrayImage::from_pixel(2, 2, Luma([100]))), [100, 100, 100, 255]),
            (GrayAlphaImage::from_pixel(2, 2, LumaA([100, 50])).into(), [100, 100, 100, 50]),
            (deep.into(), [255, 100, 0, 255]),
        ] {
            let mut bytes = Cursor::new(Vec::new());
            image.write_to(&mut bytes, ImageFormat::Png).expect("a small image");
            let (read, note) = decode(&bytes.into_inner(), "a.png").expect("it was written");
            assert_eq!((read.to_rgba8().get_pixel(1, 1).0, note), (wanted, None));
        }
    }

    /// The left half black, the right half white.
    fn halves(size: u32) -> Pyramid {
        Pyramid::new(&RgbImage::from_fn(size, size, |x, _| Rgb([if x < size / 2 { 0 } else { 255 }; 3])).into())
    }

    #[test]
    fn means_cover_the_triangle() {
        for size in [2, 16, 256, 300] {
            let image = halves(size);
            let mean = |triangle| image.mean(triangle)[0];
            assert_eq!(mean([[0.0, 0.0], [0.4, 0.0], [0.0, 1.0]]), 0.0);
            assert_eq!(mean([[0.6, 0.0], [0.9, 0.0], [0.6, 1.0]]), 1.0);
            // The half of a square: a quarter of the triangle is beyond the middle. Within half a texel of 32 along the
            // border.
            let quarter = mean([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
            assert!((quarter - 0.25).abs() < 0.02, "{size}: {quarter}");
            // Repeated ten times, shifted far away, the mean is one half.
            let tiled = mean([[100.0, -5.0], [110.0, -5.0], [100.0, 5.0]]);
            assert!((tiled - 0.5).abs() < 0.02, "{size}: {tiled}");
        }
    }

    #[test]
    fn a_uniform_image_is_exact_and_a_point_is_a_texel() {
        let grey = Pyramid::new(&RgbImage::from_pixel(3, 5, Rgb([200, 100, 0])).into());
        assert!(grey.is_uniform());
        assert_eq!(grey.mean([[0.1, 0.2], [0.3, 7.0], [1.0, 0.0]]), [decoded(200), decoded(100), 0.0]);
        let image = halves(4);
        assert!(!image.is_uniform());
        assert_eq!(image.mean([[0.8, 0.1]; 3]), [1.0; 3]);
    }
}
