//! What the hierarchical gather converges to.
//!
//! With `disc_area = texel` its mean over many frames is that of the exhaustive sum, whatever the
//! number of samples, the start resolution and the radius, as long as the rings cover the screen.
#![allow(clippy::unwrap_used)]

use halflight_evaluator::experiment::session::{Frames, Session};
use halflight_native::images::luminance;
use halflight_scenes::Scene;
use halflight_soundness::{oracle::GBuffer, scenes};
use halflight_techniques::hierarchical::{Ring, covering_radius, ring_radii};
use halflight_tests::{bundled, device, mean_luminance, request};

#[test]
fn rings_of_successive_levels_tile_the_disc() {
    for ring in [Ring::Inner, Ring::Outer] {
        for radius in [0.7f32, 20.0, 40.0, 183.6] {
            let radii: Vec<[f32; 2]> = (0..8).map(|k| ring_radii(ring, radius, k)).collect();
            assert_eq!(radii[0][0], 0.0);
            for (k, pair) in radii.windows(2).enumerate() {
                // In pixels of level 0 one ring ends exactly where the next one begins: powers of two
                // are exact in float32, so no tolerance is needed.
                let [end, begin] = [pair[0][1] * (1 << k) as f32, pair[1][0] * (2 << k) as f32];
                assert_eq!(end, begin, "{ring:?} r {radius} level {k}");
            }
            // Together they have the area of the disc. Eight products in float64 round at 1e-15.
            let area = |[inner, outer]: [f32; 2]| f64::from(outer).powi(2) - f64::from(inner).powi(2);
            let rings: f64 = radii.iter().enumerate().map(|(k, &ring)| area(ring) * 4f64.powi(k as i32)).sum();
            let disc = (f64::from(radii[7][1]) * 128.0).powi(2);
            assert!((rings / disc - 1.0).abs() < 1e-12, "{rings} {disc}");
        }
    }
}

#[test]
fn the_covering_radius_reaches_from_corner_to_corner_and_no_farther() {
    for ring in [Ring::Inner, Ring::Outer] {
        for levels in 1..=8 {
            for size in [[1, 1], [320, 180], [1279, 717]] {
                let [_, outer] = ring_radii(ring, covering_radius(ring, levels, size), levels - 1);
                let reach = f64::from(outer) * f64::from(1u32 << (levels - 1));
                let diagonal = f64::from(size[0]).hypot(f64::from(size[1]));
                // Where the picture is small, it still reaches two texels: beyond the receiver's own.
                let wanted = diagonal.max(2.0 * f64::from(1u32 << (levels - 1)));
                // One rounding of the square root.
                assert!((reach / wanted - 1.0).abs() < 1e-6, "{ring:?} {levels} {size:?}: {reach} {wanted}");
            }
        }
    }
}

/// A scene at one size with the double-precision mean that everything is measured against.
struct Reference<'a> {
    session: Session<'a>,
    scene_frames: Frames<'a>,
    size: [u32; 2],
    receivers: Vec<usize>,
    mean: f64,
}

impl<'a> Reference<'a> {
    fn new(scene: &'a Scene, size: [u32; 2], receivers: usize, samples: u32) -> Self {
        let session = Session::new(device(), scene).keep_all();
        let mut scene_frames = session.scene_frames(&Default::default(), size).unwrap();
        scene_frames.run(0).unwrap();
        let gbuffer = GBuffer::read(&scene_frames);
        // An odd stride visits all columns and rows alike.
        let stride = (gbuffer.pixels.len() / receivers).max(1) | 1;
        let receivers: Vec<usize> = (0..gbuffer.pixels.len()).step_by(stride).collect();
        let light = |&index: &usize| luminance(gbuffer.estimate(index, samples, true).as_vec3().to_array());
        let mean = receivers.iter().map(|r| f64::from(light(r))).sum::<f64>() / receivers.len() as f64;
        Self { session, scene_frames, size, receivers, mean }
    }

    /// Mean light of the same pixels, over this many frames, relative to the exhaustive sum.
    fn ratio(&self, settings: &[(&str, &str)], frames: u32) -> f64 {
        // The exhaustive sum takes no light of the sky.
        let settings = [settings, &[("sky_rays", "0")]].concat();
        let request = request("hierarchical", &settings, self.size);
        let mut technique = self.session.technique_frames(&request, &self.scene_frames).unwrap();
        let (light, _) = technique.mean_over_frames("indirect", frames).unwrap();
        let sum: f64 = self.receivers.iter().map(|&r| f64::from(luminance(light[r]))).sum();
        sum / self.receivers.len() as f64 / self.mean
    }
}

#[test]
fn the_reference_is_the_exhaustive_sum() {
    for name in ["cornell", "atrium"] {
        let scene = bundled(name);
        let reference = Reference::new(&scene, [96, 54], 96 * 54, 8192);
        let request = request("exhaustive", &[], reference.size);
        let mut technique = reference.session.technique_frames(&request, &reference.scene_frames).unwrap();
        technique.run(0).unwrap();
        let exhaustive = mean_luminance(&technique.read_rgb("indirect").unwrap().unwrap());
        let ratio = reference.mean / exhaustive;
        println!("{name}: estimate over sum {ratio:.4}");
        // A few pixels where surfaces meet hold much of the light and of the noise; measured 0.3 %, and
        // three times that still leaves the 5 % below their meaning.
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
    }
}

/// At the size the technique is made for. What is left is the pyramid's doing: a texel keeps one child's
/// depth and normal. 5 % is the promise.
fn mean_does_not_move(name: &str) {
    let scene = bundled(name);
    let reference = Reference::new(&scene, [1280, 720], 20_000, 1024);
    let mut failures = Vec::new();
    // About as many samples in every row: frames make up for few samples. They leave noise of about 0.5 %.
    for (start, samples, frames) in [
        ("full", "16", 12),
        ("full", "64", 4),
        ("full", "256", 2),
        ("half", "16", 24),
        ("half", "64", 8),
        ("half", "256", 3),
        ("quarter", "16", 64),
        ("quarter", "64", 24),
        ("quarter", "256", 8),
    ] {
        let mut check = |extra: &[(&str, &str)]| {
            let base = [("disc_area", "texel"), ("start_resolution", start), ("samples", samples)];
            let ratio = reference.ratio(&[&base[..], extra].concat(), frames);
            println!("{name} {start} {samples} samples {extra:?}: {ratio:.4}");
            if (ratio - 1.0).abs() > 0.05 {
                failures.push(format!("{start} {samples} {extra:?}: {ratio:.4}"));
            }
        };
        check(&[]);
        if (start, samples) == ("quarter", "64") {
            // Radii beyond the smallest that covers the screen (46 and 23 texels).
            check(&[("ring", "2010"), ("radius", "60")]);
            check(&[("ring", "2009"), ("radius", "40")]);
            check(&[("upsampling_kernel", "nearest")]);
            check(&[("upsampling_kernel", "linear")]);
            check(&[("pyramid_filter", "vote")]);
        }
    }
    assert!(failures.is_empty(), "{name}: {failures:#?}");
}

#[test]
fn the_mean_does_not_move_in_the_cornell_box() {
    mean_does_not_move("cornell");
}

#[test]
fn the_mean_does_not_move_in_the_atrium() {
    mean_does_not_move("atrium");
}

#[test]
fn both_rings_are_the_same_when_they_cover_the_screen() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    let image =
        |ring| halflight_tests::render(&session, &request("hierarchical", &[("ring", ring)], [96, 54]), "indirect");
    // The outermost ring ends at the diagonal in either case, so all radii are equal.
    assert_eq!(image("2009"), image("2010"));
}

#[test]
fn discs_of_whole_samples_lose_light_when_they_are_few() {
    let scene = bundled("cornell");
    let reference = Reference::new(&scene, [320, 180], 5000, 512);
    let of = |disc, samples| {
        reference.ratio(&[("disc_area", disc), ("samples", samples), ("start_resolution", "half"), ("levels", "3")], 4)
    };
    let sample = ["4", "16", "64", "256"].map(|samples| of("sample", samples));
    let texel = of("texel", "64");
    println!("sample {sample:.4?}, texel {texel:.4}");
    assert!(sample.is_sorted(), "{sample:?}");
    assert!(sample[0] < 0.9 * sample[3] && sample[3] < texel, "{sample:?} {texel}");
}

/// Each level on its own: the mean over frames and receivers against the sum over the same surfels,
/// each one weighted with the area of it that the ring covers. This is the part that has no pyramid in
/// it: strata, ring, border, decoding and form factor.
#[test]
fn each_level_gathers_its_ring() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    // 100 x 61: the last column and row of a level reach beyond the screen.
    let size = [100, 61];
    let settings = [("start_resolution", "half"), ("levels", "3"), ("disc_area", "texel"), ("samples", "64")];
    let mut frames = halflight_tests::frames(&session, &request("hierarchical", &settings, size));
    let levels = [2u32, 4, 8];
    let mut sums = [const { Vec::new() }; 3];
    let count = 64;
    for frame in 0..count {
        frames.run(frame).unwrap();
        let all = frames.read_all().unwrap();
        for (k, sums) in sums.iter_mut().enumerate() {
            let (_, light) = all.iter().find(|(name, _)| *name == format!("gathered_{k}")).unwrap();
            sums.resize(light.len(), 0.0);
            sums.iter_mut().zip(light).for_each(|(sum, v)| *sum += f64::from(luminance([v[0], v[1], v[2]])));
        }
    }
    let radius = covering_radius(Ring::Inner, 3, size.map(|v| v.div_ceil(2)));
    for (k, scale) in levels.into_iter().enumerate() {
        let surfels = GBuffer::read_surfels(&frames, scale);
        let ring = ring_radii(Ring::Inner, radius, k as u32).map(f64::from);
        let exact: f64 = (0..surfels.pixels.len()).map(|i| ring_sum(&surfels, i, ring, scale)).sum();
        let ratio = sums[k].iter().sum::<f64>() / f64::from(count) / exact;
        println!("level {k}: {ratio:.4}");
        // 64 frames of 64 strata over hundreds of receivers: noise under 0.5 %; areas are found from 64
        // points a texel, right to about 0.5 % where a texel is as wide as the ring.
        assert!((ratio - 1.0).abs() < 0.015, "level {k}: {ratio:.4}");
    }
}

/// Light of one ring around a texel, luminance, from areas on a grid of 8 x 8 points a texel.
fn ring_sum(surfels: &GBuffer, receiver: usize, [inner, outer]: [f64; 2], scale: u32) -> f64 {
    const GRID: u32 = 8;
    let width = surfels.size[0];
    let extent = surfels.display_size.map(|v| f64::from(v) / f64::from(scale));
    let centre = [receiver as u32 % width, receiver as u32 / width].map(|v| f64::from(v) + 0.5);
    let at = &surfels.pixels[receiver];
    if at.depth <= 0.0 {
        return 0.0;
    }
    let mut sum = 0.0;
    for (i, source) in surfels.pixels.iter().enumerate() {
        let texel = [i as u32 % width, i as u32 / width];
        let points = (0..GRID * GRID).filter(|&point| {
            let at = |axis: usize, step: u32| f64::from(texel[axis]) + (f64::from(step) + 0.5) / f64::from(GRID);
            let (x, y) = (at(0, point % GRID), at(1, point / GRID));
            let distance = (x - centre[0]).hypot(y - centre[1]);
            x < extent[0] && y < extent[1] && (inner..outer).contains(&distance)
        });
        let share = points.count() as f64 / f64::from(GRID * GRID);
        if share > 0.0 && source.depth > 0.0 {
            let factor = surfels.form_factor(at, source, f64::from(scale * scale), true);
            sum += share * factor * f64::from(luminance(source.radiance.as_vec3().to_array()));
        }
    }
    sum
}
