//! Light that passes translucent surfaces: closed forms, the path tracer, plans.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::{reference::trace, session::Session};
use halflight_frame_graph::FramePlan;
use halflight_renderer::{
    plan_frame,
    scene::SceneFacts,
    truth::{Request, Stop},
};
use halflight_scenes::{Light, Material, Scene};
use halflight_soundness::scenes;
use halflight_tests::{device, known, mean_luminance, render, request, settings};

const SIZE: [u32; 2] = [64, 48];

fn wax() -> Material {
    Material { albedo: [0.5; 3], translucency: [0.6, 0.5, 0.4], absorption: [0.5, 1.5, 4.0], ..Material::default() }
}

/// A box of wax that fills the view, its front at z = 0, `thickness` deep, lit from behind.
fn slab(thickness: f32, light: Light) -> Scene {
    let mesh = match thickness > 0.0 {
        true => scenes::block(Vec3::new(-2.0, -2.0, -thickness), Vec3::new(2.0, 2.0, 0.0), 0),
        false => scenes::quad(Vec3::new(-2.0, -2.0, 0.0), 4.0 * Vec3::X, 4.0 * Vec3::Y, 0),
    };
    Scene {
        name: "slab".into(),
        meshes: vec![mesh],
        materials: vec![wax()],
        lights: vec![light],
        camera: scenes::camera([0.3, 0.2, 2.0], [0.0, 0.0, 0.0], 60.0),
        ..Scene::default()
    }
}

fn sun(direction: [f32; 3]) -> Light {
    Light::Directional { direction, irradiance: [3.0; 3] }
}

fn rendered(scene: &Scene) -> Vec<[f32; 3]> {
    let session = Session::new(device(), scene);
    render(&session, &request("hybrid", &[("voxel_resolution", "32")], SIZE), "transmitted")
}

fn traced(scene: &Scene) -> Vec<[f32; 3]> {
    let request = Request { bounces: 1, ..Request::new(scene.camera, SIZE) };
    trace(device(), scene, &request, Stop::at_samples(1)).unwrap().truth.transmitted
}

#[test]
fn a_slab_absorbs_over_the_way_inside() {
    for (thickness, direction) in [(0.0, [0.0, 0.0, 1.0]), (0.5, [0.0, 0.0, 1.0]), (0.5, [0.3, 0.0, 1.0])] {
        let scene = slab(thickness, sun(direction));
        let cosine = 1.0 / Vec3::from(direction).length();
        let Material { translucency, absorption, .. } = wax();
        let wanted: [f32; 3] = std::array::from_fn(|c| {
            translucency[c] / std::f32::consts::PI * 3.0 * cosine * (-absorption[c] * thickness / cosine).exp()
        });
        // The middle of the image: at the slab's edges light enters from the side.
        let middle = (SIZE[0] * SIZE[1] / 2 + SIZE[0] / 2) as usize;
        let (own, truth) = (rendered(&scene)[middle], traced(&scene)[middle]);
        println!("{thickness} thick, {direction:?}: {own:?}, traced {truth:?}, closed form {wanted:?}");
        for c in 0..3 {
            // Rays of the truth start 8e-6 of the scene's radius inside. The light's view tells the way inside to
            // rounding where it is flat, and a tilted entry to the tilt of half a texel.
            assert!((truth[c] / wanted[c] - 1.0).abs() < 1e-3, "truth {} of {}", truth[c], wanted[c]);
            assert!((own[c] / wanted[c] - 1.0).abs() < 0.02, "{} of {}", own[c], wanted[c]);
        }
    }
}

#[test]
fn a_lamp_behind_wax_agrees_with_truth() {
    let position = [0.4, 0.3, -1.5];
    let spot = Light::Spot {
        position,
        direction: [-0.2, -0.1, 1.0],
        intensity: [5.0; 3],
        half_angle_degrees: 50.0,
        full_intensity_half_angle_degrees: 30.0,
    };
    for (name, light) in [("point", Light::Point { position, intensity: [5.0; 3] }), ("spot", spot)] {
        let scene = slab(0.4, light);
        let (own, truth) = (rendered(&scene), traced(&scene));
        let ratio = mean_luminance(&own) / mean_luminance(&truth);
        println!("{name}: {ratio:.4} of the traced mean");
        assert!(mean_luminance(&truth) > 0.01);
        // Texels of a view of 128 are up to 0.03 wide on the entry: a fifth of a per cent of absorption each way.
        assert!((ratio - 1.0).abs() < 0.02, "{name}: {ratio}");
    }
    // Light from the front does not pass from behind.
    let front = slab(0.4, sun([0.0, 0.0, -1.0]));
    assert_eq!((mean_luminance(&rendered(&front)), mean_luminance(&traced(&front))), (0.0, 0.0));
}

fn plan(scene: &Scene, technique: &str, more: &[(&str, &str)]) -> FramePlan {
    plan_frame(&SceneFacts::of(scene), known(technique), &settings(technique, more), SIZE, Default::default()).unwrap()
}

#[test]
fn a_translucent_material_adds_exactly_its_own() {
    let wax = slab(0.5, sun([0.0, 0.0, 1.0]));
    let mut opaque = wax.clone();
    opaque.materials[0].translucency = [0.0; 3];
    let names = |plan: &FramePlan| plan.passes.iter().map(|pass| pass.name.clone()).collect::<Vec<_>>();
    let resources = |plan: &FramePlan| plan.resources.iter().map(|r| r.name.clone()).collect::<Vec<_>>();
    let added = |before: Vec<String>, after: Vec<String>| -> Vec<String> {
        after.into_iter().filter(|name| !before.contains(name)).collect()
    };
    let (without, with) = (plan(&opaque, "hybrid", &[]), plan(&wax, "hybrid", &[]));
    assert_eq!(added(names(&without), names(&with)), ["translucency_0"]);
    assert_eq!(added(resources(&without), resources(&with)), ["material", "transmitted_0"]);
    assert!(!without.outputs.contains_key("transmitted"));
    let composite = |plan: &FramePlan| plan.find("composite").unwrap().shader.name;
    assert_eq!(composite(&with), format!("{}+transmitted", composite(&without)));
    // Nobody asks: nothing is planned.
    for more in [&[("translucency", "off")][..], &[("sources", "screen")]] {
        assert_eq!(plan(&wax, "hybrid", more), plan(&opaque, "hybrid", more), "{more:?}");
    }
    assert_eq!(plan(&wax, "hierarchical", &[]), plan(&opaque, "hierarchical", &[]));
    // Two lights take turns between two textures.
    let mut two = wax.clone();
    two.lights.push(sun([0.1, 0.0, 1.0]));
    assert!(names(&plan(&two, "hybrid", &[])).contains(&"translucency_1".to_owned()));
}
