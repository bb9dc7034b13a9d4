//! The automatic camera and light of a bare OBJ file.

use std::fmt::Write;

use glam::Vec3;
use halflight_scenes::{Light, MemoryFiles, Scene, generators, load_scene, write_obj};

use crate::{TRIANGLE, assert_warns, load, load_obj};

/// Faces of a box by the direction of their outward normal, with corners in counter-clockwise order seen from outside.
const FACES: [(&str, [usize; 4]); 6] = [
    ("-x", [0, 4, 6, 2]),
    ("+x", [1, 3, 7, 5]),
    ("-y", [0, 1, 5, 4]),
    ("+y", [2, 6, 7, 3]),
    ("-z", [0, 2, 3, 1]),
    ("+z", [4, 5, 7, 6]),
];

/// A box without some of its faces; normals (geometric) face out or in.
fn make_box(low: [f32; 3], high: [f32; 3], without: &[&str], inwards: bool) -> String {
    let mut obj = String::new();
    for i in 0..8 {
        let corner = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        writeln!(obj, "v {} {} {}", corner(0), corner(1), corner(2)).expect("a string");
    }
    for (name, mut corners) in FACES {
        if inwards {
            corners.reverse();
        }
        if !without.contains(&name) {
            writeln!(obj, "f {}", corners.map(|c| format!("-{}", 8 - c)).join(" ")).expect("a string");
        }
    }
    obj
}

/// Asserts that the corners of the bounding box are inside a square image and at least one is in its outer half.
fn assert_fills_view(scene: &Scene) {
    let (low, high) = scene.bounds().expect("not empty");
    let [tangent, _] = scene.camera.tan_half_fov(1, 1);
    let view = scene.camera.view_matrix();
    let reach = (0..8)
        .map(|i| {
            let corner = Vec3::select(glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4), high, low);
            let p = view.transform_point3(corner);
            assert!(p.z < 0.0, "in front of the camera");
            p.x.abs().max(p.y.abs()) / (-p.z * tangent)
        })
        .fold(0.0, f32::max);
    // The margin is 5 %.
    assert!((0.9..=1.0).contains(&reach), "{reach}");
}

fn sun(scene: &Scene) -> Vec3 {
    match scene.lights[..] {
        [Light::Directional { direction, irradiance }] => {
            assert_eq!(irradiance, [10.0, 9.5, 8.5]);
            let direction = Vec3::from(direction);
            assert!(direction.y < -0.3, "from above");
            direction
        }
        _ => panic!("not one sun: {:?}", scene.lights),
    }
}

#[test]
fn an_object_is_completely_visible_from_outside() {
    for scale in [1e-4, 1.0, 1e5] {
        let scene = load_obj(&make_box([0.0; 3], [2.0 * scale, scale, 3.0 * scale], &[], false));
        assert_fills_view(&scene);
        let (low, high) = scene.bounds().expect("not empty");
        let eye = Vec3::from(scene.camera.eye);
        assert!(eye.z > high.z && eye.y > 0.5 * (low.y + high.y), "front, above: {eye}");
        // The front, the right side and the top are visible; the sun lights the front and the top.
        assert!(sun(&scene).z < 0.0);
    }
    // Flat objects, too.
    assert_fills_view(&load_obj(TRIANGLE));
    assert_fills_view(&load_obj("v 0 0 0\nv 0 0 1\nv 1 0 0\nf 1 2 3\n"));
}

/// Share of the pixels of a picture of 320 x 180 that show a surface, by one ray each.
fn seen(scene: &Scene) -> f32 {
    let [x, y] = scene.camera.tan_half_fov(320, 180);
    let to_world = scene.camera.view_matrix().inverse();
    let eye = Vec3::from(scene.camera.eye).as_dvec3();
    let hits = (0..320 * 180).filter(|i| {
        let at = |i: i32, count: i32| (2 * i + 1) as f32 / count as f32 - 1.0;
        let ray = to_world.transform_vector3(Vec3::new(at(i % 320, 320) * x, -at(i / 320, 180) * y, -1.0)).as_dvec3();
        scene.meshes.iter().any(|mesh| {
            mesh.indices.as_chunks::<3>().0.iter().any(|triangle| {
                let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3() - eye);
                let volumes = [ray.dot(a.cross(b)), ray.dot(b.cross(c)), ray.dot(c.cross(a))];
                let same = volumes.iter().all(|&v| v >= 0.0) || volumes.iter().all(|&v| v <= 0.0);
                let normal = (b - a).cross(c - a);
                same && a.dot(normal) / ray.dot(normal) > 0.0
            })
        })
    });
    hits.count() as f32 / (320.0 * 180.0)
}

#[test]
fn long_thin_things_are_seen_from_one_end() {
    let thing = |low, high| load_obj(&make_box(low, high, &[], false));
    for scene in [
        thing([-0.2, 0.0, -0.2], [0.2, 200.0, 0.2]),
        thing([-500.0, 0.0, -0.2], [500.0, 0.4, 0.2]),
        thing([-0.2, 0.0, -500.0], [0.2, 0.4, 500.0]),
    ] {
        let share = seen(&scene);
        assert!(share >= 0.01, "{share} {:?}", scene.camera);
        assert_eq!(scene.warnings, [""; 0]);
    }
}

#[test]
fn strays_and_grounds_do_not_move_the_camera_away() {
    let cube = make_box([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0], &[], false);
    let alone = load_obj(&cube);
    assert!(seen(&alone) > 0.1);
    for stray in
        ["v 250000 0 0\nv 250001 0 0\nv 250000 1 0\nf -3 -2 -1\n", "v 0 0 -900\nv 1 0 -900\nv 0 1 -900\nf -3 -2 -1\n"]
    {
        let scene = load_obj(&(cube.clone() + stray));
        assert_eq!((scene.camera, scene.lights), (alone.camera, alone.lights.clone()), "{stray}");
    }
    let ground = "v -20000 0 -20000\nv 20000 0 -20000\nv 20000 0 20000\nv -20000 0 20000\nf -1 -2 -3 -4\n";
    let scene = load_obj(&(cube.clone() + ground));
    assert_eq!(scene.camera, alone.camera);
    // Two cubes of the same size are both shown, however far apart.
    let two = load_obj(&(cube + &make_box([99.0, 0.0, -1.0], [101.0, 2.0, 1.0], &[], false)));
    assert_ne!(two.camera, alone.camera);
}

#[test]
fn a_hall_around_a_detailed_thing_is_no_ground() {
    // 200 small faces in the middle of a court of 60 m.
    let mut obj = make_box([0.0; 3], [60.0, 20.0, 24.0], &["+y"], true);
    for i in 0..200 {
        let (x, z) = (29.5 + f64::from(i % 10) * 0.1, 11.5 + f64::from(i / 10) * 0.05);
        obj += &format!("v {x} 1 {z}\nv {} 1 {z}\nv {x} 1.1 {z}\nf -3 -2 -1\n", x + 0.1);
    }
    let eye = Vec3::from(load_obj(&obj).camera.eye);
    assert!(eye.cmpgt(Vec3::ZERO).all() && eye.cmplt(Vec3::new(60.0, 20.0, 24.0)).all(), "inside: {eye}");
}

#[test]
fn dust_is_seen_from_close_by() {
    // A thousand grains of dust in a wide cube.
    let grains = (0..1000_u32).map(|i| {
        let at = [i % 10, i / 10 % 10, i / 100].map(|k| k * 1000);
        let [x, y, z] = at;
        format!("v {x} {y} {z}\nv {x}.001 {y} {z}\nv {x} {y}.001 {z}\nf -3 -2 -1\n")
    });
    let scene = load_obj(&grains.collect::<String>());
    assert!(seen(&scene) >= 0.01);
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn a_scene_without_light_gets_a_sky_beside_its_sun() {
    let scene = load_obj(TRIANGLE);
    let sky = scene.environment.clone().expect("a sky");
    assert!(sky.texels.len() == 1 && sky.texels[0].iter().all(|&x| x > 0.0 && x < 1.0), "{sky:?}");
    sun(&scene);
    // It can be saved, and is read back.
    let files: MemoryFiles =
        halflight_scenes::write_scene(&scene, "again").expect("a good scene").into_iter().collect();
    let mut files = files;
    files.insert("m.obj", TRIANGLE);
    assert_eq!(load_scene(&files, "again.toml".as_ref()).expect("it was written").environment, scene.environment);
    // A closed room gets its lamp only.
    let room = load_obj(&make_box([0.0; 3], [4.0, 3.0, 6.0], &[], true));
    assert_eq!((room.environment, room.lights.len()), (None, 1));
}

#[test]
fn an_open_box_is_seen_through_its_opening() {
    for (opening, axis) in [("+z", Vec3::Z), ("-z", Vec3::NEG_Z), ("+x", Vec3::X), ("-x", Vec3::NEG_X)] {
        let scene = load_obj(&make_box([0.0; 3], [2.0; 3], &[opening], true));
        assert_fills_view(&scene);
        let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
        assert!((eye - target).normalize().dot(axis) > 0.999, "{opening}: {eye}");
        assert!(sun(&scene).dot(axis) < -0.3, "the sun shines in");
    }
}

#[test]
fn a_court_is_seen_from_inside_along_its_longest_axis() {
    for (size, axis) in [([20.0, 6.0, 8.0], Vec3::X), ([8.0, 6.0, 20.0], Vec3::Z)] {
        let scene = load_obj(&make_box([0.0; 3], size, &["+y"], true));
        let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
        assert!(eye.cmpgt(Vec3::ZERO).all() && eye.cmplt(Vec3::from(size)).all(), "inside: {eye}");
        let forward = (target - eye).normalize();
        assert!(forward.dot(axis).abs() > 0.95, "{forward}");
        assert!((target - eye).length() > 0.8 * 20.0, "from one end to the other");
        // Sunlight through the open roof reaches the point at eye height above the centre of the floor.
        let direction = sun(&scene);
        let middle = Vec3::new(0.5 * size[0], eye.y, 0.5 * size[2]);
        let out = middle - direction * ((size[1] - middle.y) / -direction.y);
        assert!(out.x > 0.0 && out.x < size[0] && out.z > 0.0 && out.z < size[2], "{out}");
    }
}

#[test]
fn walls_may_be_thick() {
    // The outer faces of thick walls come first in the file; rays from inside hit the inner faces first.
    let (low, high) = ([0.0; 3], [20.0, 6.0, 8.0]);
    let outside = make_box(low.map(|x| x - 1.0), high.map(|x| x + 1.0), &["+y"], false);
    let scene = load_obj(&(outside + &make_box(low, high, &["+y"], true)));
    let eye = Vec3::from(scene.camera.eye);
    assert!(eye.cmpgt(low.into()).all() && eye.cmplt(high.into()).all(), "inside: {eye}");
}

#[test]
fn objects_inside_do_not_change_the_kind_of_scene() {
    let court = make_box([0.0; 3], [20.0, 6.0, 8.0], &["+y"], true);
    // A tower beside the court moves the centre of the bounding box above its walls.
    let with_tower = court.clone() + &make_box([20.0, 0.0, 3.0], [22.0, 13.0, 5.0], &[], false);
    // The centroid is inside a plinth in the centre.
    let with_plinth = court + &make_box([9.0, 0.0, 3.0], [11.0, 2.9, 5.0], &[], false);
    for obj in [with_tower, with_plinth] {
        let eye = Vec3::from(load_obj(&obj).camera.eye);
        assert!(eye.cmpgt(Vec3::ZERO).all() && eye.cmplt(Vec3::new(20.0, 6.0, 8.0)).all(), "inside: {eye}");
    }
}

#[test]
fn a_closed_room_gets_a_point_light() {
    let scene = load_obj(&make_box([0.0; 3], [4.0, 3.0, 6.0], &[], true));
    assert_warns(&scene, &["closed", "point light"]);
    let [Light::Point { position, intensity }] = scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert!(Vec3::from(position).cmpgt(Vec3::ZERO).all() && position[1] < 3.0);
    assert!(intensity[0] > 0.0);
    let eye = Vec3::from(scene.camera.eye);
    assert!(eye.cmpgt(Vec3::ZERO).all() && eye.cmplt(Vec3::new(4.0, 3.0, 6.0)).all());
}

#[test]
fn a_scene_with_emitters_gets_no_sun() {
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}");
    let scene = load(&[("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nKe 5 5 5\n")], "m.obj");
    assert_eq!(scene.lights, []);
}

/// A bundled scene, exported and read as a bare OBJ file.
fn exported(name: &str) -> Scene {
    let generators::Geometry { meshes, materials, textures } = generators::geometry(name).expect("it builds");
    let files = write_obj(&meshes, &materials, &textures, name).expect("a good scene");
    let files: MemoryFiles = files.into_iter().collect();
    load_scene(&files, format!("{name}.obj").as_ref()).expect("a good scene")
}

#[test]
fn the_bundled_cornell_box_is_seen_through_its_opening() {
    let scene = exported("cornell");
    assert_fills_view(&scene);
    let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
    assert!((eye - target).normalize().z > 0.999, "{eye}");
}

#[test]
fn the_bundled_atrium_is_seen_from_inside_along_the_court() {
    let scene = exported("atrium");
    let [eye, target] = [scene.camera.eye, scene.camera.target].map(Vec3::from);
    // Within its 25 m by 7.5 m, under the eaves.
    assert!(eye.x.abs() < 12.5 && eye.z.abs() < 3.75 && (0.5..9.0).contains(&eye.y), "{eye}");
    assert!((target - eye).normalize().x.abs() > 0.95, "{eye} {target}");
    sun(&scene);
}
