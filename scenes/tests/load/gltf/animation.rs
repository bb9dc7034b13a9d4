//! Animated nodes of glTF models.

use std::path::Path;

use glam::Vec3;
use halflight_scenes::{MemoryFiles, Scene, load_scene, write_scene};

use super::maker::{Maker, bare, triangle};
use crate::assert_warns;

/// The triangle on a turned child of an animated node.
fn animated(path: &str, kind: &str, values: &[[f32; 4]], child: &str) -> Scene {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let times = maker.floats(&[[0.0], [1.0]]);
    let output = if path == "rotation" {
        maker.floats(values)
    } else {
        maker.floats(&values.iter().map(|v| [v[0], v[1], v[2]]).collect::<Vec<_>>())
    };
    bare(&maker.glb(&format!(
        r#"{meshes},"scenes":[{{"nodes":[0,2]}}],"nodes":[{{"children":[1],"translation":[0,0,5]}},{{"mesh":0{child}}},{{"mesh":0,"name":"fixed"}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"{path}"}}}}],
        "samplers":[{{"input":{times},"output":{output},"interpolation":"{kind}"}}]}}]"#
    )))
}

#[test]
fn animated_nodes_become_moves() {
    let scene = animated("translation", "LINEAR", &[[0.0, 0.0, 5.0, 0.0], [3.0, 0.0, 5.0, 0.0]], "");
    assert_eq!(scene.warnings, [""; 0]);
    assert_eq!(scene.meshes.iter().map(|mesh| mesh.object).collect::<Vec<_>>(), [Some(0), None]);
    let motion = &scene.moves.objects[0];
    // Two keyframes, 30 frames a second.
    assert_eq!(motion.keyframes.iter().map(|key| key.frame).collect::<Vec<_>>(), [0, 30]);
    let at = |frame| scene.pose(frame).objects[0].transform_point3(Vec3::new(0.0, 0.0, 5.0));
    assert_eq!([at(0), at(10), at(99)].map(|p| p.x), [0.0, 1.0, 3.0]);

    let step = animated("translation", "STEP", &[[0.0, 0.0, 5.0, 0.0], [3.0, 0.0, 5.0, 0.0]], "");
    let at = |frame| step.pose(frame).objects[0].transform_point3(Vec3::ZERO).x;
    assert_eq!([at(0), at(29), at(30)], [0.0, 0.0, 3.0]);

    // A quarter turn about the parent's y axis, which goes through z = 5; the child is 1 to the right of it.
    let half = 0.5_f32.sqrt();
    let turned = animated(
        "rotation",
        "LINEAR",
        &[[0.0, 0.0, 0.0, 1.0], [0.0, half, 0.0, half]],
        r#","translation":[1,0,0],"scale":[2,3,1]"#,
    );
    assert_eq!(turned.warnings, [""; 0]);
    let child = turned.meshes[0].positions[0];
    assert_eq!(child, [1.0, 0.0, 5.0]);
    for (frame, degrees) in [(0, 0.0_f32), (10, 30.0), (15, 45.0), (30, 90.0)] {
        let found = turned.pose(frame).objects[0].transform_point3(child.into());
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Matrices in float32.
        assert!(found.distance(Vec3::new(cos, 0.0, 5.0 - sin)) < 1e-4, "{frame}: {found}");
    }
    let grown = animated("scale", "LINEAR", &[[1.0; 4], [3.0; 4]], "");
    assert_eq!(grown.pose(15).objects[0].transform_point3(Vec3::new(1.0, 0.0, 5.0)), Vec3::new(2.0, 0.0, 5.0));
    // A turned child of a node that stretches would be sheared.
    let sheared =
        animated("scale", "LINEAR", &[[1.0; 4], [3.0, 1.0, 1.0, 0.0]], r#","rotation":[0,0,0.3826834,0.9238795]"#);
    assert!(sheared.moves.objects[0].keyframes.len() > 1, "factors along the world's axes are exact");
    let mirrored = animated("scale", "LINEAR", &[[1.0; 4], [-1.0, 1.0, 1.0, 0.0]], "");
    assert!(mirrored.moves.is_empty());
    assert_warns(&mirrored, &["m.glb:", "mirror", "rest pose"]);
    // Float32 has no such positions, and no factors between such sizes.
    let far = animated("translation", "LINEAR", &[[0.0; 4], [3e38; 4]], r#","scale":[9,9,9]"#);
    let grown = animated("scale", "LINEAR", &[[1e-30; 4], [3e38; 4]], "");
    for scene in [far, grown] {
        assert!(scene.moves.is_empty(), "{:?}", scene.moves);
        assert_warns(&scene, &["m.glb:", "out of range", "rest pose"]);
    }
}

#[test]
fn an_animated_model_reads_back_after_it_was_written() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let times = maker.floats(&[[0.0], [1.0]]);
    let output = maker.floats(&[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]);
    let glb = maker.glb(&format!(
        r#"{meshes},"scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0}},{{"mesh":0,"name":"fixed"}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],
        "samplers":[{{"input":{times},"output":{output}}}]}}]"#
    ));
    let scene = bare(&glb);
    let files: MemoryFiles =
        write_scene(&scene, "again").expect("valid").into_iter().chain([("m.glb".into(), glb)]).collect();
    let again = load_scene(&files, Path::new("again.toml")).expect("it was written");
    assert_eq!((again.meshes, again.moves), (scene.meshes, scene.moves));
}

#[test]
fn cameras_and_lights_move_with_their_nodes() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let times = maker.floats(&[[0.0], [1.0]]);
    let path = maker.floats(&[[0.0, 0.0, 4.0], [3.0, 0.0, 4.0]]);
    let half = 0.5_f32.sqrt();
    let turn = maker.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, half, 0.0, half]]);
    let glb = maker.glb(&format!(
        r#"{meshes},"extensionsUsed":["KHR_lights_punctual"],"scenes":[{{"nodes":[0,1]}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":2,"spot":{{"outerConeAngle":0.5}}}}]}}}},
        "nodes":[{{"mesh":0}},{{"children":[2,3],"translation":[0,0,4]}},{{"camera":0}},
            {{"translation":[0,1,0],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
        "animations":[{{"channels":[{{"sampler":0,"target":{{"node":1,"path":"translation"}}}},{{"sampler":1,"target":{{"node":3,"path":"rotation"}}}}],
        "samplers":[{{"input":{times},"output":{path}}},{{"input":{times},"output":{turn}}}]}}]"#
    ));
    let scene = bare(&glb);
    assert_eq!(scene.warnings, [""; 0]);
    assert!(scene.moves.objects.is_empty(), "the mesh is static");
    for (frame, x, degrees) in [(0, 0.0, 0.0_f32), (10, 1.0, 30.0), (30, 3.0, 90.0), (99, 3.0, 90.0)] {
        let pose = scene.pose(frame);
        // Numbers in float32.
        let near = |a: [f32; 3], b: [f32; 3]| assert!(Vec3::from(a).distance(b.into()) < 1e-4, "{frame}: {a:?} {b:?}");
        near(pose.camera.eye, [x, 0.0, 4.0]);
        near(pose.camera.target, [x, 0.0, 3.0]);
        let halflight_scenes::Light::Spot { position, direction, .. } = pose.lights[0] else {
            panic!("{:?}", pose.lights)
        };
        near(position, [x, 1.0, 4.0]);
        let (sin, cos) = degrees.to_radians().sin_cos();
        near(direction, [-sin, 0.0, -cos]);
    }
    let files: MemoryFiles =
        write_scene(&scene, "again").expect("valid").into_iter().chain([("m.glb".into(), glb)]).collect();
    let again = load_scene(&files, Path::new("again.toml")).expect("it was written");
    assert_eq!((again.camera, again.lights, again.moves), (scene.camera, scene.lights, scene.moves));
}
