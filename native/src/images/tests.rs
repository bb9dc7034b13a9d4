#![allow(clippy::unwrap_used)]
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
use super::*;

/// A folder that goes away with the test.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("halflight-images-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn sample_image() -> Image {
    let mut image = Image::new(7, 3);
    let ramp = |scale: f32| (0..21).map(|i| [i as f32 * scale, 0.5, -1.0 / (i + 1) as f32]).collect::<Vec<_>>();
    image.set_rgb("", &ramp(0.1));
    image.set_rgb("albedo", &ramp(0.03));
    image.set_vector("N", &ramp(-0.04));
    image.set_vector("P", &ramp(10_000.0));
    image.set_channel("Z", (0..21).map(|i| if i == 4 { f32::INFINITY } else { 1.0 + i as f32 }).collect());
    image.metadata.insert("settings".into(), "{\"hierarchical.levels\": 4, \"note\": \"½ light\"}".into());
    image.metadata.insert("commit".into(), "0123abc".into());
    image
}

#[test]
fn exr_returns_every_channel_and_the_header() {
    let folder = Scratch::new("exr");
    let path = folder.0.join("new folder/image.exr");
    let image = sample_image();
    assert_eq!(image.write_exr(&path, Precision::Full).unwrap(), 0);
    assert_eq!(Image::read(&path).unwrap(), image);
}

#[test]
fn half_precision_clamps_counts_and_keeps_depth_and_position() {
    let folder = Scratch::new("half");
    let path = folder.0.join("image.exr");
    let mut image = sample_image();
    image.set_channel("big", (0..21).map(|i| [1e6, -1e6, f32::INFINITY, 0.1][i % 4]).collect());
    assert_eq!(image.write_exr(&path, Precision::Half).unwrap(), 11, "6 samples of 1e6 and 5 of -1e6");
    let back = Image::read(&path).unwrap();
    assert_eq!(back.channel("big").unwrap()[..3], [65_504.0, -65_504.0, f32::INFINITY]);
    assert_eq!(back.channel("Z"), image.channel("Z"));
    assert_eq!(back.vector("P"), image.vector("P"), "200,000 does not fit float16");
    for (stored, original) in back.rgb("").unwrap().iter().flatten().zip(image.rgb("").unwrap().iter().flatten()) {
        // float16 keeps 11 bits: half a unit in the last place is at most 2^-11 of the value.
        assert!((stored - original).abs() <= original.abs() / 2048.0 + 1e-7, "{stored} {original}");
    }
}

#[test]
fn surface_mask_leaves_out_sky() {
    let mask = sample_image().surface_mask().unwrap();
    assert_eq!(mask.iter().filter(|surface| !**surface).count(), 1);
    assert!(!mask[4]);
    assert_eq!(Image::new(1, 1).surface_mask(), None);
}

#[test]
fn png_returns_what_it_was_given() {
    let folder = Scratch::new("png");
    let path = folder.0.join("ramp.png");
    let pixels: Vec<Rgb> = (0..200).map(|i| [i as f32 / 255.0, 0.0, 0.25]).collect();
    write_png(&path, 20, &pixels, 1.0).unwrap();
    let image = Image::read(&path).unwrap();
    assert_eq!((image.width, image.height), (20, 10));
    for (read, written) in image.rgb("").unwrap().iter().flatten().zip(pixels.iter().flatten()) {
        // Half an 8-bit step of the sRGB curve, whose slope in linear light is at most 2.3.
        assert!((read - written).abs() <= 2.3 * 0.5 / 255.0, "{read} {written}");
    }
}

#[test]
fn errors_are_one_sentence_with_the_path() {
    let folder = Scratch::new("errors");
    let missing = Image::read(&folder.0.join("no.exr")).unwrap_err().to_string();
    assert!(missing.starts_with("cannot read image") && missing.contains("no.exr"), "{missing}");
    let other = Image::read(Path::new("photo.jpeg")).unwrap_err().to_string();
    assert_eq!(other, "image photo.jpeg is neither .exr nor .png; name it one or the other");
    for name in ["broken.exr", "broken.png"] {
        let path = folder.0.join(name);
        std::fs::write(&path, b"not an image").unwrap();
        let broken = Image::read(&path).unwrap_err().to_string();
        assert!(broken.contains(name) && !broken.contains('\n'), "{broken}");
    }
    let blocked = folder.0.join("broken.png/image.exr");
    let unwritable = sample_image().write_exr(&blocked, Precision::Full).unwrap_err().to_string();
    assert!(unwritable.starts_with("cannot write image"), "{unwritable}");
}

#[test]
fn tone_map_is_straight_then_bends_and_keeps_hue() {
    // Below the shoulder: only exposure and the sRGB curve.
    assert_eq!(tone_map([0.1, 0.2, 0.3], 2.0), [0.2, 0.4, 0.6].map(srgb_encode));
    // Value and slope continue across the shoulder's start.
    let shown = |value: f32| srgb_decode(tone_map([value; 3], 1.0)[0]);
    let slope = |value: f32| (shown(value + 0.005) - shown(value - 0.005)) / 0.01;
    assert!((shown(0.8) - 0.8).abs() < 1e-6);
    // The second derivative jumps from 0 to 5, so a difference over 0.01 sees at most 0.05 of slope.
    assert!((slope(0.8) - 1.0).abs() < 0.05, "{}", slope(0.8));
    // Brighter stays brighter and under 1; the ratio of the channels stays.
    let [red, green, _] = tone_map([2.0, 0.5, 0.0], 1.0).map(srgb_decode);
    assert!(red < 1.0 && red > shown(1.0), "{red}");
    assert!((red / green - 4.0).abs() < 1e-3, "{red} {green}");
    // What a shader should never write still gives a displayable value.
    assert_eq!(tone_map([-1.0, f32::NAN, 0.0], 1.0), [0.0; 3]);
    assert_eq!(tone_map([f32::INFINITY, 1.0, 0.0], 1.0), [1.0, 0.0, 0.0]);
}

#[test]
fn srgb_curve_has_its_published_values_and_inverts() {
    // IEC 61966-2-1: the linear part has slope 12.92; 18 % grey encodes to 0.4613.
    assert_eq!(srgb_encode(0.002), 0.002 * 12.92);
    assert!((srgb_encode(0.18) - 0.4613).abs() < 1e-4);
    for step in 0..=100 {
        let value = step as f32 / 100.0;
        // float32 round-off through two powers.
        assert!((srgb_decode(srgb_encode(value)) - value).abs() < 1e-5);
    }
}

#[test]
fn auto_exposure_places_the_95th_percentile() {
    let pixels: Vec<Rgb> = (1..=101).map(|value| [value as f32; 3]).collect();
    // Ranks 0..=100 hold 1..=101, so the 95th percentile is 96; luminance weights sum to 1 within float32.
    assert!((auto_exposure(&pixels, None) - 0.8 / 96.0).abs() < 1e-6);
    let mask: Vec<bool> = (1..=101).map(|value| value <= 51).collect();
    assert!((auto_exposure(&pixels, Some(&mask)) - 0.8 / 49.0).abs() < 1e-6, "rank 47.5 rounds to 48");
    assert_eq!(auto_exposure(&[[0.0; 3]; 4], None), 1.0);
}

#[test]
fn reads_images_of_another_renderer() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/truth");
    if !folder.is_dir() {
        println!("no ../shared/truth here: images of another renderer are not read");
        return;
    }
    let full = Image::read(&folder.join("cornell_spot_full.exr")).unwrap();
    assert_eq!((full.width, full.height), (256, 256));
    let pixels = full.rgb("").unwrap();
    assert!(pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
    let depth = Image::read(&folder.join("sponza_nave_depth.exr")).unwrap();
    assert_eq!(
        depth.rgb("").unwrap().len(),
        640 * 360,
        "one grey channel stands for R, G and B: {:?}",
        depth.channels.keys()
    );
}
