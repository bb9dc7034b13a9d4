//! The glossy last bounce: where samples are drawn, and what they bring.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use halflight_evaluator::experiment::session::Session;
use halflight_native::truth::TruthSource;
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_renderer::{plan_frame, plan_technique, scene::SceneFacts};
use halflight_scenes::Scene;
use halflight_soundness::{
    oracle::GBuffer,
    scenes::{self, polished},
};
use halflight_tests::{device, frames, known, mean_luminance, request, settings};

#[test]
fn gloss_costs_nothing_where_no_material_has_any_or_the_switch_is_off() {
    let plan = |scene: &Scene, glossy| {
        let values = settings("hierarchical", &[("glossy", glossy)]);
        plan_frame(&SceneFacts::of(scene), known("hierarchical"), &values, [64, 36], Default::default()).unwrap()
    };
    let (matt, polished) = (scenes::court(), polished(32.0));
    assert_eq!(plan(&matt, "on"), plan(&matt, "off"));
    let (off, on) = (plan(&polished, "off"), plan(&polished, "on"));
    assert_eq!(off, plan(&matt, "off"));
    let names: Vec<&str> = on.passes.iter().map(|pass| pass.name.as_str()).collect();
    let added: Vec<_> = names.into_iter().filter(|name| off.find(name).is_none()).collect();
    let gathers = ["gather_0_glossy", "gather_1_glossy", "gather_2_glossy", "gather_3_glossy"];
    let combines = ["combine_2_glossy", "combine_1_glossy", "combine_0_glossy", "upsample_glossy"];
    assert_eq!(added, [&gathers[..], &combines].concat());
    assert_eq!(on.find("composite").unwrap().shader.name, "composite/composite+float16+glossy");
    // A filter over frames has a history of its own for it.
    let filtered = |glossy| {
        let values = settings("hierarchical", &[("glossy", glossy), ("temporal_a", "0.9")]);
        plan_frame(&SceneFacts::of(&polished), known("hierarchical"), &values, [64, 36], Default::default()).unwrap()
    };
    let (without, with) = (filtered("off"), filtered("on"));
    let names = with.passes.iter().map(|pass| pass.name.as_str());
    let added: Vec<_> = names.filter(|name| without.find(name).is_none() && on.find(name).is_none()).collect();
    assert_eq!(added, ["temporal_glossy"]);
    // On textures alone there are no materials: nothing glossy is planned.
    let alone =
        plan_technique(known("hierarchical"), &settings("hierarchical", &[("glossy", "on")]), [64, 36]).unwrap();
    assert!(!alone.outputs.contains_key("glossy"));
}

const SIZE: [u32; 2] = [256, 144];
const FRAMES: u32 = 24;

/// Mean over many frames, and the variance of one, of the glossy light.
fn measured(session: &Session, importance: &str, samples: &str) -> (f64, f64) {
    let settings = [
        ("glossy", "on"),
        ("glossy_importance", importance),
        ("samples", samples),
        ("disc_area", "texel"),
        ("storage", "float32"),
    ];
    let request = request("hierarchical", &settings, SIZE);
    let (image, deviation) = frames(session, &request).mean_over_frames("glossy", FRAMES).unwrap();
    (mean_luminance(&image), deviation * deviation)
}

#[test]
fn importance_keeps_the_mean_and_lowers_the_variance() {
    for exponent in [4.0, 32.0, 128.0] {
        let scene = polished(exponent);
        let session = Session::new(device(), &scene);
        let [even, paper, lobe] = ["off", "2010", "lobe"].map(|importance| measured(&session, importance, "16"));
        for (name, drawn, least) in [("2010", paper, 1.0), ("lobe", lobe, 4.0)] {
            let (ratio, gain) = (drawn.0 / even.0, even.1 / drawn.1);
            // Pixels share their noise within a texel: 16 x 16 of them at level 2. Four deviations of the difference of
            // two such means.
            let pixels = f64::from(SIZE[0] * SIZE[1] * FRAMES);
            let noise = 4.0 * (256.0 * (even.1 + drawn.1) / pixels).sqrt() / even.0;
            println!(
                "exponent {exponent}, {name}: mean {ratio:.4} of even sampling's (noise {noise:.4}), \
                 variance {gain:.2} times lower"
            );
            assert!((ratio - 1.0).abs() < noise, "exponent {exponent}, {name}: {ratio}");
            assert!(gain > least, "exponent {exponent}, {name}: {gain}");
        }
    }
}

#[test]
fn glossy_light_is_that_of_the_exhaustive_sum() {
    for exponent in [4.0, 32.0] {
        let scene = polished(exponent);
        let session = Session::new(device(), &scene);
        let values = [
            ("glossy", "on"),
            ("start_resolution", "full"),
            ("levels", "1"),
            ("disc_area", "texel"),
            ("samples", "256"),
            ("storage", "float32"),
        ];
        let mut frames = frames(&session, &request("hierarchical", &values, [64, 36]));
        let image = frames.mean_over_frames("glossy", 48).unwrap().0;
        let gbuffer = GBuffer::read(&frames);
        // The floor and the front of the block have the first material.
        let glossy: Vec<bool> = image.iter().map(|pixel| pixel[0] > 0.0).collect();
        let mut sum = 0.0;
        for (receiver, _) in gbuffer.pixels.iter().zip(&glossy).filter(|(_, glossy)| **glossy) {
            let ray = receiver.position.normalize();
            let mirror = ray - 2.0 * ray.dot(receiver.normal) * receiver.normal;
            let light: DVec3 = gbuffer
                .pixels
                .iter()
                .filter(|source| source.depth > 0.0 && source.radiance.max_element() > 0.0)
                .map(|source| {
                    let toward = (source.position - receiver.position).normalize_or_zero();
                    let lobe =
                        0.5 * (f64::from(exponent) + 2.0) * mirror.dot(toward).max(0.0).powf(f64::from(exponent));
                    source.radiance * gbuffer.form_factor(receiver, source, 1.0, true) * lobe
                })
                .sum();
            sum += mean_luminance(&[light.as_vec3().to_array()]);
        }
        let ratio = mean_luminance(&image) * image.len() as f64 / sum;
        println!("exponent {exponent}: {ratio:.4} of the sum over every pixel");
        // One gather without a hierarchy: strata, drawn directions and noise are all that is left.
        assert!((ratio - 1.0).abs() < 0.03, "exponent {exponent}: {ratio}");
    }
}

#[test]
fn glossy_light_is_that_of_the_path_tracer() {
    let size = [96, 54];
    for exponent in [4.0, 32.0, 128.0] {
        let scene = polished(exponent);
        let request_of_truth = TruthRequest { glossy: true, ..TruthRequest::new(scene.camera, size) };
        let source = TruthSource::new(&device().gpu, &scene, None);
        let truth = source.trace(&request_of_truth, Stop::at_samples(64), &mut |_| ()).unwrap().truth.glossy.unwrap();
        let error = truth.standard_error.iter().flatten().map(|&e| f64::from(e).powi(2)).sum::<f64>().sqrt()
            / truth.mean.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
        let session = Session::new(device(), &scene);
        let ratio = |levels: &str, samples: &str| {
            let settings = [
                ("glossy", "on"),
                ("start_resolution", "full"),
                ("disc_area", "texel"),
                ("levels", levels),
                ("samples", samples),
            ];
            let mut frames = frames(&session, &request("hierarchical", &settings, size));
            let image = frames.mean_over_frames("glossy", 6).unwrap().0;
            // The technique's light is that of each unit of Ks.
            0.5 * mean_luminance(&image) / mean_luminance(&truth.mean)
        };
        let (one, four) = (ratio("1", "256"), ratio("4", "64"));
        println!(
            "exponent {exponent}: {one:.3} of the truth with one level, {four:.3} with four (truth +- {error:.4})"
        );
        // Pixels of finite size where floor and wall meet, the little that the block hides, and noise. Coarse levels of
        // so small an image are three texels high, and a lobe of exponent 128 is less than one wide: what they add is
        // printed, not bounded.
        assert!(error < 0.01 && (one - 1.0).abs() < 0.05, "exponent {exponent}: {one} +- {error}");
    }
}
