#![allow(clippy::unwrap_used)]
use super::*;
use crate::tone::tone_map_all;

/// All linear metrics of a pair.
#[derive(Debug, PartialEq)]
struct LinearErrors {
    rel_mse: f64,
    rmse: f64,
    bias: f64,
    p95_abs: f64,
    p999_abs: f64,
    best_factor: f64,
    scaled_rel_mse: f64,
}

fn linear_errors(image: &[Rgb], reference: &[Rgb], mask: Option<&[bool]>) -> LinearErrors {
    let pair = &LinearPair::new(image, reference, mask);
    LinearErrors {
        rel_mse: rel_mse(pair),
        rmse: rmse(pair),
        bias: bias(pair),
        p95_abs: p95_abs(pair),
        p999_abs: p999_abs(pair),
        best_factor: best_factor(pair),
        scaled_rel_mse: scaled_rel_mse(pair),
    }
}

/// All display metrics of a pair.
#[derive(Debug)]
struct DisplayErrors {
    psnr_db: f64,
    ssim: f64,
    flip: f64,
    hdr_flip: f64,
}

/// A smooth, coloured, positive test image.
fn picture(width: u32, height: u32) -> Vec<Rgb> {
    let wave = |x: f32, y: f32, phase: f32| 0.6 + 0.5 * (0.3 * x + phase).sin() * (0.2 * y - phase).cos();
    (0..width * height)
        .map(|index| {
            let (x, y) = ((index % width) as f32, (index / width) as f32);
            [wave(x, y, 0.0), wave(x, y, 1.0), wave(x, y, 2.0)]
        })
        .collect()
}

fn map(image: &[Rgb], change: impl Fn(f32) -> f32) -> Vec<Rgb> {
    image.iter().map(|pixel| pixel.map(&change)).collect()
}

/// Repeatable noise in -1..1 (a 32-bit linear congruential generator's upper bits).
fn noise(count: usize) -> Vec<f32> {
    let mut state = 1u32;
    (0..count)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        })
        .collect()
}

fn noisy(image: &[Rgb], amplitude: f32) -> Vec<Rgb> {
    let noise = noise(image.len() * 3);
    image.iter().zip(noise.as_chunks::<3>().0).map(|(p, n)| std::array::from_fn(|c| p[c] + amplitude * n[c])).collect()
}

fn display(image: &[Rgb], reference: &[Rgb], width: u32) -> DisplayErrors {
    let shown = [tone_map_all(image, 1.0), tone_map_all(reference, 1.0)];
    let mut values = Values::default();
    values.measure_final(&DisplayPair {
        width,
        linear: [image, reference],
        display: [&shown[0], &shown[1]],
        mask: None,
    });
    let value = |id| values.get(id).unwrap();
    DisplayErrors {
        psnr_db: value(MetricId::FinalPsnrDb),
        ssim: value(MetricId::FinalSsim),
        flip: value(MetricId::FinalFlip),
        hdr_flip: value(MetricId::FinalHdrFlip),
    }
}

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
}

#[test]
fn equal_images_have_no_error() {
    let image = picture(40, 30);
    let linear = linear_errors(&image, &image, None);
    let none = LinearErrors {
        rel_mse: 0.0,
        rmse: 0.0,
        bias: 0.0,
        p95_abs: 0.0,
        p999_abs: 0.0,
        best_factor: 1.0,
        scaled_rel_mse: 0.0,
    };
    assert_eq!(linear, none);
    let display = display(&image, &image, 40);
    assert_eq!(display.psnr_db, f64::INFINITY);
    close(display.ssim, 1.0, 1e-6); // float32 map
    assert_eq!((display.flip, display.hdr_flip), (0.0, 0.0));
    // Black against black is equal too: nothing divides by zero.
    let black = vec![[0.0; 3]; 16];
    assert_eq!(linear_errors(&black, &black, None).rel_mse, 0.0);
}

#[test]
fn a_constant_offset_has_closed_forms() {
    // Reference t = 2 everywhere, image 2.5: relMSE = 0.25 / (4 + 0.01 * 4).
    let reference = vec![[2.0; 3]; 100];
    let errors = linear_errors(&map(&reference, |value| value + 0.5), &reference, None);
    close(errors.rel_mse, 0.25 / 4.04, 1e-12);
    for value in [errors.rmse, errors.bias, errors.p95_abs, errors.p999_abs] {
        close(value, 0.5, 1e-12);
    }
    close(linear_errors(&map(&reference, |value| value - 0.5), &reference, None).bias, -0.5, 1e-12);
    // Display values that differ by 0.1 everywhere: PSNR = -20 log10(0.1) = 20 dB; 1e-5 for float32 values.
    let (dim, bright) = (vec![[0.4f32; 3]; 9], vec![[0.5f32; 3]; 9]);
    close(psnr_db(&dim, &bright, None), 20.0, 1e-5);
    // SSIM of flat images is its luminance term alone.
    close(ssim(&dim, &bright, 3, None), (2.0 * 0.4 * 0.5 + 1e-4) / (0.16 + 0.25 + 1e-4), 1e-6);
}

#[test]
fn the_best_factor_undoes_an_exposure_and_nothing_else() {
    let reference = picture(40, 30);
    let dimmed = linear_errors(&map(&reference, |value| 0.125 * value), &reference, None);
    // An eighth is exact in float32.
    close(dimmed.best_factor, 8.0, 1e-12);
    close(dimmed.scaled_rel_mse, 0.0, 1e-12);
    // Reference 1 and 3 with mean 2, image 2 everywhere: weights w = 1 / (t^2 + 0.04), factor f = sum(w t) / (2 sum(w)).
    let reference = [[1.0; 3], [3.0; 3]];
    let errors = linear_errors(&[[2.0; 3]; 2], &reference, None);
    let weights = [1.0 / 1.04, 1.0 / 9.04];
    let factor = (weights[0] + 3.0 * weights[1]) / (2.0 * (weights[0] + weights[1]));
    close(errors.best_factor, factor, 1e-12);
    let left = weights[0] * (2.0 * factor - 1.0).powi(2) + weights[1] * (2.0 * factor - 3.0).powi(2);
    close(errors.scaled_rel_mse, left / 2.0, 1e-12);
    // Black has no exposure.
    let black = linear_errors(&[[0.0; 3]; 2], &reference, None);
    assert_eq!((black.best_factor, black.scaled_rel_mse), (1.0, black.rel_mse));
}

#[test]
fn percentiles_see_the_outliers() {
    // 999 pixels right, one wrong by 10 in each channel.
    let reference = vec![[1.0; 3]; 1000];
    let mut image = reference.clone();
    image[500] = [11.0; 3];
    let errors = linear_errors(&image, &reference, None);
    assert_eq!(errors.p95_abs, 0.0);
    // 3000 samples, rank 0.999 * 2999 = 2996.001: a thousandth of the way from the last 0 (2996) to the first 10.
    close(errors.p999_abs, 0.01, 1e-6);
    close(errors.bias, 0.01, 1e-12);
    close(errors.rmse, (100.0f64 / 1000.0).sqrt(), 1e-12);
}

#[test]
fn masked_pixels_count_nowhere() {
    let reference = picture(32, 32);
    let mut image = noisy(&reference, 0.05);
    let mask: Vec<bool> = (0..1024).map(|index| index >= 320).collect();
    let before = linear_errors(&image, &reference, Some(&mask));
    let psnr = psnr_db(&image, &reference, Some(&mask));
    let exposures = hdr_exposures(&reference, Some(&mask));
    image[..320].fill([1e6; 3]);
    assert_eq!(linear_errors(&image, &reference, Some(&mask)), before);
    assert_eq!(psnr_db(&image, &reference, Some(&mask)), psnr);
    let mut brighter = reference.clone();
    brighter[..320].fill([1e6; 3]);
    assert_eq!(hdr_exposures(&brighter, Some(&mask)), exposures);
    // The mean, too: m of relMSE belongs to the surfaces alone.
    assert_eq!(mean(&brighter, Some(&mask)), mean(&reference, Some(&mask)));
    assert!(linear_errors(&image, &reference, Some(&[false; 1024])).rmse.is_nan());
}

#[test]
fn relative_errors_do_not_depend_on_the_scale_of_light() {
    let reference = picture(32, 16);
    let image = noisy(&reference, 0.1);
    let (bright, bright_reference) = (map(&image, |value| value * 1000.0), map(&reference, |value| value * 1000.0));
    let (here, there) = (linear_errors(&image, &reference, None), linear_errors(&bright, &bright_reference, None));
    close(there.rel_mse / here.rel_mse, 1.0, 1e-4); // float32 products
    close(there.rmse / here.rmse, 1000.0, 0.1);
    // HDR-FLIP picks its exposures from the reference, so it is invariant as well (up to 8-bit rounding of its inputs).
    let hdr = |image: &[Rgb], reference: &[Rgb]| masked_mean(&hdr_flip_map(image, reference, 32, None), None);
    close(hdr(&bright, &bright_reference), hdr(&image, &reference), 2e-3);
}

#[test]
fn more_noise_is_worse_by_every_metric() {
    let reference = picture(64, 48);
    let [little, much] = [0.02, 0.2].map(|amplitude| noisy(&reference, amplitude));
    let (a, b) = (linear_errors(&little, &reference, None), linear_errors(&much, &reference, None));
    // Uniform noise of amplitude A has RMSE A / sqrt(3); 3 % for 9216 samples.
    close(b.rmse, 0.2 / 3f64.sqrt(), 0.03 * 0.2 / 3f64.sqrt());
    assert!(a.rel_mse < b.rel_mse && a.p95_abs < b.p95_abs && a.p999_abs < b.p999_abs);
    let (a, b) = (display(&little, &reference, 64), display(&much, &reference, 64));
    assert!(a.psnr_db > b.psnr_db && a.ssim > b.ssim && a.flip < b.flip && a.hdr_flip < b.hdr_flip, "{a:?} {b:?}");
    // FLIP and HDR-FLIP are bounded, and HDR-FLIP is a maximum over exposures.
    assert!(b.flip > 0.0 && b.hdr_flip <= 1.0);
}

#[test]
fn ssim_is_symmetric_and_sees_structure_before_brightness() {
    let reference = map(&picture(64, 48), |value| value * 0.5);
    let image = noisy(&reference, 0.1);
    let (there, back) = (ssim(&image, &reference, 64, None), ssim(&reference, &image, 64, None));
    close(there, back, 1e-9);
    // A constant shift and noise of the same RMSE: the shift keeps the structure (Wang et al. 2004, Fig. 2).
    let shifted = map(&reference, |value| value + 0.1 / 3f32.sqrt());
    assert!(ssim(&shifted, &reference, 64, None) > there + 0.1);
    // Inverted contrast is anti-correlated.
    assert!(ssim(&map(&reference, |value| 0.6 - value), &reference, 64, None) < 0.0);
}

#[test]
fn ssim_agrees_with_a_direct_sum() {
    // The separable window against Eq. 13 to 16 summed over an 11x11 neighbourhood, away from the border.
    let (x, y) = (noisy(&picture(21, 17), 0.1), picture(21, 17));
    let luma = |pixel: Rgb| 0.299 * f64::from(pixel[0]) + 0.587 * f64::from(pixel[1]) + 0.114 * f64::from(pixel[2]);
    let (mut weight_sum, mut sums) = (0.0, [0.0; 5]);
    for v in -5i32..=5 {
        for u in -5i32..=5 {
            let weight = (-f64::from(u * u + v * v) / (2.0 * 1.5 * 1.5)).exp();
            let at = ((8 + v) * 21 + 10 + u) as usize;
            let (a, b) = (luma(x[at]), luma(y[at]));
            weight_sum += weight;
            for (sum, term) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                *sum += weight * term;
            }
        }
    }
    let [mx, my, xx, yy, xy] = sums.map(|sum| sum / weight_sum);
    let expected = (2.0 * mx * my + 1e-4) * (2.0 * (xy - mx * my) + 9e-4)
        / ((mx * mx + my * my + 1e-4) * (xx - mx * mx + yy - my * my + 9e-4));
    close(f64::from(ssim_map(&x, &y, 21)[8 * 21 + 10]), expected, 1e-6); // stored as float32
}

#[test]
fn flip_of_black_and_white_is_its_published_maximum() {
    // Andersson et al. 2020: the error is mapped to 0..1; flat black against flat white differs in colour, not in edges.
    let (black, white) = (vec![[0.0; 3]; 32 * 32], vec![[1.0; 3]; 32 * 32]);
    let error = masked_mean(&flip_map(&white, &black, 32), None);
    assert!(error > 0.9 && error <= 1.0, "{error}");
    close(masked_mean(&flip_map(&black, &white, 32), None), error, 1e-6); // the metric is symmetric
}

#[test]
fn hdr_exposures_follow_the_paper() {
    // ACES maps x to 0.85 at the positive root; for a reference of luminance 4 and 1, the range is log2(4) = 2 stops.
    let reference: Vec<Rgb> = (0..101).map(|index| [if index == 0 { 4.0 } else { 1.0 }; 3]).collect();
    let Exposures { start, stop, count } = hdr_exposures(&reference, None);
    close(stop - start, 2.0, 1e-6); // luminance weights sum to 1 in float32
    assert_eq!(count, 2);
    let x = stop.exp2();
    let aces = (0.9036 * x * x + 0.018 * x) / (0.8748 * x * x + 0.354 * x + 0.14);
    close(aces, 0.85, 1e-6);
    // A black median and a black reference still give a finite number.
    let mut dark = vec![[0.0; 3]; 100];
    assert_eq!(hdr_exposures(&dark, None).count, 2);
    dark[0] = [1.0; 3];
    assert_eq!(hdr_exposures(&dark, None).count, 16);
}

#[test]
fn display_metrics_take_the_smallest_images() {
    for (width, height) in [(1, 1), (3, 1), (1, 4)] {
        let reference = picture(width, height);
        let errors = display(&map(&reference, |value| value * 0.5), &reference, width);
        assert!(errors.ssim.is_finite() && errors.flip > 0.0 && errors.hdr_flip > 0.0, "{width}x{height} {errors:?}");
    }
}

#[test]
fn blocks_average_noise_away() {
    let image: Vec<Rgb> = (0..15).map(|index| [index as f32, 1.0, 0.0]).collect();
    // 5x3 pixels in blocks of 2: 3x2 blocks, the last column one pixel wide, the last row one pixel high.
    let blocks = block_mean(&image, 5, 2, None);
    assert_eq!(blocks.iter().map(|block| block[0]).collect::<Vec<_>>(), [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
    assert!(blocks.iter().all(|block| block[1] == 1.0));
    // Without pixels 0, 4 and 9 the first block averages 1, 5, 6 and the third is gone.
    let mask: Vec<bool> = (0..15).map(|index| ![0, 4, 9].contains(&index)).collect();
    let blocks = block_mean(&image, 5, 2, Some(&mask));
    assert_eq!(blocks.iter().map(|block| block[0]).collect::<Vec<_>>(), [4.0, 5.0, 10.5, 12.5, 14.0]);

    let reference = vec![[2.0; 3]; 64 * 64];
    let image = noisy(&reference, 0.3);
    let pixels = relative_rmse(&image, &reference);
    let blocks = relative_rmse(&block_mean(&image, 64, 8, None), &block_mean(&reference, 64, 8, None));
    close(pixels, 0.3 / 3f64.sqrt() / 2.0, 0.005); // 12,288 samples: 1 % of 0.087, several times over
    // 64 independent pixels a block: an eighth of the noise; 192 blocks know it to 5 %, three times that is allowed.
    close(blocks / pixels, 0.125, 0.02);
    close(relative_rmse(&map(&reference, |value| value * 1.1), &reference), 0.1, 1e-6);
}

#[test]
fn block_rel_mse_by_hand() {
    // 6x5 pixels: blocks of 4x4, 2x4, 4x1 and 2x1. The reference is 2 everywhere, so the floor is 0.01 * 2^2.
    let reference = vec![[2.0; 3]; 30];
    let mut image = reference.clone();
    // In the first block, +3 and -3 cancel, and 8 stays: its mean is 0.5 too high.
    for (pixel, change) in [(0, 3.0), (1, -3.0), (7, 8.0)] {
        image[pixel] = image[pixel].map(|value| value + change);
    }
    // The last block, 2x1 pixels, is black.
    image[28] = [0.0; 3];
    image[29] = [0.0; 3];
    let denominator = 4.0 + 0.04;
    let error = |mask| block_rel_mse(&LinearPair::new(&image, &reference, mask), 6);
    close(error(None), (16.0 * 0.25 + 2.0 * 4.0) / denominator / 30.0, 1e-12);
    // Sky in the first row: the first block keeps 12 pixels, and 8 is on one of them.
    let mask: Vec<bool> = (0..30).map(|pixel| pixel >= 6).collect();
    close(error(Some(&mask)), (12.0 * (8f64 / 12.0).powi(2) + 2.0 * 4.0) / denominator / 24.0, 1e-12);
    // Only sky in the last row: its two blocks are gone.
    let mask: Vec<bool> = (0..30).map(|pixel| pixel < 24).collect();
    close(error(Some(&mask)), 16.0 * 0.25 / denominator / 24.0, 1e-12);
    // One error in all pixels is the same over blocks.
    let brighter = map(&reference, |value| value * 1.5);
    let pair = LinearPair::new(&brighter, &reference, None);
    close(block_rel_mse(&pair, 6), rel_mse(&pair), 1e-12);
    assert!(block_rel_mse(&LinearPair::new(&image, &reference, Some(&[false; 30])), 6).is_nan());
}

#[test]
fn error_maps_run_from_black_to_pale_yellow() {
    let reference = vec![[1.0; 3]; 5];
    let image = [1.0, 1.5, 2.0, 1e9, f32::NAN].map(|value| [value; 3]);
    let error = relative_error(&image, &reference, None);
    assert_eq!(error[0], 0.0);
    close(f64::from(error[2]), 1.0 / 1.01f64.sqrt(), 1e-6);
    let mask = [true, true, false, true, true];
    let colours = error_map(&error, 1.0, Some(&mask));
    assert_eq!(colours[0], colour_map()[0]);
    assert_eq!(colours[2], [96; 3]);
    assert_eq!(colours[3], colour_map()[255]);
    assert_eq!(colours[4], [0, 255, 0]);
    // Magma's ends, as published by its authors (matplotlib): (0, 0, 4) and (252, 253, 191).
    assert_eq!((colour_map()[0], colour_map()[255]), ([0, 0, 4], [252, 253, 191]));
    assert_eq!(colour_map().len(), 256);
    let brightness = |colour: &[u8; 3]| colour.iter().map(|&value| u32::from(value)).sum::<u32>();
    assert!(brightness(&colours[0]) < brightness(&colours[1]) && brightness(&colours[1]) < brightness(&colours[3]));
}

#[test]
fn values_of_one_image_are_measured_by_the_table() {
    let reference = picture(16, 8);
    let image = noisy(&reference, 0.1);
    let pair = LinearPair::new(&image, &reference, None);
    let mut values = Values::default();
    values.measure_indirect(&pair, 16);
    for metric in METRICS {
        let expected = match metric.function {
            Function::Indirect(of) => Some(of(&pair)),
            Function::IndirectBlocks(of) => Some(of(&pair, 16)),
            _ => None,
        };
        assert_eq!(values.get(metric.id), expected, "{}", metric.key);
    }
    values.measure_occlusion(&pair);
    assert_eq!(values.get(MetricId::OcclusionRmse), values.get(MetricId::IndirectRmse));
}
