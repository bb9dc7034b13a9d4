//! Against Mitsuba 3, an unrelated path tracer. Its images come with the development data and are not part of the
//! repository: without them the tests say so and pass.

use std::path::{Path, PathBuf};

use halflight_native::images::Image;
use halflight_renderer::truth::{Request, Truth};
use halflight_scenes::{Camera, DiskFiles, Light, Scene, load_scene};

use crate::trace;

type Rgb = [f32; 3];

/// The folder with the scenes and images, where there is one.
fn shared() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let found = folder.join("truth").is_dir();
    if !found {
        println!("not run: the independent images ({}) are not here", folder.display());
    }
    found.then_some(folder)
}

struct Set {
    folder: PathBuf,
    name: &'static str,
    scene: Scene,
    size: [u32; 2],
}

impl Set {
    fn load(&self, image: &str) -> Image {
        Image::read(&self.folder.join(format!("truth/{}_{image}.exr", self.name))).unwrap()
    }

    fn rgb(&self, image: &str) -> Vec<Rgb> {
        self.load(image).rgb("").unwrap()
    }

    fn request(&self) -> Request {
        Request { seed: 1, ..Request::new(self.scene.camera, self.size) }
    }
}

fn cornell() -> Option<Set> {
    let folder = shared()?;
    let mut scene = load_scene(&DiskFiles, &folder.join("scenes/cornell/cornell.obj")).unwrap();
    // The images have one light and no sky.
    scene.environment = None;
    scene.camera =
        Camera { eye: [0.0, 1.0, 3.9], target: [0.0, 1.0, 0.0], vertical_fov_degrees: 39.3, ..Camera::default() };
    scene.lights = vec![Light::Spot {
        position: [0.0, 1.95, 0.0],
        direction: [0.15, -1.0, 0.1],
        intensity: [4.0, 3.7, 3.2],
        half_angle_degrees: 40.0,
        full_intensity_half_angle_degrees: 35.0,
    }];
    Some(Set { folder, name: "cornell_spot", scene, size: [256, 256] })
}

fn sponza() -> Option<Set> {
    let folder = shared()?;
    let mut scene = load_scene(&DiskFiles, &folder.join("scenes/sponza/sponza.obj")).unwrap();
    scene.environment = None;
    scene.camera = Camera {
        eye: [-620.0, 150.0, -30.0],
        target: [500.0, 280.0, -30.0],
        vertical_fov_degrees: 60.0,
        ..Camera::default()
    };
    scene.lights = vec![Light::Directional { direction: [0.3, -1.0, 0.08], irradiance: [10.0, 9.5, 8.5] }];
    Some(Set { folder, name: "sponza_nave", scene, size: [640, 360] })
}

fn grey(values: &[f32]) -> Vec<Rgb> {
    values.iter().map(|&v| [v; 3]).collect()
}

/// `direct + albedo * incident`.
fn lit(truth: &Truth, incident: &[Rgb]) -> Vec<Rgb> {
    let pixels = truth.direct.iter().zip(&truth.albedo).zip(incident);
    pixels.map(|((direct, albedo), light)| std::array::from_fn(|c| direct[c] + albedo[c] * light[c])).collect()
}

/// Means over blocks of 8 x 8 pixels.
fn blocks(image: &[Rgb], [width, height]: [u32; 2]) -> Vec<[f64; 3]> {
    let (width, height) = (width as usize, height as usize);
    let origins = (0..height).step_by(8).flat_map(|y| (0..width).step_by(8).map(move |x| (x, y)));
    origins
        .map(|(x, y)| {
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for index in (y..(y + 8).min(height)).flat_map(|y| (x..(x + 8).min(width)).map(move |x| y * width + x)) {
                (0..3).for_each(|c| sum[c] += f64::from(image[index][c]));
                count += 1.0;
            }
            sum.map(|v| v / count)
        })
        .collect()
}

/// Relative root-mean-square difference over 8 x 8 blocks, and the relative difference of the means.
fn compare(what: &str, ours: &[Rgb], theirs: &[Rgb], size: [u32; 2]) -> (f64, f64) {
    let (ours, theirs) = (blocks(ours, size), blocks(theirs, size));
    let (ours, theirs) = (ours.as_flattened(), theirs.as_flattened());
    let count = theirs.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let square = ours.iter().zip(theirs).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count;
    let result = (square.sqrt() / mean(theirs), mean(ours) / mean(theirs) - 1.0);
    println!("{what}: RMSE over blocks {:.2} %, mean {:+.3} %", 100.0 * result.0, 100.0 * result.1);
    result
}

/// Part of the pixels that differ by more than `tolerance` of the image's mean.
fn outliers(what: &str, ours: &[Rgb], theirs: &[Rgb], tolerance: f32) -> f64 {
    let mean = theirs.as_flattened().iter().sum::<f32>() / (3 * theirs.len()) as f32;
    let apart = |(a, b): &(&Rgb, &Rgb)| (0..3).any(|c| (a[c] - b[c]).abs() > tolerance * mean.abs().max(1e-6));
    let part = ours.iter().zip(theirs).filter(apart).count() as f64 / ours.len() as f64;
    println!("{what}: {:.3} % of the pixels differ by more than {tolerance} of the mean", 100.0 * part);
    part
}

/// Parts of the pixels that may differ in depth, normal, albedo and direct light.
struct Limits {
    depth: f64,
    normal: f64,
    albedo: f64,
    direct: f64,
}

fn surfaces_agree(set: &Set, limits: &Limits) {
    let truth = trace(&set.scene, &set.request(), 1);
    let depth = outliers("depth", &grey(&truth.depth), &set.rgb("depth"), 1e-3);
    let theirs = set.rgb("normal");
    // The mean of a normal's components says nothing: compare the vectors themselves.
    let apart = |(a, b): &(&Rgb, &Rgb)| (0..3).map(|c| a[c] * b[c]).sum::<f32>() < 0.999 && b != &&[0.0; 3];
    let normal = truth.normal.iter().zip(&theirs).filter(apart).count() as f64 / theirs.len() as f64;
    println!("normal: {:.3} % of the pixels are more than 2.5 degrees apart", 100.0 * normal);
    let albedo = outliers("albedo", &truth.albedo, &set.rgb("albedo"), 0.02);
    let direct = outliers("direct", &truth.direct, &set.rgb("direct"), 0.02);
    assert!(depth < limits.depth && normal < limits.normal && albedo < limits.albedo && direct < limits.direct);
}

/// Pixel centres that fall on an edge of geometry or of a shadow may fall to either side.
#[test]
fn cornell_surfaces_and_direct_light() {
    let Some(set) = cornell() else { return };
    surfaces_agree(&set, &Limits { depth: 0.001, normal: 0.002, albedo: 0.002, direct: 0.002 });
}

/// Behind a hole of a cut-out Mitsuba continues its ray displaced along the cut-out's normal by about 0.1 units (its
/// ray epsilon), so what is seen through leaves is seen beside the place where a float64 ray through the scene's
/// triangles meets it; ours agrees with that ray to 1e-6. JPEG decoders also differ by a few per cent in colour where
/// colours change abruptly.
#[test]
fn sponza_surfaces_and_direct_light() {
    let Some(set) = sponza() else { return };
    surfaces_agree(&set, &Limits { depth: 0.002, normal: 0.002, albedo: 0.015, direct: 0.008 });
}

/// `samples` leave our own noise over blocks near 2 %, theirs is near 1.4 %.
fn light_agrees(set: &Set, radius: f32, occlusion: &str, samples: u32) {
    // 16 segments: the eye's, the light's, and 14 bounces between them.
    let request = Request { bounce1: true, bounces: 14, ambient_occlusion: Some(radius), ..set.request() };
    let truth = trace(&set.scene, &request, samples);
    println!(
        "{samples} samples: relative error over blocks {:.3} %",
        100.0 * truth.rel_error(8).expect("enough light")
    );
    let bounce1 = lit(&truth, &truth.bounce1.as_ref().unwrap().mean);
    let full = lit(&truth, &truth.indirect.as_ref().unwrap().mean);
    let results = [
        compare("bounce1", &bounce1, &set.rgb("bounce1"), set.size),
        compare("full", &full, &set.rgb("full"), set.size),
        compare(occlusion, &grey(&truth.ambient_occlusion.as_ref().unwrap().mean), &set.rgb(occlusion), set.size),
    ];
    for (error, mean) in results {
        assert!(error < 0.03 && mean.abs() < 0.01);
    }
}

#[test]
fn cornell_light() {
    let Some(set) = cornell() else { return };
    light_agrees(&set, 0.0, "ao", 256);
}

#[test]
fn sponza_light() {
    let Some(set) = sponza() else { return };
    light_agrees(&set, 200.0, "ao_r200", 16);
}
