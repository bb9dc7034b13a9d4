//! Small images in the repository, and their comparison with what a test rendered.

use std::{
    env,
    path::{Path, PathBuf},
};

use halflight_native::images::{Image, read_png, srgb_encode, write_png_srgb8};

/// Environment variable that makes tests write their images as the new expected ones.
pub const ACCEPT: &str = "HALFLIGHT_ACCEPT_SNAPSHOTS";

/// Largest difference of an 8-bit channel that counts as equal: a step for each of the two roundings to sRGB.
pub const STEPS: u8 = 2;

/// Largest fraction of pixels that may differ by more than [`STEPS`]. Adapters round differently, and where a comparison
/// decides (an edge, a voxel, a chosen sample), a pixel differs as a whole. 1 % is a hundred pixels of an image of two
/// halves of 96x54; a wrong ring, level or weight changes most of one half.
pub const OUTLIERS: f64 = 0.01;

/// The same where rays through voxels decide for each pair of surfaces whether light arrives, twice in turn. Two processors with
/// the same Mesa and LLVM differed by 2.0 % of the pixels, by at most 10 of 255: this is twice as many.
pub const OUTLIERS_OF_VOXELS: f64 = 0.04;

/// An 8-bit image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Display values, rows from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// The images side by side; all have the same height.
    ///
    /// # Panics
    /// Where they have not.
    pub fn beside(all: &[&Self]) -> Self {
        let rows = |picture: &Self| picture.pixels.len() / picture.width as usize;
        let height = all.first().map_or(0, |first| rows(first));
        assert!(all.iter().all(|picture| rows(picture) == height), "images of one height");
        let row = |y: usize| {
            all.iter().flat_map(move |picture| picture.pixels.chunks(picture.width as usize).nth(y)).flatten().copied()
        };
        Self { width: all.iter().map(|picture| picture.width).sum(), pixels: (0..height).flat_map(row).collect() }
    }

    fn read(path: &Path) -> Result<Self, String> {
        let image: Image = read_png(path).map_err(|error| error.to_string())?;
        let pixels = image.rgb("").unwrap_or_default();
        let code = |value: f32| (srgb_encode(value) * 255.0).round() as u8;
        Ok(Self { width: image.width, pixels: pixels.into_iter().map(|pixel| pixel.map(code)).collect() })
    }

    fn write(&self, path: &Path) {
        write_png_srgb8(path, self.width, &self.pixels).expect("the image is written");
    }
}

/// How two images differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Fraction of pixels that differ by more than [`STEPS`] in a channel.
    pub outliers: f64,
    /// Largest difference of a channel.
    pub largest: u8,
}

impl Difference {
    /// The difference of two images of one size.
    pub fn of(a: &Picture, b: &Picture) -> Self {
        let most = |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
        let all: Vec<u8> = a.pixels.iter().zip(&b.pixels).map(most).collect();
        let outliers = all.iter().filter(|&&steps| steps > STEPS).count();
        Self { outliers: outliers as f64 / all.len().max(1) as f64, largest: all.iter().copied().max().unwrap_or(0) }
    }

    /// Whether the images count as equal if this fraction of pixels may differ.
    pub fn passes(&self, outliers: f64) -> bool {
        self.outliers <= outliers
    }
}

/// Compares an image with the expected one of this name in `tests/snapshots`, of which the fraction `outliers` of the pixels may
/// differ. Where they differ, writes expected image, new
/// image and eight times the difference side by side to `target/snapshots`. With [`ACCEPT`] the new image becomes the
/// expected one.
///
/// # Errors
/// What differs, where to look at it and how to accept it.
///
/// # Panics
/// Where an image cannot be written.
pub fn compare(name: &str, new: &Picture, outliers: f64) -> Result<(), String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("snapshots");
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/snapshots");
    compare_in([&folder, &target], name, new, outliers, env::var_os(ACCEPT).is_some())
}

/// [`compare`] with these folders: of expected images, and for those that differ.
///
/// # Errors
/// As [`compare`].
///
/// # Panics
/// As [`compare`].
pub fn compare_in(
    [folder, target]: [&Path; 2],
    name: &str,
    new: &Picture,
    outliers: f64,
    accept: bool,
) -> Result<(), String> {
    let path = folder.join(format!("{name}.png"));
    let shown: PathBuf = target.join(format!("{name}.png"));
    let how = "cargo xtask snapshots --accept accepts all new images";
    let expected = Picture::read(&path);
    if accept {
        // An image that still passes keeps its bytes.
        if !expected.is_ok_and(|old| same_size(&old, new) && Difference::of(&old, new).largest == 0) {
            new.write(&path);
        }
        return Ok(());
    }
    let expected = expected.map_err(|error| {
        new.write(&shown);
        format!("{name}: {error}; the new image is {}; {how}", shown.display())
    })?;
    if !same_size(&expected, new) {
        new.write(&shown);
        return Err(format!("{name}: the size differs; the new image is {}; {how}", shown.display()));
    }
    let difference = Difference::of(&expected, new);
    if difference.passes(outliers) {
        return Ok(());
    }
    let amplified = |(a, b): (&[u8; 3], &[u8; 3])| std::array::from_fn(|c| a[c].abs_diff(b[c]).saturating_mul(8));
    let pixels = expected.pixels.iter().zip(&new.pixels).map(amplified).collect();
    Picture::beside(&[&expected, new, &Picture { width: new.width, pixels }]).write(&shown);
    Err(format!(
        "{name}: {:.1} % of the pixels differ by more than {STEPS} of 255 ({:.1} % may), by {} at most; expected, new and 8 \
         times the difference: {}; {how}",
        100.0 * difference.outliers,
        100.0 * outliers,
        difference.largest,
        shown.display()
    ))
}

fn same_size(a: &Picture, b: &Picture) -> bool {
    a.width == b.width && a.pixels.len() == b.pixels.len()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// A ramp of 20 x 10.
    fn ramp() -> Picture {
        Picture { width: 20, pixels: (0..200u8).map(|i| [i, 255 - i, 40]).collect() }
    }

    #[test]
    fn a_changed_image_fails_and_is_shown() {
        let folder = env::temp_dir().join(format!("halflight-snapshots-{}", std::process::id()));
        let (expected, target) = (folder.join("expected"), folder.join("target"));
        let compare = |new: &Picture, accept| compare_in([&expected, &target], "ramp", new, OUTLIERS, accept);
        let mut image = ramp();
        assert!(compare(&image, false).expect_err("fails").contains("--accept"), "nothing is expected yet");
        compare(&image, true).expect("accepted");
        compare(&image, false).expect("the same image");
        // Rounding everywhere, and two pixels of 200 as a whole: the largest that passes.
        image.pixels.iter_mut().for_each(|pixel| pixel[2] += STEPS);
        image.pixels[0] = [255; 3];
        image.pixels[1] = [255, 0, 255];
        compare(&image, false).expect("within the tolerance");
        image.pixels[2] = [255; 3];
        let error = compare(&image, false).expect_err("fails");
        assert!(error.contains("1.5 % of the pixels"), "{error}");
        let shown = Picture::read(&target.join("ramp.png")).expect("the comparison is written");
        assert_eq!((shown.width, shown.pixels.len()), (60, 600));
        assert_eq!((shown.pixels[2], shown.pixels[22], shown.pixels[42]), ([2, 253, 40], [255; 3], [255, 16, 255]));
        image.pixels.truncate(100);
        assert!(compare(&image, false).expect_err("fails").contains("size"));
        fs::remove_dir_all(&folder).expect("the test's own folder");
    }
}
