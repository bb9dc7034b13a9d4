//! `load_scene` reads what `write_obj` writes.

use std::path::Path;

use halflight_scenes::{Material, MemoryFiles, Mesh, Scene, Texture, generators, load_scene, write_obj};

use crate::{assert_says, corners};

fn rewritten(scene: &Scene) -> Scene {
    let files = write_obj(&scene.meshes, &scene.materials, &scene.textures, "out").expect("a valid scene");
    let files: MemoryFiles = files.into_iter().collect();
    load_scene(&files, Path::new("out.obj")).expect("a written file can be read")
}

/// Asserts that two scenes have the same triangles of the same materials.
fn assert_same(read: &Scene, scene: &Scene) {
    assert_eq!(read.warnings, [""; 0]);
    let (read_corners, wanted) = (corners(read), corners(scene));
    assert_eq!(read_corners.len(), wanted.len());
    for ((_, read), (_, wanted)) in read_corners.iter().zip(&wanted) {
        assert_eq!((read.0, read.1), (wanted.0, wanted.1), "positions and normals, bit for bit");
        for (read, wanted) in read.2.iter().zip(wanted.2) {
            // v is stored as 1 - v: two roundings, each by half a float32 step at up to |v| + 1.
            assert!((read - wanted).abs() <= f32::EPSILON * (1.0 + wanted.abs()), "{read} {wanted}");
        }
    }
    let seen = |scene: &Scene| {
        let texture = |index: Option<usize>| index.map(|i| (scene.textures[i].width, scene.textures[i].rgba.clone()));
        let material = |mesh: &Mesh| {
            let Material { albedo, albedo_texture, alpha_texture, emission, specular, phong_exponent, .. } =
                scene.materials[mesh.material].clone();
            (albedo, texture(albedo_texture), texture(alpha_texture), emission, specular, phong_exponent)
        };
        scene.meshes.iter().map(material).collect::<Vec<_>>()
    };
    assert!(seen(read) == seen(scene), "the same materials and texels");
}

/// Difficult numbers, names that clash or are invalid in OBJ, and every kind of texture.
fn difficult() -> Scene {
    let texture = |name: &str, texels: &[[u8; 4]]| Texture {
        name: name.into(),
        width: texels.len() as u32,
        height: 1,
        rgba: texels.concat(),
    };
    let opaque = [[1, 2, 3, 255], [200, 100, 50, 255]];
    let holes = [[9, 8, 7, 0], [0, 255, 0, 129]];
    let material = |albedo_texture, alpha_texture| Material {
        name: "same  name".into(),
        albedo: [0.1, 1.0 / 3.0, 1e-20],
        albedo_texture,
        alpha_texture,
        emission: [1234.5678, 0.0, 1e-7],
        specular: [0.3, 0.2, 0.1],
        phong_exponent: 12.3,
        ..Material::default()
    };
    let mesh = |material, offset: f32| Mesh {
        name: format!("mesh {material}\nnext line"),
        positions: vec![[offset, 1e-30, 16_777_216.0], [0.1, -7.0e6, 1.0 / 3.0], [1e-7, 2.5, -0.0]],
        normals: vec![[0.6, 0.8, 0.0], [0.0, 0.0, -1.0], [0.577_350_26; 3]],
        uvs: vec![[0.0, 1.0], [0.1, 0.3], [-7.25, 1e-9]],
        indices: vec![0, 1, 2, 2, 1, 0],
        material,
        ..Mesh::default()
    };
    Scene {
        meshes: (0..4).map(|i| mesh(i, i as f32)).collect(),
        materials: vec![
            material(None, None),
            material(Some(0), None),
            material(Some(0), Some(1)),
            material(Some(2), Some(2)),
        ],
        textures: vec![texture("a/x.jpg", &opaque), texture("b/X.png", &holes), texture("../ä ö?.tga", &holes)],
        ..Scene::default()
    }
}

#[test]
fn a_difficult_scene_reads_back() {
    let scene = difficult();
    assert_same(&rewritten(&scene), &scene);
}

#[test]
fn generated_scenes_read_back() {
    for &name in generators::NAMES {
        let generators::Geometry { meshes, materials, textures } = generators::geometry(name).expect("it builds");
        let scene = Scene { meshes, materials, textures, ..Scene::default() };
        assert_same(&rewritten(&scene), &scene);
    }
}

#[test]
fn an_opaque_mask_is_left_out() {
    let mut scene = difficult();
    scene.materials[0].alpha_texture = Some(0);
    assert_eq!(rewritten(&scene).materials[0].alpha_texture, None);
}

#[test]
fn a_texture_of_the_wrong_size_is_refused() {
    let mut scene = difficult();
    scene.textures[0].width = 3;
    let error = write_obj(&scene.meshes, &scene.materials, &scene.textures, "out").expect_err("3 texels in 8 bytes");
    assert_says(&error.to_string(), &["`a/x.jpg`", "8 bytes", "12"]);
}
