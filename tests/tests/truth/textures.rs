//! Textures averaged over pixels, against many bilinear values in each pixel.

use halflight_evaluator::experiment::session::Session;
use halflight_renderer::{
    gi::TextureFilter,
    truth::{Request, Truth},
};
use halflight_scenes::{Camera, Material, Scene, Texture};
use halflight_tests::{device, render, request};

use crate::{add_quad, trace};

const SIZE: [u32; 2] = [96, 64];
/// Values along each axis of a pixel.
const VALUES: u32 = 16;
const TEXELS: u32 = 64;

/// A floor with a texture of noise. In the picture texels are from one pixel wide down to a hundredth along the view.
fn floor() -> Scene {
    let code = |i: u32| (i.wrapping_mul(0x9e37_79b9) ^ (i >> 3).wrapping_mul(0x85eb_ca6b)).to_le_bytes()[2];
    let rgba = (0..TEXELS * TEXELS).flat_map(|i| [code(3 * i), code(3 * i + 1), code(3 * i + 2), 255]).collect();
    let camera =
        Camera { eye: [0.0, 1.0, 0.0], target: [0.0, 0.0, -3.0], up: [0.0, 1.0, 0.0], vertical_fov_degrees: 30.0 };
    let mut scene = Scene { camera, ..Scene::default() };
    scene.textures.push(Texture { name: "noise".into(), width: TEXELS, height: TEXELS, rgba });
    let material = Material { albedo: [1.0; 3], albedo_texture: Some(0), ..Material::default() };
    add_quad(&mut scene, [-50.0, 0.0, 10.0], [100.0, 0.0, 0.0], [0.0, 0.0, -100.0], material);
    scene.meshes[0].uvs = vec![[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
    scene
}

/// What the path tracer says of the surfaces that the camera sees.
fn seen(scene: &Scene, size: [u32; 2], texture_filter: TextureFilter) -> Truth {
    trace(scene, &Request { texture_filter, ..Request::new(scene.camera, size) }, 1)
}

/// Root of the mean square of the differences.
fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let squares: f64 = a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (squares / a.as_flattened().len() as f64).sqrt()
}

#[test]
fn mips_are_means_over_pixels() {
    let scene = floor();
    let fine = seen(&scene, SIZE.map(|side| side * VALUES), TextureFilter::Bilinear).albedo;
    let [width, height] = SIZE.map(|side| side as usize);
    let values = VALUES as usize;
    let mean_of = |pixel: usize| -> [f32; 3] {
        let (x, y) = (pixel % width * values, pixel / width * values);
        let rows = (y..y + values).flat_map(|y| &fine[y * width * values + x..][..values]);
        rows.fold([0.0; 3], |sum, value| std::array::from_fn(|c| sum[c] + value[c] / (values * values) as f32))
    };
    let means: Vec<_> = (0..width * height).map(mean_of).collect();
    let mips = seen(&scene, SIZE, TextureFilter::Mips);
    assert!(mips.depth.iter().all(|&depth| depth > 0.0), "the floor fills the picture");
    let (with, without) =
        (difference(&mips.albedo, &means), difference(&seen(&scene, SIZE, TextureFilter::Bilinear).albedo, &means));
    println!("RMS of albedo: {with:.4} with mips, {without:.4} without");
    // What is left is blur: bilinear values are soft, and a pixel is taken as at most four times as long as wide.
    assert!(with < 0.2 * without, "{with:.4} with mips, {without:.4} without");
}

/// The rasterizer takes differences between pixels, the path tracer intersects planes.
#[test]
fn the_reference_reads_textures_as_the_picture_does() {
    let scene = floor();
    let session = Session::new(device(), &scene);
    for (filter, name) in [(TextureFilter::Mips, "mips"), (TextureFilter::Bilinear, "bilinear")] {
        let request = request("none", &[("gbuffer.texture_filter", name)], SIZE);
        let albedo = render(&session, &request, "albedo");
        let truth = seen(&scene, SIZE, filter).albedo;
        let worst =
            albedo.as_flattened().iter().zip(truth.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{name}: {worst}");
        // The picture has 8 bits: half a step is at most 0.0045 near 1. Coordinates of up to 100 are rounded to a
        // thousandth of a texel, which is as much of the difference between two texels, at most 1.
        assert!(worst < 0.006, "{name}: {worst}");
    }
}

/// Texture coordinates that are all alike, tiny or huge, and textures of one texel or a single column: albedo stays between
/// that of the darkest and of the brightest texel.
#[test]
fn extreme_footprints_stay_in_range() {
    for (size, scale) in
        [([64, 64], 0.0), ([64, 64], 1e-30), ([64, 64], 1e6), ([64, 64], 1e30), ([1, 1], 1.0), ([1, 7], 1.0)]
    {
        let mut scene = floor();
        let count = (size[0] * size[1]) as usize;
        let rgba = [[60, 60, 60, 255], [200, 200, 200, 255]].into_iter().cycle().take(count).flatten().collect();
        scene.textures[0] = Texture { name: "stripes".into(), width: size[0], height: size[1], rgba };
        scene.meshes[0].uvs.iter_mut().flatten().for_each(|coordinate| *coordinate *= scale);
        let session = Session::new(device(), &scene);
        let picture = render(&session, &request("none", &[("gbuffer.texture_filter", "mips")], SIZE), "albedo");
        let truth = seen(&scene, SIZE, TextureFilter::Mips).albedo;
        // Linear values of the two codes, 0.0452 and 0.5776, and half a step of 8 bits.
        let in_range = |value: &f32| (0.043..=0.581).contains(value);
        for (name, albedo) in [("picture", picture), ("reference", truth)] {
            let wrong = albedo.as_flattened().iter().find(|value| !in_range(value));
            assert_eq!(wrong, None, "{name}, {size:?}, coordinates times {scale}");
        }
    }
}
