//! What leaves the viewer as text: a command line, a preset, a scene file.

use std::fmt::Write;

use halflight_scenes::{Camera, Light, Scene};
use halflight_techniques::preset::Preset;

use crate::state::{Configuration, DROPPED, State};

/// Presets that come with the viewer: a name, and a file that the evaluator reads, too.
pub const PRESETS: [(&str, &str); 4] = [
    ("Default", include_str!("../presets/default.toml")),
    ("Fast", include_str!("../presets/fast.toml")),
    ("Fine", include_str!("../presets/fine.toml")),
    ("As published in 2009", include_str!("../presets/soler2009.toml")),
];

/// Whether the picture is that of the scene's own file.
fn is_as_filed(state: &State) -> bool {
    state.camera.is_none() && state.lights.is_empty() && state.scene != DROPPED
}

/// The scene file that shows the picture's scene: the bundled one, or the one that the viewer saves.
fn scene_path(state: &State) -> String {
    if is_as_filed(state) { format!("scenes/{}.toml", state.scene) } else { format!("{}-view.toml", state.scene) }
}

/// The command that renders the same picture. Where the camera or a light was moved it names the scene file that the
/// viewer saves.
pub fn evaluator_command(state: &State, side: &Configuration) -> String {
    let [width, height] = state.size;
    let mut command = format!("evaluator render --scene {} --technique {}", scene_path(state), side.technique);
    for (key, value) in &side.settings {
        // Writing to a String cannot fail.
        let _ = write!(command, " --set {key}={value}");
    }
    if state.frame != 0 {
        let _ = write!(command, " --frame {}", state.frame);
    }
    if state.seed != 0 {
        let _ = write!(command, " --seed {}", state.seed);
    }
    let _ = write!(command, " --size {width}x{height} --out {}.exr", state.scene);
    command
}

/// The preset of a configuration.
pub fn preset(side: &Configuration) -> Preset {
    Preset { technique: side.technique(), settings: side.settings.clone() }
}

/// Name and contents of a scene file with the camera and lights as they stand. A dropped model is named as it was
/// dropped and has to lie beside the file.
pub fn scene_file(state: &State, scene: &Scene, camera: &Camera) -> (String, String) {
    let model = if state.scene == DROPPED {
        format!("path = \"{}.obj\"", scene.name)
    } else {
        format!("generator = \"{}\"", state.scene)
    };
    let vector = |v: [f32; 3]| format!("[{:?}, {:?}, {:?}]", v[0], v[1], v[2]);
    let mut text = format!(
        "name = \"{}\"\n\n[[model]]\n{model}\n\n[camera]\neye = {}\ntarget = {}\nup = {}\nvertical_fov_degrees = {:?}\n",
        scene.name,
        vector(camera.eye),
        vector(camera.target),
        vector(camera.up),
        camera.vertical_fov_degrees
    );
    for light in &scene.lights {
        let (kind, lines) = match *light {
            Light::Directional { direction, irradiance } => {
                ("directional", format!("direction = {}\nirradiance = {}\n", vector(direction), vector(irradiance)))
            }
            Light::Point { position, intensity } => {
                ("point", format!("position = {}\nintensity = {}\n", vector(position), vector(intensity)))
            }
            Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => (
                "spot",
                format!(
                    "position = {}\ndirection = {}\nintensity = {}\nhalf_angle_degrees = {half_angle_degrees:?}\n\
                     full_intensity_half_angle_degrees = {full_intensity_half_angle_degrees:?}\n",
                    vector(position),
                    vector(direction),
                    vector(intensity)
                ),
            ),
        };
        let _ = write!(text, "\n[[light]]\nkind = \"{kind}\"\n{lines}");
    }
    let mut named = state.clone();
    named.camera = Some(*camera);
    (scene_path(&named), text)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use halflight_renderer::parameters::Value;
    use halflight_scenes::{MemoryFiles, load_scene};

    use super::*;
    use crate::{scenes::bundled, state::LightChange};

    #[test]
    fn presets_are_read() {
        for (name, text) in PRESETS {
            Preset::read(Path::new(name), text).expect("a good preset");
        }
    }

    #[test]
    fn a_command_names_what_was_changed() {
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

    #[test]
    fn a_saved_scene_reads_back() {
        for name in ["cornell", "atrium"] {
            let mut scene = bundled(name).expect("a bundled scene");
            let camera = Camera { eye: [0.1, 2e-7, 3.0], ..scene.camera };
            let mut state = State { scene: name.into(), camera: Some(camera), ..State::default() };
            let change =
                LightChange { direction: [0.25, -1.0, 0.0], strength: 0.5, ..LightChange::none(&scene.lights[0]) };
            state.change_light(0, &scene.lights[0], change);
            scene.lights = state.lights(&scene.lights);
            let (path, text) = scene_file(&state, &scene, &camera);
            assert_eq!(path, format!("{name}-view.toml"));
            let files = MemoryFiles::from_iter([(&path, text.into_bytes())]);
            let read = load_scene(&files, Path::new(&path)).expect("its own file");
            assert_eq!((read.camera, &read.lights), (camera, &scene.lights));
        }
    }
}
