//! Facts about a scene that a plan needs, without geometry or device.

use glam::Vec3;
use halflight_scenes::{Camera, Scene, SceneNeeds, check_length};

use super::{
    EmittingTriangle, Extent, SceneSize, ShadowLayer,
    contrast::is_uneven,
    emitters::emitting_triangles,
    shadow::{far_shadow_layers, shadow_layers},
};
use crate::parameters::SettingsError;

/// Facts about a scene that a plan needs, without geometry or device.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFacts {
    /// Features that the scene requires.
    pub needs: SceneNeeds,
    /// Its shadow map layers in the first frame. Reflective shadow maps have the same views.
    pub shadow_layers: Vec<ShadowLayer>,
    /// Coarser shadow map layers of directional lights, for surfaces outside of the finer ones.
    pub far_shadow_layers: Vec<ShadowLayer>,
    /// One word per material: 1 if it receives indirect light but sends none. Empty if no material does.
    pub receive_only: Vec<u32>,
    /// Extra cameras, which see light that the display's camera does not.
    pub extra_cameras: Vec<Camera>,
    /// Near plane of its cameras, scene units.
    pub near: f32,
    /// Lower and upper corner of what is looked at, world space: of everything over all frames, unless the cameras look
    /// at a much smaller part. A unit cube for an empty scene.
    pub bounds: [[f32; 3]; 2],
    /// The boxes that sizes of shadow maps depend on.
    pub extent: Extent,
    /// Number of triangles.
    pub triangles: u32,
    /// Sizes of its buffers on a device.
    pub size: SceneSize,
    /// Whether only surfaces that the camera sees send light in reflective shadow maps. Used to separate errors of
    /// light from the screen from errors of light from off the screen.
    pub only_seen_surfaces_send: bool,
    /// Whether the environment is so uneven that directions are drawn from it by its radiance.
    pub uneven_sky: bool,
    /// Triangles that emit light and send it on.
    pub emitters: Vec<EmittingTriangle>,
    /// Lower and upper corner of each animated object at rest, world space.
    pub object_boxes: Vec<[[f32; 3]; 2]>,
}

impl SceneFacts {
    /// Collects the facts, for the scene's own cameras.
    pub fn of(scene: &Scene) -> Self {
        Self::within(scene, Extent::of(scene))
    }

    /// Collects the facts, with sizes for this extent: see [`Sight::extent`](super::Sight::extent).
    pub fn within(scene: &Scene, extent: Extent) -> Self {
        Self::with_needs(scene, SceneNeeds::of(scene), extent)
    }

    /// As [`Self::within`], with what the scene needs ([`SceneNeeds::of`]), which takes the longest to find out.
    pub fn with_needs(scene: &Scene, needs: SceneNeeds, extent: Extent) -> Self {
        let flags = scene.materials.iter().map(|material| u32::from(material.receive_only));
        let receive_only = if needs.receive_only { flags.collect() } else { Vec::new() };
        let mut facts = Self {
            needs,
            shadow_layers: Vec::new(),
            far_shadow_layers: Vec::new(),
            receive_only,
            extra_cameras: scene.extra_cameras.clone(),
            near: 0.0,
            bounds: [[0.0; 3]; 2],
            extent,
            triangles: scene.triangle_count() as u32,
            size: SceneSize::of(scene),
            only_seen_surfaces_send: false,
            uneven_sky: scene.environment.as_ref().is_some_and(is_uneven),
            emitters: emitting_triangles(scene),
            object_boxes: object_boxes(scene),
        };
        facts.resize(scene, extent);
        facts
    }

    /// Changes all sizes to those for this extent, for example after the camera moved. `scene` is that of the facts.
    pub fn resize(&mut self, scene: &Scene, extent: Extent) {
        let (low, high) = extent.focus;
        let lights = scene.pose(0).lights;
        self.extent = extent;
        self.bounds = [low.to_array(), high.to_array()];
        self.near = extent.near();
        self.shadow_layers = shadow_layers(&lights, &extent, scene);
        self.far_shadow_layers = far_shadow_layers(&lights, &extent, scene);
    }

    /// Whether float32 can compute with the scene's lengths, those of what is looked at included
    /// ([`halflight_scenes::LENGTHS`]).
    ///
    /// # Errors
    /// What is too small or too large, and the fix.
    pub fn check_lengths(&self) -> Result<(), SettingsError> {
        let length = |(low, high): (Vec3, Vec3)| low.as_dvec3().distance(high.as_dvec3());
        check_length("the scene's diagonal", length(self.extent.scene))
            .and_then(|()| check_length("the diagonal of what is looked at", length(self.extent.focus)))
            .map_err(SettingsError)
    }

    /// These facts for a technique that does not read which surfaces send light.
    pub fn without_senders(&self) -> Self {
        let needs = SceneNeeds { receive_only: false, ..self.needs };
        Self { needs, receive_only: Vec::new(), ..self.clone() }
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

/// Boxes of the animated objects at rest. An object without vertices has a point at the origin.
fn object_boxes(scene: &Scene) -> Vec<[[f32; 3]; 2]> {
    let box_of = |object: usize| {
        let meshes = scene.meshes.iter().filter(|mesh| mesh.object == Some(object));
        let mut positions = meshes.flat_map(|mesh| mesh.positions.iter().map(|&p| Vec3::from(p)));
        let first = positions.next().unwrap_or_default();
        let (low, high) = positions.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        [low.to_array(), high.to_array()]
    };
    (0..scene.moves.objects.len()).map(box_of).collect()
}
