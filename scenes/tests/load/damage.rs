//! Damaged files are read or refused with a message, and never cause a panic.

use std::path::Path;

use halflight_scenes::{MemoryFiles, load_scene};
use image::{ImageFormat, RgbaImage};

/// Every kind of line that the OBJ reader supports.
const OBJ: &str = "mtllib m.mtl\no a\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 .5 .5 .5\nv 0 1 0\nvt 0 0\nvt 1 .5 0\nvn 0 0 1\n\
    g b\nusemtl m\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -4 -3 -2\nf 1//1 3//-1 \\\n4//1\nf 1/1 2/2 4/1\nl 1 2\np 3\n# end\n";
const MTL: &str = "newmtl m\nKd .5 .5 .5\nKs 0.1\nKe 1 2 3\nNs 20\nd 1\nmap_Kd a.png\nmap_d -s 1 1 1 a.png\nillum 2\n";
const TOML: &str = "name = \"x\"\n[[model]]\npath = \"m.obj\"\ntransform = { scale = 2, rotate_degrees = [1, 2, 3] }\n\
    [camera]\neye = [0, 1, 5]\ntarget = [0.0, 1e0, 0.0]\nvertical_fov_degrees = 40\n\
    [[light]]\nkind = \"spot\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, 1]\nhalf_angle_degrees = 30\n";

/// A hash of two numbers (the finaliser of MurmurHash3).
fn hash(a: usize, b: usize) -> usize {
    let mut h = (a as u32).wrapping_mul(0x9e37_79b9) ^ (b as u32).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    (h ^ (h >> 16)) as usize
}

/// One to three deletions, duplications, cuts or replacements by bytes that have a meaning in these formats.
fn damaged(mut bytes: Vec<u8>, seed: usize) -> Vec<u8> {
    const BYTES: &[u8] = b"0 9-/.#\\\n\"[]{}=enaif\xff";
    for step in 0..1 + seed % 3 {
        let at = hash(seed, 4 * step) % bytes.len().max(1);
        let length = 1 + hash(seed, 4 * step + 1) % 6;
        let end = (at + length).min(bytes.len());
        match hash(seed, 4 * step + 2) % 4 {
            0 => drop(bytes.drain(at.min(end)..end)),
            1 => bytes.splice(at..at, bytes[at.min(end)..end].to_vec()).for_each(drop),
            2 if hash(seed, 9).is_multiple_of(8) => bytes.truncate(at),
            _ => bytes.splice(at..end, [BYTES[hash(seed, 4 * step + 3) % BYTES.len()]]).for_each(drop),
        }
    }
    bytes
}

#[test]
fn damaged_files_never_panic() {
    let mut png = std::io::Cursor::new(Vec::new());
    RgbaImage::from_fn(4, 4, |x, y| image::Rgba([1, 2, 3, (x * y) as u8]))
        .write_to(&mut png, ImageFormat::Png)
        .expect("small");
    let good =
        [("m.obj", OBJ.as_bytes()), ("m.mtl", MTL.as_bytes()), ("s.toml", TOML.as_bytes()), ("a.png", png.get_ref())];
    let all: MemoryFiles = good.into_iter().collect();
    load_scene(&all, Path::new("s.toml")).expect("undamaged");
    let (mut read, mut refused) = (0, 0);
    for seed in 0..4000 {
        let (name, bytes) = good[seed % good.len()];
        let mut files = all.clone();
        files.insert(name, damaged(bytes.to_vec(), seed));
        match load_scene(&files, Path::new("s.toml")) {
            Ok(scene) => {
                read += 1;
                for mesh in &scene.meshes {
                    let count = mesh.positions.len();
                    assert!(mesh.normals.len() == count && mesh.uvs.len() == count);
                    assert!(mesh.indices.iter().all(|&i| (i as usize) < count));
                    let numbers = [mesh.positions.as_flattened(), mesh.normals.as_flattened(), mesh.uvs.as_flattened()];
                    assert!(numbers.concat().iter().all(|x| x.is_finite()));
                    assert!(mesh.material < scene.materials.len());
                }
            }
            Err(error) => {
                refused += 1;
                let sentence = error.to_string();
                let names_file = ["m.obj", "s.toml"].iter().any(|name| sentence.starts_with(name));
                assert!(names_file && sentence.lines().count() == 1, "{sentence}");
            }
        }
    }
    // Both outcomes occur.
    assert!(read > 1000 && refused > 500, "{read} read, {refused} refused");
}
