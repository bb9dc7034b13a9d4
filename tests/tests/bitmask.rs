//! The visibility bitmask and the horizon family against closed forms, a double-precision twin and each other.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight_evaluator::experiment::session::{Frames, Session};
use halflight_native::{images::Rgb, truth::TruthSource};
use halflight_renderer::truth::{Request as TruthRequest, Stop, Truth};
use halflight_scenes::{Environment, Mesh, Scene};
use halflight_soundness::{
    oracle::{GBuffer, Pixel, sectors::Gather},
    scenes,
    suite::corner::{corner, seen_of_the_other},
};
use halflight_tests::{bundled, device, frames, mean_luminance, request};

/// What each pixel shows, in world space.
fn world(frames: &Frames) -> Vec<Option<(DVec3, DVec3)>> {
    let to_world = frames.view().world_to_view.as_dmat4().inverse();
    let place = |p: &Pixel| {
        (p.depth > 0.0).then(|| (to_world.transform_point3(p.position), to_world.transform_vector3(p.normal)))
    };
    GBuffer::read(frames).pixels.iter().map(place).collect()
}

/// Thickness that is given is constant unless said otherwise.
fn with_slope<'a>(technique: &str, settings: &[(&'a str, &'a str)]) -> Vec<(&'a str, &'a str)> {
    let given = settings.iter().any(|(name, _)| *name == "thickness") && ["bitmask", "ray-march"].contains(&technique);
    settings.iter().copied().chain(given.then_some(("thickness_slope", "0"))).collect()
}

fn converged(session: &Session, technique: &str, settings: &[(&str, &str)], size: [u32; 2], count: u32) -> Vec<Rgb> {
    let finds_light = !settings.contains(&("finds", "occlusion")) && technique != "gtao";
    let output = if finds_light { "indirect" } else { "ambient_occlusion" };
    let settings = [&[("denoise", "0")], with_slope(technique, settings).as_slice()].concat();
    frames(session, &request(technique, &settings, size)).mean_over_frames(output, count).unwrap().0
}

/// Mean of the first channel over the pixels where the truth says something, and the truth's; then the mean of the
/// differences' sizes.
fn against(image: &[Rgb], truth: &[Option<f64>]) -> [f64; 3] {
    let pairs: Vec<_> = image.iter().zip(truth).filter_map(|(x, t)| t.map(|t| (f64::from(x[0]), t))).collect();
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
    [mean(&|p| p.0), mean(&|p| p.1), mean(&|p| (p.0 - p.1).abs())]
}

const SIZE: [u32; 2] = [96, 72];

#[test]
fn radiometric_finds_openness_and_light_of_a_corner() {
    let scene = corner();
    let session = Session::new(device(), &scene).keep_all();
    let size = SIZE;
    let mut shown = frames(&session, &request("none", &[], size));
    shown.run(0).unwrap();
    // The other plane as each point sees it. Points under the width of a pixel from the edge see it through one texel.
    let factor = |(p, n): (DVec3, DVec3)| seen_of_the_other(p, n);
    let world = world(&shown);
    let open: Vec<_> = world.iter().map(|place| place.map(|place| 1.0 - factor(place))).collect();
    // The floor sends 1; the wall alone receives it.
    let light: Vec<_> = world.iter().map(|place| place.filter(|(_, n)| n.y < 0.5).map(factor)).collect();
    for (estimator, thickness) in [("radiometric", "0"), ("published", "0.2")] {
        let common = [("estimator", estimator), ("thickness", thickness), ("slices", "4"), ("steps", "16")];
        let image = converged(&session, "bitmask", &[&common[..], &[("finds", "occlusion")]].concat(), size, 8);
        let [mean, truth, error] = against(&image, &open);
        println!(
            "{estimator}: openness {mean:.4}, closed form {truth:.4} ({:+.2} %), mean error {error:.4}",
            100.0 * (mean / truth - 1.0)
        );
        let image = converged(&session, "bitmask", &common, size, 8);
        let [lit, lit_truth, _] = against(&image, &light);
        println!("{estimator}: light {lit:.4}, closed form {lit_truth:.4} ({:+.2} %)", 100.0 * (lit / lit_truth - 1.0));
        if estimator == "radiometric" {
            // 64 slices of 32 steps leave a deviation of a few per mille; the edge itself is under a pixel wide.
            assert!((mean / truth - 1.0).abs() < 0.02 && error < 0.02, "{mean} {truth} {error}");
            assert!((lit / lit_truth - 1.0).abs() < 0.05, "{lit} {lit_truth}");
        }
    }
}

/// A ball of radius 1 on a floor, finely divided.
fn ball_on_floor() -> Scene {
    let (rows, columns) = (48u32, 96u32);
    let mut ball = Mesh { material: 0, ..Mesh::default() };
    for i in 0..=rows {
        for j in 0..columns {
            let (a, b) = (f64::from(i) / f64::from(rows) * PI, f64::from(j) / f64::from(columns) * 2.0 * PI);
            let n = DVec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin());
            ball.positions.push((n + DVec3::Y).as_vec3().to_array());
            ball.normals.push(n.as_vec3().to_array());
            ball.uvs.push([0.0; 2]);
            let next = (j + 1) % columns;
            if i < rows {
                let [p, q, r, s] =
                    [i * columns + j, i * columns + next, (i + 1) * columns + j, (i + 1) * columns + next];
                ball.indices.extend([p, q, r, q, s, r]);
            }
        }
    }
    let floor = scenes::quad(Vec3::new(-9.0, 0.0, 9.0), 18.0 * Vec3::X, -18.0 * Vec3::Z, 0);
    let mut scene = Scene {
        name: "ball".into(),
        meshes: vec![floor, ball],
        materials: vec![scenes::grey(0.8)],
        lights: vec![scenes::sun()],
        ..Scene::default()
    };
    scene.camera = scenes::camera([0.0, 1.3, 6.0], [0.0, 0.8, 0.0], 40.0);
    scene
}

#[test]
fn radiometric_finds_openness_under_a_ball() {
    let scene = ball_on_floor();
    let session = Session::new(device(), &scene).keep_all();
    let mut shown = frames(&session, &request("none", &[], SIZE));
    shown.run(0).unwrap();
    // Before the ball, where the eye sees all of the ball that the floor sees: openness 1 - (r / d)^3.
    let truth: Vec<_> = world(&shown)
        .iter()
        .map(|place| {
            let (p, _) = place.filter(|(p, n)| n.y > 0.9 && p.y.abs() < 1e-3 && p.x.abs() < 0.5 && p.z > 0.8)?;
            Some(1.0 - p.distance(DVec3::Y).powi(-3))
        })
        .collect();
    let settings = [("finds", "occlusion"), ("thickness", "0.5"), ("slices", "4"), ("steps", "16")];
    let image = converged(&session, "bitmask", &settings, SIZE, 8);
    let [mean, exact, error] = against(&image, &truth);
    println!("ball: openness {mean:.4}, closed form {exact:.4}, mean error {error:.4}");
    assert!((mean / exact - 1.0).abs() < 0.02 && error < 0.02, "{mean} {exact} {error}");
}

#[test]
fn the_gather_agrees_with_double_precision() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    let size = [64, 48];
    for (estimator, spacing, resolution, radius, sectors) in [
        ("radiometric", "exponential", "full", 0.0, 32),
        ("radiometric", "constant", "half", 1.2, 128),
        ("published", "constant", "full", 0.0, 64),
    ] {
        let (radius_text, sectors_text) = (radius.to_string(), sectors.to_string());
        let settings = [
            ("estimator", estimator),
            ("spacing", spacing),
            ("resolution", resolution),
            ("radius", &radius_text),
            ("sectors", &sectors_text),
            ("slices", "2"),
            ("steps", "6"),
            ("thickness", "0.3"),
            ("thickness_slope", "0"),
            ("denoise", "0"),
            ("storage", "float32"),
        ];
        let mut frames = frames(&session, &request("bitmask", &settings, size));
        frames.run(3).unwrap();
        let scale = if resolution == "half" { 2 } else { 1 };
        let image = GBuffer::read_surfels(&frames, scale);
        let bytes = frames.read_bytes("gathered").unwrap().unwrap();
        let found: &[[f32; 4]] = bytemuck::cast_slice(&bytes);
        let twin = Gather {
            radiometric: estimator == "radiometric",
            radius: if radius > 0.0 { radius } else { 1e15 },
            thickness: 0.3,
            slices: 2,
            steps: 6,
            exponential: spacing == "exponential",
            sectors,
            frame: 3,
            seed: 0,
        };
        let (mut off, mut count, mut sums) = (0, 0, [[0.0; 2]; 2]);
        for (index, found) in found.iter().enumerate() {
            let expected = twin.gather(&image, index, scale);
            if image.pixels[index].depth <= 0.0 {
                continue;
            }
            count += 1;
            let differences = [f64::from(found[0]) - expected.light.x, f64::from(found[3]) - expected.open];
            off += u32::from(differences.iter().any(|d| d.abs() > 2e-3));
            sums[0][0] += f64::from(found[0]);
            sums[0][1] += expected.light.x;
            sums[1][0] += f64::from(found[3]);
            sums[1][1] += expected.open;
        }
        let [light, open] = sums.map(|[own, twin]| own / twin - 1.0);
        println!(
            "{estimator} {spacing} {resolution}: {off} of {count} pixels differ, means by {light:.1e} and {open:.1e}"
        );
        // A place on the border of two sectors, or a sample on that of two texels, falls to either side by rounding.
        assert!(f64::from(off) < 0.03 * f64::from(count), "{off} of {count}");
        assert!(light.abs() < 2e-3 && open.abs() < 1e-3, "{light} {open}");
    }
}

#[test]
fn resolution_units_and_steps_do_not_move_the_mean() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    let mut large = scene.clone();
    let scale = |v: &mut [f32; 3]| *v = v.map(|v| v * 1000.0);
    large.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(scale);
    scale(&mut large.camera.eye);
    scale(&mut large.camera.target);
    let large = Session::new(device(), &large).keep_all();
    let base = [("slices", "2"), ("steps", "16"), ("thickness", "0.3")];
    let of = |session: &Session, radius, changed: &[(&str, &str)], size| {
        let settings: Vec<_> = base
            .iter()
            .map(|&(name, value)| changed.iter().find(|(n, _)| *n == name).copied().unwrap_or((name, value)))
            .chain(changed.iter().copied().filter(|(name, _)| !base.iter().any(|(n, _)| n == name)))
            .collect();
        // Light of all the screen: with a radius, a stride that leaves it counts as a whole or not at all, which moves the
        // light of 16 steps by 3 %.
        [("occlusion", radius), ("light", "0")].map(|(finds, radius)| {
            let settings = [&settings[..], &[("finds", finds), ("radius", radius)]].concat();
            mean_luminance(&converged(session, "bitmask", &settings, size, 12))
        })
    };
    let size = [120, 90];
    let expected = of(&session, "1", &[], size);
    for (what, found) in [
        ("twice the resolution", of(&session, "1", &[], size.map(|v| 2 * v))),
        ("units of a millimetre", of(&large, "1000", &[("thickness", "300")], size)),
        ("half the steps", of(&session, "1", &[("steps", "8")], size)),
        ("four times the steps", of(&session, "1", &[("steps", "64")], size)),
        ("constant steps", of(&session, "1", &[("spacing", "constant")], size)),
        ("half resolution", of(&session, "1", &[("resolution", "half")], size)),
    ] {
        let [open, light] = [0, 1].map(|i| found[i] / expected[i] - 1.0);
        println!("{what}: openness {:+.2} %, light {:+.2} %", 100.0 * open, 100.0 * light);
        // At half resolution a texel keeps one surface of four pixels, which moves edges by half a pixel: light is
        // strongest there.
        // Twice the resolution moves the edges of shadows by half a pixel, too.
        let most = match what {
            "half resolution" => 0.05,
            "twice the resolution" => 0.025,
            _ => 0.02,
        };
        assert!(open.abs() < 0.02 && light.abs() < most, "{what}: {open} {light}");
    }
}

#[test]
fn at_equal_samples_slices_are_less_noisy_than_rays() {
    let scene = bundled("cornell");
    let session = Session::new(device(), &scene).keep_all();
    let deviation = |technique: &str, settings: &[(&str, &str)]| {
        let thick = [("denoise", "0"), ("steps", "16"), ("thickness", "0.2"), ("thickness_slope", "0")];
        let settings = [&thick, settings].concat();
        let (image, deviation) =
            frames(&session, &request(technique, &settings, SIZE)).mean_over_frames("indirect", 12).unwrap();
        deviation / mean_luminance(&image)
    };
    // 32 samples each: two rays, or two sides of a slice.
    let rays = deviation("ray-march", &[("rays", "2")]);
    let slices = deviation("bitmask", &[("slices", "1")]);
    println!(
        "deviation over mean: rays {rays:.3}, slices {slices:.3}, variance {:.2} times lower",
        (rays / slices).powi(2)
    );
    assert!(slices < rays, "{slices} {rays}");
}

#[test]
fn a_closed_white_room_converges_under_the_geometric_series() {
    // The furnace's walls send 0.5; painted white they also reflect all that arrives.
    let mut scene = bundled("furnace");
    scene.materials.iter_mut().for_each(|material| material.albedo = [1.0; 3]);
    let session = Session::new(device(), &scene).keep_all();
    let sent = scene.materials[0].emission[0];
    for bound in ["0.5", "0.95"] {
        let settings = [("feedback", bound), ("slices", "2"), ("storage", "float32")];
        let mut frames = frames(&session, &request("bitmask", &settings, [32, 24]));
        let mut means = Vec::new();
        for frame in 0..80 {
            frames.run(frame).unwrap();
            means.push(mean_luminance(&frames.read_rgb("indirect").unwrap().unwrap()));
        }
        let window = |range: std::ops::Range<usize>| means[range.clone()].iter().sum::<f64>() / range.len() as f64;
        let (before, after) = (window(40..60), window(60..80));
        let limit = f64::from(sent) / (1.0 - bound.parse::<f64>().unwrap());
        println!("albedo at most {bound}: first frame {:.3}, then {before:.3}, {after:.3}; bound {limit:.3}", means[0]);
        assert!(means.iter().all(|&mean| mean < limit), "{means:?}");
        // Twenty frames average noise away; 0.95^40 of the last change is left.
        assert!((after / before - 1.0).abs() < 0.02, "{before} {after}");
        assert!(after > 1.1 * means[0], "no further bounce arrives");
    }
}

#[test]
fn extremes_are_finite_and_sensible() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    let mean = |settings: &[(&str, &str)]| {
        let settings = [&[("finds", "occlusion"), ("denoise", "0")], &*with_slope("bitmask", settings)].concat();
        let mut frames = frames(&session, &request("bitmask", &settings, [48, 36]));
        frames.run(0).unwrap();
        let open = frames.read_rgb("ambient_occlusion").unwrap().unwrap();
        let world = world(&frames);
        let shown: Vec<f64> =
            open.iter().zip(&world).filter(|(_, place)| place.is_some()).map(|(v, _)| f64::from(v[0])).collect();
        assert!(shown.iter().all(|v| v.is_finite()), "{settings:?}");
        shown.iter().sum::<f64>() / shown.len() as f64
    };
    let plain = mean(&[("slices", "4")]);
    // One slice of one step each way sees less, and no more than everything.
    let least = mean(&[("slices", "1"), ("steps", "1")]);
    assert!((0.0..=1.0).contains(&least), "{least}");
    // Thicker hides more; without end it still leaves what lies above.
    let thickness = ["0", "0.1", "10", "1e9"].map(|t| mean(&[("slices", "4"), ("thickness", t)]));
    println!("openness {plain:.3}, one step {least:.3}, by thickness {thickness:.3?}");
    assert!(thickness.windows(2).all(|pair| pair[1] <= pair[0] + 1e-3), "{thickness:?}");
    assert!(thickness[3] > 0.05, "{thickness:?}");
    // A radius far smaller than a pixel finds nothing, one larger than the scene all that 0, for no end, finds.
    assert!((mean(&[("radius", "1e-6")]) - 1.0).abs() < 1e-6);
    let [without_end, large] = ["0", "1e6"].map(|radius| mean(&[("radius", radius)]));
    assert!((without_end - large).abs() < 1e-4, "{without_end} {large}");
}

fn trace(scene: &Scene, request: &TruthRequest, samples: u32) -> Truth {
    let source = TruthSource::new(&device().gpu, scene, None);
    source.trace(request, Stop::at_samples(samples), &mut |_| ()).unwrap().truth
}

#[test]
fn behind_thin_bars_the_bitmask_is_nearer_to_rays_than_horizons() {
    // Figure 6: radius 2, thickness 1, 0.5, 0.25 and 0.1 against both kinds of gtao.
    let scene = bundled("bars");
    let size = [128, 72];
    let request = TruthRequest { ambient_occlusion: Some(2.0), ..TruthRequest::new(scene.camera, size) };
    let truth = trace(&scene, &request, 64).ambient_occlusion.unwrap().mean;
    let session = Session::new(device(), &scene).keep_all();
    let rmse = |technique: &str, settings: &[(&str, &str)]| {
        let settings = [&[("radius", "2"), ("slices", "4"), ("steps", "16")], settings].concat();
        let image = converged(&session, technique, &settings, size, 2);
        let square = |(x, t): (&Rgb, &f32)| f64::from(x[0] - t).powi(2);
        (image.iter().zip(&truth).map(square).sum::<f64>() / truth.len() as f64).sqrt()
    };
    let horizons = [rmse("gtao", &[]), rmse("gtao", &[("falloff", "0.6")])];
    let bitmask = ["1", "0.5", "0.25", "0.1"].map(|t| rmse("bitmask", &[("finds", "occlusion"), ("thickness", t)]));
    println!("gtao without and with falloff {horizons:.3?}, bitmask {bitmask:.3?}");
    assert!(bitmask.iter().all(|own| horizons.iter().all(|other| own < other)), "{horizons:?} {bitmask:?}");
}

#[test]
fn the_environment_lights_what_is_open() {
    let mut scene = corner();
    scene.lights.clear();
    let size = [48, 36];
    let common = [("thickness", "0"), ("slices", "4"), ("steps", "16"), ("storage", "float32")];
    // Of radiance 1 from everywhere a surface receives its openness, which has a closed form.
    scene.environment = Some(Environment::constant([1.0; 3]));
    let session = Session::new(device(), &scene).keep_all();
    let mut shown = frames(&session, &request("none", &[], size));
    shown.run(0).unwrap();
    let open: Vec<_> = world(&shown)
        .iter()
        .map(|place| {
            let (p, n) = (*place)?;
            Some(1.0 - seen_of_the_other(p, n))
        })
        .collect();
    let ray = TruthRequest { bounces: 1, ..TruthRequest::new(scene.camera, size) };
    let traced = trace(&scene, &ray, 64).indirect.unwrap().mean;
    let [mean, exact, _] = against(&traced, &open);
    println!("constant: path tracer {mean:.4}, closed form {exact:.4}");
    // 64 samples of a thousand pixels: a deviation of 0.002.
    assert!((mean / exact - 1.0).abs() < 0.01);
    for (technique, settings) in [
        ("bitmask", [&common[..], &[("ambient", "bitmask")]].concat()),
        ("bitmask", [&common[..], &[("ambient", "bent-normal")]].concat()),
        ("bitmask", [&common[..], &[("ambient", "normal")]].concat()),
        ("horizon", common[1..].to_vec()),
        ("ray-march", vec![("rays", "8"), ("steps", "32"), ("thickness", "0.3"), ("storage", "float32")]),
    ] {
        let [mean, exact, _] = against(&converged(&session, technique, &settings, size, 4), &open);
        println!("constant: {technique} {:?} {mean:.4}", settings.last().unwrap());
        // Rays step over the edge, horizons round it: their own errors, not the environment's.
        let most = if technique == "bitmask" { 0.02 } else { 0.06 };
        assert!((mean / exact - 1.0).abs() < most, "{technique} {settings:?}: {mean} {exact}");
    }
    // gtao finds openness alone, and the environment through it.
    let settings = [("denoise", "0"), ("slices", "4"), ("steps", "16")];
    let gtao = halflight_tests::render(&session, &request("gtao", &settings, size), "indirect");
    let [mean, exact, _] = against(&gtao, &open);
    assert!((mean / exact - 1.0).abs() < 0.06, "gtao: {mean} {exact}");

    // A sky that is red on one side, blue on the other and green above: directions tell the methods apart (Figure 11).
    let (width, height) = (64, 32);
    let texel = |i: u32| {
        let longitude = (f64::from(i % width) + 0.5) / f64::from(width) * 2.0 * PI - PI;
        let latitude = (f64::from(i / width) + 0.5) / f64::from(height) * PI;
        let x = latitude.sin() * longitude.sin();
        [x.max(0.0) as f32, latitude.cos().max(0.0) as f32, (-x).max(0.0) as f32]
    };
    let texels = (0..width * height).map(texel).collect();
    scene.environment = Some(Environment { map: Some("sky".into()), width, height, texels });
    // A wall that hides one side of the sky.
    scene.meshes.push(scenes::quad(Vec3::new(0.3, 0.0, 0.0), 2.0 * Vec3::Z, 1.2 * Vec3::Y, 0));
    let session = Session::new(device(), &scene).keep_all();
    let traced = trace(&scene, &ray, 256);
    let mask: Vec<bool> = traced.depth.iter().map(|&depth| depth > 0.0).collect();
    let traced = traced.indirect.unwrap().mean;
    let rmse = ["normal", "bent-normal", "bitmask"].map(|ambient| {
        let settings = [&common[1..], &[("ambient", ambient), ("thickness", "0.02")]].concat();
        let image = converged(&session, "bitmask", &settings, size, 4);
        halflight_metrics::rmse(&halflight_metrics::LinearPair::new(&image, &traced, Some(&mask)))
    });
    println!("sky: RMSE of normal, bent normal and bitmask {rmse:.4?}");
    assert!(rmse[2] < rmse[0] && rmse[2] < rmse[1], "{rmse:?}");
}
