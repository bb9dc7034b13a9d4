//! Bounces after the first.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use halflight_evaluator::session::Session;
use halflight_tests::{bundled, device, frames, mean_luminance, oracle::GBuffer, request, scenes};

/// Light of the first bounces, then of more, luminance.
fn light(name: &str, bounces: u32, more: &[(&str, &str)], count: u32) -> f64 {
    let scene = bundled(name);
    let session = Session::new(device(), &scene);
    let bounces = bounces.to_string();
    let base = [("bounces", bounces.as_str()), ("storage", "float32"), ("start_resolution", "half")];
    let request = request("hierarchical", &[&base[..], more].concat(), [128, 72]);
    let mut frames = frames(&session, &request);
    mean_luminance(&frames.mean_over_frames("indirect", count).unwrap().0)
}

#[test]
fn the_white_room_stays_under_the_geometric_series() {
    // Radiance 0.5 leaves every surface of albedo 0.5: bounce n brings 0.5^n, and all of them 1 in the end. The screen
    // shows a part of the room, so every bounce brings less than that.
    for more in [&[][..], &[("disc_area", "texel")], &[("visibility", "auto")]] {
        let sums: Vec<f64> = [1, 2, 3, 4, 8].map(|bounces| light("furnace", bounces, more, 4)).into();
        println!("{more:?}: {sums:.4?}");
        for (sum, bounces) in sums.iter().zip([1, 2, 3, 4, 8]) {
            let series = 1.0 - 0.5f64.powi(bounces);
            // A thousandth for the noise that four frames leave in a mean of 9216 pixels.
            assert!(*sum < series + 1e-3, "{more:?}: {sum} after {bounces} bounces of {series}");
        }
        assert!(sums.is_sorted(), "each bounce adds light: {sums:?}");
        // Each step towards the truth is smaller than the one before it, by albedo or more.
        let steps: Vec<f64> = sums[..4].windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(
            steps[0] < 0.5 * sums[0] + 1e-3 && steps[1] < 0.5 * steps[0] + 1e-3 && steps[2] < 0.5 * steps[1] + 1e-3
        );
    }
}

#[test]
fn no_bounce_is_no_light_and_one_is_the_default() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
    let image = |settings: &[(&str, &str)]| {
        halflight_tests::render(&session, &request("hierarchical", settings, [64, 36]), "final")
    };
    assert!(image(&[("bounces", "0")]) == image(&[("hierarchical.bounces", "0")]));
    assert!(image(&[]) == image(&[("bounces", "1")]));
    let direct = halflight_tests::render(&session, &request("none", &[], [64, 36]), "direct");
    assert!(image(&[("bounces", "0")]) == direct);
    // The first bounce is the same whether or not others follow it.
    assert!(mean_luminance(&image(&[("bounces", "2")])) > mean_luminance(&image(&[])));
}

#[test]
fn the_second_bounce_is_that_of_the_exhaustive_sum() {
    // Every pixel sums over every pixel twice, in double precision, reflected by albedo in between.
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
    let size = [64, 36];
    for (start, tolerance) in [("full", 0.05), ("half", 0.08)] {
        let settings = |bounces| {
            [
                ("bounces", bounces),
                ("start_resolution", start),
                ("disc_area", "texel"),
                ("levels", "2"),
                ("samples", "256"),
            ]
        };
        let mean = |bounces| {
            let mut frames = frames(&session, &request("hierarchical", &settings(bounces), size));
            let image = frames.mean_over_frames("indirect", 24).unwrap().0;
            (frames, mean_luminance(&image))
        };
        let (frames, first) = mean("1");
        let second = mean("2").1 - first;
        let mut gbuffer = GBuffer::read(&frames);
        let albedo = frames.read_rgb("albedo").unwrap().unwrap();
        let luminance = |light: &[DVec3]| {
            let pixels: Vec<_> = light.iter().map(|l| l.as_vec3().to_array()).collect();
            mean_luminance(&pixels)
        };
        let once = gbuffer.exhaustive(true);
        for ((pixel, light), albedo) in gbuffer.pixels.iter_mut().zip(&once).zip(&albedo) {
            pixel.radiance = *light * DVec3::from(albedo.map(f64::from));
        }
        let twice = gbuffer.exhaustive(true);
        let ratios = [first / luminance(&once), second / luminance(&twice)];
        println!("{start}: first bounce {:.4}, second bounce {:.4} of the exhaustive sum", ratios[0], ratios[1]);
        // What convergence.rs allows one gather; a second one may double it, a coarser start on so small an image adds.
        assert!(
            (ratios[0] - 1.0).abs() < tolerance && (ratios[1] - 1.0).abs() < 2.0 * tolerance,
            "{start}: {ratios:?}"
        );
    }
}
