//! What moves in a scene: keyframes as data, and the pose that they give a frame.

use glam::{EulerRot, Mat3, Mat4, Quat, Vec3};

use crate::{Camera, Light, Scene};

/// A place in time of a moving model or light. Between two keyframes every number is interpolated
/// linearly; before the first and after the last one the motion rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// Number of the frame.
    pub frame: u32,
    /// Way from the place at rest, scene units.
    pub translate: [f32; 3],
    /// Turns about the fixed axes x, then y, then z, degrees; more than one turn is allowed.
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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// World position, at rest, of the point that turning and scaling leave in place.
    pub pivot: [f32; 3],
    /// At least one, by ascending frame.
    pub keyframes: Vec<Keyframe>,
}

/// A place in time of a moving camera; interpolated like [`Keyframe`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraKeyframe {
    /// Number of the frame.
    pub frame: u32,
    /// World position of the eye.
    pub eye: [f32; 3],
    /// World position that the camera looks at.
    pub target: [f32; 3],
    /// A cut: the camera rests at the keyframe before until this frame, and nothing of the frame
    /// before is reused in it.
    pub cut: bool,
}

/// Everything that moves in a scene; empty for a still one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moves {
    /// Motions of models; [`crate::Mesh::object`] refers to them by index.
    pub objects: Vec<Motion>,
    /// Lights that move, by index into [`Scene::lights`]: a position moves by `translate`, a
    /// direction turns by `rotate_degrees`.
    pub lights: Vec<(usize, Motion)>,
    /// The path of the camera, by ascending frame.
    pub camera: Vec<CameraKeyframe>,
}

/// What moves, at one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// World at rest to world at this frame, for each of [`Moves::objects`].
    pub objects: Vec<Mat4>,
    /// Every light of the scene.
    pub lights: Vec<Light>,
    /// The camera.
    pub camera: Camera,
    /// Whether the camera cuts to this frame: the one before says nothing about it.
    pub cut: bool,
}

/// The keyframes around a frame and the share of the second one, 0..1.
fn around<K: Copy>(keyframes: &[K], frame: u32, at: impl Fn(&K) -> u32) -> Option<(K, K, f32)> {
    let next = keyframes.partition_point(|key| at(key) <= frame);
    let (before, after) = (keyframes.get(next.saturating_sub(1))?, keyframes.get(next).or(keyframes.last())?);
    let (start, end) = (at(before), at(after));
    let share = if frame > start && end > start { (frame - start) as f32 / (end - start) as f32 } else { 0.0 };
    Some((*before, *after, share))
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    Vec3::from(a).lerp(b.into(), share).to_array()
}

impl Motion {
    /// The interpolated keyframe of a frame.
    pub fn at(&self, frame: u32) -> Keyframe {
        let Some((a, b, share)) = around(&self.keyframes, frame, |key| key.frame) else {
            return Keyframe { frame, ..Keyframe::default() };
        };
        Keyframe {
            frame,
            translate: mix(a.translate, b.translate, share),
            rotate_degrees: mix(a.rotate_degrees, b.rotate_degrees, share),
            scale: mix(a.scale, b.scale, share),
        }
    }

    /// World at rest to world at this frame: scaled, then turned about the pivot, then translated.
    pub fn matrix(&self, frame: u32) -> Mat4 {
        let key = self.at(frame);
        let pivot = Vec3::from(self.pivot);
        let placed = Mat4::from_scale_rotation_translation(
            key.scale.into(),
            rotation(key.rotate_degrees),
            pivot + Vec3::from(key.translate),
        );
        placed * Mat4::from_translation(-pivot)
    }

    /// Corners of a box around `low..high` over the whole motion. Turning is covered by a sphere.
    fn swept(&self, low: Vec3, high: Vec3) -> (Vec3, Vec3) {
        let pivot = Vec3::from(self.pivot);
        let reach = (low - pivot).abs().max((high - pivot).abs()).length();
        let turns = self.keyframes.iter().any(|key| key.rotate_degrees != [0.0; 3]);
        // Centres and sizes are linear between keyframes, so the keyframes' boxes hold all between.
        self.keyframes.iter().fold((low, high), |(a, b), key| {
            let (centre, scale) = (pivot + Vec3::from(key.translate), Vec3::from(key.scale));
            let (from, to) = if turns {
                let radius = Vec3::splat(reach * scale.max_element());
                (centre - radius, centre + radius)
            } else {
                (centre + scale * (low - pivot), centre + scale * (high - pivot))
            };
            (a.min(from), b.max(to))
        })
    }
}

/// Turns about the fixed axes x, y and z, in this order.
pub(crate) fn rotation(degrees: [f32; 3]) -> Quat {
    let [x, y, z] = degrees.map(f32::to_radians);
    Quat::from_euler(EulerRot::ZYX, z, y, x)
}

fn moved_light(light: Light, key: &Keyframe) -> Light {
    let place = |position: [f32; 3]| (Vec3::from(position) + Vec3::from(key.translate)).to_array();
    let turn = |direction: [f32; 3]| (rotation(key.rotate_degrees) * Vec3::from(direction)).to_array();
    match light {
        Light::Directional { direction, irradiance } => Light::Directional { direction: turn(direction), irradiance },
        Light::Point { position, intensity } => Light::Point { position: place(position), intensity },
        Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
            Light::Spot {
                position: place(position),
                direction: turn(direction),
                intensity,
                half_angle_degrees,
                full_intensity_half_angle_degrees,
            }
        }
    }
}

impl Moves {
    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && self.lights.is_empty() && self.camera.is_empty()
    }

    /// The last frame at which something moves; 0 for a still scene.
    pub fn last_frame(&self) -> u32 {
        let models = self.objects.iter().chain(self.lights.iter().map(|(_, motion)| motion));
        let last = models.filter_map(|motion| motion.keyframes.last()).map(|key| key.frame);
        last.chain(self.camera.last().map(|key| key.frame)).max().unwrap_or_default()
    }
}

impl Scene {
    /// What moves, at this frame.
    pub fn pose(&self, frame: u32) -> Pose {
        let mut lights = self.lights.clone();
        for (index, motion) in &self.moves.lights {
            if let Some(light) = lights.get_mut(*index) {
                *light = moved_light(*light, &motion.at(frame));
            }
        }
        let mut camera = self.camera;
        let mut cut = false;
        if let Some((a, b, share)) = around(&self.moves.camera, frame, |key| key.frame) {
            let share = if b.cut { 0.0 } else { share };
            (camera.eye, camera.target) = (mix(a.eye, b.eye, share), mix(a.target, b.target, share));
            cut = self.moves.camera.iter().any(|key| key.cut && key.frame == frame);
        }
        let objects = self.moves.objects.iter().map(|motion| motion.matrix(frame)).collect();
        Pose { objects, lights, camera, cut }
    }

    /// The still scene that this one is at a frame: what a path tracer sees.
    pub fn posed(&self, frame: u32) -> Scene {
        let mut scene = self.clone();
        if self.moves.is_empty() {
            return scene;
        }
        let Pose { objects, lights, camera, .. } = self.pose(frame);
        (scene.lights, scene.camera) = (lights, camera);
        for mesh in &mut scene.meshes {
            let Some(matrix) = mesh.object.take().and_then(|object| objects.get(object)) else { continue };
            for position in &mut mesh.positions {
                *position = matrix.transform_point3((*position).into()).to_array();
            }
            let normal_matrix = Mat3::from_mat4(*matrix).inverse().transpose();
            for normal in &mut mesh.normals {
                *normal = (normal_matrix * Vec3::from(*normal)).normalize_or(Vec3::Y).to_array();
            }
        }
        scene.moves = Moves::default();
        scene
    }

    /// Corners of an axis-aligned box around all vertices at every frame; `None` for an empty scene.
    pub fn swept_bounds(&self) -> Option<(Vec3, Vec3)> {
        self.meshes.iter().fold(None, |bounds, mesh| {
            let points = mesh.positions.iter().map(|&p| Vec3::from(p));
            let own = points.fold(None, |bounds: Option<(Vec3, Vec3)>, p| {
                let (low, high) = bounds.unwrap_or((p, p));
                Some((low.min(p), high.max(p)))
            });
            let motion = mesh.object.and_then(|object| self.moves.objects.get(object));
            let own = own.map(|(low, high)| motion.map_or((low, high), |motion| motion.swept(low, high)));
            match (bounds, own) {
                (Some((a, b)), Some((low, high))) => Some((low.min(a), high.max(b))),
                (one, other) => one.or(other),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    fn key(frame: u32, x: f32, degrees: f32, scale: f32) -> Keyframe {
        Keyframe { frame, translate: [x, 0.0, 0.0], rotate_degrees: [0.0, degrees, 0.0], scale: [scale; 3] }
    }

    /// A unit step of a mesh at (1, 0, 0) that turns about its corner at the origin.
    fn scene(keyframes: Vec<Keyframe>) -> Scene {
        Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0; 3], [1.0, 0.0, 0.0]],
                normals: vec![[1.0, 0.0, 0.0]; 2],
                object: Some(0),
                ..Mesh::default()
            }],
            moves: Moves { objects: vec![Motion { pivot: [0.0; 3], keyframes }], ..Moves::default() },
            ..Scene::default()
        }
    }

    #[test]
    fn numbers_are_linear_between_keyframes_and_rest_outside() {
        let motion = Motion { pivot: [0.0; 3], keyframes: vec![key(10, 1.0, 0.0, 1.0), key(20, 3.0, 90.0, 2.0)] };
        for (frame, x, degrees, scale) in
            [(0, 1.0, 0.0, 1.0), (10, 1.0, 0.0, 1.0), (15, 2.0, 45.0, 1.5), (20, 3.0, 90.0, 2.0), (99, 3.0, 90.0, 2.0)]
        {
            assert_eq!(motion.at(frame), key(frame, x, degrees, scale));
        }
    }

    #[test]
    fn a_point_goes_where_its_motion_says() {
        // Twice as large, a quarter turn about +y (x goes to -z), then 3 along x.
        let posed = scene(vec![key(0, 0.0, 0.0, 1.0), key(8, 3.0, 90.0, 2.0)]).posed(8);
        let [x, y, z] = posed.meshes[0].positions[1];
        // Roundings of a sine and a product near 3.
        assert!((Vec3::new(x, y, z) - Vec3::new(3.0, 0.0, -2.0)).length() < 1e-6, "{x} {y} {z}");
        let normal = Vec3::from(posed.meshes[0].normals[0]);
        assert!((normal - Vec3::NEG_Z).length() < 1e-6, "{normal}");
        assert!(posed.moves.is_empty() && posed.meshes[0].object.is_none());
    }

    #[test]
    fn the_swept_box_holds_every_frame() {
        let scene = scene(vec![key(0, 0.0, 0.0, 1.0), key(7, 2.0, 500.0, 0.5), key(20, -3.0, 0.0, 2.0)]);
        let (low, high) = scene.swept_bounds().expect("it has vertices");
        for frame in 0..22 {
            let (a, b) = scene.posed(frame).bounds().expect("it has vertices");
            // Roundings of coordinates around 4.
            assert!(a.cmpge(low - 1e-5).all() && b.cmple(high + 1e-5).all(), "frame {frame}: {a} {b} in {low} {high}");
        }
    }

    #[test]
    fn a_camera_rests_until_a_cut() {
        let at = |frame, x, cut| CameraKeyframe { frame, eye: [x, 0.0, 0.0], target: [x, 0.0, -1.0], cut };
        let camera = vec![at(0, 0.0, false), at(4, 4.0, false), at(6, 100.0, true), at(8, 102.0, false)];
        let scene = Scene { moves: Moves { camera, ..Moves::default() }, ..Scene::default() };
        let seen: Vec<_> = (0..10).map(|frame| scene.pose(frame)).map(|p| (p.camera.eye[0], p.cut)).collect();
        let eyes = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 100.0, 101.0, 102.0, 102.0];
        assert_eq!(seen, std::array::from_fn::<_, 10, _>(|i| (eyes[i], i == 6)));
    }

    #[test]
    fn lights_move_and_turn() {
        let light = Light::Spot {
            position: [1.0, 2.0, 3.0],
            direction: [1.0, 0.0, 0.0],
            intensity: [1.0; 3],
            half_angle_degrees: 40.0,
            full_intensity_half_angle_degrees: 30.0,
        };
        let motion = Motion { pivot: [0.0; 3], keyframes: vec![key(0, 0.0, 0.0, 1.0), key(10, 5.0, 90.0, 1.0)] };
        let moves = Moves { lights: vec![(0, motion)], ..Moves::default() };
        let scene = Scene { lights: vec![light], moves, ..Scene::default() };
        let Light::Spot { position, direction, .. } = scene.pose(10).lights[0] else { panic!("still a spot") };
        assert_eq!(position, [6.0, 2.0, 3.0]);
        assert!((Vec3::from(direction) - Vec3::NEG_Z).length() < 1e-6, "{direction:?}");
        assert_eq!(scene.moves.last_frame(), 10);
    }
}
