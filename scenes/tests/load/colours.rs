//! Colours of vertices, and emission from images.

use std::io::Cursor;

use halflight_scenes::Scene;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};

use crate::{assert_warns, corners, load, load_obj};

fn png(image: RgbImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::from(image).write_to(&mut bytes, ImageFormat::Png).expect("a small image");
    bytes.into_inner()
}

/// sRGB, 8 bits, to linear.
fn linear(x: u8) -> f32 {
    let x = f32::from(x) / 255.0;
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// The albedo and the positions of each triangle.
fn coloured(scene: &Scene) -> Vec<([f32; 3], [[f32; 3]; 3])> {
    let triangles = |mesh: &halflight_scenes::Mesh| {
        let albedo = scene.materials[mesh.material].albedo;
        let mesh = mesh.clone();
        let triangle = move |t: &[u32; 3]| (albedo, t.map(|i| mesh.positions[i as usize]));
        mesh.indices.as_chunks::<3>().0.iter().map(triangle).collect::<Vec<_>>()
    };
    scene.meshes.iter().flat_map(triangles).collect()
}

#[test]
fn faces_take_the_colours_of_their_vertices() {
    let scene = load_obj(
        "v 0 0 0 .7 .1 .1\nv 1 0 0 .7 .1 .1\nv 0 1 0 .7 .1 .1\nf 1 2 3\n\
         v 0 0 1 .1 .2 .7\nv 1 0 1 .1 .2 .7\nv 0 1 1 .1 .2 .7\nf 4 5 6\nf 3 2 1\n",
    );
    // The same as with materials of these colours.
    let twin = load(
        &[
            ("m.obj", b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nusemtl r\nf 1 2 3\nf 3 2 1\nusemtl b\nf 4 5 6\n"),
            ("m.mtl", b"newmtl r\nKd .7 .1 .1\nnewmtl b\nKd .1 .2 .7\n"),
        ],
        "m.obj",
    );
    assert_eq!(coloured(&scene), coloured(&twin));
    assert_eq!((scene.materials.len(), scene.warnings.len()), (2, 0));
}

#[test]
fn colours_multiply_the_albedo_and_are_averaged_with_a_warning() {
    let obj = b"mtllib m.mtl\nusemtl m\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3 4\n";
    let scene = load(&[("m.obj", obj), ("m.mtl", b"newmtl m\nKd .5 .8 1\nKs .1 .1 .1\n")], "m.obj");
    assert_eq!(scene.materials[0].albedo, [0.125, 0.2, 0.0]);
    assert_eq!(scene.materials[0].specular, [0.1; 3]);
    assert_warns(&scene, &["m.obj:", "colours of vertices", "averaged"]);
}

#[test]
fn white_vertices_change_nothing() {
    let white = load_obj("v 0 0 0 1 1 1\nv 1 0 0 1.0 1 1\nv 0 1 0 1 1 1\nf 1 2 3\n");
    assert_eq!((white.materials[0].albedo, white.warnings.len()), ([0.8; 3], 0));
    // Four numbers are a weight, not a colour.
    let weights = load_obj("v 0 0 0 .5\nv 1 0 0 .5\nv 0 1 0 .5\nf 1 2 3\n");
    assert_eq!(weights.materials[0].albedo, [0.8; 3]);
}

#[test]
fn colours_in_bytes_are_scaled() {
    let scene = load_obj("v 0 0 0 255 51 0\nv 1 0 0 255 51 0\nv 0 1 0 255 51 0\nf 1 2 3\n");
    assert_eq!(scene.materials[0].albedo, [1.0, 0.2, 0.0]);
    assert_warns(&scene, &["m.obj:", "255", "0..255"]);
}

#[test]
fn textured_surfaces_keep_their_texture() {
    let image = png(RgbImage::from_pixel(1, 1, Rgb([9, 9, 9])));
    let obj = b"mtllib m.mtl\nusemtl m\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n";
    let scene = load(&[("m.obj", obj), ("m.mtl", b"newmtl m\nmap_Kd a.png\n"), ("a.png", &image)], "m.obj");
    assert_eq!(scene.materials[0].albedo, [1.0; 3]);
    assert_warns(&scene, &["m.obj:", "not used on textured"]);
}

#[test]
fn many_colours_become_a_texture() {
    // 400 triangles, each of one colour.
    let mut obj = String::new();
    for i in 0..400 {
        let colour = format!("{} {} .25", linear((i % 20 * 12) as u8), linear((i / 20 * 12) as u8));
        for corner in ["0 0", "1 0", "0 1"] {
            obj += &format!("v {corner} {i} {colour}\n");
        }
        obj += "f -3 -2 -1\n";
    }
    let scene = load_obj(&obj);
    assert_eq!((scene.meshes.len(), scene.materials.len(), scene.warnings.len()), (1, 1, 0));
    let texture = &scene.textures[scene.materials[0].albedo_texture.expect("a texture of colours")];
    for (corner, (_, (position, _, [u, v]))) in corners(&scene).into_iter().enumerate() {
        let i = corner / 3;
        assert_eq!(position[2], i as f32);
        let (x, y) = ((u * texture.width as f32) as usize, (v * texture.height as f32) as usize);
        let texel = 4 * (y * texture.width as usize + x);
        // .25 is 137 in sRGB.
        assert_eq!(texture.rgba[texel..texel + 4], [(i % 20 * 12) as u8, (i / 20 * 12) as u8, 137, 255]);
    }
}

/// Two triangles: the left half of the image and its right half.
fn lamp(mtl: &str, image: RgbImage) -> Scene {
    let obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt .05 .05\nvt .45 .05\nvt .05 .95\nvt .55 .05\nvt .95 .05\nvt .55 .95\n\
         f 1/1 2/2 3/3\nf 1/4 2/5 3/6\n";
    load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("e.png", &png(image))], "m.obj")
}

fn emissions(scene: &Scene) -> Vec<[f32; 3]> {
    scene.meshes.iter().map(|mesh| scene.materials[mesh.material].emission).collect()
}

#[test]
fn emission_is_multiplied_by_its_image() {
    let uniform = |level| RgbImage::from_pixel(4, 4, Rgb([level; 3]));
    let black = lamp("newmtl m\nKe 2 1.6 1\nmap_Ke e.png\n", uniform(0));
    assert_eq!((emissions(&black), black.lights.len()), (vec![[0.0; 3]], 0));
    assert_warns(&black, &["m.obj:", "black", "add a light"]);
    assert_eq!(emissions(&lamp("newmtl m\nmap_Ke e.png\n", uniform(255))), [[1.0; 3]]);
    assert_eq!(emissions(&lamp("newmtl m\nKe 2 1.6 1\nmap_Ke e.png\n", uniform(255))), [[2.0, 1.6, 1.0]]);
    let grey = linear(128);
    assert_eq!(emissions(&lamp("newmtl m\nKe 2 1 0\nmap_Ke e.png\n", uniform(128))), [[2.0 * grey, grey, 0.0]]);
}

#[test]
fn faces_emit_the_mean_of_their_part_of_the_image() {
    let halves = RgbImage::from_fn(64, 64, |x, _| Rgb([if x < 32 { 0 } else { 255 }; 3]));
    let scene = lamp("newmtl m\nKe 3 3 3\nmap_Ke e.png\n", halves);
    assert_eq!(emissions(&scene), [[0.0; 3], [3.0; 3]]);
    assert_warns(&scene, &["m.obj:", "map_Ke", "averaged"]);
}

#[test]
fn a_missing_image_of_emission_is_told() {
    let obj = b"mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = load(&[("m.obj", obj), ("m.mtl", b"newmtl m\nKe 2 2 2\nmap_Ke gone.png\n")], "m.obj");
    assert_eq!(emissions(&scene), [[2.0; 3]]);
    assert_warns(&scene, &["m.mtl:1:", "`m`", "gone.png", "is missing", "without it"]);
}

#[test]
fn few_materials_hold_many_emissions() {
    // 1,000 triangles, each with its own texel of a wide image.
    let image = RgbImage::from_fn(1000, 1, |x, _| Rgb([(x % 251) as u8 / 2 + 100, (x / 5) as u8 / 2 + 100, 100]));
    let mut obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for i in 0..1000 {
        obj += &format!("vt {} 0.5\nf 1/-1 2/-1 3/-1\n", (f64::from(i) + 0.5) / 1000.0);
    }
    let scene =
        load(&[("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nmap_Ke e.png\n"), ("e.png", &png(image))], "m.obj");
    assert!(scene.materials.len() <= 256, "{}", scene.materials.len());
    assert_warns(&scene, &["map_Ke", "averaged", "within"]);
    // The sum of red is that of the image.
    let sum: f64 = scene
        .meshes
        .iter()
        .map(|mesh| f64::from(scene.materials[mesh.material].emission[0]) * (mesh.indices.len() / 3) as f64)
        .sum();
    let wanted: f64 = (0..1000).map(|x| f64::from(linear((x % 251) as u8 / 2 + 100))).sum();
    // Rounding of float32.
    assert!((sum / wanted - 1.0).abs() < 1e-5, "{sum} {wanted}");
}
