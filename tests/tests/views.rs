//! Extra cameras: what they add to a plan, and what they see that the display's camera does not.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::session::Session;
use halflight_frame_graph::{FramePlan, Part};
use halflight_metrics::{LinearPair, rmse};
use halflight_native::{images::Rgb, truth::TruthSource};
use halflight_renderer::{
    DirectSource, plan_frame,
    scene::SceneFacts,
    truth::{Request as TruthRequest, Stop},
};
use halflight_scenes::{Camera, Light, Scene};
use halflight_soundness::scenes;
use halflight_tests::{device, frames, known, mean_luminance, render, request, settings};

/// Floor and wall, and before the wall a panel whose back is lit: its light falls on what the camera sees, but the lit side
/// does not show. The extra camera stands beside the panel and sees both.
fn panel() -> Scene {
    let mut scene = scenes::court();
    scene.meshes.truncate(2);
    scene.meshes.push(scenes::quad(Vec3::new(-0.7, 0.4, -1.0), 1.4 * Vec3::X, 0.9 * Vec3::Y, 0));
    scene.lights = vec![Light::Spot {
        position: [0.0, 0.85, -1.95],
        direction: [0.0, 0.0, 1.0],
        intensity: [4.0, 3.5, 3.0],
        half_angle_degrees: 40.0,
        full_intensity_half_angle_degrees: 30.0,
    }];
    scene.extra_cameras = vec![Camera {
        eye: [-2.0, 1.4, -1.5],
        target: [0.0, 0.7, -1.5],
        vertical_fov_degrees: 90.0,
        ..Camera::default()
    }];
    scene
}

fn plan(scene: &Scene, values: &[(&str, &str)], direct: DirectSource) -> FramePlan {
    let values = settings("hierarchical", values);
    plan_frame(&SceneFacts::of(scene), known("hierarchical"), &values, [64, 36], direct).unwrap()
}

#[test]
fn an_extra_camera_adds_exactly_its_own_passes() {
    let scene = panel();
    let without = Scene { extra_cameras: Vec::new(), ..scene.clone() };
    let rendered = |scene: &Scene, values: &[(&str, &str)]| plan(scene, values, DirectSource::Rendered);
    let (plain, with) = (rendered(&without, &[]), rendered(&scene, &[]));
    assert_eq!(rendered(&scene, &[("extra_cameras", "off")]), plain);
    assert_eq!(rendered(&scene, &[("bounces", "0")]), rendered(&without, &[("bounces", "0")]));
    let added: Vec<_> = with.passes.iter().filter(|pass| plain.find(&pass.name).is_none()).collect();
    let names: Vec<_> = added.iter().map(|pass| pass.name.as_str()).collect();
    // Every pass of a frame once more but for the shadow maps, which serve all views, and the composite; then the merge.
    let again = plain.passes.iter().map(|pass| &pass.name);
    let again = again.filter(|name| !name.starts_with("shadow") && *name != "composite");
    let expected: Vec<_> = again.map(|name| format!("camera_1_{name}")).chain(["merge_camera_1".into()]).collect();
    assert_eq!(names, expected);
    assert!(added.iter().all(|pass| pass.part == Part::Technique), "nothing else needs them");
    assert!(plain.passes.iter().all(|pass| with.find(&pass.name).is_some()), "nothing is left out");
    // Direct light that is given is the display's; the extra camera's is made, from shadow maps.
    let given = plan(&scene, &[], DirectSource::Given);
    assert!(given.find("direct").is_none() && given.find("shadow_0").is_some());
    // Another technique does not know them.
    let exhaustive = |scene| {
        let facts = SceneFacts::of(scene);
        plan_frame(&facts, known("exhaustive"), &settings("exhaustive", &[]), [64, 36], DirectSource::Rendered).unwrap()
    };
    assert_eq!(exhaustive(&scene), exhaustive(&without));
}

#[test]
fn light_that_only_an_extra_camera_sees_is_found() {
    let scene = panel();
    let size = [96, 54];
    let source = TruthSource::new(&device().gpu, &scene, None);
    let request_of_truth = TruthRequest { bounce1: true, ..TruthRequest::new(scene.camera, size) };
    let truth = source.trace(&request_of_truth, Stop::at_samples(64), &mut |_| ()).unwrap().truth.bounce1.unwrap().mean;
    let session = Session::new(device(), &scene);
    let error = |switch, visibility| -> (f64, f64) {
        let settings = [
            ("extra_cameras", switch),
            ("visibility", visibility),
            ("start_resolution", "full"),
            ("storage", "float32"),
        ];
        let mut frames = frames(&session, &request("hierarchical", &settings, size));
        let image: Vec<Rgb> = frames.mean_over_frames("indirect", 4).unwrap().0;
        (rmse(&LinearPair::new(&image, &truth, None)), mean_luminance(&image) / mean_luminance(&truth))
    };
    let mean = mean_luminance(&truth);
    for visibility in ["off", "surface"] {
        let (alone, together) = (error("off", visibility), error("on", visibility));
        println!(
            "visibility {visibility}: RMSE {:.2} of the mean light without, {:.2} with the extra camera; {:.2} and {:.2} of \
             the light",
            alone.0 / mean,
            together.0 / mean,
            alone.1,
            together.1
        );
        assert!(together.0 < 0.7 * alone.0 && alone.1 < 0.3, "{visibility}: {alone:?} {together:?}");
    }
}

#[test]
fn an_extra_camera_in_the_place_of_the_display_s_adds_nothing() {
    let mut scene = scenes::court();
    scene.extra_cameras = vec![scene.camera];
    let session = Session::new(device(), &scene);
    for more in [&[][..], &[("bounces", "2"), ("visibility", "surface")]] {
        let image = |switch| {
            let settings = [&[("extra_cameras", switch), ("storage", "float32")][..], more].concat();
            render(&session, &request("hierarchical", &settings, [64, 36]), "indirect")
        };
        let (with, without) = (image("on"), image("off"));
        // Both views draw the same numbers. A pixel is found again within rounding of its centre, so that neighbours weigh
        // a millionth.
        let differs = |(a, b): &(&Rgb, &Rgb)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-3 * (a + b) + 1e-5);
        assert_eq!(with.iter().zip(&without).filter(differs).count(), 0);
        assert!(with.iter().flatten().zip(without.iter().flatten()).all(|(with, without)| with >= without));
    }
}
