//! Motion that is added to a static scene, so that a frame of a moving view can be compared with the static reference.

use std::fmt;

use clap::ValueEnum;
use glam::Vec3;
use halflight_scenes::{CameraKeyframe, Keyframe, Motion, Scene};

/// Sideways motion of the camera in a frame, relative to the distance to its target.
const CAMERA_STEP: f32 = 0.002;
/// Rotation of the lights about the vertical axis before they are turned.
const TURN_DEGREES: f32 = 30.0;
/// Frames before the lights are turned.
const FRAMES_BEFORE_TURN: u32 = 120;

/// What moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Moving {
    /// Nothing.
    #[default]
    Nothing,
    /// The camera moves sideways by 0.2 % of the distance to its target in each frame, and is where the scene has it in the
    /// frame that is shown.
    Camera,
    /// The lights turn by 30 degrees after 120 frames, to where the scene has them. Frames are counted from then on.
    Lights,
}

impl fmt::Display for Moving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Every variant is a value of the command line.
        f.write_str(self.to_possible_value().as_ref().map_or("", |value| value.get_name()))
    }
}

impl Moving {
    /// The motion of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::from_str(name, false).ok()
    }

    /// A static scene with this motion, and the number of its frames before those that are counted. The camera arrives in
    /// counted frame `last`, from 1.
    pub fn apply(self, mut scene: Scene, last: u32) -> (Scene, u32) {
        let last = last.max(1);
        match self {
            Self::Nothing => (scene, 0),
            Self::Camera => {
                let (eye, target) = (Vec3::from(scene.camera.eye), Vec3::from(scene.camera.target));
                let along = (target - eye).cross(scene.camera.up.into()).normalize() * eye.distance(target);
                let key = |frame: u32| {
                    let offset = along * (CAMERA_STEP * (last - 1 - frame) as f32);
                    let [eye, target] = [eye, target].map(|point| (point + offset).into());
                    CameraKeyframe { frame, eye, target, cut: false }
                };
                scene.moves.camera = vec![key(0), key(last - 1)];
                (scene, 0)
            }
            Self::Lights => {
                let key =
                    |frame, degrees| Keyframe { frame, rotate_degrees: [0.0, degrees, 0.0], ..Keyframe::default() };
                let keyframes =
                    vec![key(0, TURN_DEGREES), key(FRAMES_BEFORE_TURN - 1, TURN_DEGREES), key(FRAMES_BEFORE_TURN, 0.0)];
                scene.moves.lights = (0..scene.lights.len())
                    .map(|light| (light, Motion { keyframes: keyframes.clone(), ..Motion::default() }))
                    .collect();
                (scene, FRAMES_BEFORE_TURN)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use halflight_scenes::bundled;

    use super::*;

    #[test]
    fn what_moves_arrives_in_the_frame_that_is_shown() {
        let scene = bundled::scene("atrium").unwrap();
        for last in [1, 2, 32] {
            let (moved, before) = Moving::Camera.apply(scene.clone(), last);
            assert_eq!((before, moved.pose(last - 1).camera), (0, scene.camera));
            // 0.2 % of the distance to the target in each frame before.
            let distance = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).distance(b.into());
            let step = 0.002 * distance(scene.camera.eye, scene.camera.target);
            let away = distance(moved.pose(0).camera.eye, scene.camera.eye);
            assert!((away - step * (last - 1) as f32).abs() <= 1e-5 * distance(scene.camera.eye, [0.0; 3]), "{away}");
        }
        let (moved, before) = Moving::Lights.apply(scene.clone(), 8);
        assert_eq!(before, 120);
        let at_rest = scene.pose(0).lights;
        assert_ne!(moved.pose(before - 1).lights, at_rest);
        assert_eq!(moved.pose(before).lights, at_rest);
        assert_eq!(Moving::Nothing.apply(scene.clone(), 8).0.moves.is_empty(), scene.moves.is_empty());
    }

    #[test]
    fn names_are_those_of_the_command_line() {
        let names: Vec<String> = Moving::value_variants().iter().map(Moving::to_string).collect();
        assert_eq!(names, ["nothing", "camera", "lights"]);
        for moving in Moving::value_variants() {
            assert_eq!(Moving::of_name(&moving.to_string()), Some(*moving));
        }
        assert_eq!(Moving::of_name("sun"), None);
    }
}
