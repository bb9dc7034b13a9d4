//! A scene on the device.

use glam::Vec3;
use halflight_frame_graph::Gpu;
use halflight_renderer::{
    gi::TextureFilter,
    scene::{BvhError, SceneBuffers, SceneBvh, SceneFacts, Sight},
};
use halflight_scenes::{Camera, Light, Scene};

use crate::loading::Loaded;

/// An animated scene in one frame.
struct Posed {
    frame: u32,
    scene: Scene,
    buffers: SceneBuffers,
}

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
    /// Why there is no BVH and will be none.
    bvh_error: Option<BvhError>,
    /// An animated scene as it is in one frame, for the path tracer.
    posed: Option<Posed>,
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
    /// A scene whose BVH is still being built. `software` tells whether the device is a software adapter.
    pub fn new(loaded: Loaded, software: bool) -> Self {
        let Loaded { scene, needs, sight, buffers } = loaded;
        let facts = SceneFacts::with_needs(&scene, needs, sight.extent(&[scene.camera]));
        Self {
            original_lights: scene.lights.clone(),
            scene,
            facts,
            buffers,
            bvh_error: None,
            posed: None,
            software,
            sight,
            looked_from: None,
        }
    }

    /// Uses the BVH of the scene, or keeps why there is none.
    pub fn set_bvh(&mut self, bvh: Result<Box<SceneBvh>, BvhError>) {
        match bvh {
            Ok(bvh) => self.buffers.set_bvh(*bvh),
            Err(error) => self.bvh_error = Some(error),
        }
    }

    /// Whether the BVH was built.
    ///
    /// # Errors
    /// Why it cannot be built.
    pub fn has_bvh(&self) -> Result<bool, &BvhError> {
        self.bvh_error.as_ref().map_or_else(|| Ok(self.buffers.has_bvh()), Err)
    }

    /// Uses the scene as it is in a frame, with its BVH, for the path tracer.
    pub fn set_posed(&mut self, gpu: &Gpu, frame: u32, loaded: Loaded, bvh: SceneBvh) {
        let Loaded { scene, buffers, .. } = loaded;
        buffers.set_bvh(bvh);
        self.posed = Some(Posed { frame, scene, buffers });
        self.relight_posed(gpu);
    }

    /// The frame of the last [`Self::set_posed`].
    pub fn posed_frame(&self) -> Option<u32> {
        self.posed.as_ref().map(|posed| posed.frame)
    }

    /// The scene of a frame as the path tracer needs it; `None` while its BVH is being built.
    pub fn traceable(&self, frame: u32) -> Option<(&Scene, &SceneBuffers)> {
        if self.is_animated() {
            let posed = self.posed.as_ref().filter(|posed| posed.frame == frame)?;
            return Some((&posed.scene, &posed.buffers));
        }
        self.buffers.has_bvh().then_some((&self.scene, &self.buffers))
    }

    fn relight_posed(&mut self, gpu: &Gpu) {
        if let Some(posed) = &mut self.posed {
            posed.scene.lights = self.scene.pose(posed.frame).lights;
            posed.buffers.relight(gpu, &posed.scene.lights);
        }
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
        let extent = self.facts.extent;
        self.facts.resize(&self.scene, extent);
        self.relight_posed(gpu);
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
