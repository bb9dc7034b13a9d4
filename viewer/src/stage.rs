//! A scene on the device.

use glam::Vec3;
use halflight_frame_graph::Gpu;
use halflight_renderer::scene::{SceneBuffers, SceneFacts};
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
}

impl Stage {
    /// Uploads a scene; `software` tells whether the device is a software adapter.
    pub fn new(gpu: &Gpu, scene: Scene, software: bool) -> Self {
        let (facts, buffers) = (SceneFacts::of(&scene), SceneBuffers::new(gpu, &scene));
        Self { original_lights: scene.lights.clone(), scene, facts, buffers, software }
    }

    /// Updates the lights; false if nothing changed.
    pub fn relight(&mut self, gpu: &Gpu, lights: Vec<Light>) -> bool {
        if lights == self.scene.lights {
            return false;
        }
        self.buffers.relight(gpu, &lights);
        self.scene.lights = lights;
        self.facts = SceneFacts::of(&self.scene);
        true
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

    /// Length of the bounding box's diagonal, scene units.
    pub fn diagonal(&self) -> f32 {
        self.scene.bounds().map_or(1.0, |(low, high)| (high - low).length())
    }
}
