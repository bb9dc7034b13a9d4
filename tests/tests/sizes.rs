//! Sizes follow what is looked at, not the scene's extent: a larger ground changes nothing in a room on it. And the
//! shadow maps themselves against closed forms.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::session::Session;
use halflight_frame_graph::{Changed, CompiledGraph, Externals};
use halflight_metrics::Rgb;
use halflight_native::frames::read_texture;
use halflight_renderer::{
    plan_frame,
    scene::{LIGHTS, SceneBuffers, SceneFacts, Sight, camera_view},
};
use halflight_scenes::{Camera, CameraKeyframe, Light, Material, Mesh, Scene};
use halflight_tests::{bundled, device, frames, known, mean_luminance, render, request, settings};

const SIZE: [u32; 2] = [96, 54];
/// Widths of the ground: each is at least ten times as wide as the last.
const GROUNDS: [f32; 4] = [200.0, 2e3, 4e4, 4e5];

/// A quadrilateral from a corner along two sides, with the normal of their cross product.
fn quad(corner: Vec3, a: Vec3, b: Vec3) -> Mesh {
    let positions = [corner, corner + a, corner + a + b, corner + b].map(|v| v.to_array()).to_vec();
    let normals = vec![a.cross(b).normalize().to_array(); 4];
    Mesh { positions, normals, uvs: vec![[0.0; 2]; 4], indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() }
}

/// The six sides of a box around the origin, half as wide as `half`. They face inwards if `half` is negative.
fn cube(half: f32) -> Vec<Mesh> {
    let sides = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)];
    let side = |(a, b): (Vec3, Vec3)| {
        [a.cross(b), b.cross(a)].map(|out| {
            let (a, b) = if out.dot(a.cross(b)) > 0.0 { (a, b) } else { (b, a) };
            quad(half * (out - a - b), 2.0 * half * a, 2.0 * half * b)
        })
    };
    sides.into_iter().flat_map(side).collect()
}

fn scene(meshes: Vec<Mesh>, lights: Vec<Light>, eye: Vec3, target: Vec3) -> Scene {
    let camera =
        Camera { eye: eye.to_array(), target: target.to_array(), vertical_fov_degrees: 50.0, ..Camera::default() };
    let materials = vec![Material { albedo: [0.5; 3], ..Material::default() }];
    Scene { meshes, materials, lights, camera, ..Scene::default() }
}

/// A room of 4 x 3 x 4 units with a box, without front, right wall and ceiling, on a ground of this width.
fn room(ground: f32, light: Light) -> Scene {
    let mut meshes = vec![
        quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z),
        quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y),
        quad(Vec3::new(-2.0, 0.0, 2.0), -4.0 * Vec3::Z, 3.0 * Vec3::Y),
        quad(Vec3::new(-0.5 * ground, -0.1, 0.5 * ground), ground * Vec3::X, -ground * Vec3::Z),
    ];
    meshes.extend(cube(0.5).into_iter().map(|mut mesh| {
        mesh.positions.iter_mut().for_each(|p| *p = (Vec3::from(*p) + Vec3::new(0.3, 0.6, -0.2)).to_array());
        mesh
    }));
    scene(meshes, vec![light], Vec3::new(0.0, 1.3, 4.2), Vec3::new(0.0, 1.0, 0.0))
}

fn lights() -> [Light; 3] {
    let position = [0.5, 2.2, 1.5];
    let intensity = [8.0; 3];
    [
        Light::Point { position, intensity },
        Light::Spot {
            position,
            direction: [0.0, -1.0, -0.6],
            intensity,
            half_angle_degrees: 50.0,
            full_intensity_half_angle_degrees: 45.0,
        },
        Light::Directional { direction: [-0.5, -1.0, -0.6], irradiance: intensity },
    ]
}

/// World positions of the pixels; `None` without a surface.
fn positions(depth: &[Rgb], camera: &Camera, [width, height]: [u32; 2]) -> Vec<Option<Vec3>> {
    let [tan_x, tan_y] = camera.tan_half_fov(width, height);
    let to_world = camera.view_matrix().inverse();
    let position = |(i, depth): (usize, &Rgb)| {
        let [column, row] = [i % width as usize, i / width as usize].map(|index| index as f32 + 0.5);
        let x = 2.0 * column / width as f32 - 1.0;
        let y = 1.0 - 2.0 * row / height as f32;
        let in_view = depth[0] * Vec3::new(x * tan_x, y * tan_y, -1.0);
        (depth[0] > 0.0).then(|| to_world.transform_point3(in_view))
    };
    depth.iter().enumerate().map(position).collect()
}

#[test]
fn the_room_is_seen_and_lit_alike_on_any_ground() {
    for light in lights() {
        let of_ground = |ground| {
            let scene = room(ground, light);
            let session = Session::new(device(), &scene).keep_all();
            let mut frames = frames(&session, &request("none", &[("direct.shadow_map_size", "1024")], SIZE));
            frames.run(0).unwrap();
            ["depth", "direct"].map(|output| frames.read_rgb(output).unwrap().unwrap())
        };
        let [first, others @ ..] = GROUNDS.map(of_ground);
        let positions = positions(&first[0], &room(200.0, light).camera, SIZE);
        // The ground's own corners are rounded to 3 cm at a width of 400,000, so it is compared on the others only.
        let pixels = |lowest: f32| -> Vec<usize> {
            let inside = |p: &Vec3| p.y > lowest && p.abs().max_element() < 4.0;
            (0..positions.len()).filter(|&i| positions[i].as_ref().is_some_and(inside)).collect()
        };
        assert!(pixels(-0.05).len() > 2000, "the room fills the picture: {}", pixels(-0.05).len());
        let mean = mean_luminance(&first[1]);
        assert!(mean > 0.01, "the room is lit");
        for (&ground, other) in GROUNDS[1..].iter().zip(others) {
            for i in pixels(if ground < 1e5 { -1.0 } else { -0.05 }) {
                let [depth, other_depth] = [first[0][i][0], other[0][i][0]];
                assert!((depth - other_depth).abs() < 1e-4 * depth, "{light:?} {ground} {i}: {depth} {other_depth}");
                let [lit, other_lit] = [first[1][i][0], other[1][i][0]].map(f64::from);
                assert!((lit - other_lit).abs() <= 0.02 * lit.max(mean), "{light:?} {ground} {i}: {lit} {other_lit}");
            }
        }
    }
}

#[test]
fn texels_and_voxels_of_the_room_are_alike_on_any_ground() {
    for light in lights() {
        let [first, others @ ..] = GROUNDS.map(|ground| SceneFacts::of(&room(ground, light)));
        assert!(first.extent.is_part());
        for other in others {
            assert_eq!((first.near, first.bounds), (other.near, other.bounds));
            assert_eq!(first.shadow_layers.len(), other.shadow_layers.len());
            for (a, b) in first.shadow_layers.iter().zip(&other.shadow_layers) {
                assert_eq!((a.width, a.light), (b.width, b.light));
            }
        }
    }
}

#[test]
fn the_voxels_of_the_room_are_alike_on_any_ground() {
    let of_ground = |ground| {
        let scene = room(ground, lights()[2]);
        let session = Session::new(device(), &scene).keep_all();
        let mut frames = frames(&session, &request("hybrid", &[], SIZE));
        frames.run(0).unwrap();
        frames.read_buffer("scene_cubes").unwrap().unwrap()
    };
    let [first, others @ ..] = GROUNDS.map(of_ground);
    let set = |voxels: &[u8]| voxels.iter().map(|byte| byte.count_ones()).sum::<u32>();
    assert!(set(&first) > 10_000, "{}", set(&first));
    for (ground, other) in GROUNDS[1..].iter().zip(others) {
        // The ground's corners are rounded: a few voxels at the side of the grid may differ.
        let differ: u32 = first.iter().zip(&other).map(|(a, b)| (a ^ b).count_ones()).sum();
        assert!(differ < set(&first) / 100, "{ground}: {differ} of {}", set(&first));
    }
}

#[test]
fn all_of_each_bundled_scene_is_looked_at() {
    for name in ["atrium", "bars", "bars_sky", "cornell", "cornell_sky", "furnace", "motion", "statue", "statue_floor"]
    {
        let facts = SceneFacts::of(&bundled(name));
        assert!(!facts.extent.is_part() && facts.far_shadow_layers.is_empty(), "{name}");
    }
}

#[test]
fn surfaces_far_from_what_is_looked_at_have_shadows() {
    // A slab above the ground, 60 units behind the room and to the right: few pixels, but in its shadow it is dark.
    let scene = with_slab([0.0, -1.0, 0.0]);
    let facts = SceneFacts::of(&scene);
    let [low, high] = facts.bounds;
    assert!(facts.extent.is_part() && low[2] > -40.0 && high[0] < 30.0, "{low:?} {high:?}");
    let session = Session::new(device(), &scene).keep_all();
    let mut frames = frames(&session, &request("none", &[("direct.shadow_map_size", "1024")], [192, 108]));
    frames.run(0).unwrap();
    let [depth, direct] = ["depth", "direct"].map(|output| frames.read_rgb(output).unwrap().unwrap());
    let [mut dark, mut lit] = [0, 0];
    for (world, direct) in positions(&depth, &scene.camera, [192, 108]).into_iter().zip(&direct) {
        let Some(world) = world else { continue };
        // On the ground, a texel's width away from the edges of the shadow and from the room.
        if world.y.abs() < 0.5 && world.z < -10.0 && world.distance(Vec3::ZERO) < 200.0 {
            let inside = |margin: f32| {
                let within = |v: f32, low: f32| v > low - margin && v < low + 30.0 + margin;
                within(world.x, 30.0) && within(world.z, -80.0)
            };
            if inside(-1.0) {
                assert_eq!(direct[0], 0.0, "{world}");
                dark += 1;
            } else if !inside(1.0) {
                // Albedo has eight bits.
                let ratio = direct[0] / (8.0 * 0.5 / std::f32::consts::PI);
                assert!((ratio - 1.0).abs() < 0.02, "{world} {ratio}");
                lit += 1;
            }
        }
    }
    assert!(dark > 20 && lit > 20, "{dark} {lit}");
}

/// A slab far behind the room, which only a far shadow map shows.
fn with_slab(direction: [f32; 3]) -> Scene {
    let mut scene = room(4e4, Light::Directional { direction, irradiance: [8.0; 3] });
    scene.meshes.push(quad(Vec3::new(30.0, 20.0, -50.0), 30.0 * Vec3::X, -30.0 * Vec3::Z));
    scene.camera.target = [3.0, 1.0, 0.0];
    scene
}

#[test]
fn maps_and_voxels_that_are_drawn_once_follow_a_new_light_and_a_new_camera() {
    let gpu = &device().gpu;
    let hybrid = settings("hybrid", &[("direct.shadow_map_size", "512"), ("sources", "lights")]);
    let plan = |facts: &SceneFacts| plan_frame(facts, known("hybrid"), &hybrid, SIZE, Default::default()).unwrap();
    let images = |graph: &CompiledGraph, scene: &Scene, facts: &SceneFacts| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        graph.record(gpu, &mut encoder, &camera_view(&scene.camera, SIZE, facts.near), Changed::Only(&[LIGHTS]));
        gpu.queue.submit([encoder.finish()]);
        ["direct", "indirect"].map(|output| read_texture(gpu, graph.output(output).unwrap()).unwrap())
    };
    let before = with_slab([0.0, -1.0, 0.0]);
    // Another sun, and another camera: it looks at another part.
    let mut after = with_slab([0.6, -1.0, 0.2]);
    after.camera.eye = [1.0, 1.4, 3.0];
    let buffers = SceneBuffers::new(gpu, &before);
    let externals = || Externals { scene: Some(&buffers), ..Default::default() };
    let mut facts = SceneFacts::of(&before);
    let mut graph = CompiledGraph::new(gpu, plan(&facts), &externals());
    let first = images(&graph, &before, &facts);
    assert!(buffers.relight(gpu, &after.lights));
    facts.resize(&after, Sight::new(&after).extent(&[after.camera]));
    assert_eq!(facts, SceneFacts::of(&after));
    assert_ne!(facts.bounds, SceneFacts::of(&before).bounds, "the camera looks at another part");
    assert!(graph.update(gpu, &plan(&facts)), "only numbers changed");
    let updated = images(&graph, &after, &facts);
    let fresh = images(&CompiledGraph::new(gpu, plan(&facts), &externals()), &after, &facts);
    for i in 0..2 {
        assert!(updated[i] == fresh[i], "an update differs from a new graph: {i}");
        assert!(updated[i] != first[i], "{i}");
    }
}

#[test]
fn all_of_the_path_of_a_camera_is_looked_at() {
    let mut scene = room(4e4, lights()[2]);
    scene.meshes.push(quad(Vec3::new(38.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y));
    let still = SceneFacts::of(&scene).bounds;
    let key = |frame, x| CameraKeyframe { frame, eye: [x, 1.3, 4.2], target: [x, 1.0, 0.0], cut: false };
    scene.moves.camera = vec![key(0, 0.0), key(100, 40.0)];
    let [low, high] = SceneFacts::of(&scene).bounds;
    assert!(still[1][0] < 20.0, "{still:?}");
    assert!(low[0] <= -2.0 && high[0] >= 42.0 && high[0] < 100.0, "{low:?} {high:?}");
}

#[test]
fn a_plane_in_grazing_light_does_not_shadow_itself() {
    for azimuth in 0..8 {
        let (sin, cos) = (azimuth as f32 * 0.4 + 0.1).sin_cos();
        for slope in [0.02, 0.1, 0.7] {
            let direction = Vec3::new(cos, -slope, sin);
            let sun = Light::Directional { direction: direction.to_array(), irradiance: [8.0; 3] };
            let ground = quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z);
            let scene = scene(vec![ground], vec![sun], Vec3::new(0.3, 1.5, 2.0), Vec3::ZERO);
            let session = Session::new(device(), &scene).keep_all();
            let mut frames = frames(&session, &request("none", &[("direct.shadow_map_size", "256")], SIZE));
            frames.run(0).unwrap();
            let [depth, direct] = ["depth", "direct"].map(|output| frames.read_rgb(output).unwrap().unwrap());
            let expected = 8.0 * 0.5 / std::f32::consts::PI * slope / (1.0 + slope * slope).sqrt();
            let lit = depth.iter().zip(&direct).filter(|(depth, _)| depth[0] > 0.0).map(|(_, direct)| direct[0]);
            let (least, most) = lit.fold((f32::MAX, 0.0f32), |(least, most), v| (least.min(v), most.max(v)));
            assert!(least > 0.999 * most, "{direction}: {least} {most}");
            // Albedo has eight bits.
            assert!((most / expected - 1.0).abs() < 0.02, "{direction}: {most} {expected}");
        }
    }
}

#[test]
fn no_light_passes_the_seams_of_cube_faces() {
    // A lamp in a closed box inside a larger one. Seen between the two, all is dark. The box is turned, so that light
    // through a seam could reach any of its sides.
    for turn in [0.0f32, 0.3, 0.785] {
        let turned = glam::Quat::from_rotation_y(turn) * glam::Quat::from_rotation_x(0.5 * turn);
        let mut meshes = cube(1.0);
        for position in meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
            *position = (turned * Vec3::from(*position)).to_array();
        }
        for mesh in &mut meshes {
            mesh.normals.iter_mut().for_each(|normal| *normal = (turned * Vec3::from(*normal)).to_array());
        }
        meshes.extend(cube(-4.0));
        let lamp = Light::Point { position: [0.0; 3], intensity: [100.0; 3] };
        let scene = scene(meshes, vec![lamp], Vec3::new(3.5, 3.2, 3.6), Vec3::new(-1.0, -1.0, -1.0));
        let session = Session::new(device(), &scene).keep_all();
        for size in ["64", "256", "1024"] {
            let direct = render(&session, &request("none", &[("direct.shadow_map_size", size)], SIZE), "direct");
            let leaks = direct.iter().filter(|pixel| pixel[0] > 0.0).count();
            assert_eq!(leaks, 0, "{turn} {size}");
        }
    }
}

#[test]
fn the_seams_of_cube_faces_are_not_seen() {
    // A lamp in the middle of an empty box: the light is a closed form everywhere but at the box's edges, where the
    // filter reaches the next wall. The seams of the lamp's faces are there, too, and on diagonals of a turned box.
    let lamp = Light::Point { position: [0.0; 3], intensity: [10.0; 3] };
    let scene = scene(cube(-2.0), vec![lamp], Vec3::new(1.9, 1.7, 1.8), Vec3::new(-2.0, -1.0, -1.2));
    let session = Session::new(device(), &scene).keep_all();
    for size in ["64", "256", "1024"] {
        let mut frames = frames(&session, &request("none", &[("direct.shadow_map_size", size)], SIZE));
        frames.run(0).unwrap();
        let [depth, direct] = ["depth", "direct"].map(|output| frames.read_rgb(output).unwrap().unwrap());
        for (world, direct) in positions(&depth, &scene.camera, SIZE).into_iter().zip(&direct) {
            let world = world.expect("a closed box");
            let texel = 4.0 / size.parse::<f32>().unwrap();
            if world.abs().to_array().iter().filter(|&&side| side > 2.0 - 2.0 * texel).count() > 1 {
                continue;
            }
            let square = world.length_squared();
            let expected = 10.0 * 0.5 / std::f32::consts::PI * 2.0 / (square * square.sqrt());
            assert!((direct[0] / expected - 1.0).abs() < 0.03, "{size} {world}: {}", direct[0] / expected);
        }
    }
}
