//! Beyond what devices allow: a scene renders, or one sentence says what is too large and what would fit. Nothing panics.
#![allow(clippy::unwrap_used)]

use halflight_evaluator::experiment::session::Session;
use halflight_frame_graph::{DeviceLimits, FramePlan, ResourceKind, Work};
use halflight_metrics::Rgb;
use halflight_renderer::{
    PlanInputs,
    parameters::{Settings, SettingsError},
    plan_frame, plan_within,
    scene::SceneFacts,
};
use halflight_scenes::{Camera, Light, Material, Mesh, Scene, Texture};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{device, known, render, request, settings};

const SIZE: [u32; 2] = [48, 27];

/// A floor with an upright square on it that casts shadows.
fn scene(lights: Vec<Light>) -> Scene {
    let quad = |positions: [[f32; 3]; 4], normal| Mesh {
        positions: positions.to_vec(),
        normals: vec![normal; 4],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    };
    let floor = [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]];
    let square = [[-0.7, 0.0, -0.5], [0.7, 0.0, -0.5], [0.7, 1.4, -0.5], [-0.7, 1.4, -0.5]];
    Scene {
        meshes: vec![quad(floor, [0.0, 1.0, 0.0]), quad(square, [0.0, 0.0, 1.0])],
        materials: vec![Material { albedo: [0.6; 3], ..Material::default() }],
        lights,
        camera: Camera {
            eye: [0.5, 2.5, 4.5],
            target: [0.0, 0.4, 0.0],
            vertical_fov_degrees: 50.0,
            ..Camera::default()
        },
        ..Scene::default()
    }
}

fn point(index: u32, intensity: f32) -> Light {
    let angle = index as f32 * 0.37;
    Light::Point { position: [2.0 * angle.cos(), 1.9, 2.0 * angle.sin()], intensity: [intensity; 3] }
}

fn sun(index: u32, irradiance: f32) -> Light {
    let angle = index as f32 * 0.37;
    Light::Directional { direction: [angle.cos(), -1.2, angle.sin()], irradiance: [irradiance; 3] }
}

fn direct_light(lights: Vec<Light>, map_size: &str) -> Vec<Rgb> {
    let scene = scene(lights);
    let session = Session::new(device(), &scene);
    render(&session, &request("none", &[("direct.shadow_map_size", map_size)], SIZE), "direct")
}

/// The plan of a scene within what every browser guarantees.
fn within_browsers(scene: &Scene, technique: &str, settings: &Settings, size: [u32; 2]) -> Result<FramePlan, String> {
    let (facts, technique) = (SceneFacts::of(scene), known(technique));
    let parameters = (technique.parameters)();
    let inputs = PlanInputs { parameters: &parameters, settings, size };
    let plan = |settings: &Settings, size| plan_frame(&facts, technique, settings, size, Default::default());
    plan_within(&DeviceLimits::browser(), &facts, inputs, &plan).map_err(|error: SettingsError| error.to_string())
}

/// Bytes and layers of the shadow maps.
fn shadow_maps(plan: &FramePlan) -> (u64, u32) {
    let maps = plan.resources.iter().find(|resource| resource.name == "shadow_maps").unwrap();
    let ResourceKind::Texture { layers, .. } = maps.kind else { panic!("{maps:?}") };
    (maps.bytes(), layers)
}

/// Frames of a scene on the device of the tests: either they run, or there is one sentence that says `fix`.
#[track_caller]
fn runs_or_says(scene: &Scene, fix: &str) {
    match Session::new(device(), scene).frames(&request("none", &[], SIZE)) {
        Ok(mut frames) => drop(frames.run(0).unwrap()),
        Err(error) => {
            let sentence = error.to_string();
            assert_eq!(error.exit_code(), 2, "{sentence}");
            assert!(sentence.contains("this device allows") && sentence.contains(fix), "{sentence}");
            assert!(!sentence.contains('\n'), "{sentence}");
        }
    }
}

#[test]
fn a_map_in_a_tile_shows_the_same_shadow_as_one_of_its_own() {
    // More maps than a texture may have layers. Only one of the lights shines.
    for (count, light) in [(43, point as fn(u32, f32) -> Light), (257, sun)] {
        for shining in [0, count / 2, count - 1] {
            let alone = direct_light(vec![light(shining, 20.0)], "256");
            let intensity = |index| if index == shining { 20.0 } else { 0.0 };
            let among_others = direct_light((0..count).map(|index| light(index, intensity(index))).collect(), "256");
            let lit = alone.iter().filter(|pixel| pixel[0] > 0.0).count();
            assert!(lit > 300 && alone == among_others, "light {shining} of {count}: {lit} lit pixels");
        }
    }
}

#[test]
fn shadow_maps_of_many_lights_stay_within_their_budget() {
    for (lights, least) in [
        ((0..43).map(|i| point(i, 1.0)).collect(), 900),
        ((0..64).map(|i| point(i, 1.0)).collect(), 800),
        ((0..257).map(|i| sun(i, 1.0)).collect(), 900),
        ((0..1000).map(|i| sun(i, 1.0)).collect::<Vec<_>>(), 500),
    ] {
        let count = lights.len();
        let plan = within_browsers(&scene(lights), "none", &Settings::new(), SIZE).unwrap();
        let (bytes, layers) = shadow_maps(&plan);
        assert!(bytes <= 1 << 30 && layers <= 256, "{count}: {bytes} {layers}");
        let [note] = plan.notes.iter().filter(|note| note.contains("shadow maps are")).collect::<Vec<_>>()[..] else {
            panic!("{count}: {:?}", plan.notes)
        };
        let size: u32 = note.split(['x', ' ']).find_map(|word| word.parse().ok()).unwrap();
        assert!((least..4096).contains(&size), "{note}");
        let tiles = plan.passes.iter().filter(|pass| matches!(pass.work, Work::Draw { tile: Some(_), .. })).count();
        assert!(tiles >= 257, "{count}: {tiles}");
    }
    // A few lights have whole maps, and nothing to say.
    let plan = within_browsers(&scene(vec![point(0, 1.0), point(1, 1.0)]), "none", &Settings::new(), SIZE).unwrap();
    assert_eq!(shadow_maps(&plan), (12 << 26, 12));
    assert!(plan.notes.iter().all(|note| !note.contains("shadow maps are")), "{:?}", plan.notes);
}

#[test]
fn a_thousand_lights_render() {
    let suns = |count: u32| (0..count).map(|i| sun(i, 4.0 / count as f32)).collect();
    // The mean over the directions hardly depends on their number.
    let [many, fewer] = [1000, 17].map(|count| direct_light(suns(count), "64"));
    let mean = |pixels: &[Rgb]| pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64;
    let (many, fewer) = (mean(&many), mean(&fewer));
    assert!(many > 0.1 && (many / fewer - 1.0).abs() < 0.05, "{many} {fewer}");
}

#[test]
fn lights_without_number_are_refused() {
    let many = scene((0..11_000).map(|i| point(i, 1.0)).collect());
    let error = within_browsers(&many, "none", &Settings::new(), SIZE).unwrap_err();
    assert!(error.contains("11000 lights need 66000 shadow maps") && error.contains("use fewer lights"), "{error}");
}

#[test]
fn millions_of_vertices() {
    let mut large = scene(vec![sun(0, 1.0)]);
    let mesh = &mut large.meshes[0];
    mesh.positions.resize(4_400_000, [0.0; 3]);
    mesh.normals.resize(4_400_000, [0.0, 1.0, 0.0]);
    mesh.uvs.resize(4_400_000, [0.0; 2]);
    let error = within_browsers(&large, "none", &Settings::new(), SIZE).unwrap_err();
    assert_eq!(
        error,
        "the buffer scene.vertices needs 140.80 MB in one storage binding and this device allows 134.22 MB: use at most \
         4.19 million vertices"
    );
    runs_or_says(&large, "million vertices");
}

#[test]
fn large_textures() {
    let mut textured = scene(vec![sun(0, 1.0)]);
    let texture = |side: u32, value: u8| Texture {
        name: "large.png".into(),
        width: side,
        height: side,
        rgba: vec![value; side as usize * side as usize * 4],
    };
    textured.textures = vec![texture(4096, 250), texture(4096, 100)];
    textured.materials.push(Material { albedo_texture: Some(1), ..textured.materials[0].clone() });
    textured.materials[0].albedo_texture = Some(0);
    textured.meshes[1].material = 1;
    // More than a storage binding of a browser.
    drop(within_browsers(&textured, "none", &Settings::new(), SIZE).unwrap());
    let albedo = |scene: &Scene| render(&Session::new(device(), scene), &request("none", &[], SIZE), "albedo");
    let large = albedo(&textured);
    // Of one colour each, so their size does not matter.
    textured.textures = vec![texture(1, 250), texture(1, 100)];
    assert_eq!(large, albedo(&textured));
}

#[test]
fn images_larger_than_a_texture() {
    let scene = scene(vec![sun(0, 1.0)]);
    for technique in ["none", "hierarchical"] {
        let error = within_browsers(&scene, technique, &Settings::new(), [9000, 9000]).unwrap_err();
        assert!(error.contains("9000x9000") && error.contains("use at most 8192x8192 pixels"), "{error}");
    }
    // Nothing at all.
    let error = within_browsers(&scene, "none", &Settings::new(), [0, 9]).unwrap_err();
    assert!(error.contains("1 to 8192"), "{error}");
}

#[test]
fn what_would_fit_is_found_by_planning() {
    let scene = scene(vec![point(0, 1.0)]);
    let facts = SceneFacts::of(&scene);
    let technique = known("none");
    let parameters = (technique.parameters)();
    let plan = |settings: &Settings, size| plan_frame(&facts, technique, settings, size, Default::default());
    let fits = |memory: u64, settings: &Settings, size| {
        let device = DeviceLimits { memory: Some(memory), ..DeviceLimits::browser() };
        plan_within(&device, &facts, PlanInputs { parameters: &parameters, settings, size }, &plan).map(drop)
    };
    // The image is too large for the memory: the size that the sentence names fits, and a larger one does not.
    let small = settings("none", &[("direct.shadow_map_size", "64")]);
    let memory = 100_000_000;
    let error = fits(memory, &small, [4000, 2000]).unwrap_err().to_string();
    let size = error.split("use at most ").nth(1).and_then(|rest| rest.split_once(" pixels")).unwrap().0;
    let (w, h) = size.split_once('x').map(|(w, h)| (w.parse::<u32>().unwrap(), h.parse::<u32>().unwrap())).unwrap();
    assert_eq!(fits(memory, &small, [w, h]), Ok(()), "{error}");
    assert!(fits(memory, &small, [w + w / 100, h + h / 100]).is_err(), "{error}");
    // The shadow maps are too large for the memory.
    let error = fits(memory, &Settings::new(), SIZE).unwrap_err().to_string();
    let most: u32 = error.split("use `direct.shadow_map_size` of at most ").nth(1).unwrap().parse().unwrap();
    let with = |size: u32| settings("none", &[("direct.shadow_map_size", &size.to_string())]);
    assert_eq!(fits(memory, &with(most), SIZE), Ok(()), "{error}");
    assert!(fits(memory, &with(most + 1), SIZE).is_err(), "{error}");
}

#[test]
fn images_beyond_every_texture_are_refused_with_a_size_that_fits() {
    let scene = scene(vec![sun(0, 1.0)]);
    let facts = SceneFacts::of(&scene);
    for technique in TECHNIQUES {
        let parameters = (technique.parameters)();
        let settings = Settings::new();
        let plan = |settings: &Settings, size| plan_frame(&facts, technique, settings, size, Default::default());
        let within = |memory: Option<u64>, size| {
            let device = DeviceLimits { memory, ..DeviceLimits::browser() };
            let inputs = PlanInputs { parameters: &parameters, settings: &settings, size };
            plan_within(&device, &facts, inputs, &plan).map(drop).map_err(|error| error.to_string())
        };
        for (memory, size) in [
            (None, [16384, 16384]),
            (Some(2_000_000_000), [16384, 16384]),
            (Some(2_000_000_000), [16384, 900]),
            (None, [u32::MAX, u32::MAX]),
            (None, [0, 5]),
        ] {
            let error = within(memory, size).unwrap_err();
            let [width, height] = size;
            let begins =
                format!("an image of {width}x{height} pixels is not possible, because this device allows 1 to 8192");
            assert!(error.starts_with(&begins) && !error.contains('\n'), "{}: {error}", technique.name);
            let fix = error.split("use at most ").nth(1).and_then(|rest| rest.strip_suffix(" pixels")).unwrap();
            let (w, h) = fix.split_once('x').map(|(w, h)| (w.parse().unwrap(), h.parse().unwrap())).unwrap();
            assert_eq!(within(memory, [w, h]), Ok(()), "{}: {error}", technique.name);
            let is_larger = w >= 8192.min(width.max(1)) && h >= 8192.min(height.max(1));
            // Either nothing larger is possible, or it does not fit the memory.
            let larger = [w + w / 50 + 2, h + h / 50 + 2];
            assert!(is_larger || within(memory, larger).is_err(), "{}: {error}", technique.name);
        }
        // Within the textures and beyond the memory.
        let error = within(Some(1_500_000_000), [8192, 8192]).unwrap_err();
        // In total, or one buffer in a binding.
        assert!(
            error.contains(" and this device allows ") && error.contains("use at most"),
            "{}: {error}",
            technique.name
        );
    }
}
