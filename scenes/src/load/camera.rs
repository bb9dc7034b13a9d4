//! A camera of a model.

use glam::{DMat4, DVec3};

use crate::Camera;

/// A camera whose position has the digits of float64.
pub(super) struct View {
    eye: DVec3,
    forward: DVec3,
    up: DVec3,
    vertical_fov_degrees: f32,
}

impl View {
    /// The camera of a node: it looks along -z. `None` if the node's axes vanish.
    pub fn of_node(to_world: DMat4, vertical_fov_degrees: f32) -> Option<Self> {
        Some(Self {
            eye: to_world.w_axis.truncate(),
            forward: (-to_world.z_axis.truncate()).try_normalize()?,
            up: to_world.y_axis.truncate().try_normalize()?,
            vertical_fov_degrees,
        })
    }

    /// The camera relative to `origin`. Its target is one unit ahead.
    pub fn relative_to(&self, origin: DVec3) -> Camera {
        let eye = self.eye - origin;
        Camera {
            eye: eye.as_vec3().to_array(),
            target: (eye + self.forward).as_vec3().to_array(),
            up: self.up.as_vec3().to_array(),
            vertical_fov_degrees: self.vertical_fov_degrees,
        }
    }
}
