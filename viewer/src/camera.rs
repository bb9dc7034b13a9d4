//! Camera controls: orbit, look, pan, zoom and fly.

use glam::{Quat, Vec3};
use halflight_scenes::Camera;

/// Rotation when the pointer moves by the picture's height, radians.
const TURN: f32 = std::f32::consts::PI;
/// Smallest angle between the view axis and the up vector, radians. Beyond the up vector, left and right would swap.
const POLE: f32 = 0.05;

/// Axes of a camera: right, up and forward, unit length.
struct Axes {
    right: Vec3,
    up: Vec3,
    forward: Vec3,
}

fn axes(camera: &Camera) -> Axes {
    let view = camera.view_matrix().transpose();
    Axes { right: view.x_axis.truncate(), up: view.y_axis.truncate(), forward: -view.z_axis.truncate() }
}

fn distance(camera: &Camera) -> f32 {
    Vec3::from(camera.eye).distance(camera.target.into()).max(f32::MIN_POSITIVE)
}

/// The direction rotated by `drag` (right and down, in picture heights), away from the poles.
fn turned(camera: &Camera, direction: Vec3, drag: [f32; 2]) -> Vec3 {
    let up = Vec3::from(camera.up).normalize_or(Vec3::Y);
    let right = axes(camera).right;
    let about_right = Quat::from_axis_angle(right, -drag[1] * TURN);
    let about_up = Quat::from_axis_angle(up, -drag[0] * TURN);
    let tilted = about_right * direction;
    let angle = tilted.angle_between(up);
    let tilted = if (POLE..std::f32::consts::PI - POLE).contains(&angle) { tilted } else { direction };
    about_up * tilted
}

/// Rotates the eye about the target. `drag` is right and down, in picture heights.
pub fn orbit(camera: &mut Camera, drag: [f32; 2]) {
    let offset = turned(camera, Vec3::from(camera.eye) - Vec3::from(camera.target), drag);
    camera.eye = (Vec3::from(camera.target) + offset).to_array();
}

/// Rotates the target about the eye.
pub fn look(camera: &mut Camera, drag: [f32; 2]) {
    let offset = turned(camera, Vec3::from(camera.target) - Vec3::from(camera.eye), drag.map(|v| 0.5 * v));
    camera.target = (Vec3::from(camera.eye) + offset).to_array();
}

/// Moves eye and target parallel to the picture, so that the target follows the pointer.
pub fn pan(camera: &mut Camera, drag: [f32; 2]) {
    let Axes { right, up, .. } = axes(camera);
    let height = 2.0 * distance(camera) * (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
    shift(camera, (up * drag[1] - right * drag[0]) * height);
}

/// Divides the distance between eye and target by this factor.
pub fn zoom(camera: &mut Camera, factor: f32) {
    let target = Vec3::from(camera.target);
    camera.eye = (target + (Vec3::from(camera.eye) - target) / factor).to_array();
}

/// Moves eye and target by `step` scene units along right, up and forward.
pub fn fly(camera: &mut Camera, step: [f32; 3]) {
    let Axes { right, up, forward } = axes(camera);
    shift(camera, right * step[0] + up * step[1] + forward * step[2]);
}

fn shift(camera: &mut Camera, by: Vec3) {
    camera.eye = (Vec3::from(camera.eye) + by).to_array();
    camera.target = (Vec3::from(camera.target) + by).to_array();
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera =
        Camera { eye: [0.0, 1.0, 4.0], target: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0], vertical_fov_degrees: 90.0 };

    #[test]
    fn an_orbit_keeps_the_distance_and_stays_upright() {
        let mut camera = CAMERA;
        for _ in 0..100 {
            orbit(&mut camera, [0.01, 0.05]);
            assert!((distance(&camera) - 4.0).abs() < 1e-4);
            assert!(axes(&camera).up.y > 0.0);
        }
        // Dragging down raises the eye.
        assert!(camera.eye[1] > 4.5, "{camera:?}");
    }

    #[test]
    fn the_target_follows_the_pointer() {
        let mut camera = CAMERA;
        // A field of view of 90 degrees at a distance of 4 is 8 units high.
        pan(&mut camera, [0.25, 0.0]);
        assert!((camera.target[0] + 2.0).abs() < 1e-5, "{camera:?}");
        pan(&mut camera, [0.0, 0.25]);
        assert!((camera.target[1] - 3.0).abs() < 1e-5, "{camera:?}");
    }

    #[test]
    fn fly_and_zoom_go_forward() {
        let mut camera = CAMERA;
        fly(&mut camera, [1.0, 2.0, 3.0]);
        assert_eq!((camera.eye, camera.target), ([1.0, 3.0, 1.0], [1.0, 3.0, -3.0]));
        zoom(&mut camera, 2.0);
        assert_eq!(camera.eye, [1.0, 3.0, -1.0]);
        look(&mut camera, [1.0, 0.0]);
        // The target is now two units away; one picture height rotates by 90 degrees to the right.
        assert!(Vec3::from(camera.target).distance(Vec3::new(3.0, 3.0, -1.0)) < 1e-5, "{camera:?}");
    }
}
