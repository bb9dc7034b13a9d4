//! MTL libraries and textures.

use std::io::Cursor;

use halflight_scenes::{Material, Scene, SceneNeeds};
use image::{DynamicImage, ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

use crate::{TRIANGLE, assert_warns, load};

/// A triangle of material `m` with this library and further files beside it.
fn with_library(mtl: &str, files: &[(&str, &[u8])]) -> Scene {
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}");
    load(&[&[("dir/m.obj", obj.as_bytes()), ("dir/m.mtl", mtl.as_bytes())], files].concat(), "dir/m.obj")
}

fn material(mtl: &str) -> Material {
    let scene = with_library(&format!("newmtl m\n{mtl}"), &[]);
    assert_eq!(scene.warnings, [""; 0]);
    scene.materials[0].clone()
}

fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).expect("a small image");
    bytes.into_inner()
}

/// 2 x 2: red and green above, blue and white below.
fn colours() -> RgbImage {
    let rows = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]];
    RgbImage::from_fn(2, 2, |x, y| Rgb(rows[y as usize][x as usize]))
}

#[test]
fn every_quantity_is_read() {
    let read = material("Kd .5 .25 0\nKe 3 2 1\nKs .1 .2 .3\nNs 80\nNi 1.5\nillum 2\nKa 1 1 1\nTf 1 1 1\nPm 0\n");
    assert_eq!((read.name.as_str(), read.albedo), ("m", [0.5, 0.25, 0.0]));
    assert_eq!((read.emission, read.specular, read.phong_exponent), ([3.0, 2.0, 1.0], [0.1, 0.2, 0.3], 80.0));
    assert_eq!(material("kd 0.5\n").albedo, [0.5; 3]);
    assert_eq!(material("").albedo, [0.8; 3]);
}

#[test]
fn numbers_out_of_range_are_clamped_with_a_warning() {
    for (line, shown) in [
        ("Kd 1.5 -1 0.5", "Kd 1.5 -1 0.5 is clamped to 0..1"),
        ("Ks 2 0 0", "Ks 2 0 0 is clamped to 0..1"),
        ("Ke -1 0 0", "Ke -1 0 0 is clamped to 0.."),
        ("Ke nan 0 0", "Ke NaN 0 0 is clamped to 0.."),
        ("Ke inf 0 0", "Ke inf 0 0 is clamped to 0.."),
    ] {
        let scene = with_library(&format!("# head\nnewmtl m\n{line}\n"), &[]);
        assert_warns(&scene, &["dir/m.mtl:2:", "`m`", shown]);
        let read = &scene.materials[0];
        for value in [read.albedo, read.specular, read.emission].concat() {
            assert!(value.is_finite() && value >= 0.0);
        }
    }
    let scene = with_library("newmtl m\nKd 1.5 -1 0.5\n", &[]);
    assert_eq!(scene.materials[0].albedo, [1.0, 0.0, 0.5]);
    assert_warns(&with_library("newmtl m\nNs 1e9\n", &[]), &["Ns", "clamped", "1000000"]);
    assert_warns(&with_library("newmtl m\nd 0.3\n", &[]), &["d 0.3", "opaque", "map_d"]);
}

#[test]
fn invalid_lines_are_skipped_with_a_warning() {
    for line in ["Kd", "Kd red", "Kd 1 2", "Ns", "map_Kd", "map_d"] {
        let scene = with_library(&format!("newmtl m\n{line}\nKs .5 .5 .5\n"), &[]);
        assert_warns(&scene, &["dir/m.mtl:2:", &format!("`{line}`"), "is skipped"]);
        assert_eq!(scene.materials[0].specular, [0.5; 3], "the lines after it count");
    }
}

#[test]
fn images_are_loaded_once_with_row_0_on_top() {
    let png = encoded(colours(), ImageFormat::Png);
    let mtl = "newmtl m\nmap_Kd tex\\My Image.png\nnewmtl n\nKd .5 .5 .5\nmap_Kd TEX/my image.PNG\n";
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}usemtl n\nf 3 2 1\n");
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("tex/My Image.png", &png)], "m.obj");
    assert_eq!(scene.warnings, [""; 0]);
    let used: Vec<_> = scene.materials.iter().map(|m| (m.albedo, m.albedo_texture)).collect();
    // The default of Kd with an image is 1. On some disks another spelling is another file.
    assert_eq!(used[0], ([1.0; 3], Some(0)));
    assert_eq!(used[1].0, [0.5; 3]);
    let texture = &scene.textures[0];
    assert_eq!((texture.name.as_str(), texture.width, texture.height), ("tex/My Image.png", 2, 2));
    let rgba = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];
    assert_eq!(texture.rgba, rgba);

    for twice in [
        "newmtl m\nmap_Kd x/a.png\nnewmtl n\nmap_Kd ./x/a.png\n",
        "newmtl m\nmap_Kd x/a.png\nnewmtl n\nmap_Kd x\\a.png\n",
    ] {
        let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", twice.as_bytes()), ("x/a.png", &png)], "m.obj");
        assert_eq!(scene.textures.len(), 1);
    }
}

#[test]
fn common_formats_are_read() {
    for (name, format) in [
        ("i.png", ImageFormat::Png),
        ("i.jpg", ImageFormat::Jpeg),
        ("i.tga", ImageFormat::Tga),
        ("i.bmp", ImageFormat::Bmp),
        ("i.webp", ImageFormat::WebP),
    ] {
        let grey = RgbImage::from_pixel(8, 8, Rgb([100, 100, 100]));
        let scene =
            with_library(&format!("newmtl m\nmap_Kd {name}\n"), &[(&format!("dir/{name}"), &encoded(grey, format))]);
        assert_eq!(scene.warnings, [""; 0]);
        // JPEG is lossy: a level or two off.
        assert!(scene.textures[0].rgba[0].abs_diff(100) <= 2, "{name}");
    }
}

#[test]
fn alpha_masks_come_from_alpha_or_else_luminance() {
    let masks = |image: Vec<u8>, mtl: &str| with_library(&format!("newmtl m\n{mtl}"), &[("dir/leaf.png", &image)]);
    let alphas = |scene: &Scene| {
        let texture = &scene.textures[scene.materials[0].alpha_texture.expect("a mask")];
        texture.rgba.chunks(4).map(|texel| texel[3]).collect::<Vec<_>>()
    };
    // White with transparent texels.
    let alpha = RgbaImage::from_fn(2, 1, |x, _| Rgba([255, 255, 255, if x == 0 { 0 } else { 200 }]));
    // With an opaque alpha channel the luminance is the mask.
    let level = |x| if x == 0 { 10 } else { 250 };
    let opaque = RgbaImage::from_fn(2, 1, |x, _| Rgba([level(x), level(x), level(x), 255]));
    let grey = RgbImage::from_fn(2, 1, |x, _| Rgb([level(x); 3]));
    let alpha = encoded(alpha, ImageFormat::Png);
    assert_eq!(alphas(&masks(alpha.clone(), "map_d leaf.png\n")), [0, 200]);
    assert_eq!(alphas(&masks(encoded(opaque, ImageFormat::Png), "map_d leaf.png\n")), [10, 250]);
    let grey = encoded(grey, ImageFormat::Png);
    assert_eq!(alphas(&masks(grey.clone(), "map_d leaf.png\n")), [10, 250]);

    // One file in both roles: one texture if alpha is the mask, otherwise two.
    let both = masks(alpha, "map_Kd leaf.png\nmap_d leaf.png\n");
    assert_eq!((both.textures.len(), both.materials[0].albedo_texture), (1, both.materials[0].alpha_texture));
    let both = masks(grey, "map_Kd leaf.png\nmap_d leaf.png\n");
    assert_eq!(both.textures.len(), 2);
    assert_eq!(both.textures[0].rgba[3], 255, "a colour stays opaque");
    assert!(SceneNeeds::of(&both).alpha_tested);
}

#[test]
fn missing_and_broken_images_are_replaced_with_a_warning() {
    let scene = with_library("newmtl m\nmap_Kd gone.png\n", &[]);
    assert_warns(&scene, &["dir/m.mtl:1:", "`m`", "dir/gone.png", "is missing", "checker"]);
    let texture = &scene.textures[scene.materials[0].albedo_texture.expect("a replacement")];
    assert_eq!(texture.name, "replacement for gone.png");
    assert_eq!(
        (texture.rgba[..4].to_vec(), texture.rgba[32..36].to_vec()),
        (vec![255, 0, 255, 255], vec![128, 128, 128, 255])
    );
    assert_eq!(texture.rgba.len(), 4 * texture.width as usize * texture.height as usize);

    for bytes in [&b"not an image"[..], &encoded(colours(), ImageFormat::Png)[..40], b""] {
        let scene = with_library("newmtl m\nmap_Kd a.png\n", &[("dir/a.png", bytes)]);
        assert_warns(&scene, &["dir/a.png", "cannot be decoded", "checker"]);
    }
    let scene = with_library("newmtl m\nmap_d gone.png\n", &[]);
    assert_warns(&scene, &["dir/gone.png", "is missing", "drawn opaque"]);
    assert_eq!(scene.materials[0].alpha_texture, None);

    // One file, one warning that names every material.
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}usemtl n\nf 3 2 1\n");
    let mtl = "newmtl m\nmap_Kd gone.png\nnewmtl n\nmap_Kd gone.png\n";
    assert_warns(&load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())], "m.obj"), &["gone.png", "`m`, `n`"]);
}

#[test]
fn texture_options_are_drawn_or_told_once() {
    let png = encoded(colours(), ImageFormat::Png);
    let mtl = "newmtl m\nmap_Kd -mm 0.1 1 a.png\nmap_d -clamp on a.png\nnewmtl n\nmap_Kd -t 1 1 1 a.png\n";
    let scene = with_library(mtl, &[("dir/a.png", &png)]);
    assert_warns(&scene, &["dir/m.mtl:2:", "options", "map_Kd -mm 0.1 1 a.png", "2 further lines"]);
    assert_eq!(scene.textures[0].name, "a.png");

    // Scale and offset count for this material only; v points up in both.
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\nusemtl n\nf 1/1 2/2 3/3\n";
    let mtl = "newmtl m\nmap_Kd -s 2 4 1 -o 0.5 0.25 0 a.png\nnewmtl n\nmap_Kd a.png\n";
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("a.png", &png)], "m.obj");
    assert_eq!(scene.warnings, [""; 0]);
    assert_eq!(scene.meshes[0].uvs, [[0.5, 0.75], [2.5, 0.75], [0.5, -3.25]]);
    assert_eq!(scene.meshes[1].uvs, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
    let scene = with_library("newmtl m\nmap_Kd -s 2 2 a.png\nmap_Ke a.png\n", &[("dir/a.png", &png)]);
    assert!(
        scene.warnings.iter().any(|w| w.contains("-s and -o of map_Kd are used for map_Ke")),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn the_file_is_found_whatever_stands_around_its_name() {
    let png = encoded(colours(), ImageFormat::Png);
    for line in [
        "-o 0.0 -7.0 0.0 -s 1.0 10.0 1.0 -clamp on tex dir/my image.png",
        "-s 10 10 10 tex dir\\my image.png",
        "tex dir/my image.png -s 2 2 1",
        "-bm 0.3 -blendu on -mm 0 1 -texres 512 tex dir/my image.png",
        "tex dir/my image.png # the front",
        "\"tex dir/my image.png\"",
    ] {
        let mtl = format!("newmtl m\nmap_Kd {line}\n");
        let scene = with_library(&mtl, &[("dir/tex dir/my image.png", &png)]);
        assert_eq!(scene.textures[0].rgba[..4], [255, 0, 0, 255], "{line}: {:?}", scene.warnings);
    }
    // A name that looks like one with a comment or an option.
    let scene = with_library("newmtl m\nmap_Kd a # 1.png\n", &[("dir/a # 1.png", &png), ("dir/a", b"another")]);
    assert_eq!((scene.textures[0].width, scene.warnings.len()), (2, 0));
}

#[test]
fn images_with_paths_of_other_computers_are_found_by_name() {
    let png = encoded(colours(), ImageFormat::Png);
    for (name, place) in [
        ("C:\\work\\x\\wall.png", "dir/wall.png"),
        ("/home/x/wall.png", "dir/wall.png"),
        ("../maps/wall.png", "dir/textures/wall.png"),
        ("D:/maps/wall.png", "dir/textures/wall.png"),
    ] {
        let scene = with_library(&format!("newmtl m\nmap_Kd {name}\n"), &[(place, &png)]);
        assert_eq!(scene.textures[0].width, 2, "{name}");
        assert_warns(&scene, &["dir/m.obj", "one image", "by its file name"]);
    }
    // Beside the model where the library is elsewhere.
    let obj = format!("mtllib lib/m.mtl\nusemtl m\n{TRIANGLE}");
    let files: [(&str, &[u8]); 3] =
        [("m.obj", obj.as_bytes()), ("lib/m.mtl", b"newmtl m\nmap_Kd tex/wall.png\n"), ("tex/wall.png", &png)];
    assert_eq!(load(&files, "m.obj").textures[0].width, 2);
}

#[test]
fn lines_that_change_the_light_are_drawn_or_told_once() {
    for (line, told) in [
        ("Tf 0.5 1 1", "`Tf`"),
        ("illum 7", "`illum 7`"),
        ("Pr 0.3\nPm 1\nPm 1", "`Pr`, `Pm` (2 times)"),
        ("map_Ks a.png\nbump b.png\nmap_Bump c.png\nnorm d.png", "`map_Ks`, `bump`, `map_Bump`, `norm`"),
        ("refl -type sphere a.png\ndisp b.png\ndecal c.png", "`refl`, `disp`, `decal`"),
    ] {
        let scene = with_library(&format!("newmtl m\n{line}\n"), &[]);
        assert_warns(&scene, &["dir/m.mtl:", "not used", told]);
    }
    for quiet in ["illum 2", "illum 0", "Ni 1.5", "Ka 1 1 1\nmap_Ka a.png", "d 1", "Tr 0", "Tf 0 0 0", "# Pm 1"] {
        assert_eq!(with_library(&format!("newmtl m\n{quiet}\n"), &[]).warnings, [""; 0], "{quiet}");
    }
    assert_warns(&with_library("newmtl m\nTr 0.7\n", &[]), &["dir/m.mtl:1:", "`m`", "Tr 0.7", "opaque", "map_d"]);
    assert_warns(&with_library("newmtl m\nd -halo 0.6\n", &[]), &["d 0.6", "opaque"]);
    // `d` is the newer keyword.
    assert_eq!(with_library("newmtl m\nd 1\nTr 1\n", &[]).warnings, [""; 0]);
    assert_warns(&with_library("newmtl m\nglitter 3\n", &[]), &["dir/m.mtl:", "unknown keywords", "`glitter`"]);
}

#[test]
fn an_image_that_is_cut_off_is_told() {
    // Large enough for several blocks of a JPEG file.
    let noise = RgbImage::from_fn(64, 64, |x, y| Rgb([(x * y) as u8, (x * 37) as u8, (y * 91) as u8]));
    let jpeg = encoded(noise, ImageFormat::Jpeg);
    let scene = with_library("newmtl m\nmap_Kd a.jpg\n", &[("dir/a.jpg", &jpeg[..jpeg.len() * 2 / 3])]);
    assert_warns(&scene, &["dir/m.mtl:1:", "`m`", "dir/a.jpg", "cut off"]);
    assert_eq!(scene.textures[0].width, 64);
}

#[test]
fn a_black_kd_with_an_image_gives_a_warning() {
    let png = encoded(colours(), ImageFormat::Png);
    let scene = with_library("newmtl m\nKd 0 0 0\nmap_Kd a.png\n", &[("dir/a.png", &png)]);
    assert_warns(&scene, &["dir/m.mtl:1:", "map_Kd black", "Kd 1 1 1"]);
}

#[test]
fn missing_libraries_and_materials_are_drawn_in_grey() {
    let obj = format!("mtllib gone.mtl\nusemtl m\n{TRIANGLE}usemtl n\nf 3 2 1\n");
    let scene = load(&[("m.obj", obj.as_bytes())], "m.obj");
    assert_warns(&scene, &["m.obj:1:", "`gone.mtl`", "no such file", "grey"]);
    assert_eq!(scene.materials.iter().map(|m| m.albedo).collect::<Vec<_>>(), [[0.8; 3]; 2]);

    let obj = format!("mtllib m.mtl\nusemtl brik\n{TRIANGLE}");
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl brick\nKd 1 0 0\n")], "m.obj");
    assert_warns(&scene, &["m.obj:2:", "`brik`", "`brick`", "grey"]);
    // A file without usemtl gives no warning.
    let scene = load(&[("m.obj", TRIANGLE.as_bytes())], "m.obj");
    assert_eq!((scene.warnings.len(), scene.materials), (0, vec![Material::default()]));
}

#[test]
fn libraries_are_found_wherever_they_are_named() {
    // After their use; two on one line; a name with a space.
    for (line, names) in [("a.mtl b.mtl", ["a.mtl", "b.mtl"]), ("my lib.mtl", ["my lib.mtl", "x.mtl"])] {
        let obj = format!("usemtl m\n{TRIANGLE}mtllib {line}\n");
        let [first, second] = names;
        let files: [(&str, &[u8]); 3] =
            [("m.obj", obj.as_bytes()), (first, b"newmtl m\nKd 1 0 0\n"), (second, b"newmtl n\nKd 0 1 0\n")];
        let scene = load(&files, "m.obj");
        assert_eq!(scene.warnings, [""; 0]);
        assert_eq!(scene.materials[0].albedo, [1.0, 0.0, 0.0]);
    }
    // Names with blanks beside others, a comment, quotes, and the path of another computer.
    for line in ["x.mtl my lib.mtl", "my lib.mtl # walls", "\"my lib.mtl\"", "C:\\x\\my lib.mtl"] {
        let obj = format!("mtllib {line}\nusemtl m\n{TRIANGLE}");
        let files: [(&str, &[u8]); 3] =
            [("m.obj", obj.as_bytes()), ("x.mtl", b"newmtl n\n"), ("my lib.mtl", b"newmtl m\nKd 1 0 0\n")];
        let scene = load(&files, "m.obj");
        assert_eq!((scene.materials[0].albedo, scene.warnings.len()), ([1.0, 0.0, 0.0], 0), "{line}");
    }
    // One of two is missing.
    let obj = format!("mtllib m.mtl gone.mtl\nusemtl m\n{TRIANGLE}");
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nKd 1 0 0\n")], "m.obj");
    assert_eq!(scene.materials[0].albedo, [1.0, 0.0, 0.0]);
    assert_warns(&scene, &["m.obj:1:", "`gone.mtl`", "no such file"]);
}

#[test]
fn names_of_materials_may_have_comments_and_tabs() {
    let mtl = "  newmtl   grey \t\n\tKD\t0.7\t0.7 0.7 # plaster\n\tnewmtl red # brick\n   Kd 0.7 0.1 0.1\n newmtl a # b\nKd 0 0 1\n";
    for (line, albedo) in [
        ("usemtl  \tgrey  \t", [0.7; 3]),
        ("  usemtl red # towards the street", [0.7, 0.1, 0.1]),
        ("USEMTL red", [0.7, 0.1, 0.1]),
        ("usemtl a # b", [0.0, 0.0, 1.0]),
    ] {
        let obj = format!("\tMTLLIB   m.mtl \t\n{line}\n{TRIANGLE}");
        let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())], "m.obj");
        assert_eq!((scene.materials[0].albedo, scene.warnings.len()), (albedo, 0), "{line}");
    }
    // Two comments, one material.
    let obj = format!("mtllib m.mtl\nusemtl red # a\n{TRIANGLE}usemtl red # b\nf 3 2 1\n");
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())], "m.obj");
    assert_eq!((scene.materials.len(), scene.meshes.len()), (1, 1));
}
