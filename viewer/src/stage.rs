//! A scene on the device.

use glam::Vec3;
use halflight_frame_graph::Gpu;
use halflight_renderer::{
    gi::TextureFilter,
    scene::{SceneBuffers, SceneFacts, Sight},
};
use halflight_scenes::{Camera, Light, Scene};

/// A scene on a device.
pub struct Stage {
    /// The scene with its current lights.
    pub scene: Scene,
    /// The lights of the scene file.
    pub original_lights: Vec<Light>,
    /// What a plan depends on.
    pub facts: SceneFacts,
    /// The scene's buffers.
    pub buffers: SceneBuffers,
    /// Whether the device is a software adapter.
    pub software: bool,
    sight: Sight,
    /// The camera that the facts were last checked for.
    looked_from: Option<Camera>,
}

/// Motion of the camera after which the facts are checked, as a share of what is looked at, and rotation, radians.
const MOVED: f32 = 1.0 / 32.0;
const ROTATED: f32 = 0.1;

impl Stage {
    /// Uploads a scene that the device can hold ([`SceneSize::check`](halflight_renderer::scene::SceneSize::check)).
    /// `software` tells whether the device is a software adapter.
    pub fn new(gpu: &Gpu, scene: Scene, software: bool) -> Self {
        let sight = Sight::new(&scene);
        let facts = SceneFacts::within(&scene, sight.extent(&[scene.camera]));
        let buffers = SceneBuffers::new(gpu, &scene);
        Self { original_lights: scene.lights.clone(), scene, facts, buffers, software, sight, looked_from: None }
    }

    /// How textures are read in pictures and in the reference, unless a setting says otherwise. Means over pixels take two to
    /// three times as long to draw on software adapters.
    pub fn texture_filter(&self) -> TextureFilter {
        if self.software { TextureFilter::Bilinear } else { TextureFilter::Mips }
    }

    /// Updates the lights; false if nothing changed.
    pub fn relight(&mut self, gpu: &Gpu, lights: Vec<Light>) -> bool {
        if lights == self.scene.lights {
            return false;
        }
        self.buffers.relight(gpu, &lights);
        self.scene.lights = lights;
        self.facts = SceneFacts::within(&self.scene, self.facts.extent);
        true
    }

    /// Updates the sizes of maps and voxels to what this camera looks at, after it has moved or turned enough.
    pub fn look_from(&mut self, camera: Camera) {
        let (low, high) = self.facts.extent.focus;
        let close = |before: &Camera| {
            let eyes = Vec3::from(camera.eye).distance(before.eye.into());
            let axis = |camera: &Camera| (Vec3::from(camera.target) - Vec3::from(camera.eye)).normalize_or_zero();
            let turned = axis(&camera).dot(axis(before)) < ROTATED.cos();
            eyes <= MOVED * low.distance(high) && !turned && camera.vertical_fov_degrees == before.vertical_fov_degrees
        };
        if self.looked_from.as_ref().is_some_and(close) {
            return;
        }
        self.looked_from = Some(camera);
        let cameras: Vec<Camera> = [camera].into_iter().chain(self.scene.extra_cameras.iter().copied()).collect();
        let extent = self.sight.extent(&cameras);
        if extent != self.facts.extent {
            self.facts.resize(&self.scene, extent);
        }
    }

    /// The scene's own camera at a frame.
    pub fn camera(&self, frame: u32) -> Camera {
        if self.is_animated() { self.scene.pose(frame).camera } else { self.scene.camera }
    }

    /// Whether the scene is animated.
    pub fn is_animated(&self) -> bool {
        !self.scene.moves.is_empty()
    }

    /// Centre of the bounding box, world space.
    pub fn centre(&self) -> Vec3 {
        self.scene.bounds().map_or(Vec3::ZERO, |(low, high)| 0.5 * (low + high))
    }

    /// Length of the diagonal of what is looked at, scene units.
    pub fn diagonal(&self) -> f32 {
        let (low, high) = self.facts.extent.focus;
        low.distance(high)
    }
}
