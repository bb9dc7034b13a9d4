//! Animation as data: keyframes of models, lights and the camera.

use glam::{EulerRot, Mat4, Quat, Vec3};
use serde::{Deserialize, Serialize};

/// A keyframe of an animated model or light. Numbers between two keyframes are interpolated linearly; before the first
/// keyframe and after the last one they are constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Frame number.
    pub frame: u32,
    /// Translation from the rest position, scene units.
    pub translate: [f32; 3],
    /// Rotations about the fixed axes x, then y, then z, degrees; more than one revolution is allowed.
    pub rotate_degrees: [f32; 3],
    /// Factors along the axes, above 0.
    pub scale: [f32; 3],
}

impl Default for Keyframe {
    fn default() -> Self {
        Self { frame: 0, translate: [0.0; 3], rotate_degrees: [0.0; 3], scale: [1.0; 3] }
    }
}

/// The motion of a model or a light.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// World position, in the rest pose, of the fixed point of rotation and scale.
    pub pivot: [f32; 3],
    /// At least one, by ascending frame.
    pub keyframes: Vec<Keyframe>,
}

/// A keyframe of an animated camera; interpolated like [`Keyframe`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraKeyframe {
    /// Frame number.
    pub frame: u32,
    /// World position of the eye.
    pub eye: [f32; 3],
    /// World position that the camera looks at.
    pub target: [f32; 3],
    /// A cut: the camera stays at the previous keyframe until this frame and jumps here. Nothing of the previous frame
    /// is reused.
    pub cut: bool,
}

/// The animation of a scene; empty for a static one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moves {
    /// Motions of models; [`crate::Mesh::object`] refers to them by index.
    pub objects: Vec<Motion>,
    /// Motions of lights, each with its index into [`crate::Scene::lights`]. `translate` moves a light's position,
    /// `rotate_degrees` rotates its direction.
    pub lights: Vec<(usize, Motion)>,
    /// The path of the camera, by ascending frame.
    pub camera: Vec<CameraKeyframe>,
}

/// The keyframes around a frame and the weight of the second one, 0..1.
pub(crate) fn around<K: Copy>(keyframes: &[K], frame: u32, at: impl Fn(&K) -> u32) -> Option<(K, K, f32)> {
    let next = keyframes.partition_point(|key| at(key) <= frame);
    let (before, after) = (keyframes.get(next.saturating_sub(1))?, keyframes.get(next).or(keyframes.last())?);
    let (start, end) = (at(before), at(after));
    let weight = if frame > start && end > start { (frame - start) as f32 / (end - start) as f32 } else { 0.0 };
    Some((*before, *after, weight))
}

/// Linear interpolation.
pub(crate) fn mix(a: [f32; 3], b: [f32; 3], weight: f32) -> [f32; 3] {
    Vec3::from(a).lerp(b.into(), weight).to_array()
}

/// Rotations about the fixed axes x, then y, then z.
pub(crate) fn rotation(degrees: [f32; 3]) -> Quat {
    let [x, y, z] = degrees.map(f32::to_radians);
    Quat::from_euler(EulerRot::ZYX, z, y, x)
}

impl Motion {
    /// The interpolated keyframe of a frame.
    pub fn at(&self, frame: u32) -> Keyframe {
        let Some((a, b, weight)) = around(&self.keyframes, frame, |key| key.frame) else {
            return Keyframe { frame, ..Keyframe::default() };
        };
        Keyframe {
            frame,
            translate: mix(a.translate, b.translate, weight),
            rotate_degrees: mix(a.rotate_degrees, b.rotate_degrees, weight),
            scale: mix(a.scale, b.scale, weight),
        }
    }

    /// World space of the rest pose to world space at this frame: scale and rotation about the pivot, then translation.
    pub fn matrix(&self, frame: u32) -> Mat4 {
        let key = self.at(frame);
        let pivot = Vec3::from(self.pivot);
        let from_pivot = Mat4::from_scale_rotation_translation(
            key.scale.into(),
            rotation(key.rotate_degrees),
            pivot + Vec3::from(key.translate),
        );
        from_pivot * Mat4::from_translation(-pivot)
    }

    /// Bounds over the whole motion of a box given by its bounds. Rotation is covered by a bounding sphere.
    pub fn swept(&self, low: Vec3, high: Vec3) -> (Vec3, Vec3) {
        let pivot = Vec3::from(self.pivot);
        let reach = (low - pivot).abs().max((high - pivot).abs()).length();
        let rotates = self.keyframes.iter().any(|key| key.rotate_degrees != [0.0; 3]);
        // Centres and sizes are linear between keyframes, so the union of the keyframes' boxes is enough.
        self.keyframes.iter().fold((low, high), |(a, b), key| {
            let (centre, scale) = (pivot + Vec3::from(key.translate), Vec3::from(key.scale));
            let (from, to) = if rotates {
                let radius = Vec3::splat(reach * scale.max_element());
                (centre - radius, centre + radius)
            } else {
                (centre + scale * (low - pivot), centre + scale * (high - pivot))
            };
            (a.min(from), b.max(to))
        })
    }
}

impl Moves {
    /// Whether nothing is animated.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && self.lights.is_empty() && self.camera.is_empty()
    }

    /// The last keyframe's frame number; 0 for a static scene.
    pub fn last_frame(&self) -> u32 {
        let motions = self.objects.iter().chain(self.lights.iter().map(|(_, motion)| motion));
        let last = motions.filter_map(|motion| motion.keyframes.last()).map(|key| key.frame);
        last.chain(self.camera.last().map(|key| key.frame)).max().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_linear_between_keyframes_and_constant_outside() {
        let key = |frame, x, degrees, scale| Keyframe {
            frame,
            translate: [x, 0.0, 0.0],
            rotate_degrees: [0.0, degrees, 0.0],
            scale: [scale; 3],
        };
        let motion = Motion { pivot: [0.0; 3], keyframes: vec![key(10, 1.0, 0.0, 1.0), key(20, 3.0, 90.0, 2.0)] };
        for (frame, x, degrees, scale) in
            [(0, 1.0, 0.0, 1.0), (10, 1.0, 0.0, 1.0), (15, 2.0, 45.0, 1.5), (20, 3.0, 90.0, 2.0), (99, 3.0, 90.0, 2.0)]
        {
            assert_eq!(motion.at(frame), key(frame, x, degrees, scale));
        }
    }
}
