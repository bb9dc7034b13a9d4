//! A camera of a model.

use glam::{DMat4, DVec3};

use crate::{Camera, CameraKeyframe};

/// A camera whose position has the digits of float64.
pub(super) struct View {
    eye: DVec3,
    forward: DVec3,
    up: DVec3,
    vertical_fov_degrees: f32,
    /// Eye and target at some frames; empty for a static camera.
    pub path: Vec<(u32, [DVec3; 2])>,
}

impl View {
    /// The camera of a node: it looks along -z. `None` if the node's axes vanish.
    pub fn of_node(to_world: DMat4, vertical_fov_degrees: f32) -> Option<Self> {
        Some(Self {
            eye: to_world.w_axis.truncate(),
            forward: (-to_world.z_axis.truncate()).try_normalize()?,
            up: to_world.y_axis.truncate().try_normalize()?,
            vertical_fov_degrees,
            path: Vec::new(),
        })
    }

    /// Its position, and a position one unit ahead.
    pub fn eye_and_target(&self) -> [DVec3; 2] {
        [self.eye, self.eye + self.forward]
    }

    /// The keyframes of its path, relative to `origin`.
    pub fn moves(&self, origin: DVec3) -> Vec<CameraKeyframe> {
        let keyframe = |&(frame, positions): &(u32, [DVec3; 2])| {
            let [eye, target] = positions.map(|position| (position - origin).as_vec3().to_array());
            CameraKeyframe { frame, eye, target, cut: false }
        };
        self.path.iter().map(keyframe).collect()
    }

    /// The camera relative to `origin`. Its target is one unit ahead.
    pub fn relative_to(&self, origin: DVec3) -> Camera {
        let [eye, target] = self.eye_and_target().map(|position| (position - origin).as_vec3().to_array());
        Camera { eye, target, up: self.up.as_vec3().to_array(), vertical_fov_degrees: self.vertical_fov_degrees }
    }
}
