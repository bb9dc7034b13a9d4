//! What the path tracer promises whatever the scene: repeatability, resumption, finite numbers, a bounded error.

use std::time::Duration;

use halflight_native::{AdapterChoice, NativeGpu, cache::Cache, truth::TruthSource};
use halflight_renderer::{
    scene::SceneBuffers,
    truth::{Request, State, Stop, Tracer, Truth},
};
use halflight_scenes::{Camera, Light, Material, Mesh, Scene, Texture, generators};

use crate::{add_quad, assert_near, grey, mean, trace};

fn cornell() -> Scene {
    let mut geometry = generators::geometry("cornell").unwrap();
    geometry.materials.iter_mut().for_each(|material| {
        material.specular = [0.3; 3];
        material.phong_exponent = 8.0;
    });
    Scene {
        meshes: geometry.meshes,
        materials: geometry.materials,
        textures: geometry.textures,
        lights: vec![Light::Point { position: [0.0, 1.9, 0.0], intensity: [3.0; 3] }],
        camera: Camera {
            eye: [0.0, 1.0, 3.9],
            target: [0.0, 1.0, 0.0],
            vertical_fov_degrees: 39.3,
            ..Camera::default()
        },
        ..Scene::default()
    }
}

fn everything(camera: Camera, size: [u32; 2]) -> Request {
    Request {
        bounce1: true,
        bounces: 3,
        on_screen: true,
        glossy: true,
        ambient_occlusion: Some(0.5),
        ..Request::new(camera, size)
    }
}

/// Drives a trace by hand with a device that seems to take `took` for every batch.
fn drive(scene: &Scene, request: &Request, samples: u32, took: Duration, from: Option<&State>) -> State {
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap().gpu;
    let tracer = Tracer::new(&gpu, scene, &SceneBuffers::new(&gpu, scene)).unwrap();
    let mut trace = tracer.start(&gpu, request, Stop::at_samples(samples)).unwrap();
    if let Some(state) = from {
        trace.restore(&gpu, state);
    }
    while trace.submit(&gpu) {
        trace.pace(took);
    }
    let reading = trace.read(&gpu);
    gpu.device.poll(wgpu_wait()).unwrap();
    reading.take().unwrap()
}

fn wgpu_wait() -> wgpu::PollType {
    wgpu::PollType::wait_indefinitely()
}

#[test]
fn sums_do_not_depend_on_how_the_work_was_split() {
    let scene = cornell();
    let request = everything(scene.camera, [37, 23]);
    let slow = drive(&scene, &request, 6, Duration::from_secs(1), None);
    let quick = drive(&scene, &request, 6, Duration::ZERO, None);
    assert_eq!(slow.to_bytes(), quick.to_bytes(), "batches of one block or of the whole image");
    let part = drive(&scene, &request, 2, Duration::ZERO, None);
    let part = State::from_bytes(&part.to_bytes(), &request).unwrap();
    let continued = drive(&scene, &request, 6, Duration::from_secs(1), Some(&part));
    assert_eq!(slow.to_bytes(), continued.to_bytes(), "stopped after 2 of 6 samples and continued");
    let other = drive(&scene, &Request { seed: 1, ..request }, 6, Duration::ZERO, None);
    assert_ne!(slow.to_bytes(), other.to_bytes(), "another seed");
}

#[test]
fn threads_may_share_a_device() {
    let scene = cornell();
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap().gpu;
    let request = Request::new(scene.camera, [8, 8]);
    let source = || TruthSource::new(&gpu, &scene, None);
    let alone = source().trace(&request, Stop::at_samples(1), &mut |_| ()).unwrap().truth;
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let own = source();
                // Polls that overtake one another are rare: of reads this many, several were lost where one poll was waited for.
                for _ in 0..500 {
                    assert_eq!(own.trace(&request, Stop::at_samples(1), &mut |_| ()).unwrap().truth, alone);
                }
            });
        }
    });
}

#[test]
fn standard_errors_are_true() {
    let scene = cornell();
    let request = everything(scene.camera, [24, 24]);
    let truths: Vec<_> = (0..24).map(|seed| trace(&scene, &Request { seed, ..request.clone() }, 16)).collect();
    let spread = |image: fn(&Truth) -> Vec<f32>, errors: fn(&Truth) -> Vec<f32>| {
        let images: Vec<_> = truths.iter().map(image).collect();
        let count = images.len() as f32;
        let mut observed = 0.0;
        for pixel in 0..images[0].len() {
            let mean = images.iter().map(|i| i[pixel]).sum::<f32>() / count;
            observed += images.iter().map(|i| (i[pixel] - mean).powi(2)).sum::<f32>() / (count - 1.0);
        }
        let stated = truths.iter().flat_map(errors).map(|e| e * e).sum::<f32>() / count;
        (observed / stated).sqrt()
    };
    let ratios = [
        spread(
            |t| t.indirect.as_ref().unwrap().mean.as_flattened().to_vec(),
            |t| t.indirect.as_ref().unwrap().standard_error.as_flattened().to_vec(),
        ),
        spread(
            |t| t.glossy.as_ref().unwrap().mean.as_flattened().to_vec(),
            |t| t.glossy.as_ref().unwrap().standard_error.as_flattened().to_vec(),
        ),
        spread(
            |t| t.ambient_occlusion.as_ref().unwrap().mean.clone(),
            |t| t.ambient_occlusion.as_ref().unwrap().standard_error.clone(),
        ),
    ];
    // 576 pixels x 23 degrees of freedom: the ratio itself is known to better than 3 %.
    assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.06), "observed over stated: {ratios:?}");
}

#[test]
fn the_error_target_is_met_and_the_cache_answers_the_second_time() {
    let scene = cornell();
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap().gpu;
    let cache = Cache::at(std::env::temp_dir().join(format!("halflight-truth-{}", std::process::id())));
    let request = Request { bounces: 1, ..Request::new(scene.camera, [48, 48]) };
    let source = TruthSource::new(&gpu, &scene, Some(cache.clone()));
    let stop = Stop { error_block: 8, ..Stop::at_rel_error(0.02) };
    let mut last = 0.0;
    let first = source
        .trace(&request, stop, &mut |progress| {
            assert!((0.0..=1.0).contains(&progress.fraction));
            last = progress.fraction;
        })
        .unwrap();
    assert_eq!(last, 1.0);
    let reached = first.rel_error.expect("enough light");
    assert!(reached <= 0.02, "reached {reached}");
    // Error falls with the square root of the samples: far more of them than needed would be waste.
    assert!(reached >= 0.012, "reached {reached} where 0.02 was asked for");
    assert!(first.traced.0 > 0 && first.warnings.is_empty());

    let again = TruthSource::new(&gpu, &scene, Some(cache.clone())).trace(&request, stop, &mut |_| ()).unwrap();
    assert_eq!((again.traced.0, again.cached_samples), (0, first.truth.samples));
    assert_eq!(again.truth, first.truth);
    assert_eq!(again.inputs, first.inputs);

    // A trace that was interrupted goes on to where it was to judge its error, and ends with the same samples.
    let mut half = source.trace_range(&request, 0..first.truth.samples / 2, &mut |_| ()).unwrap().sums;
    half.plan(first.truth.samples);
    cache.store("truth", &first.inputs, &half.to_bytes()).unwrap();
    let continued = source.trace(&request, Stop { rel_error: Some(0.5), ..stop }, &mut |_| ()).unwrap();
    assert_eq!((continued.cached_samples, &continued.truth), (first.truth.samples / 2, &first.truth));

    // More samples start from those that are there; another request starts from nothing.
    let more = source.trace(&request, Stop::at_samples(first.truth.samples + 8), &mut |_| ()).unwrap();
    assert_eq!(more.cached_samples, first.truth.samples);
    let other = source.trace(&Request { seed: 5, ..request.clone() }, Stop::at_samples(1), &mut |_| ()).unwrap();
    assert_eq!(other.cached_samples, 0);
    assert_ne!(other.inputs, first.inputs);
    let mut darker = scene.clone();
    darker.materials[0].albedo[0] *= 0.5;
    let darker = TruthSource::new(&gpu, &darker, Some(cache.clone())).trace(&request, Stop::at_samples(1), &mut |_| ());
    assert_ne!(darker.unwrap().inputs, first.inputs);

    // A damaged entry is a warning, and the reference is traced again.
    std::fs::write(cache.path("truth", &first.inputs), b"not a truth").unwrap();
    let mended = source.trace(&request, Stop::at_samples(2), &mut |_| ()).unwrap();
    assert!(mended.warnings[0].contains("damaged") && mended.traced.0 > 0, "{:?}", mended.warnings);
    std::fs::remove_dir_all(cache.folder()).unwrap();
}

#[test]
fn bad_requests_are_told() {
    let scene = cornell();
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap().gpu;
    let source = TruthSource::new(&gpu, &scene, None);
    let request = Request::new(scene.camera, [8, 8]);
    for (request, stop, word) in [
        (Request { size: [0, 8], ..request.clone() }, Stop::at_samples(1), "0x8"),
        (Request { size: [70000, 1], ..request.clone() }, Stop::at_samples(1), "65535"),
        (Request { bounces: 65, ..request.clone() }, Stop::at_samples(1), "64"),
        (Request { ambient_occlusion: Some(-1.0), ..request.clone() }, Stop::at_samples(1), "radius"),
        (request.clone(), Stop::at_samples(0), "at least 1"),
        (request.clone(), Stop::at_rel_error(f32::NAN), "above 0"),
    ] {
        let message = source.trace(&request, stop, &mut |_| ()).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

/// Light may not depend on where the scene is or how large its units are.
#[test]
fn scale_and_place_do_not_matter() {
    let scene = cornell();
    let request = everything(scene.camera, [32, 32]);
    let reference = trace(&scene, &request, 32);
    let (expected, error) = mean(reference.indirect.as_ref().unwrap());
    // 300 m away a 2 m box still has 13 bits to each of its sides.
    for (scale, shift) in [(1e-3, 0.0), (1e6, 0.0), (1.0, 300.0)] {
        let place = |p: [f32; 3]| p.map(|v| v * scale + shift);
        let mut moved = scene.clone();
        moved.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(|p| *p = place(*p));
        let intensity = [3.0 * scale * scale; 3];
        moved.lights = vec![Light::Point { position: place([0.0, 1.9, 0.0]), intensity }];
        moved.camera.eye = place(moved.camera.eye);
        moved.camera.target = place(moved.camera.target);
        let request = Request { camera: moved.camera, ambient_occlusion: Some(0.5 * scale), ..request.clone() };
        let truth = trace(&moved, &request, 32);
        let what = format!("scale {scale}, moved by {shift}");
        // The random numbers are the same, so the difference is far below the noise of either; the noise bounds it.
        assert_near((mean(truth.indirect.as_ref().unwrap()).0, error), expected, 0.0, &what);
        let direct = |t: &Truth| t.direct.as_flattened().iter().map(|&v| f64::from(v)).sum::<f64>();
        assert!((direct(&truth) / direct(&reference) - 1.0).abs() < 2e-3, "{what}: direct light");
        assert!(
            (truth.depth[16 * 32 + 16] / scale / reference.depth[16 * 32 + 16] - 1.0).abs() < 1e-3,
            "{what}: depth"
        );
    }
}

#[test]
fn extremes_stay_finite() {
    let triangle = |positions: [[f32; 3]; 3], normal: [f32; 3]| Mesh {
        positions: positions.to_vec(),
        normals: vec![normal; 3],
        uvs: vec![[0.0; 2]; 3],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    let whole = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    let camera = Camera { eye: [0.0, 0.3, 0.4], target: [0.0; 3], ..Camera::default() };
    let with = |meshes: Vec<Mesh>, light: f32| Scene {
        meshes,
        materials: vec![Material { specular: [1.0, 0.5, 0.0], phong_exponent: 1e6, ..grey(1.0, 0.1) }],
        lights: vec![
            Light::Point { position: [0.0, 0.5, 0.0], intensity: [light; 3] },
            Light::Directional { direction: [0.0; 3], irradiance: [light; 3] },
        ],
        ..Scene::default()
    };
    let flat = triangle(whole, [0.0, 1.0, 0.0]);
    let scenes = [
        ("empty", with(vec![], 1.0)),
        ("one triangle", with(vec![flat.clone()], 1.0)),
        ("zero-area triangles", with(vec![triangle([[0.0; 3]; 3], [0.0, 1.0, 0.0]), flat.clone()], 1.0)),
        ("zero normals", with(vec![triangle(whole, [0.0; 3])], 1.0)),
        ("NaN normals", with(vec![triangle(whole, [f32::NAN; 3])], 1.0)),
        ("duplicated faces", with(vec![flat.clone(); 40], 1.0)),
        ("light on the surface", {
            let mut scene = with(vec![flat.clone()], 1.0);
            scene.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
            scene
        }),
        ("very bright", with(vec![flat.clone()], 1e30)),
        ("very dim", with(vec![flat.clone()], 1e-30)),
        ("eye on the surface", with(vec![triangle(whole.map(|p| [p[0], 0.3, p[2] + 0.4]), [0.0, 1.0, 0.0])], 1.0)),
    ];
    for (what, scene) in scenes {
        for size in [[1, 1], [3, 1], [1, 7], [17, 13]] {
            let truth = trace(&scene, &everything(camera, size), 3);
            let light = [&truth.bounce1, &truth.indirect, &truth.on_screen, &truth.glossy].map(|e| e.as_ref().unwrap());
            let mut images = vec![&truth.position, &truth.normal, &truth.albedo, &truth.direct];
            images.extend(light.iter().flat_map(|e| [&e.mean, &e.standard_error]));
            assert!(images.iter().flat_map(|i| i.as_flattened()).all(|v| v.is_finite()), "{what} at {size:?}");
            assert!(truth.depth.iter().all(|v| v.is_finite()), "{what} at {size:?}");
            let all_dark = truth.direct.as_flattened().iter().all(|&v| v == 0.0);
            assert_eq!(all_dark, what == "empty" || truth.depth.iter().all(|&d| d == 0.0), "{what} at {size:?}");
            if what == "very bright" {
                assert!(truth.direct.as_flattened().iter().any(|&v| v > 1e29), "{what}: nothing is clamped away");
            }
        }
    }
}

/// Holes are holes for the eye, for shadow rays and for bounces, however many lie behind each other.
#[test]
fn absent_parts_of_cut_outs_let_everything_through() {
    let mask = |alpha: [u8; 2]| Texture {
        name: "mask".into(),
        width: 2,
        height: 1,
        rgba: [[255, 255, 255, alpha[0]], [255, 255, 255, alpha[1]]].concat(),
    };
    let scene = |textures: Vec<Texture>| {
        let mut scene = Scene {
            lights: vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] }],
            textures,
            ..Scene::default()
        };
        add_quad(&mut scene, [-5.0, 0.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0], grey(0.5, 0.0));
        for layer in 0..5 {
            let leaf = Material { alpha_texture: (!scene.textures.is_empty()).then_some(0), ..grey(0.5, 0.0) };
            let height = 0.5 + 0.2 * layer as f32;
            add_quad(&mut scene, [-5.0, height, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0], leaf);
            // The left half of the sheet shows texel 0, the right half texel 1.
            scene.meshes.last_mut().unwrap().uvs = vec![[0.0, 0.5], [1.0, 0.5], [1.0, 0.5], [0.0, 0.5]];
        }
        scene
    };
    let camera = Camera { eye: [0.0, 3.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0], vertical_fov_degrees: 60.0 };
    let request = Request { ambient_occlusion: Some(0.0), bounces: 1, ..Request::new(camera, [32, 16]) };
    let truth = trace(&scene(vec![mask([0, 255])]), &request, 32);
    for (index, depth) in truth.depth.iter().enumerate() {
        let left = index % 32 < 16;
        assert!((depth - if left { 3.0 } else { 1.7 }).abs() < 1e-4, "pixel {index} at depth {depth}");
        let lit = truth.direct[index][0] > 0.1;
        assert!(lit, "pixel {index}: sun through the holes on the left, on the uppermost sheet on the right");
    }
    // No holes at all, with and without the texture: the same image.
    let solid = trace(&scene(vec![mask([255, 255])]), &request, 8);
    let plain = trace(&scene(vec![]), &request, 8);
    assert_eq!(solid.indirect, plain.indirect);
    // All holes: only the floor is left, and it sees the sky.
    let open = trace(&scene(vec![mask([0, 0])]), &request, 8);
    assert!(open.ambient_occlusion.unwrap().mean.iter().all(|&v| v == 1.0));
}
