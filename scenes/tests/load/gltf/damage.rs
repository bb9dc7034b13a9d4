//! glTF files that are unusual, not supported or damaged.

use std::path::Path;

use halflight_scenes::{MemoryFiles, load_scene};
use image::{ImageFormat, Rgb, RgbImage};

use super::maker::{Maker, ONE_NODE, bare, binary, encoded, triangle};
use crate::{assert_says, refusal};

#[test]
fn what_is_not_drawn_is_told_once() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", r#","targets":[{"POSITION":0}]"#);
    let weights = r#""skins":[{"joints":[0]}],"scenes":[{"nodes":[0]},{"nodes":[0]}],"nodes":[{"mesh":0,"skin":0}]"#;
    let scene = bare(&maker.glb(&format!("{meshes},{weights}")));
    assert_eq!(scene.warnings.len(), 3, "{:?}", scene.warnings);
    let all = scene.warnings.join("\n");
    assert_says(&all, &["morph targets are not drawn", "skins are not drawn", "only the first scene"]);
}

#[test]
fn what_cannot_be_read_is_refused_with_one_sentence() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let good = maker.glb(&format!("{meshes},{ONE_NODE}"));
    assert_eq!(bare(&good).triangle_count(), 1);
    let with = |parts: &str| maker.glb(&format!("{meshes},{parts}"));
    let required =
        |name: &str| with(&format!(r#"{ONE_NODE},"extensionsRequired":["{name}"],"extensionsUsed":["{name}"]"#));
    let replaced = |from: &str, to: &str| {
        let json = maker.json(&format!("{meshes},{ONE_NODE}"), "").replace(from, to);
        binary(&json, &maker.bytes)
    };
    for (bytes, parts) in [
        (required("KHR_draco_mesh_compression"), ["Draco", "without compression"]),
        (required("EXT_meshopt_compression"), ["meshopt", "without compression"]),
        (required("ACME_boxes"), ["ACME_boxes", "export it without it"]),
        (b"glTF\x01\0\0\0\x0c\0\0\0".to_vec(), ["version 1", "only version 2"]),
        (good[..good.len() - 8].to_vec(), ["is cut off", "export the model again"]),
        (b"glTF".to_vec(), ["is cut off", "export"]),
        (b"{".to_vec(), ["not a readable glTF file", "export"]),
        (b"{}".to_vec(), ["not a readable glTF file", "export"]),
        (
            with(r#""scenes":[{"nodes":[7]}],"nodes":[{"mesh":0}]"#),
            ["not valid glTF", "refers to something that is not there"],
        ),
        (with(r#""scenes":[{"nodes":[0]}],"nodes":[{}]"#), ["no triangles", "export"]),
        (replaced(r#""count":3"#, r#""count":4"#), ["reaches beyond its buffer view", ""]),
        (replaced(r#""byteLength":36"#, r#""byteLength":9999"#), ["beyond its buffer", ""]),
        (replaced(r#""version":"2.0""#, r#""version":"1.0""#), ["version 1.0", "only version 2"]),
        (
            with(r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"translation":[0,2e38,0]}]"#),
            ["a transform that is too large or not finite at node 1", "export"],
        ),
        (
            replaced(
                r#"{"bufferView":0,"count":3,"#,
                r#"{"sparse":{"count":1,"indices":{"bufferView":0,"componentType":5125},"values":{"bufferView":0}},"count":2000000,"#,
            ),
            ["accessor 0 has no data", ""],
        ),
    ] {
        let sentence = refusal(&[("dir/m.glb", &bytes)], "dir/m.glb");
        assert_says(&sentence, &["dir/m.glb", parts[0], parts[1]]);
    }
    let json = maker.json(&format!("{meshes},{ONE_NODE}"), r#","uri":"gone.bin""#);
    let sentence = refusal(&[("m.gltf", json.as_bytes())], "m.gltf");
    assert_says(&sentence, &["m.gltf:", "gone.bin", "no such file"]);
    // Basis textures alone do not refuse a model.
    assert_eq!(bare(&required("KHR_texture_basisu")).triangle_count(), 1);
}

#[test]
fn damaged_files_never_panic() {
    let mut maker = Maker::default();
    let png = encoded(RgbImage::from_pixel(2, 2, Rgb([1, 2, 3])), ImageFormat::Png);
    let colours = maker.accessor(&[255; 12], 3, "VEC4", 5121, r#","normalized":true"#);
    let indices = maker.indices(&[0, 1, 2]);
    let times = maker.floats(&[[0.0], [0.1]]);
    let turns = maker.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]);
    let meshes =
        triangle(&mut maker, &format!(r#","COLOR_0":{colours}"#), &format!(r#","material":0,"indices":{indices}"#));
    let image = maker.view(&png);
    let parts = format!(
        r#"{meshes},"scene":0,"scenes":[{{"nodes":[0,2]}}],"nodes":[{{"children":[1],"rotation":[0,0,0,1]}},{{"mesh":0,"scale":[1,2,1]}},{{"camera":0}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"roughnessFactor":0.5}},"alphaMode":"MASK","emissiveFactor":[1,1,1],"emissiveTexture":{{"index":0}}}}],
        "textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071}}],"images":[{{"bufferView":{image},"mimeType":"image/png"}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],"samplers":[{{"input":{times},"output":{turns}}}]}}]"#
    );
    let (json, bytes) = (maker.json(&parts, ""), maker.bytes.clone());
    bare(&binary(&json, &bytes));
    let mut random = 7_u32;
    let mut next = |below: usize| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 8) as usize % below.max(1)
    };
    let (mut read, mut refused) = (0, 0);
    for round in 0..4000 {
        let mut text = json.clone().into_bytes();
        let mut data = bytes.clone();
        for _ in 0..1 + round % 3 {
            match next(5) {
                // Digits of the JSON, its other bytes, bytes of the buffer.
                0 | 1 => {
                    let digits: Vec<_> = (0..text.len()).filter(|&i| text[i].is_ascii_digit()).collect();
                    text[digits[next(digits.len())]] = b"0123456789"[next(10)];
                }
                2 => {
                    let at = next(text.len());
                    text[at] = b"0 9-{}[]\",:e.x"[next(14)];
                }
                3 => {
                    let at = next(data.len());
                    data[at] = [0, 1, 127, 128, 255][next(5)];
                }
                _ => {
                    let at = next(text.len());
                    text.insert(at, b"19-,"[next(4)]);
                }
            }
        }
        let mut glb = binary(&String::from_utf8_lossy(&text), &data);
        if next(10) == 0 {
            glb.truncate(next(glb.len()));
        } else if next(10) == 0 {
            let at = next(24);
            glb[at] = next(256) as u8;
        }
        let files = MemoryFiles::from_iter([("m.glb", glb)]);
        match load_scene(&files, Path::new("m.glb")) {
            Ok(scene) => {
                read += 1;
                for mesh in &scene.meshes {
                    let count = mesh.positions.len();
                    assert!(mesh.normals.len() == count && mesh.uvs.len() == count);
                    assert!(
                        mesh.indices.iter().all(|&i| (i as usize) < count) && mesh.material < scene.materials.len()
                    );
                    let numbers = [mesh.positions.as_flattened(), mesh.normals.as_flattened(), mesh.uvs.as_flattened()];
                    assert!(numbers.concat().iter().all(|x| x.is_finite()));
                    assert!(mesh.object.is_none_or(|object| object < scene.moves.objects.len()));
                }
                for material in &scene.materials {
                    let numbers = [material.albedo, material.specular, material.emission].concat();
                    assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0));
                }
                assert!(scene.camera.view_matrix().is_finite());
            }
            Err(error) => {
                refused += 1;
                let sentence = error.to_string();
                assert!(sentence.starts_with("m.glb") && sentence.lines().count() == 1, "{sentence}");
            }
        }
    }
    // Both outcomes occur.
    assert!(read > 500 && refused > 500, "{read} read, {refused} refused");
}
