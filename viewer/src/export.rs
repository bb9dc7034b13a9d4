//! What a user takes from the viewer: a command line, a preset, a scene file.

use halflight_scenes::{Scene, SceneError, write_scene};
use halflight_techniques::{invocation::Invocation, preset::Preset};

use crate::state::{Configuration, DROPPED, State};

/// Built-in presets: a name, and the contents of a preset file. The viewer shows those of the technique that is chosen.
pub const PRESETS: [(&str, &str); 7] = [
    ("Low", include_str!("../presets/radiance-cache-low.toml")),
    ("Medium", include_str!("../presets/radiance-cache-medium.toml")),
    ("High", include_str!("../presets/radiance-cache-high.toml")),
    ("Default", include_str!("../presets/default.toml")),
    ("Fast", include_str!("../presets/fast.toml")),
    ("Fine", include_str!("../presets/fine.toml")),
    ("As published in 2009", include_str!("../presets/soler2009.toml")),
];

/// The built-in presets of a technique.
pub fn presets_of(technique: &str) -> Vec<(&'static str, Preset)> {
    // A test reads every preset, so none is left out.
    let read = |(name, text): (&'static str, &str)| Some((name, Preset::read(name.as_ref(), text).ok()?));
    PRESETS.into_iter().filter_map(read).filter(|(_, preset)| preset.technique.name == technique).collect()
}

/// Whether the picture shows the bundled scene file unchanged.
fn is_unchanged(state: &State) -> bool {
    state.camera.is_none() && state.lights.is_empty() && state.scene != DROPPED
}

/// Name of a saved scene, without extension.
fn saved_name(state: &State) -> String {
    format!("{}-view", state.scene)
}

/// The scene file of the picture: the bundled one, or the one that the viewer saves.
fn scene_path(state: &State) -> String {
    if is_unchanged(state) { format!("scenes/{}.toml", state.scene) } else { format!("{}.toml", saved_name(state)) }
}

/// The command that renders the same picture. If the camera or a light was changed, it uses the scene file that the
/// viewer saves.
pub fn evaluator_command(state: &State, side: &Configuration) -> String {
    let technique = side.technique();
    Invocation::render(scene_path(state), technique.name, &side.settings, state.size)
        .option_unless("frame", state.frame, 0)
        .option_unless("seed", state.seed, 0)
        .option("out", format_args!("{}.exr", state.scene))
        .to_string()
}

/// The preset of a configuration.
pub fn preset(side: &Configuration) -> Preset {
    Preset { technique: side.technique(), settings: side.settings.clone() }
}

/// The files of the scene with the camera and the lights of the state; the scene file is first. It refers to models
/// as the original scene file does, so it belongs into the same folder.
///
/// # Errors
/// Those of [`write_scene`].
pub fn scene_files(state: &State, scene: &Scene) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let mut saved = scene.clone();
    if let Some(camera) = state.camera {
        saved.camera = camera;
        // The user's camera replaces the path of the scene's own camera.
        saved.moves.camera.clear();
    }
    write_scene(&saved, &saved_name(state))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use halflight_renderer::parameters::Value;
    use halflight_scenes::{Camera, MemoryFiles, load_scene};

    use super::*;
    use crate::state::LightChange;
    use halflight_scenes::bundled::scene as bundled;

    #[test]
    fn presets_can_be_read() {
        for (name, text) in PRESETS {
            Preset::read(Path::new(name), text).expect("a valid preset");
        }
    }

    #[test]
    fn a_command_has_all_settings() {
        let mut state = State { size: [1280, 720], ..State::default() };
        state.sides[0].set("hierarchical.samples", Value::Int(16));
        assert_eq!(
            evaluator_command(&state, &state.sides[0]),
            "evaluator render --scene scenes/cornell.toml --technique hierarchical --set hierarchical.samples=16 \
             --size 1280x720 --out cornell.exr"
        );
        state.camera = Some(Camera::default());
        assert!(evaluator_command(&state, &state.sides[0]).contains("--scene cornell-view.toml"));
    }

    /// A scene file with everything that a scene file can hold.
    const EVERYTHING: &str = "
name = 'everything'
[[model]]
generator = 'motion'
transform = { translate = [-0.6, 0.75, 0.45] }
moves = [{ frame = 0 }, { frame = 40, translate = [1.2, 0.0, 0.0] }]
[[model]]
path = 'room.obj'
receive_only = true
[camera]
eye = [0.0, 1.0, 3.9]
target = [0.0, 1.0, 0.0]
moves = [{ frame = 0, eye = [0.0, 1.0, 3.9], target = [0.0, 1.0, 0.0] }]
[[extra_camera]]
eye = [2.0, 1.0, 3.9]
target = [0.0, 1.0, 0.0]
[[light]]
kind = 'point'
position = [0.0, 1.0, 0.0]
intensity = [1.0, 1.0, 1.0]
moves = [{ frame = 3, translate = [1.0, 0.0, 0.0] }]
[environment]
radiance = [0.1, 0.1, 0.1]
";
    const ROOM: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn opened(name: &str, text: &[u8]) -> Scene {
        let files = [(name, text), ("room.obj", ROOM.as_bytes())];
        load_scene(&MemoryFiles::from_iter(files), Path::new(name)).expect("a scene file that can be opened")
    }

    /// Saves the scene of a state, opens it again, and returns it with its name.
    fn saved(state: &State, scene: &Scene) -> (String, Scene) {
        let files = scene_files(state, scene).expect("a scene that can be saved");
        let [(name, text)] = files.as_slice() else { panic!("{} files instead of one", files.len()) };
        (name.clone(), opened(name, text))
    }

    #[test]
    fn a_saved_scene_is_equal() {
        let motion = bundled("motion").expect("a bundled scene");
        for (name, scene) in [("motion", motion), (DROPPED, opened("everything.toml", EVERYTHING.as_bytes()))] {
            let state = State { scene: name.into(), frame: 7, ..State::default() };
            let (file, read) = saved(&state, &scene);
            assert_eq!(file, format!("{name}-view.toml"));
            assert!(read == scene, "{name} is not equal after saving");
        }
    }

    #[test]
    fn a_saved_scene_has_the_camera_and_the_lights_of_the_state() {
        for name in ["cornell", "atrium", "motion"] {
            let mut scene = bundled(name).expect("a bundled scene");
            let camera = Camera { eye: [0.1, 2e-7, 3.0], ..scene.camera };
            let mut state = State { scene: name.into(), camera: Some(camera), ..State::default() };
            let change =
                LightChange { direction: [0.25, -1.0, 0.0], strength: 0.5, ..LightChange::none(&scene.lights[0]) };
            state.change_light(0, &scene.lights[0], change);
            scene.lights = state.lights(&scene.lights);
            let (_, read) = saved(&state, &scene);
            assert_eq!((read.pose(20).camera, &read.lights), (camera, &scene.lights));
            scene.camera = camera;
            scene.moves.camera.clear();
            assert!(read == scene, "{name} is not equal after saving");
        }
    }
}
