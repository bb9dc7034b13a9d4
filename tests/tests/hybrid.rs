//! Light from what the lights see: absolute units, units of the scene, light from off the screen, plans.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::reference::trace;
use halflight_evaluator::experiment::session::Session;
use halflight_renderer::{
    plan_frame,
    scene::SceneFacts,
    truth::{Request, Stop},
};
use halflight_scenes::{Keyframe, Light, Material, Motion, Scene};
use halflight_soundness::scenes;
use halflight_tests::{device, frames, known, mean_luminance, render, request, settings};

const SIZE: [u32; 2] = [96, 54];

/// Floor and wall that meet, both lit and both in view: nothing hides anything.
fn corner(light: Light) -> Scene {
    let mut scene = scenes::court();
    scene.meshes.truncate(2);
    scene.lights = vec![light];
    scene
}

fn lights() -> [(&'static str, Light); 3] {
    let position = [0.3, 2.0, 0.6];
    let intensity = [9.0, 8.0, 7.0];
    [
        ("directional", scenes::sun()),
        ("point", Light::Point { position, intensity }),
        (
            "spot",
            Light::Spot {
                position,
                direction: [-0.1, -1.0, -0.8],
                intensity,
                half_angle_degrees: 55.0,
                full_intensity_half_angle_degrees: 40.0,
            },
        ),
    ]
}

/// Mean of the first bounce, path-traced.
fn truth(scene: &Scene) -> f64 {
    let request = Request { bounces: 1, ..Request::new(scene.camera, SIZE) };
    let traced = trace(device(), scene, &request, Stop::at_samples(384)).unwrap();
    mean_luminance(&traced.truth.indirect.unwrap().mean)
}

/// Mean over these frames.
fn hybrid(scene: &Scene, more: &[(&str, &str)], count: u32) -> f64 {
    let session = Session::new(device(), scene);
    let base =
        [("start_resolution", "full"), ("storage", "float32"), ("sources", "lights"), ("voxel_resolution", "128")];
    let request = request("hybrid", &[&base[..], more].concat(), SIZE);
    mean_luminance(&frames(&session, &request).mean_over_frames("indirect", count).unwrap().0)
}

/// The paper's patterns with a shell that holds all of the corner.
const PATTERN: &[(&str, &str)] = &[
    ("weighting", "pattern"),
    ("radius", "0.4"),
    ("far_radius", "6"),
    ("screen_samples", "128"),
    ("light_samples", "256"),
];

#[test]
fn what_the_lights_see_agrees_with_truth_in_absolute_units() {
    for (name, light) in lights() {
        let scene = corner(light);
        let wanted = truth(&scene);
        let mut found = Vec::new();
        for (how, settings) in [
            ("lights", &[("visibility", "off")][..]),
            ("lights, visibility", &[]),
            ("both", &[("sources", "both"), ("visibility", "off"), ("radius", "0.4")]),
            ("both, the paper's patterns", &[&[("sources", "both")], PATTERN].concat()),
            ("lights, the paper's patterns", PATTERN),
            ("lights, the paper's patterns without visibility", &[&[("visibility", "off")], PATTERN].concat()),
        ] {
            let ratio = hybrid(&scene, settings, 4) / wanted;
            println!("{name}, {how}: {ratio:.4} of the path-traced mean");
            // The promise for a single light and nothing hidden: a disc stands for a texel of the light's view.
            assert!((ratio - 1.0).abs() < 0.05, "{name}, {how}: {ratio}");
            found.push(ratio);
        }
        // Nothing is hidden, and rays are clear of the cubes of both walls, but for pairs beside the crease: a place
        // within a cube of the other wall is lifted along that wall's cubes, and what it exchanges with it is lost. How
        // much depends on where the texels of the light's view lie: 1e-4 to 1.5e-3 of all light over five rotations of
        // the sun's. Where the grid hid none of it, sums in another order differed by less than 1e-4.
        let lost = [1.0 - found[1] / found[0], 1.0 - found[4] / found[5]];
        println!("{name}: lost to the grid {lost:.6?}");
        assert!(lost.iter().all(|lost| (-1e-4..2e-3).contains(lost)), "{name}: {lost:?}");
        // The original pattern, wide enough for all of the map. Of a map with a perspective it reaches only what lies
        // before the light on the receiver's side.
        if name != "directional" {
            continue;
        }
        let session = Session::new(device(), &scene);
        let settings =
            [("start_resolution", "full"), ("storage", "float32"), ("map_radius", "1.5"), ("samples", "256")];
        let rsm = frames(&session, &request("rsm", &settings, SIZE)).mean_over_frames("indirect", 4).unwrap().0;
        let ratio = mean_luminance(&rsm) / wanted;
        println!("{name}, rsm: {ratio:.4} of the path-traced mean");
        assert!((ratio - 1.0).abs() < 0.05, "{name}, rsm: {ratio}");
    }
}

#[test]
fn a_choice_of_lights_brings_what_all_of_them_bring() {
    let scene = corner(scenes::sun());
    let all = hybrid(&scene, &[("visibility", "off"), ("light_samples", "1024"), ("light_view_size", "32")], 4);
    for (virtual_lights, light_samples) in [("1024", "64"), ("128", "128"), ("512", "32")] {
        let settings = [
            ("visibility", "off"),
            ("light_view_size", "32"),
            ("virtual_lights", virtual_lights),
            ("light_samples", light_samples),
        ];
        let ratio = hybrid(&scene, &settings, 32) / all;
        println!("{virtual_lights} lights, {light_samples} samples: {ratio:.4}");
        // 32 frames choose anew 32 times; measured up to 1 %, which is their noise.
        assert!((ratio - 1.0).abs() < 0.03, "{virtual_lights}, {light_samples}: {ratio}");
    }
}

#[test]
fn units_of_the_scene_do_not_matter() {
    let image = |scale: f32| {
        let mut scene = scenes::court();
        for position in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
            *position = (Vec3::from(*position) * scale).to_array();
        }
        scene.camera.eye = scene.camera.eye.map(|v| v * scale);
        scene.camera.target = scene.camera.target.map(|v| v * scale);
        let session = Session::new(device(), &scene);
        let request = request("hybrid", &[("storage", "float32"), ("voxel_resolution", "128")], SIZE);
        frames(&session, &request).mean_over_frames("indirect", 24).unwrap().0
    };
    let (one, hundred) = (image(1.0), image(100.0));
    let worst = one.iter().zip(&hundred).flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs())).fold(0.0, f32::max);
    let largest = one.iter().flatten().copied().fold(0.0, f32::max);
    let ratio = mean_luminance(&hundred) / mean_luminance(&one);
    println!("largest difference {worst:e} of {largest}, means {ratio:.5}");
    // A sum of 16,384 importances rounds at 1e-4 of it, a tenth of the way between two chosen lights: others are chosen,
    // and what 24 frames leave of that noise is 0.4 % of the mean.
    assert!((ratio - 1.0).abs() < 0.01);
    let differ = one.iter().zip(&hundred).filter(|(a, b)| (a[1] - b[1]).abs() > 0.02 * largest).count();
    assert!(differ < one.len() / 20, "{differ} of {} pixels differ", one.len());
}

#[test]
fn light_from_a_wall_off_the_screen_arrives() {
    // A red wall behind the camera, lit by a lamp between them, faces a white one: the screen shows the white one alone.
    let red = Material { albedo: [0.9, 0.05, 0.05], ..Material::default() };
    let scene = Scene {
        name: "behind".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y, 0),
            scenes::quad(Vec3::new(2.0, 0.0, 2.0), -4.0 * Vec3::X, 3.0 * Vec3::Y, 1),
        ],
        materials: vec![scenes::grey(0.8), red],
        lights: vec![Light::Spot {
            position: [0.0, 1.5, 0.0],
            direction: [0.0, 0.0, 1.0],
            intensity: [10.0; 3],
            half_angle_degrees: 50.0,
            full_intensity_half_angle_degrees: 40.0,
        }],
        camera: scenes::camera([0.0, 1.5, 1.5], [0.0, 1.5, -2.0], 40.0),
        ..Scene::default()
    };
    let wanted = truth(&scene);
    let screen = hybrid(&scene, &[("sources", "screen"), ("radius", "30")], 2);
    let hierarchical = {
        let session = Session::new(device(), &scene);
        mean_luminance(&render(&session, &request("hierarchical", &[], SIZE), "indirect"))
    };
    let both = hybrid(&scene, &[("sources", "both")], 4);
    println!("truth {wanted:.4}, screen {screen:.4}, hierarchical {hierarchical:.4}, both {both:.4}");
    assert!(wanted > 0.01);
    // The wall on the screen is unlit: exactly nothing comes from there.
    assert_eq!((screen, hierarchical), (0.0, 0.0));
    let session = Session::new(device(), &scene);
    assert_eq!(mean_luminance(&render(&session, &request("ssdo", &[("radius", "30")], SIZE), "indirect")), 0.0);
    assert!((both / wanted - 1.0).abs() < 0.05, "{both} of {wanted}");
}

/// A red wall lit by a lamp before it, a floor in view, and between the two, in view of neither camera nor lamp, a screen
/// of this height that stays dark.
fn behind_a_screen(height: f32, floor: Material) -> Scene {
    let red = Material { albedo: [0.9, 0.05, 0.05], ..Material::default() };
    Scene {
        name: "screened".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, 4.0), 5.0 * Vec3::X, -8.0 * Vec3::Z, 0),
            scenes::quad(Vec3::new(3.0, 0.0, -4.0), 8.0 * Vec3::Z, 6.0 * Vec3::Y, 1),
            scenes::quad(Vec3::new(1.2, 0.0, -4.0), 8.0 * Vec3::Z, height * Vec3::Y, 2),
        ],
        materials: vec![floor, red, scenes::grey(0.5)],
        lights: vec![Light::Spot {
            position: [2.0, 2.0, 0.0],
            direction: [1.0, 0.0, 0.0],
            intensity: [10.0; 3],
            half_angle_degrees: 50.0,
            full_intensity_half_angle_degrees: 40.0,
        }],
        camera: scenes::camera([-2.0, 1.5, 0.0], [-0.2, 0.0, 0.0], 24.0),
        ..Scene::default()
    }
}

#[test]
fn what_no_view_sees_hides_light_of_the_lights_views() {
    let lights: [(&str, &[(&str, &str)]); 2] =
        [("radiometric", &[]), ("pattern", &[("weighting", "pattern"), ("radius", "0.4"), ("far_radius", "8")])];
    for (weighting, settings) in lights {
        let of = |height, visibility| {
            let more = [settings, &[("visibility", visibility), ("light_samples", "256")]].concat();
            hybrid(&behind_a_screen(height, scenes::grey(0.8)), &more, 8)
        };
        // Cubes are 6.25 cm wide: the low screen ends within one of where it does.
        let wanted = [0.6, 3.0, 0.5375, 0.6625].map(|height| truth(&behind_a_screen(height, scenes::grey(0.8))));
        let (low, low_off, high, high_off) = (of(0.6, "on"), of(0.6, "off"), of(3.0, "on"), of(3.0, "off"));
        println!(
            "{weighting}: low screen {low:.5} of {:.5}, without visibility {low_off:.4}; high {high} of {}, {high_off:.4}; \
             a cube lower or higher {:.5?}",
            wanted[0],
            wanted[1],
            &wanted[2..]
        );
        // The high screen hides all of the wall.
        assert!(wanted[1] == 0.0 && high == 0.0 && high_off > 0.01, "{weighting}: {high} and {high_off}");
        assert!(wanted[3] < low && low < wanted[2], "{weighting}: {low} of {wanted:?}");
        assert!(low_off > 1.3 * wanted[0], "{weighting}: {low_off}");
    }
}

#[test]
fn what_no_view_sees_hides_what_a_mirror_would_show() {
    let mirror = Material { specular: [0.8; 3], phong_exponent: 1e6, ..scenes::grey(0.2) };
    let red = |image: &[[f32; 3]]| image.iter().map(|p| f64::from((p[0] - p[1]).max(0.0))).sum::<f64>();
    for height in [0.6, 3.0] {
        let scene = behind_a_screen(height, mirror.clone());
        let of_mirror = Request { glossy: true, ..Request::new(scene.camera, SIZE) };
        let wanted = trace(device(), &scene, &of_mirror, Stop::at_samples(4)).unwrap().truth.glossy.unwrap().mean;
        let session = Session::new(device(), &scene);
        let shown = |visibility: &str| {
            let settings = [
                ("specular", "both"),
                ("light_view_size", "256"),
                ("sources", "screen"),
                ("screen_samples", "1"),
                ("voxel_resolution", "512"),
                ("visibility", visibility),
            ];
            let image = render(&session, &request("hybrid", &settings, SIZE), "glossy");
            image.into_iter().map(|pixel| pixel.map(|v| 0.8 * v)).collect::<Vec<_>>()
        };
        let (on, off) = (shown("on"), shown("off"));
        let [wanted_red, on_red, off_red] = [&wanted, &on, &off].map(|image| red(image));
        let error =
            |image: &[[f32; 3]]| halflight_metrics::rmse(&halflight_metrics::LinearPair::new(image, &wanted, None));
        println!(
            "screen of {height}: red light {on_red:.2} of {wanted_red:.2}, {off_red:.2} without visibility; RMSE {:.4}, {:.4}",
            error(&on),
            error(&off)
        );
        if height > 1.0 {
            assert!(wanted_red == 0.0 && on_red == 0.0 && off_red > 10.0);
        } else {
            // The screen's upper end is off by a cube at most, 1.6 cm: a row of pixels, which has 6 % of the light.
            assert!((on_red / wanted_red - 1.0).abs() < 0.08 && off_red > 1.2 * wanted_red);
            assert!(error(&on) < 0.5 * error(&off));
        }
    }
}

#[test]
fn pixels_that_interpolation_does_not_know_are_gathered_anew() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
    let image = |more: &[(&str, &str)]| {
        // Samples of the screen would stay as coarse as they are; of the lights' few surfaces each is taken about four times,
        // so that there is no noise.
        let base = [
            ("sources", "lights"),
            ("storage", "float32"),
            ("visibility", "off"),
            ("light_view_size", "16"),
            ("light_samples", "1024"),
        ];
        frames(&session, &request("hybrid", &[&base[..], more].concat(), SIZE))
            .mean_over_frames("indirect", 2)
            .unwrap()
            .0
    };
    let full = image(&[("start_resolution", "full")]);
    let error = |image: &[[f32; 3]]| halflight_metrics::rmse(&halflight_metrics::LinearPair::new(image, &full, None));
    let of = |below: &str| image(&[("start_resolution", "quarter"), ("recompute_below", below)]);
    let [none, few, all] = ["0", "0.1", "1"].map(of);
    let changed = few.iter().zip(&none).filter(|(a, b)| a != b).count() as f64 / none.len() as f64;
    let errors = [&none, &few, &all].map(|image| error(image));
    println!(
        "RMSE {errors:.4?} against full resolution; {:.1} % of the pixels gathered anew below 0.1",
        100.0 * changed
    );
    // A fifth of a percent of the pixels, at edges, holds a quarter of the error. What is left where all are gathered anew is
    // the choice of lights: receivers of another resolution choose others.
    assert!(changed > 0.0 && changed < 0.01 && errors[1] < 0.85 * errors[0], "{changed} {errors:?}");
    assert!(errors[2] < 0.35 * errors[0], "{errors:?}");
}

#[test]
fn the_plan_has_what_scene_and_settings_need() {
    let names = |scene: &Scene, more: &[(&str, &str)]| -> Vec<String> {
        let plan =
            plan_frame(&SceneFacts::of(scene), known("hybrid"), &settings("hybrid", more), SIZE, Default::default());
        let technique = |pass: &&halflight_frame_graph::Pass| pass.part == halflight_frame_graph::Part::Technique;
        plan.unwrap().passes.iter().filter(technique).map(|pass| pass.name.clone()).collect()
    };
    let scene = scenes::court();
    let screen = names(&scene, &[("sources", "screen")]);
    assert!(!screen.iter().any(|name| name.contains("light") || name.contains("voxels")), "{screen:?}");
    let both = names(&scene, &[]);
    for name in ["light_view_0", "lit_surfaces_0", "collect_0", "choose", "scene_voxels", "gather"] {
        assert!(both.iter().any(|pass| pass == name), "{name}: {both:?}");
    }
    assert_eq!(names(&scene, &[("visibility", "off")]).len(), both.len() - 1);
    // A second sun brings a view, its surfaces and their collection; what is done for the screen is done once.
    let mut two = scene.clone();
    two.lights.push(scenes::sun());
    assert_eq!(names(&two, &[]).len(), both.len() + 3);
    // Six faces look around a point light.
    two.lights = vec![Light::Point { position: [0.0, 2.0, 0.0], intensity: [1.0; 3] }];
    assert_eq!(names(&two, &[]).len(), both.len() + 15);
    // The paper's patterns need no choice of lights, and published weights no grid of cubes.
    for (weighting, tested) in [("published", false), ("pattern", true)] {
        let patterns = names(&scene, &[("weighting", weighting)]);
        for (name, there) in
            [("near", true), ("rsm_0", true), ("gather", false), ("choose", false), ("scene_voxels", tested)]
        {
            assert_eq!(patterns.iter().any(|pass| pass == name), there, "{name}: {patterns:?}");
        }
    }
    for settings in [[("sources", "screen"), ("visibility", "on")], [("sources", "both"), ("visibility", "off")]] {
        let patterns = names(&scene, &[&settings[..], &[("weighting", "pattern")]].concat());
        assert!(!patterns.iter().any(|pass| pass == "scene_voxels"), "{patterns:?}");
    }
    // Single pixels are gathered anew where that is asked for and something was interpolated.
    assert_eq!(names(&scene, &[("recompute_below", "0.1")]).len(), both.len() + 1);
    let at_full = [("recompute_below", "0.1"), ("start_resolution", "full")];
    assert!(!names(&scene, &at_full).iter().any(|pass| pass == "recompute"));
    // Nothing specular where no material is glossy; where one is, one march on the screen for all lights.
    let specular = [("specular", "both")];
    assert_eq!(names(&scene, &specular), both);
    let mut polished = scenes::polished(32.0);
    let added = |scene: &Scene, settings: &[(&str, &str)]| -> Vec<String> {
        let without = names(scene, &[]);
        names(scene, settings).into_iter().filter(|name| !without.contains(name)).collect()
    };
    assert_eq!(added(&polished, &specular), ["mirror_map", "specular_0"]);
    assert_eq!(added(&polished, &[("specular", "screen")]), ["mirror_map", "specular"]);
    // Mirror directions that end in a light's view cross the grid; those on the screen do not.
    let grid = |more: &[(&str, &str)]| {
        let screen = [&[("sources", "screen")], more].concat();
        names(&polished, &screen).iter().any(|name| name == "scene_voxels")
    };
    assert!(grid(&specular) && !grid(&[("specular", "screen")]));
    assert!(!grid(&[("specular", "both"), ("visibility", "off")]));
    assert!(!grid(&[("specular", "both"), ("weighting", "published")]));
    polished.lights.push(scenes::sun());
    assert_eq!(added(&polished, &specular), ["mirror_map", "specular_0", "specular_1"]);
    // Openness: the screen's part once, a light's part for each; it attenuates light where it is asked for.
    let filters = ["occlusion", "denoise_0", "denoise_1", "upsample_ambient_occlusion", "attenuate_indirect"];
    let open = added(&polished, &[("ambient_occlusion", "both")]);
    assert_eq!(open, [&["occlusion_screen", "occlusion_0", "occlusion_1"][..], &filters].concat());
    assert_eq!(added(&scene, &[("ambient_occlusion", "screen")]), [&["occlusion_screen"][..], &filters].concat());
    // Without lights nothing is left.
    two.lights.clear();
    assert!(names(&two, &[]).is_empty());
}

#[test]
fn published_weights_are_a_mean_over_all_samples() {
    let mut scene = corner(scenes::sun());
    let session = Session::new(device(), &scene);
    let of = |session: &Session, more: &[(&str, &str)]| {
        let base =
            [("weighting", "published"), ("start_resolution", "full"), ("radius", "0.4"), ("storage", "float32")];
        frames(session, &request("hybrid", &[&base[..], more].concat(), SIZE))
            .mean_over_frames("indirect", 4)
            .unwrap()
            .0
    };
    let mean = |more: &[(&str, &str)]| mean_luminance(&of(&session, more));
    // Equation 2: L = (L_rsm N_rsm + L_ssdo N_ssdo) / (N_rsm + N_ssdo), here with a third of the samples on the screen.
    let (both, screen, lights) = (mean(&[]), mean(&[("sources", "screen")]), mean(&[("sources", "lights")]));
    // Alone, the lights' pattern is the whole hemisphere; in both it is the shell around the screen's.
    println!("both {both:.5}, screen {screen:.5}, lights {lights:.5}");
    assert!(screen > 0.0 && lights > 0.0 && both > screen / 3.0);
    // One documented intensity and nothing else.
    let twice = mean(&[("intensity", "2")]);
    assert!((twice / both - 2.0).abs() < 1e-5, "{twice} of {both}");
    // Equation 5: lights are averaged over their samples. Two suns of half the light each bring half of one sun's.
    let Light::Directional { direction, irradiance } = scenes::sun() else { panic!("a sun") };
    scene.lights = vec![Light::Directional { direction, irradiance: irradiance.map(|v| 0.5 * v) }; 2];
    let two = Session::new(device(), &scene);
    let halves = mean_luminance(&of(&two, &[("sources", "lights")])) / lights;
    println!("two half suns: {halves:.3} of one");
    // Samples of the second light are other ones: noise of a mean over 5,000 pixels and 4 frames.
    assert!((halves - 0.5).abs() < 0.02, "{halves}");
}

/// A red wall over the camera's head, lit by a lamp, and a floor like a mirror in which it shows.
fn hall_of_one_mirror() -> Scene {
    let red = Material { albedo: [0.9, 0.05, 0.05], ..Material::default() };
    let mirror = Material { specular: [0.8; 3], phong_exponent: 1e6, ..scenes::grey(0.2) };
    Scene {
        name: "mirror".into(),
        meshes: vec![
            // The floor; a lit wall at its end that is on the screen; the wall above it that is not.
            scenes::quad(Vec3::new(-3.0, 0.0, 2.0), 6.0 * Vec3::X, -6.0 * Vec3::Z, 0),
            scenes::quad(Vec3::new(-3.0, 0.0, -4.0), 6.0 * Vec3::X, 1.2 * Vec3::Y, 1),
            scenes::quad(Vec3::new(-3.0, 1.2, -4.0), 6.0 * Vec3::X, 4.8 * Vec3::Y, 2),
        ],
        materials: vec![mirror, scenes::grey(0.6), red],
        lights: vec![Light::Directional { direction: [0.1, -0.3, -1.0], irradiance: [4.0; 3] }],
        camera: scenes::camera([0.0, 1.5, 2.0], [0.0, 0.0, -2.2], 32.0),
        ..Scene::default()
    }
}

#[test]
fn a_mirror_shows_what_is_off_the_screen() {
    let scene = hall_of_one_mirror();
    let of_mirror = Request { glossy: true, ..Request::new(scene.camera, SIZE) };
    // A lobe of exponent 1e6 is a mirror direction.
    let traced = trace(device(), &scene, &of_mirror, Stop::at_samples(4)).unwrap().truth;
    let wanted = traced.glossy.unwrap().mean;
    let session = Session::new(device(), &scene);
    let shown = |specular: &str| {
        let settings = [("specular", specular), ("light_view_size", "256"), ("start_resolution", "half")];
        let image = render(&session, &request("hybrid", &settings, SIZE), "glossy");
        // The technique's light is that of each unit of Ks.
        image.into_iter().map(|pixel| pixel.map(|v| 0.8 * v)).collect::<Vec<_>>()
    };
    let (screen, both) = (shown("screen"), shown("both"));
    // The red wall, which is off the screen, is all red light; the grey one has as much of each colour.
    let red = |image: &[[f32; 3]]| image.iter().map(|p| f64::from((p[0] - p[1]).max(0.0))).sum::<f64>();
    let grey = |image: &[[f32; 3]]| image.iter().map(|p| f64::from(p[2])).sum::<f64>();
    let (red_ratio, grey_ratio) = (red(&both) / red(&wanted), grey(&both) / grey(&wanted));
    println!(
        "red: {:.4} of the truth by the screen, {red_ratio:.4} by both; grey {grey_ratio:.4}",
        red(&screen) / red(&wanted)
    );
    assert!(red(&wanted) > 10.0 && grey(&wanted) > 1.0);
    assert_eq!(red(&screen), 0.0);
    // Texels of a light's view are 2.5 cm wide and pixels of the floor 5 cm long: the border between the walls, and the end
    // of the upper one, are off by one or the other.
    assert!((red_ratio - 1.0).abs() < 0.05, "{red_ratio}");
    assert!((grey_ratio - 1.0).abs() < 0.1, "{grey_ratio}");
    let errors =
        |image: &[[f32; 3]]| halflight_metrics::rmse(&halflight_metrics::LinearPair::new(image, &wanted, None));
    println!("RMSE {:.4} by the screen, {:.4} by both", errors(&screen), errors(&both));
    assert!(errors(&both) < 0.3 * errors(&screen));
}

#[test]
fn directions_of_a_lobe_bring_its_light() {
    let mut scene = hall_of_one_mirror();
    for exponent in [8.0, 64.0] {
        scene.materials[0].phong_exponent = exponent;
        let of_lobe = Request { glossy: true, ..Request::new(scene.camera, SIZE) };
        let traced = trace(device(), &scene, &of_lobe, Stop::at_samples(64)).unwrap().truth;
        let wanted = mean_luminance(&traced.glossy.unwrap().mean);
        let session = Session::new(device(), &scene);
        let settings = [
            ("specular", "both"),
            ("specular_lobe", "on"),
            ("sources", "screen"),
            ("screen_samples", "1"),
            ("light_view_size", "256"),
        ];
        let mut run = frames(&session, &request("hybrid", &settings, SIZE));
        let ratio = 0.8 * mean_luminance(&run.mean_over_frames("glossy", 16).unwrap().0) / wanted;
        println!("exponent {exponent}: {ratio:.4} of the path-traced mean");
        // As for a mirror, and the wider the lobe is, the more of it grazes the floor, where it begins a texel above it.
        assert!((ratio - 1.0).abs() < 0.05, "exponent {exponent}: {ratio}");
    }
}

#[test]
fn what_a_light_sees_follows_it() {
    let mut scene = hall_of_one_mirror();
    let turned = Keyframe { frame: 20, rotate_degrees: [12.0, 8.0, 0.0], ..Keyframe::default() };
    scene.moves.lights.push((0, Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default(), turned] }));
    let posed = scene.posed(13);
    let images = |scene: &Scene, frame| {
        let session = Session::new(device(), scene);
        let settings = [
            ("weighting", "pattern"),
            ("start_resolution", "half"),
            ("specular", "both"),
            ("ambient_occlusion", "both"),
            ("light_view_size", "64"),
        ];
        let mut run = frames(&session, &request("hybrid", &settings, SIZE));
        run.run(frame).unwrap();
        ["indirect", "glossy", "ambient_occlusion"].map(|output| run.read_rgb(output).unwrap().unwrap())
    };
    let [moving, still, before] = [images(&scene, 13), images(&posed, 13), images(&scene, 0)];
    let rms = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let squares = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2));
        (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
    };
    for (i, name) in ["indirect", "glossy", "openness"].into_iter().enumerate() {
        let (off, moved) = (rms(&moving[i], &still[i]), rms(&moving[i], &before[i]));
        println!("{name}: {off:.2e} from the still scene, {moved:.2e} from where it was");
        // Matrices are the same but for rounding, which moves borders of texels: of 64 texels in a few pixels.
        assert!(moved > 1e-3 && off < 0.1 * moved, "{name}: {off} of {moved}");
    }
}

#[test]
fn openness_from_two_views_is_nearer_to_truth() {
    // The floor beside a wall that stands just off the screen, lit from the side: the screen takes the place for open.
    let scene = Scene {
        name: "beside".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-3.0, 0.0, 3.0), 6.0 * Vec3::X, -6.0 * Vec3::Z, 0),
            scenes::block(Vec3::new(0.4, 0.0, -3.0), Vec3::new(0.8, 1.5, 3.0), 0),
        ],
        materials: vec![scenes::grey(0.7)],
        lights: vec![Light::Directional { direction: [0.6, -1.0, 0.2], irradiance: [3.0; 3] }],
        camera: scenes::camera([-0.75, 3.0, 0.0], [-0.75, 0.0, -0.01], 24.0),
        ..Scene::default()
    };
    let radius = 1.0;
    let asked = Request { ambient_occlusion: Some(radius), ..Request::new(scene.camera, SIZE) };
    let wanted = trace(device(), &scene, &asked, Stop::at_samples(256)).unwrap().truth.ambient_occlusion.unwrap().mean;
    let session = Session::new(device(), &scene);
    let error = |technique: &str, settings: &[(&str, &str)]| {
        let image = render(&session, &request(technique, settings, SIZE), "ambient_occlusion");
        let squares = image.iter().zip(&wanted).map(|(v, &t)| f64::from(v[0] - t).powi(2));
        (squares.sum::<f64>() / wanted.len() as f64).sqrt()
    };
    let hybrid = |views| {
        let settings = [
            ("ambient_occlusion", views),
            ("occlusion_radius", "1"),
            ("sources", "screen"),
            ("light_view_size", "256"),
        ];
        error("hybrid", &settings)
    };
    let (ssao, screen, both) = (error("ssao", &[("radius", "1")]), hybrid("screen"), hybrid("both"));
    println!("RMSE of openness: ssao {ssao:.4}, screen {screen:.4}, both {both:.4}");
    assert!(both < 0.7 * screen && both < 0.7 * ssao, "{both} against {screen} and {ssao}");
}
