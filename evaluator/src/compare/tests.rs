#![allow(clippy::unwrap_used)]
use halflight_metrics::MetricId;
use halflight_native::images::{Precision, write_png};

use super::*;

fn bias(layer: &LayerComparison) -> f64 {
    layer.values.get(MetricId::IndirectBias).unwrap()
}

/// Runs `test` with a folder of its own that goes away.
fn in_folder(name: &str, test: impl FnOnce(&Path)) {
    let folder = std::env::temp_dir().join(format!("halflight-compare-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    test(&folder);
    std::fs::remove_dir_all(folder).unwrap();
}

/// A 16x16 frame whose top row is sky; every surface pixel reflects `level` of indirect light.
fn frame(level: f32) -> Image {
    let mut image = Image::new(16, 16);
    let pixel = |index: usize, value: f32| if index < 16 { [50.0; 3] } else { [value; 3] };
    image.set_rgb("", &(0..256).map(|index| pixel(index, 0.5 + level)).collect::<Vec<_>>());
    image.set_rgb("albedo", &(0..256).map(|index| pixel(index, 0.5)).collect::<Vec<_>>());
    image.set_rgb("indirect", &(0..256).map(|index| pixel(index, level)).collect::<Vec<_>>());
    image.set_channel("Z", (0..256).map(|index| if index < 16 { f32::INFINITY } else { 3.0 }).collect());
    image
}

#[test]
fn layers_are_measured_without_the_sky() {
    in_folder("exr", |folder| {
        let (a, b) = (folder.join("a.exr"), folder.join("b.exr"));
        frame(0.3).write_exr(&a, Precision::Full).unwrap();
        frame(0.2).write_exr(&b, Precision::Full).unwrap();
        let found = compare(&a, &b).unwrap();
        assert_eq!(found.counted_pixels, 240);
        let [whole, indirect] = &found.layers[..] else { panic!("two layers: {:?}", found.layers) };
        // 0.8 against 0.7 and 0.5 * 0.3 against 0.5 * 0.2, up to float32.
        assert!((bias(whole) - 0.1).abs() < 1e-6 && (bias(indirect) - 0.05).abs() < 1e-6);
        assert!((indirect.block_relative_rmse - 0.5).abs() < 1e-6);
        assert!((found.exposure - 0.8 / 0.7).abs() < 1e-5, "exposed for the surfaces, not for the sky");

        let text = found.to_string();
        assert!(text.contains("93.8 % of the pixels count") && text.contains("+50.0 %"), "{text}");
        let json = serde_json::to_value(&found).unwrap();
        assert!((json["layers"][1]["bias"].as_f64().unwrap() - 0.05).abs() < 1e-6);
        assert_eq!(serde_json::from_value::<Comparison>(json).unwrap(), found);
    });
}

#[test]
fn png_is_compared_as_shown() {
    in_folder("png", |folder| {
        let (a, b) = (folder.join("a.png"), folder.join("b.png"));
        let ramp: Vec<Rgb> = (0..256).map(|index| [index as f32 / 255.0; 3]).collect();
        write_png(&a, 16, &ramp, 1.0).unwrap();
        write_png(&b, 16, &ramp, 1.0).unwrap();
        let found = compare(&a, &b).unwrap();
        assert_eq!((found.exposure, found.layers[0].values.get(MetricId::FinalPsnrDb)), (1.0, Some(f64::INFINITY)));
        assert_eq!(found.notes.len(), 2);
        let back: Comparison = serde_json::from_str(&serde_json::to_string(&found).unwrap()).unwrap();
        assert_eq!(back, found, "an infinite PSNR survives JSON");
    });
}

#[test]
fn bad_input_is_one_sentence() {
    in_folder("bad", |folder| {
        let (a, b, c) = (folder.join("a.exr"), folder.join("b.exr"), folder.join("c.exr"));
        frame(0.1).write_exr(&a, Precision::Half).unwrap();
        let mut small = Image::new(2, 2);
        small.set_rgb("", &[[0.0; 3]; 4]);
        small.write_exr(&b, Precision::Full).unwrap();
        let mut other = Image::new(16, 16);
        other.set_vector("N", &[[0.0; 3]; 256]);
        other.write_exr(&c, Precision::Full).unwrap();
        for (image, reference, part) in [
            (&a, &b, "a.exr is 16x16 but"),
            (&a, &c, "share no layer"),
            (&a, &folder.join("no.exr"), "no.exr: No such file"),
        ] {
            let error = compare(image, reference).unwrap_err();
            assert!(error.to_string().contains(part), "{error}");
            assert_eq!((error.exit_code(), error.to_string().lines().count()), (2, 1));
        }
    });
}
