//! Models far from the origin.

use halflight_scenes::{Light, MemoryFiles, Scene, load_scene, write_scene};

use crate::{assert_says, assert_warns, load};

/// A step of 1 by 0.5 at a position, with decimals that float32 cannot hold far away.
fn step(at: [f64; 3]) -> String {
    let corners =
        [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0], [0.5, 0.5, -0.25], [-0.5, 0.5, -0.25]];
    let line = |c: [f64; 3]| format!("v {:.6} {:.6} {:.6}\n", at[0] + c[0], at[1] + c[1], at[2] + c[2]);
    corners.map(line).concat() + "f 1 2 3 4\nf 4 3 5 6\n"
}

fn settings(at: [f64; 3]) -> String {
    let shifted = |p: [f64; 3]| format!("[{:?}, {:?}, {:?}]", at[0] + p[0], at[1] + p[1], at[2] + p[2]);
    format!(
        "[camera]\neye = {}\ntarget = {}\nmoves = [{{ frame = 2, eye = {}, target = {} }}]\n\
         [[extra_camera]]\neye = {}\ntarget = {}\n\
         [[light]]\nkind = \"point\"\nposition = {}\nintensity = [1, 1, 1]\n\
         [[light]]\nkind = \"spot\"\nposition = {}\ndirection = [0, -1, 0]\nintensity = [1, 1, 1]\nhalf_angle_degrees = 30\n",
        shifted([0.5, 0.25, 4.125]),
        shifted([0.5, 0.25, 0.0]),
        shifted([1.0, 0.0, 3.0]),
        shifted([0.0; 3]),
        shifted([2.0, 0.0, 1.0]),
        shifted([0.0; 3]),
        shifted([0.0, 2.5, 0.0]),
        shifted([0.25, 2.0, 0.0]),
    )
}

fn scene(at: [f64; 3], model: &str) -> Scene {
    let toml = format!("[[model]]\npath = \"m.obj\"\n{model}{}", settings(at));
    load(&[("s.toml", toml.as_bytes()), ("m.obj", step(at).as_bytes())], "s.toml")
}

const FAR: [f64; 3] = [500_000.0, 0.0, 4_649_776.0];

/// The scene without what names its origin.
fn relative(scene: Scene) -> Scene {
    Scene { origin: [0.0; 3], warnings: vec![], ..scene }
}

#[test]
fn a_far_scene_equals_the_same_scene_at_the_origin() {
    let far = scene(FAR, "");
    assert_eq!(far.origin, FAR);
    assert_warns(&far, &["s.toml:", "far from the origin", "[500000, 0, 4649776]"]);
    let near = scene([0.0; 3], "");
    assert_eq!((near.origin, near.warnings.len()), ([0.0; 3], 0));
    assert_eq!(relative(far), relative(near));
}

#[test]
fn shapes_survive_at_any_distance() {
    for at in [[13_487_434.76, -6.4, -3_741_689.4], [1e7, 1e7, 1e7], [-2e9, 0.0, 5.5]] {
        let far = load(&[("m.obj", step(at).as_bytes())], "m.obj");
        let near = load(&[("m.obj", step([0.0; 3]).as_bytes())], "m.obj");
        assert_warns(&far, &["m.obj:", "far from the origin"]);
        for (mesh, wanted) in far.meshes.iter().zip(&near.meshes) {
            for (position, wanted) in mesh.positions.iter().zip(&wanted.positions) {
                for i in 0..3 {
                    let error = f64::from(position[i]) + far.origin[i] - at[i] - f64::from(wanted[i]);
                    // Half a step of float64 at 2e9, the rounding of the text to 6 digits, and float32 beside the model.
                    assert!(error.abs() < 2e-6, "{at:?}: {error}");
                }
            }
        }
    }
}

#[test]
fn a_near_scene_is_left_alone() {
    let at = [998.0, 0.0, -1002.0];
    let near = load(&[("m.obj", (step(at) + "v 1002 3 -998\nf 1 2 7\n").as_bytes())], "m.obj");
    assert_eq!((near.origin, near.warnings.len()), ([0.0; 3], 0));
    assert_eq!(near.meshes[0].positions[0], [997.5, 0.0, -1002.0]);
}

#[test]
fn a_transform_may_bring_a_model_back_or_away() {
    let toml = |translate: &str| {
        format!("[[model]]\npath = \"m.obj\"\ntransform = {{ translate = {translate} }}\n{}", settings([0.0; 3]))
    };
    let back = toml("[-500000, 0, -4649776]");
    let back = load(&[("s.toml", back.as_bytes()), ("m.obj", step(FAR).as_bytes())], "s.toml");
    let near = scene([0.0; 3], "");
    assert_eq!((back.meshes, back.origin, back.warnings.len()), (near.meshes.clone(), [0.0; 3], 0));
    let away = toml("[500000, 0, 4649776]");
    let away = load(&[("s.toml", away.as_bytes()), ("m.obj", step([0.0; 3]).as_bytes())], "s.toml");
    assert_eq!((away.meshes, away.origin), (near.meshes, FAR));
    // The light stands where the file says, far from the model.
    let Light::Point { position, .. } = away.lights[0] else { panic!("{:?}", away.lights) };
    assert_eq!(position, [-500_000.0, 2.5, -4_649_776.0]);
}

#[test]
fn two_models_share_one_origin() {
    let toml = format!("[[model]]\npath = \"m.obj\"\n[[model]]\npath = \"n.obj\"\n{}", settings(FAR));
    let other = [FAR[0] + 3.0, FAR[1], FAR[2] - 2.0];
    let files = [("s.toml", toml.as_bytes()), ("m.obj", &step(FAR).into_bytes()), ("n.obj", &step(other).into_bytes())];
    let scene = load(&files, "s.toml");
    let first = |i: usize| scene.meshes[i].positions[0];
    let distance: Vec<_> = (0..3).map(|i| first(1)[i] - first(0)[i]).collect();
    assert_eq!(distance, [3.0, 0.0, -2.0]);
}

#[test]
fn a_far_scene_reads_back_after_it_was_written() {
    let moves = "moves = [{ frame = 0 }, { frame = 4, translate = [0.5, 0, 0] }]\n";
    let turns = "pivot = [500000.5, 0, 4649776]\nmoves = [{ frame = 4, rotate_degrees = [0, 90, 0] }]\n";
    for model in ["", moves, turns] {
        let mut far = scene(FAR, model);
        let toml = write_scene(&far, "again").expect("a good scene").remove(0).1;
        let files: [(&str, &[u8]); 2] = [("again.toml", &toml), ("m.obj", &step(FAR).into_bytes())];
        let read = load(&files, "again.toml");
        far.warnings.clear();
        assert_eq!(Scene { warnings: vec![], ..read }, far, "{}", String::from_utf8_lossy(&toml));
    }
    // Meshes made in memory are written where they stand.
    let mut made = scene(FAR, "");
    made.meshes.iter_mut().for_each(|mesh| mesh.model = None);
    let files: MemoryFiles = write_scene(&made, "made").expect("a good scene").into_iter().collect();
    let read = load_scene(&files, "made.toml".as_ref()).expect("it was written");
    assert_eq!(read.origin, FAR);
    assert_eq!(read.meshes[0].positions, made.meshes[0].positions);
    assert_says(&read.warnings[0], &["made.toml", "far from the origin"]);
}
