//! Keyframes in scene files, valid and invalid.

use halflight_scenes::{CameraKeyframe, Keyframe, Motion, Scene, SceneNeeds};

use crate::{TRIANGLE, assert_says, load, refusal};

const CAMERA: &str = "[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n";
const MODEL: &str = "[[model]]\npath = \"m.obj\"\n";
const SUN: &str = "[[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
const POINT: &str = "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n";

fn scene(toml: &str) -> Scene {
    load(&[("s.toml", toml.as_bytes()), ("m.obj", TRIANGLE.as_bytes())], "s.toml")
}

/// A static model, an animated one, an animated one that only receives light, a camera path with a cut, extra cameras, an
/// environment, and two animated lights.
pub fn animated() -> Scene {
    scene(&format!(
        "{MODEL}{MODEL}transform = {{ translate = [1, 2, 3], scale = 2 }}\n\
         moves = [{{ frame = 0 }}, {{ frame = 60, translate = [0.5, 0, 0], rotate_degrees = [0, 90, 0], scale = 1.5 }}]\n\
         {MODEL}receive_only = true\npivot = [0.1, 0, 0]\nmoves = [{{ frame = 3, scale = [1, 2, 3] }}]\n\
         {CAMERA}vertical_fov_degrees = 33.3\nmoves = [{{ frame = 0, eye = [0, 0, 5], target = [0, 0, 0] }}, \
         {{ frame = 9, eye = [1e-3, 0, 4], target = [0, 0.1, 0], cut = true }}]\n\
         {SUN}moves = [{{ frame = 0 }}, {{ frame = 10, rotate_degrees = [10, 0, 0] }}]\n{SUN}{POINT}\
         [[light.moves]]\nframe = 5\ntranslate = [0, 0, 1]\n{EXTRA}[environment]\nradiance = [0.1, 0.2, 1e-7]\n"
    ))
}

#[test]
fn keyframes_are_read() {
    let scene = animated();
    let objects = scene.meshes.iter().map(|mesh| mesh.object).collect::<Vec<_>>();
    assert_eq!(objects, [None, Some(0), Some(1)]);
    let rest = Keyframe::default();
    let last = Keyframe { frame: 60, translate: [0.5, 0.0, 0.0], rotate_degrees: [0.0, 90.0, 0.0], scale: [1.5; 3] };
    // Rotation is about the model's origin unless a pivot is given.
    assert_eq!(scene.moves.objects[0], Motion { pivot: [1.0, 2.0, 3.0], keyframes: vec![rest, last] });
    let third = Keyframe { frame: 3, scale: [1.0, 2.0, 3.0], ..rest };
    assert_eq!(scene.moves.objects[1], Motion { pivot: [0.1, 0.0, 0.0], keyframes: vec![third] });
    let receive_only = scene.meshes.iter().map(|mesh| scene.materials[mesh.material].receive_only).collect::<Vec<_>>();
    assert_eq!(receive_only, [false, false, true]);
    let cut = CameraKeyframe { frame: 9, eye: [1e-3, 0.0, 4.0], target: [0.0, 0.1, 0.0], cut: true };
    assert_eq!(scene.moves.camera[1], cut);
    assert_eq!(scene.moves.lights.iter().map(|(light, _)| *light).collect::<Vec<_>>(), [0, 2]);
    let needs = SceneNeeds::of(&scene);
    assert!(needs.moving_objects == 2 && needs.moving_lights && needs.receive_only, "{needs:?}");
}

#[test]
fn a_static_scene_has_no_animation() {
    let fixed = scene(&format!("{MODEL}receive_only = false\n{CAMERA}{SUN}"));
    assert!(fixed.moves.is_empty());
    assert_eq!((fixed.moves.last_frame(), fixed.posed(7)), (0, fixed.clone()));
    let needs = SceneNeeds::of(&fixed);
    assert!(needs.moving_objects == 0 && !needs.moving_lights && !needs.receive_only, "{needs:?}");
}

/// Extra cameras.
const EXTRA: &str = "
[[extra_camera]]
eye = [3.0, 1.0, 0.5]
target = [0.0, 1.0, 0.0]
[[extra_camera]]
eye = [0.0, 4.0, 0.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
vertical_fov_degrees = 90.0
";

#[test]
fn extra_cameras_are_cameras() {
    let cameras = scene(&format!("{MODEL}{CAMERA}{EXTRA}{SUN}")).extra_cameras;
    assert_eq!((cameras.len(), cameras[0].eye, cameras[0].vertical_fov_degrees), (2, [3.0, 1.0, 0.5], 60.0));
    assert_eq!((cameras[1].up, cameras[1].vertical_fov_degrees), ([0.0, 0.0, 1.0], 90.0));
    assert!(scene(&format!("{MODEL}{CAMERA}{SUN}")).extra_cameras.is_empty());
}

#[test]
fn invalid_keyframes_are_refused_with_line_key_and_fix() {
    for (toml, line, parts) in [
        (format!("{MODEL}moves = []\n"), 3, ["`model.moves` is empty", "{ frame = 0 }"]),
        (format!("{MODEL}moves = 3\n"), 3, ["`model.moves` is 3", "array of tables"]),
        (format!("{MODEL}moves = [{{ translate = [0, 0, 0] }}]\n"), 3, ["`moves.frame` is missing", "frame = 0"]),
        (format!("{MODEL}moves = [{{ frame = 1.5 }}]\n"), 3, ["`moves.frame` is 1.5", "whole number"]),
        (format!("{MODEL}moves = [{{ frame = 2 }}, {{ frame = 2 }}]\n"), 3, ["`moves.frame` is 2", "ascending frame"]),
        (format!("{MODEL}moves = [{{ frame = 2, translte = [0, 0, 0] }}]\n"), 3, ["`moves.translte`", "`translate`?"]),
        (format!("{MODEL}moves = [{{ frame = 2, scale = -1 }}]\n"), 3, ["`moves.scale`", "above 0"]),
        (format!("{MODEL}pivot = [0, 0, 0]\n"), 3, ["`model.pivot`", "without `moves`"]),
        (format!("{MODEL}recieve_only = true\n"), 3, ["`model.recieve_only`", "did you mean `receive_only`?"]),
        (format!("{MODEL}receive_only = 1\n"), 3, ["`model.receive_only` is 1", "`true` or `false`"]),
        (
            format!("{SUN}moves = [{{ frame = 0, translate = [1, 0, 0] }}]\n"),
            5,
            ["`moves.translate`", "`rotate_degrees`"],
        ),
        (format!("{POINT}moves = [{{ frame = 0, scale = 2 }}]\n"), 5, ["`moves.scale`", "`translate`"]),
        (
            format!("{CAMERA}moves = [{{ frame = 0, eye = [0, 0, 0] }}]\n"),
            4,
            ["`moves.target` is missing", "target = ["],
        ),
        (
            format!("{CAMERA}moves = [{{ frame = 0, eye = [0, 0, 0], target = [0, 0, 0] }}]\n"),
            4,
            ["`moves.target`", "different from"],
        ),
    ] {
        let sentence = refusal(&[("s.toml", toml.as_bytes()), ("m.obj", TRIANGLE.as_bytes())], "s.toml");
        assert_says(&sentence, &[&format!("s.toml:{line}:"), parts[0], parts[1]]);
    }
}
