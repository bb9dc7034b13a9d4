//! Facts about a scene that a plan needs, without geometry or device.

use halflight_scenes::{Camera, Scene, SceneNeeds};

use super::{
    EmittingTriangle, ShadowLayer,
    emitters::emitting_triangles,
    shadow::{shadow_bounds, shadow_layers},
};

/// Facts about a scene that a plan needs, without geometry or device.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFacts {
    /// Features that the scene requires.
    pub needs: SceneNeeds,
    /// Its shadow map layers in the first frame.
    pub shadow_layers: Vec<ShadowLayer>,
    /// One word per material: 1 if it receives indirect light but sends none. Empty if no material does.
    pub receive_only: Vec<u32>,
    /// Extra cameras, which see light that the display's camera does not.
    pub extra_cameras: Vec<Camera>,
    /// Near plane of its cameras, scene units.
    pub near: f32,
    /// Lower and upper corner of its bounding box, over all frames, world space; a unit cube for an empty scene.
    pub bounds: [[f32; 3]; 2],
    /// Number of triangles.
    pub triangles: u32,
    /// Whether only surfaces that the camera sees send light in reflective shadow maps. Used to separate errors of
    /// light from the screen from errors of light from off the screen.
    pub only_seen_surfaces_send: bool,
    /// Triangles that emit light and send it on.
    pub emitters: Vec<EmittingTriangle>,
}

impl SceneFacts {
    /// Collects the facts.
    pub fn of(scene: &Scene) -> Self {
        let bounds = scene.swept_bounds();
        let diagonal = bounds.map_or(1.0, |(low, high)| (high - low).length());
        // Reversed depth is precise at all distances, so the near plane may be close. It only has to stay above zero.
        let near = (diagonal * 1e-4).max(f32::MIN_POSITIVE * 1e10);
        let bounds = bounds.map_or([[0.0; 3], [1.0; 3]], |(low, high)| [low.to_array(), high.to_array()]);
        let needs = SceneNeeds::of(scene);
        let flags = scene.materials.iter().map(|material| u32::from(material.receive_only));
        let receive_only = if needs.receive_only { flags.collect() } else { Vec::new() };
        let shadow_layers = shadow_layers(&scene.pose(0).lights, shadow_bounds(scene));
        let extra_cameras = scene.extra_cameras.clone();
        let triangles = scene.triangle_count() as u32;
        let emitters = emitting_triangles(scene);
        Self {
            needs,
            shadow_layers,
            receive_only,
            extra_cameras,
            near,
            bounds,
            triangles,
            only_seen_surfaces_send: false,
            emitters,
        }
    }

    /// Whether some mesh is animated.
    pub fn animated(&self) -> bool {
        self.needs.moving_objects > 0
    }

    /// Whether some mesh is solid (encloses a volume).
    pub fn solid_meshes(&self) -> bool {
        self.needs.watertight_meshes > 0
    }

    /// Whether some mesh is neither solid nor alpha-masked.
    pub fn open_meshes(&self) -> bool {
        self.needs.open_meshes > self.needs.alpha_masked_meshes
    }
}
