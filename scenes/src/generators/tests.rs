#![allow(clippy::unwrap_used)]
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::{Vec2, Vec3};

use super::*;

fn all() -> impl Iterator<Item = (&'static str, Geometry)> {
    NAMES.iter().map(|&name| (name, geometry(name).unwrap()))
}

fn triangles(mesh: &Mesh) -> impl Iterator<Item = ([Vec3; 3], [Vec3; 3])> {
    mesh.indices.chunks_exact(3).map(|t| {
        let corner = |list: &[[f32; 3]], k: usize| Vec3::from(list[t[k] as usize]);
        ([0, 1, 2].map(|k| corner(&mesh.positions, k)), [0, 1, 2].map(|k| corner(&mesh.normals, k)))
    })
}

fn count(geometry: &Geometry) -> usize {
    geometry.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum()
}

#[test]
fn every_generator_has_its_scene_file() {
    assert!(geometry("no such scene").is_none());
    for name in NAMES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("{name}.toml"));
        let file: toml::Table = std::fs::read_to_string(&path).expect("scene file").parse().expect("TOML");
        assert_eq!(file["name"].as_str(), Some(*name), "{}", path.display());
        assert_eq!(file["model"][0]["generator"].as_str(), Some(*name), "{}", path.display());
    }
}

#[test]
fn builds_are_the_same_bit_for_bit() {
    let bits = |g: &Geometry| -> Vec<u32> {
        let vectors = g.meshes.iter().flat_map(|m| m.positions.iter().chain(&m.normals));
        let uvs = g.meshes.iter().flat_map(|m| &m.uvs);
        vectors.flatten().chain(uvs.flatten()).map(|x| x.to_bits()).collect()
    };
    for (name, first) in all() {
        let second = geometry(name).unwrap();
        // Bits as well as values, because 0.0 equals -0.0.
        assert!(first == second && bits(&first) == bits(&second), "{name}");
    }
}

#[test]
fn triangle_counts() {
    for (name, range) in [
        ("atrium", 100_000..300_000),
        ("bars", 1_000..5_000),
        ("cameras", 1_000..5_000),
        ("cornell", 30..31),
        ("furnace", 100..1_000),
        ("lights", 3_000..8_000),
        ("motion", 24..25),
        ("room", 20_000..60_000),
        ("statue", 5_000..12_000),
        ("translucent", 3_000..10_000),
    ] {
        let triangles = count(&geometry(name).unwrap());
        assert!(range.contains(&triangles), "{name}: {triangles} triangles");
    }
}

#[test]
fn meshes_are_sound() {
    for (name, geometry) in all() {
        let mut turned_away = 0;
        for mesh in &geometry.meshes {
            let label = format!("{name}/{}", mesh.name);
            let n = mesh.positions.len();
            assert!(n == mesh.normals.len() && n == mesh.uvs.len() && mesh.indices.len() % 3 == 0, "{label}");
            assert!(mesh.material < geometry.materials.len(), "{label}");
            assert!(mesh.indices.iter().all(|&i| (i as usize) < n), "{label}");
            assert!(mesh.positions.iter().flatten().chain(mesh.uvs.iter().flatten()).all(|x| x.is_finite()), "{label}");
            // A normalized float32 vector has unit length within a few parts in 1e7; rotation by the frame adds as much.
            assert!(mesh.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-5), "{label}");
            for ([a, b, c], normals) in triangles(mesh) {
                let face = (b - a).cross(c - a);
                // Smallest parts: wires 3 mm thick, whose facets span about 1e-5 m^2; 1e-10 only excludes slivers.
                assert!(face.length() > 1e-10, "{label}: degenerate triangle at {a}");
                assert!(face.dot(normals.iter().sum()) > 0.0, "{label}: triangle at {a} faces away from its normals");
                turned_away += normals.iter().any(|n| face.dot(*n) <= 0.0) as usize;
            }
        }
        // One corner may deviate at the tips of leaves and capitals, where a sheet ends in a point.
        assert!(turned_away * 500 <= count(&geometry), "{name}: {turned_away} triangles with a corner turned away");
    }
}

#[test]
fn materials_and_textures_are_in_range() {
    for (name, geometry) in all() {
        for material in &geometry.materials {
            let label = format!("{name}/{}", material.name);
            assert!(material.albedo.iter().all(|x| (0.0..=1.0).contains(x)), "{label}");
            let polished = label == "statue/floor";
            assert!(polished || material.specular == [0.0; 3], "{label}: these scenes are diffuse");
            let textures = material.albedo_texture.into_iter().chain(material.alpha_texture);
            assert!(textures.into_iter().all(|index| index < geometry.textures.len()), "{label}");
        }
        for (index, texture) in geometry.textures.iter().enumerate() {
            let label = format!("{name}/{}", texture.name);
            assert!([texture.width, texture.height].iter().all(|side| [256, 512].contains(side)), "{label}");
            assert_eq!(texture.rgba.len(), (texture.width * texture.height * 4) as usize, "{label}");
            // Plausible surfaces: the mean linear albedo of each channel is between that of soot and that of fresh lime.
            let texels = texture.rgba.chunks_exact(4).filter(|texel| texel[3] == 255);
            let linear = |c: u8| (c as f32 / 255.0).powf(2.2);
            let (sum, n) = texels.fold((Vec3::ZERO, 0.0), |(sum, n), t| {
                (sum + Vec3::new(linear(t[0]), linear(t[1]), linear(t[2])), n + 1.0)
            });
            let mean = sum / n;
            assert!(mean.min_element() > 0.004 && mean.max_element() < 0.8, "{label}: mean albedo {mean}");
            let cut_out = geometry.materials.iter().any(|m| m.alpha_texture == Some(index));
            let alphas = || texture.rgba.chunks_exact(4).map(|texel| texel[3]);
            assert!(alphas().all(|a| a == 0 || a == 255) && alphas().any(|a| a == 0) == cut_out, "{label}");
        }
    }
}

#[test]
fn atrium_holds_what_a_benchmark_of_cut_outs_and_texture_needs() {
    let atrium = geometry("atrium").unwrap();
    for part in ["cloth_red", "cloth_green", "cloth_blue", "iron", "frond", "leaves", "court_tiles", "brick"] {
        let mesh = atrium.meshes.iter().find(|mesh| mesh.name == part);
        assert!(mesh.is_some_and(|mesh| !mesh.indices.is_empty()), "{part} is missing");
    }
}

/// Area of the intersection of two triangles in a plane, by clipping.
fn shared_area(a: [Vec2; 3], b: [Vec2; 3]) -> f32 {
    let doubled = |t: &[Vec2]| (1..t.len().max(2) - 1).map(|i| (t[i] - t[0]).perp_dot(t[i + 1] - t[0])).sum::<f32>();
    let mut polygon = a.to_vec();
    let turn = doubled(&b).signum();
    for k in 0..3 {
        let (p, q) = (b[k], b[(k + 1) % 3]);
        let side = |x: Vec2| turn * (q - p).perp_dot(x - p);
        let mut clipped = vec![];
        for (i, &x) in polygon.iter().enumerate() {
            let y = polygon[(i + 1) % polygon.len()];
            let (sx, sy) = (side(x), side(y));
            if sx >= 0.0 {
                clipped.push(x);
            }
            if sx * sy < 0.0 {
                clipped.push(x.lerp(y, sx / (sx - sy)));
            }
        }
        polygon = clipped;
    }
    if polygon.len() < 3 { 0.0 } else { 0.5 * doubled(&polygon).abs() }
}

/// Scenes whose parts stand apart, so that not even faces with opposite normals share a plane.
const APART: [&str; 4] = ["cameras", "lights", "room", "translucent"];

/// Overlapping faces in the same plane with the same normal would flicker.
#[test]
fn no_two_axis_aligned_faces_overlap_in_a_plane() {
    for (name, geometry) in all() {
        let apart = APART.contains(&name);
        // Plane: axis, sign, and offset in steps of half a millimetre, or of a tenth where parts stand apart. Faces: the
        // triangle in that plane.
        let steps = if apart { 10_000.0 } else { 2000.0 };
        let mut planes: HashMap<_, Vec<([Vec2; 3], &str)>> = HashMap::new();
        for mesh in &geometry.meshes {
            for (corners, _) in triangles(mesh) {
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                let axis = normal.abs().max_position();
                if normal[axis].abs() > 0.9999 {
                    let flat = corners.map(|p| Vec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]));
                    let plane = (axis, apart || normal[axis] > 0.0, (corners[0][axis] * steps).round() as i32);
                    planes.entry(plane).or_default().push((flat, &mesh.name));
                }
            }
        }
        let mut found: BTreeMap<_, f32> = BTreeMap::new();
        for (plane, mut faces) in planes {
            let low = |face: &[Vec2; 3]| face[0].x.min(face[1].x).min(face[2].x);
            faces.sort_by(|a, b| low(&a.0).total_cmp(&low(&b.0)));
            for (i, a) in faces.iter().enumerate() {
                let high = a.0[0].x.max(a.0[1].x).max(a.0[2].x);
                for b in faces[i + 1..].iter().take_while(|b| low(&b.0) < high) {
                    let area = shared_area(a.0, b.0);
                    // Rounding leaves slivers a micrometre wide along shared edges, at most 31 m long.
                    if area > 3e-5 {
                        *found.entry((a.1, b.1, plane, a.0[0].to_string())).or_default() += area;
                    }
                }
            }
        }
        assert!(found.is_empty(), "{name}: {} overlaps, (mesh, mesh, plane, place): m^2 {found:#?}", found.len());
    }
}

#[test]
fn furnace_is_closed_and_has_the_closed_form() {
    let furnace = geometry("furnace").unwrap();
    for material in &furnace.materials {
        for channel in 0..3 {
            assert_eq!(material.emission[channel] / (1.0 - material.albedo[channel]), 1.0);
        }
    }
    // Closed: each edge, identified by the bits of its ends, is used once in each direction.
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for mesh in &furnace.meshes {
        for (corners, _) in triangles(mesh) {
            let bits = corners.map(|p| (p + 0.0).to_array().map(f32::to_bits));
            for k in 0..3 {
                let (from, to) = (bits[k], bits[(k + 1) % 3]);
                let (edge, way) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
                *edges.entry(edge).or_default() += way;
            }
        }
    }
    assert!(edges.values().all(|&balance| balance == 0));
}

#[test]
#[ignore = "needs the original Cornell box: set HALFLIGHT_CORNELL to its OBJ file"]
fn cornell_equals_the_original_model() {
    let path = std::env::var_os("HALFLIGHT_CORNELL").expect("HALFLIGHT_CORNELL is the path of cornell.obj");
    let text = std::fs::read_to_string(path).unwrap();
    let numbers = |line: &str| line.split_whitespace().skip(1).map(|x| x.parse::<f32>().unwrap()).collect::<Vec<_>>();
    let points: Vec<Vec3> =
        text.lines().filter(|l| l.starts_with("v ")).map(|l| Vec3::from_slice(&numbers(l))).collect();
    let mut material = "";
    let mut expected = vec![];
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("usemtl ") {
            material = name;
        } else if line.starts_with("f ") {
            let corner: Vec<Vec3> = numbers(line).iter().map(|&i| points[i as usize - 1]).collect();
            expected.extend([[0, 1, 2], [0, 2, 3]].map(|t| (material, t.map(|k| corner[k]))));
        }
    }
    let cornell = geometry("cornell").unwrap();
    assert_eq!(count(&cornell), expected.len());
    for mesh in &cornell.meshes {
        for (corners, _) in triangles(mesh) {
            // The model is written with six significant digits.
            let near = |other: &[Vec3; 3]| (0..3).all(|k| corners[k].distance(other[k]) < 2e-6);
            assert!(expected.iter().any(|(name, t)| *name == mesh.name && near(t)), "{}: {corners:?}", mesh.name);
        }
    }
}
