//! Playing an animation: the current frame, or a rotating light in a static scene.

use glam::{Quat, Vec3};
use halflight_scenes::Light;
use web_time::Instant;

use crate::state::LightChange;

/// Angular speed of the rotating light, radians per second.
const SPEED: f32 = 0.4;
/// Longest step of the rotating light, seconds, so that it does not jump if frames are slow.
const LONGEST_STEP: f32 = 0.1;
/// Frames for which an animation stays at its last frame before it starts again.
const PAUSE: u32 = 12;

/// The animation while it plays.
#[derive(Clone, Copy, Debug)]
pub struct Playing {
    /// Frame number.
    pub frame: u32,
    /// Angle of the first light in a static scene, radians.
    pub angle: f32,
    /// Time of the last step.
    stepped: Instant,
}

impl Playing {
    /// Starts at this frame.
    pub fn start(frame: u32) -> Self {
        Self { frame, angle: 0.0, stepped: Instant::now() }
    }

    /// The next frame. An animation with a `last` frame starts again after it.
    pub fn step(self, last: Option<u32>) -> Self {
        let seconds = self.stepped.elapsed().as_secs_f32().min(LONGEST_STEP);
        let frame = match last {
            Some(last) if self.frame >= last.saturating_add(PAUSE) => 0,
            _ => self.frame.wrapping_add(1),
        };
        Self { frame, angle: self.angle + SPEED * seconds, stepped: Instant::now() }
    }
}

/// The change that rotates a light by this angle about the vertical: its direction, or for a point light its position
/// about `centre`.
pub fn rotated(light: &Light, angle: f32, centre: Vec3) -> LightChange {
    let mut change = LightChange::none(light);
    let rotation = Quat::from_rotation_y(angle);
    if let Light::Point { position, .. } = light {
        change.position = (centre + rotation * (Vec3::from(*position) - centre)).to_array();
    } else {
        change.direction = (rotation * Vec3::from(change.direction)).to_array();
    }
    change
}
