//! Readers and writers through the public interface: files in, scenes or error messages out.

mod automatic;
mod colours;
mod damage;
mod far;
mod gltf;
mod keyframes;
mod materials;
mod obj;
mod round_trip;
mod saved;
mod scene_file;
mod sponza;

use std::path::Path;

use halflight_scenes::{MemoryFiles, Scene, load_scene};

/// Path and contents of a file.
type File<'a> = (&'a str, &'a [u8]);

/// One triangle in the plane z = 0, counter-clockwise seen from +z.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn try_load(files: &[File], path: &str) -> Result<Scene, String> {
    let files: MemoryFiles = files.iter().copied().collect();
    load_scene(&files, Path::new(path)).map_err(|error| error.to_string())
}

fn load(files: &[File], path: &str) -> Scene {
    try_load(files, path).expect("the scene is valid")
}

/// Loads a bare OBJ file without other files.
fn load_obj(text: &str) -> Scene {
    load(&[("m.obj", text.as_bytes())], "m.obj")
}

/// The message with which a file is refused: always one line.
fn refusal(files: &[File], path: &str) -> String {
    let sentence = try_load(files, path).expect_err("the scene is invalid");
    assert_eq!(sentence.lines().count(), 1, "{sentence}");
    sentence
}

/// Asserts that the text contains all parts.
#[track_caller]
fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
}

/// Asserts that there is exactly one warning and that it contains all parts.
#[track_caller]
fn assert_warns(scene: &Scene, parts: &[&str]) {
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert_says(&scene.warnings[0], parts);
}

/// Three corners of a triangle: position, normal, texture coordinate of each.
type Corner = ([f32; 3], [f32; 3], [f32; 2]);

/// All corners of a scene in order, with the names of their materials.
fn corners(scene: &Scene) -> Vec<(String, Corner)> {
    let of_mesh = |mesh: &halflight_scenes::Mesh| {
        let name = scene.materials[mesh.material].name.clone();
        let corner = |&i: &u32| {
            let i = i as usize;
            (name.clone(), (mesh.positions[i], mesh.normals[i], mesh.uvs[i]))
        };
        mesh.indices.iter().map(corner).collect::<Vec<_>>()
    };
    scene.meshes.iter().flat_map(of_mesh).collect()
}
