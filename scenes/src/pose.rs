//! The scene at one frame of its animation.

use glam::{Mat3, Mat4, Vec3};

use crate::data::{Camera, Light, Scene};
use crate::moves::{Keyframe, Moves, around, mix, rotation};

/// The animated parts of a scene at one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// World space of the rest pose to world space at this frame, for each of [`Moves::objects`].
    pub objects: Vec<Mat4>,
    /// All lights of the scene.
    pub lights: Vec<Light>,
    /// The camera.
    pub camera: Camera,
    /// Whether the camera cuts to this frame, so that the previous frame must not be reused.
    pub cut: bool,
}

fn moved_light(light: Light, key: &Keyframe) -> Light {
    let translated = |position: [f32; 3]| (Vec3::from(position) + Vec3::from(key.translate)).to_array();
    let rotated = |direction: [f32; 3]| (rotation(key.rotate_degrees) * Vec3::from(direction)).to_array();
    match light {
        Light::Directional { direction, irradiance } => {
            Light::Directional { direction: rotated(direction), irradiance }
        }
        Light::Point { position, intensity } => Light::Point { position: translated(position), intensity },
        Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
            Light::Spot {
                position: translated(position),
                direction: rotated(direction),
                intensity,
                half_angle_degrees,
                full_intensity_half_angle_degrees,
            }
        }
    }
}

impl Scene {
    /// The animated parts at this frame.
    pub fn pose(&self, frame: u32) -> Pose {
        let mut lights = self.lights.clone();
        for (index, motion) in &self.moves.lights {
            if let Some(light) = lights.get_mut(*index) {
                *light = moved_light(*light, &motion.at(frame));
            }
        }
        let mut camera = self.camera;
        let mut cut = false;
        if let Some((a, b, weight)) = around(&self.moves.camera, frame, |key| key.frame) {
            let weight = if b.cut { 0.0 } else { weight };
            (camera.eye, camera.target) = (mix(a.eye, b.eye, weight), mix(a.target, b.target, weight));
            cut = self.moves.camera.iter().any(|key| key.cut && key.frame == frame);
        }
        let objects = self.moves.objects.iter().map(|motion| motion.matrix(frame)).collect();
        Pose { objects, lights, camera, cut }
    }

    /// The static scene that this one is at a frame: what a path tracer renders.
    pub fn posed(&self, frame: u32) -> Scene {
        let mut scene = self.clone();
        if self.moves.is_empty() {
            return scene;
        }
        let Pose { objects, lights, camera, .. } = self.pose(frame);
        (scene.lights, scene.camera) = (lights, camera);
        for mesh in &mut scene.meshes {
            let Some(matrix) = mesh.object.take().and_then(|object| objects.get(object)) else { continue };
            // The mesh is no longer what its model's file or generator gives.
            mesh.model = None;
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

    /// Axis-aligned bounding box of all vertices over all frames as (low, high); `None` for an empty scene.
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
    use crate::{CameraKeyframe, Mesh, Motion};

    fn key(frame: u32, x: f32, degrees: f32, scale: f32) -> Keyframe {
        Keyframe { frame, translate: [x, 0.0, 0.0], rotate_degrees: [0.0, degrees, 0.0], scale: [scale; 3] }
    }

    /// A mesh with vertices at the origin and at (1, 0, 0), with its pivot at the origin.
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
    fn a_vertex_follows_its_motion() {
        // Scaled by 2, rotated by 90 degrees about +y (x goes to -z), then moved by 3 along x.
        let posed = scene(vec![key(0, 0.0, 0.0, 1.0), key(8, 3.0, 90.0, 2.0)]).posed(8);
        let [x, y, z] = posed.meshes[0].positions[1];
        // Rounding of a sine and of a product near 3.
        assert!((Vec3::new(x, y, z) - Vec3::new(3.0, 0.0, -2.0)).length() < 1e-6, "{x} {y} {z}");
        let normal = Vec3::from(posed.meshes[0].normals[0]);
        assert!((normal - Vec3::NEG_Z).length() < 1e-6, "{normal}");
        assert!(posed.moves.is_empty() && posed.meshes[0].object.is_none());
    }

    #[test]
    fn swept_bounds_contain_every_frame() {
        let scene = scene(vec![key(0, 0.0, 0.0, 1.0), key(7, 2.0, 500.0, 0.5), key(20, -3.0, 0.0, 2.0)]);
        let (low, high) = scene.swept_bounds().expect("it has vertices");
        for frame in 0..22 {
            let (a, b) = scene.posed(frame).bounds().expect("it has vertices");
            // Rounding of coordinates around 4.
            assert!(a.cmpge(low - 1e-5).all() && b.cmple(high + 1e-5).all(), "frame {frame}: {a} {b} in {low} {high}");
        }
    }

    #[test]
    fn the_camera_stays_until_a_cut() {
        let at = |frame, x, cut| CameraKeyframe { frame, eye: [x, 0.0, 0.0], target: [x, 0.0, -1.0], cut };
        let camera = vec![at(0, 0.0, false), at(4, 4.0, false), at(6, 100.0, true), at(8, 102.0, false)];
        let scene = Scene { moves: Moves { camera, ..Moves::default() }, ..Scene::default() };
        let seen: Vec<_> = (0..10).map(|frame| scene.pose(frame)).map(|p| (p.camera.eye[0], p.cut)).collect();
        let eyes = [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 100.0, 101.0, 102.0, 102.0];
        assert_eq!(seen, std::array::from_fn::<_, 10, _>(|i| (eyes[i], i == 6)));
    }

    #[test]
    fn lights_translate_and_rotate() {
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
