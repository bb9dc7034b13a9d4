//! Geometry of OBJ files, valid and invalid.

use crate::{TRIANGLE, assert_says, assert_warns, corners, load_obj, refusal};

fn refused(text: &str) -> String {
    refusal(&[("dir/m.obj", text.as_bytes())], "dir/m.obj")
}

#[test]
fn missing_normals_are_flat_and_split_vertices() {
    // Two triangles that share an edge at a right angle.
    let scene = load_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\n");
    let normals: Vec<_> = corners(&scene).iter().map(|(_, (_, normal, _))| *normal).collect();
    assert_eq!(normals[..3], [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(normals[3..], [[0.0, 1.0, 0.0]; 3]);
    assert_eq!(scene.meshes[0].positions.len(), 6);
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn polygons_become_fans_and_objects_split_by_material() {
    let scene = load_obj(
        "o a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 .5 0\nusemtl x\nf 1 2 3 4\nusemtl y\nf 1 3 4 5\n\
         usemtl x\nf 1 2 3 4 5\no b\nf 1 2 3\n",
    );
    let meshes: Vec<_> = scene
        .meshes
        .iter()
        .map(|m| (m.name.as_str(), scene.materials[m.material].name.as_str(), m.indices.len() / 3))
        .collect();
    assert_eq!(meshes, [("a", "x", 5), ("a", "y", 2), ("b", "x", 1)]);
}

#[test]
fn texture_coordinates_point_down() {
    let scene = load_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt .25 .125\nvt 2\nf 1/1 2/2 3/3\n");
    let uvs: Vec<_> = corners(&scene).iter().map(|(_, (_, _, uv))| *uv).collect();
    assert_eq!(uvs, [[0.0, 1.0], [0.25, 0.875], [2.0, 1.0]]);
}

#[test]
fn groups_may_mix_face_forms() {
    // Texture coordinates only in the second face, normals only in the third: arrays must stay aligned.
    let scene = load_obj(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 5\nvt .5 .25\nvn 0 0 -3\n\
         f 1 2 3\nf 1/1 2/1 4/1\nf 1//1 3//1 4//1\nf 1/1/1 2/1/1 3/1/1\n",
    );
    let corners = corners(&scene);
    assert_eq!(corners.len(), 12);
    assert_eq!(scene.meshes.len(), 1);
    let of_face = |i: usize| corners[3 * i].1;
    assert_eq!(of_face(0), ([0.0; 3], [0.0, 0.0, 1.0], [0.0; 2]));
    assert_eq!(of_face(1), ([0.0; 3], [0.0, -1.0, 0.0], [0.5, 0.75]));
    assert_eq!(of_face(2), ([0.0; 3], [0.0, 0.0, -1.0], [0.0; 2]));
    assert_eq!(of_face(3), ([0.0; 3], [0.0, 0.0, -1.0], [0.5, 0.75]));
    assert_eq!(corners[3 + 2].1.0, [0.0, 0.0, 5.0]);
}

#[test]
fn unusual_but_valid_lines_are_read() {
    let plain = corners(&load_obj(TRIANGLE));
    for text in [
        // Relative indices, Windows line ends, comments, a byte order mark, spaces.
        "\u{feff}# head\r\nv 0 0 0\r\nv 1 0 0 # one\r\n\tv 0 1 0\r\nf -3 -2 -1 # face\r\n",
        // A face before its vertices, and a line that continues on the next.
        "f 1 2 \\\n 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
        // Weights, white vertices and smoothing groups.
        "v 0 0 0 2\nv 1 0 0 1 1 1\nv 0 1 0\ns off\nvp 1 2\nf 1 2 3\n",
        // Keywords in upper case, old line ends, tabs.
        "V 0 0 0\rv\t1 0 0\r\nV 0 1 0\rG\rF 1 2 3",
        // A comment that ends like a line that continues.
        "# C:\\models\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1// 2// 3//\n",
    ] {
        let scene = load_obj(text);
        assert_eq!(corners(&scene), plain, "{text}");
        assert_eq!(scene.warnings, [""; 0]);
    }
}

#[test]
fn text_that_is_not_utf8_is_read() {
    let text = [b"# caf\xe9\no t\xfcr\n", TRIANGLE.as_bytes()].concat();
    assert_eq!(crate::load(&[("m.obj", &text)], "m.obj").triangle_count(), 1);
}

#[test]
fn utf16_is_read() {
    let little: Vec<u8> = "\u{feff}".encode_utf16().chain(TRIANGLE.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = "\u{feff}".encode_utf16().chain(TRIANGLE.encode_utf16()).flat_map(u16::to_be_bytes).collect();
    for bytes in [little, big] {
        assert_eq!(corners(&crate::load(&[("m.obj", &bytes)], "m.obj")), corners(&load_obj(TRIANGLE)));
    }
}

#[test]
fn what_is_not_drawn_is_told_once() {
    for (lines, parts) in [
        ("p 1\nl 1 2 3\n", ["2 lines and points", "not drawn"]),
        ("l 1 2\n", ["1 line or point", "is not drawn"]),
        (
            "cstype bezier\ndeg 3\ncurv 0 1 1 2\nsurf 0 1 0 1 1\ncurv 0 1 1 2\nend\n",
            ["`curv` (2 times), `surf`", "not drawn"],
        ),
        ("colour 1 0 0\nfloor\ncolour 1 0 0\n", ["unknown keywords", "`colour` (2 times), `floor`"]),
    ] {
        assert_warns(&load_obj(&format!("{TRIANGLE}{lines}")), &["m.obj:", parts[0], parts[1]]);
    }
}

/// Area of all triangles of a scene in the plane z = 0, positive towards +z.
fn area(scene: &halflight_scenes::Scene) -> f32 {
    let corners: Vec<_> = corners(scene).into_iter().map(|(_, (position, ..))| position).collect();
    let twice =
        |t: &[[f32; 3]; 3]| (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
    0.5 * corners.as_chunks::<3>().0.iter().map(twice).sum::<f32>()
}

#[test]
fn concave_faces_have_their_own_area() {
    let letter = "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 2 0\nv 3 2 0\nv 3 3 0\nv 0 3 0\n";
    for face in ["f 1 2 3 4 5 6 7 8\n", "f 5 6 7 8 1 2 3 4\n"] {
        let scene = load_obj(&format!("{letter}{face}"));
        assert_eq!((area(&scene), scene.triangle_count()), (7.0, 6), "{face}");
        assert!(corners(&scene).iter().all(|(_, (_, normal, _))| *normal == [0.0, 0.0, 1.0]));
        assert_eq!(scene.warnings, [""; 0]);
    }
    // The other way round, the normals point the other way.
    let turned = load_obj(&format!("{letter}f 8 7 6 5 4 3 2 1\n"));
    assert_eq!(area(&turned), -7.0);
}

#[test]
fn zero_area_faces_are_dropped_and_counted() {
    // A repeated corner, three collinear corners (not exactly in binary), a face with two corners.
    let scene = load_obj(&format!("{TRIANGLE}v .1 .3 .7\nv .2 .6 1.4\nv .7 2.1 4.9\nf 1 2 2\nf 4 5 6\nf 1 2\n"));
    assert_eq!(scene.triangle_count(), 1);
    assert_warns(&scene, &["m.obj", "3 faces of zero area were dropped"]);
    // A thin triangle is kept: its height is 1e-4 of its length.
    assert_eq!(load_obj("v 0 0 0\nv 100 0 0\nv 50 .01 0\nf 1 2 3\n").triangle_count(), 1);
}

#[test]
fn bad_normals_become_geometric_ones() {
    for bad in ["0 0 0", "nan 0 1", "inf 0 0", "1.#QNAN 0 0", "1 0"] {
        let scene = load_obj(&format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn {bad}\nvn 0 3 4\nf 1//1 2//2 3//1\n"));
        let normals: Vec<_> = corners(&scene).iter().map(|(_, (_, normal, _))| *normal).collect();
        assert_eq!(normals, [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]], "{bad}");
        assert_warns(&scene, &["m.obj", "2 zero or non-finite normals were replaced"]);
    }
}

#[test]
fn a_shared_bad_normal_is_the_mean_around_its_vertex() {
    // A right-angled ridge along x: the mean of +z and +y.
    let scene =
        load_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 0\nvn 0 0 1\nf 1//1 2//2 3//2\nf 1//1 4//2 2//2\n");
    let normal = corners(&scene)[0].1.1;
    // Rounding of float32.
    assert!((normal[1] - 0.5_f32.sqrt()).abs() < 1e-6 && (normal[2] - 0.5_f32.sqrt()).abs() < 1e-6, "{normal:?}");
}

#[test]
fn bad_texture_coordinates_become_zero() {
    let scene = load_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt .5 .5\nf 1/1 2/2 3/2\n");
    assert_eq!(corners(&scene)[0].1.2, [0.0, 1.0]);
    assert_warns(&scene, &["m.obj", "1 non-finite texture coordinate was replaced by 0"]);
}

#[test]
fn bad_vertices_are_refused_with_their_line() {
    for bad in ["nan 0 0", "0 inf 0", "0 0 1e400", "0 0 -1.#IND", "0 0", "a b c"] {
        let sentence = refused(&format!("# head\nv 0 0 0\nv {bad}\n{TRIANGLE}"));
        assert_says(&sentence, &["dir/m.obj:3:", &format!("`v {bad}`"), "finite", "export the model again"]);
    }
}

#[test]
fn indices_out_of_range_are_refused_with_their_line() {
    let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
    for (face, what) in [
        ("1 2 4", ["vertex 4", "3 `v` lines"]),
        ("1 2 -4", ["vertex -4", "3 `v` lines"]),
        ("1 2 0", ["vertex 0", "3 `v` lines"]),
        ("1/1 2/1 3/9", ["texture coordinate 9", "1 `vt` lines"]),
        ("1/1 2/1 3/-2", ["texture coordinate -2", "1 `vt` lines"]),
        ("1//1 2//1 3//2", ["normal 2", "1 `vn` lines"]),
        ("1 2 9223372036854775807", ["vertex 9223372036854775807", "3 `v` lines"]),
    ] {
        let sentence = refused(&format!("{head}f {face}\nf 1 2 3\n"));
        assert_says(&sentence, &["dir/m.obj:6:", what[0], what[1], "export the model again"]);
    }
}

#[test]
fn broken_faces_are_refused_with_their_line() {
    let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
    for (face, what) in [
        ("1 2 x", "whole numbers"),
        ("1 2 3/1/1/1", "more than three"),
        ("1/1 2/1 3", "different forms"),
        ("1 2 99999999999999999999", "whole numbers"),
    ] {
        assert_says(&refused(&format!("{head}f {face}\n")), &["dir/m.obj:5:", what, "export the model again"]);
    }
}

#[test]
fn files_without_faces_are_refused() {
    assert_says(&refused("v 0 0 0\n"), &["dir/m.obj:", "no faces", "export"]);
    assert_says(&refused(""), &["dir/m.obj:", "no faces"]);
    assert_says(&refused("v 0 0 0\nv 1 0 0\nf 1 2 2\n"), &["dir/m.obj:", "every face has zero area"]);
}

#[test]
fn files_that_cannot_be_read_are_refused() {
    assert_says(&refusal(&[], "dir/m.obj"), &["dir/m.obj:", "no such file", "check the path"]);
    assert_says(&refusal(&[], "m.fbx"), &["m.fbx:", ".toml", ".obj", ".gltf", ".glb"]);
    assert_says(&refusal(&[], "scenes"), &["scenes:", ".toml", ".obj"]);
}
