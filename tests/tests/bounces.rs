//! Bounces after the first.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use halflight_evaluator::experiment::session::{Frames, Session};
use halflight_native::images::Rgb;
use halflight_renderer::{plan_frame, scene::SceneFacts};
use halflight_scenes::{CameraKeyframe, Light, Moves};
use halflight_soundness::{oracle::GBuffer, scenes};
use halflight_tests::{bundled, device, frames, known, mean_luminance, request, settings};

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

/// Two bounces that take turns, with little noise.
const INTERLEAVED: [(&str, &str); 5] = [
    ("bounces", "2"),
    ("bounce_interleaving", "on"),
    ("storage", "float32"),
    ("start_resolution", "half"),
    ("disc_area", "texel"),
];

fn indirect(frames: &Frames) -> Vec<Rgb> {
    frames.read_rgb("indirect").unwrap().unwrap()
}

#[test]
fn interleaved_bounces_cost_one_gather() {
    let plan = |bounces, interleaving| {
        let values = settings("hierarchical", &[("bounces", bounces), ("bounce_interleaving", interleaving)]);
        let facts = SceneFacts::of(&scenes::court());
        plan_frame(&facts, known("hierarchical"), &values, [64, 36], Default::default()).unwrap()
    };
    let (one, two) = (plan("1", "off"), plan("2", "on"));
    let names = two.passes.iter().map(|pass| pass.name.as_str());
    let added: Vec<_> = names.filter(|name| one.find(name).is_none()).collect();
    let relit = ["relight_4_bounce_2", "relight_8_bounce_2", "relight_16_bounce_2", "relight_32_bounce_2"];
    assert_eq!(added, [&["recall_bounce", "albedo_of_surfels"][..], &relit, &["interleave_bounces"]].concat());
    assert!(one.passes.iter().all(|pass| two.find(&pass.name).is_some()), "nothing else is left out");
    // It is for two bounces.
    for bounces in ["0", "1", "3"] {
        assert_eq!(plan(bounces, "on"), plan(bounces, "off"));
    }
}

#[test]
fn interleaved_bounces_are_two_bounces() {
    let scene = scenes::court();
    let here = scene.camera;
    let key = |frame, eye| CameraKeyframe { frame, eye, target: here.target, cut: false };
    let mut moving = scene.clone();
    moving.moves = Moves { camera: vec![key(0, here.eye), key(16, [0.5, 1.3, 3.6])], ..Moves::default() };
    let size = [64, 36];
    for (scene, what, last) in [(&scene, "still", 33), (&moving, "a moving camera", 16)] {
        let session = Session::new(device(), scene);
        let mean = |more: &[(&str, &str)]| -> f64 {
            let mut run = frames(&session, &request("hierarchical", &[&INTERLEAVED[..], more].concat(), size));
            // The first frame has one bounce alone.
            let means = (0..=last).map(|frame| {
                run.run(frame).unwrap();
                mean_luminance(&indirect(&run))
            });
            means.skip(1).sum::<f64>() / f64::from(last)
        };
        let [both, one, two] = [&[][..], &[("bounces", "1")], &[("bounce_interleaving", "off")]].map(mean);
        println!("{what}: {both:.4} interleaved, {two:.4} both bounces, {one:.4} the first one");
        // The second bounce within a tenth of itself: the court's is a twelfth of all light.
        assert!(two > 1.05 * one && (both - two).abs() < 0.1 * (two - one), "{what}: {both} for {two}, of it {one}");
    }
}

#[test]
fn interleaved_bounces_scale_with_light_and_start_anew_after_a_cut() {
    let scene = scenes::court();
    let mut bright = scene.clone();
    for light in &mut bright.lights {
        if let Light::Directional { irradiance, .. } = light {
            *irradiance = irradiance.map(|v| v * 16.0);
        }
    }
    let request = request("hierarchical", &INTERLEAVED, [64, 36]);
    let at = |scene, first: u32| {
        let session = Session::new(device(), scene);
        let mut run = frames(&session, &request);
        run.run(first).unwrap();
        let alone = indirect(&run);
        run.run(first + 1).unwrap();
        (alone, indirect(&run))
    };
    // A power of two moves exponents and no mantissa.
    let (plain, bright) = (at(&scene, 0), at(&bright, 0));
    let times: Vec<Rgb> = plain.1.iter().map(|pixel| pixel.map(|v| v * 16.0)).collect();
    assert!(times == bright.1, "light that is remembered scales, too");
    // A first frame has the first bounce, whatever its number.
    let one = |frame| {
        let session = Session::new(device(), &scene);
        let settings = [&INTERLEAVED[..], &[("bounces", "1")]].concat();
        let mut run = frames(&session, &halflight_tests::request("hierarchical", &settings, [64, 36]));
        run.run(frame).unwrap();
        indirect(&run)
    };
    for first in [0, 5] {
        assert!(at(&scene, first).0 == one(first), "frame {first}");
    }
}
