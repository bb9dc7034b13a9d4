//! What must not change an image, or must change it in a known way.
#![allow(clippy::unwrap_used)]

use halflight_evaluator::session::Session;
use halflight_native::images::{Rgb, luminance};
use halflight_scenes::{Light, Scene};
use halflight_tests::{bundled, device, frames, mean_luminance, render, request, scenes};

/// The scene seen in a mirror: x changes its sign, and triangles turn over.
fn mirrored(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        mesh.positions.iter_mut().chain(&mut mesh.normals).for_each(|v| v[0] = -v[0]);
        mesh.indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
    for light in &mut scene.lights {
        match light {
            Light::Directional { direction, .. } => direction[0] = -direction[0],
            Light::Point { position, .. } => position[0] = -position[0],
            Light::Spot { position, direction, .. } => {
                position[0] = -position[0];
                direction[0] = -direction[0];
            }
        }
    }
    scene.camera.eye[0] = -scene.camera.eye[0];
    scene.camera.target[0] = -scene.camera.target[0];
    scene
}

/// Root mean square of the difference of two images, relative to the mean of the first.
fn difference(a: &[Rgb], b: &[Rgb]) -> f64 {
    let square = |(a, b): (&Rgb, &Rgb)| f64::from(luminance(*a) - luminance(*b)).powi(2);
    (a.iter().zip(b).map(square).sum::<f64>() / a.len() as f64).sqrt() / mean_luminance(a)
}

/// An image with its columns in reverse order.
fn flipped(image: &[Rgb], width: usize) -> Vec<Rgb> {
    image.chunks_exact(width).flat_map(|row| row.iter().rev()).copied().collect()
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_image() {
    // 128 x 64 divides into whole texels of every level, so that the mirror maps texels onto texels.
    let size = [128, 64];
    let scene = scenes::court();
    let twin = mirrored(&scene);
    let (scene, twin) = (Session::new(device(), &scene), Session::new(device(), &twin));
    let direct = request("none", &[], size);
    let exact = difference(&render(&scene, &direct, "direct"), &flipped(&render(&twin, &direct, "direct"), 128));
    println!("direct: {exact:.1e}");
    let of_2010 = [("visibility", "surface"), ("bounces", "2"), ("bounce_interleaving", "on")];
    for (filter, more) in [("nearest", &[][..]), ("vote", &[]), ("nearest", &of_2010)] {
        for start in ["full", "half", "quarter"] {
            let settings = [("start_resolution", start), ("pyramid_filter", filter), ("storage", "float32")];
            let settings = [&settings[..], more].concat();
            let mean = |session, seed| {
                let request =
                    halflight_evaluator::session::Request { seed, ..request("hierarchical", &settings, size) };
                frames(session, &request).mean_over_frames("indirect", 24).unwrap().0
            };
            let image = mean(&scene, 0);
            let noise = difference(&image, &mean(&scene, 1));
            let mirror = difference(&image, &flipped(&mean(&twin, 2), 128));
            let moved: Vec<Rgb> = image.iter().skip(1).chain(&image[..1]).copied().collect();
            let shift = difference(&image, &moved);
            println!(
                "{filter} {start} {more:?}: mirrored {mirror:.4}, another seed {noise:.4}, one pixel aside {shift:.4}"
            );
            // Another seed differs by noise alone; the mirrored image may not differ by much more. The
            // last percent is the shadow map's, whose texels do not mirror.
            assert!(mirror < 1.5 * noise + 0.01, "{filter} {start} {more:?}: {mirror} against noise {noise}");
        }
    }
}

fn bits(image: &[Rgb]) -> Vec<[u32; 3]> {
    image.iter().map(|pixel| pixel.map(f32::to_bits)).collect()
}

#[test]
fn brightness_scales_exactly_with_light() {
    let scene = scenes::court();
    let mut bright = scene.clone();
    // A power of two moves exponents and no mantissa, so every bit must agree.
    for light in &mut bright.lights {
        if let Light::Directional { irradiance, .. } = light {
            *irradiance = irradiance.map(|v| v * 16.0);
        }
    }
    let (scene, bright) = (Session::new(device(), &scene), Session::new(device(), &bright));
    for (technique, settings) in [
        ("exhaustive", &[][..]),
        ("hierarchical", &[("storage", "float32")]),
        (
            "hierarchical",
            &[("storage", "float32"), ("disc_area", "texel"), ("pyramid_filter", "vote"), ("form_factor", "eq3")],
        ),
        ("hierarchical", &[("storage", "float32"), ("visibility", "auto"), ("bounces", "3")]),
    ] {
        for output in ["indirect", "final"] {
            let request = request(technique, settings, [64, 36]);
            let expected: Vec<Rgb> = render(&scene, &request, output).iter().map(|p| p.map(|v| v * 16.0)).collect();
            assert!(mean_luminance(&expected) > 0.0);
            assert!(bits(&expected) == bits(&render(&bright, &request, output)), "{technique} {settings:?} {output}");
        }
    }
}

/// The scene in other units.
fn scaled(scene: &Scene, factor: f32) -> Scene {
    let mut scene = scene.clone();
    let scale = |v: &mut [f32; 3]| *v = v.map(|v| v * factor);
    scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(scale);
    for light in &mut scene.lights {
        match light {
            Light::Directional { .. } => {}
            // Intensity falls with the square of a distance that is now longer.
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                scale(position);
                *intensity = intensity.map(|v| v * factor * factor);
            }
        }
    }
    scale(&mut scene.camera.eye);
    scale(&mut scene.camera.target);
    scene
}

#[test]
fn world_units_do_not_matter() {
    let scene = bundled("cornell");
    let plain = Session::new(device(), &scene);
    let decimal = [1e-3, 1e3, 1e6];
    // A voxel is set or not: where a surface lies on the border of two, the last bit decides over all rays there. Powers
    // of two change no mantissa, so that only logarithms are rounded otherwise.
    let binary = [2f32.powi(-10), 2f32.powi(10), 2f32.powi(20)];
    for (technique, settings, factors) in [
        ("hierarchical", &[("storage", "float32")][..], decimal),
        ("hierarchical", &[("storage", "float32"), ("visibility", "auto"), ("bounces", "2")], binary),
        ("exhaustive", &[], decimal),
    ] {
        let request = request(technique, settings, [96, 54]);
        let expected = render(&plain, &request, "indirect");
        for factor in factors {
            let other = scaled(&scene, factor);
            let image = render(&Session::new(device(), &other), &request, "indirect");
            let (mean, rms) = (mean_luminance(&image) / mean_luminance(&expected), difference(&expected, &image));
            println!("{technique} x {factor}: mean {mean:.6}, rms {rms:.1e}");
            // Rounding differs: a pixel at an edge may show the other surface, or a kept child change.
            assert!((mean - 1.0).abs() < 2e-3 && rms < 0.05, "{technique} {factor}: {mean} {rms}");
        }
    }
}

#[test]
fn one_seed_gives_one_image_and_another_seed_another() {
    let scene = scenes::court();
    let image = |seed| {
        // A session of its own: nothing may be left over from the run before.
        let session = Session::new(device(), &scene);
        let settings = [("visibility", "surface"), ("bounces", "2")];
        let request = halflight_evaluator::session::Request { seed, ..request("hierarchical", &settings, [97, 53]) };
        bits(&render(&session, &request, "final"))
    };
    let first = image(7);
    assert!(first == image(7), "two runs with one seed differ");
    assert!(first != image(8), "the seed changes nothing");
}

#[test]
fn frames_do_not_depend_on_those_before_them() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
    let request = request("hierarchical", &[("visibility", "surface"), ("bounces", "2")], [64, 36]);
    let mut frames = frames(&session, &request);
    let mut image = |frame| {
        frames.run(frame).unwrap();
        bits(&frames.read_rgb("final").unwrap().unwrap())
    };
    let (zero, one) = (image(0), image(1));
    assert!(zero != one, "frames do not turn the random numbers");
    assert!(zero == image(0), "frame 0 changed after frame 1");
}
