//! Inputs of a technique.

use glam::Vec3;
use halflight_frame_graph::ResourceId;

use crate::{
    parameters::SettingsError,
    scene::{EmittingTriangle, SceneFacts, ShadowLayer},
};

/// Inputs of a technique, all at full resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<'a> {
    /// Planar view depth, scene units; 0 without a surface.
    pub depth: ResourceId,
    /// View-space unit normal facing the eye.
    pub normal: ResourceId,
    /// Radiance after direct light: the source of indirect light. Receive-only surfaces are black.
    pub direct: ResourceId,
    /// Diffuse reflectance.
    pub albedo: ResourceId,
    /// Animated objects, if the scene has some and the temporal filter follows them.
    pub motion: Option<MotionInputs>,
    /// Index of each pixel's material, if the plan has glossy or translucent light.
    pub material: Option<ResourceId>,
    /// Receive-only surfaces, if the scene has any. `direct` is already without their light.
    pub receive_only: Option<ReceiveOnlyInputs>,
    /// The scene; `None` if only textures are available.
    pub scene: Option<&'a SceneFacts>,
    /// Additional views that gather light, each with its own G-buffer.
    pub extra_views: &'a [ExtraView],
}

/// Default radius of nearby light, as a share of the diagonal of what is looked at.
const NEARBY: f32 = 1.0 / 30.0;

impl<'a> Inputs<'a> {
    /// The shadow map layers of the scene's lights; empty without lights or without a scene.
    pub fn shadow_layers(&self) -> &'a [ShadowLayer] {
        self.scene.map_or(&[], |scene| &scene.shadow_layers)
    }

    /// Emitting triangles of the scene; empty without any, or without a scene.
    pub fn emitters(&self) -> &'a [EmittingTriangle] {
        self.scene.map_or(&[], |scene| &scene.emitters)
    }

    /// Whether light may come from off the screen: from lights or emitters of the scene. True without a scene, so that
    /// the technique reports that the scene is missing.
    pub fn may_be_lit(&self) -> bool {
        self.scene.is_none() || !self.shadow_layers().is_empty() || !self.emitters().is_empty()
    }

    /// The radius of nearby surfaces, scene units: `radius`, or the default share of the scene if it is 0.
    ///
    /// # Errors
    /// If the radius is 0 and there is no scene.
    pub fn nearby(&self, radius: f32, technique: &str) -> Result<f32, SettingsError> {
        self.length_or_share(radius, &format!("{technique}.radius"))
    }

    /// As [`Self::nearby`], for the parameter of this key.
    pub fn length_or_share(&self, length: f32, key: &str) -> Result<f32, SettingsError> {
        match self.scene {
            _ if length > 0.0 => Ok(length),
            Some(SceneFacts { bounds: [low, high], .. }) => Ok(NEARBY * Vec3::from(*high).distance((*low).into())),
            None => Err(SettingsError(format!(
                "{key} = 0 derives its length from the scene, and only textures were given: give a length"
            ))),
        }
    }
}

/// The animated object of each pixel, and its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionInputs {
    /// Index into `objects`; 0 for static geometry.
    pub object: ResourceId,
    /// `array<Object>` of common/scene.wgsl.
    pub objects: ResourceId,
}

/// The receive-only pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiveOnlyInputs {
    /// Index of each pixel's material.
    pub material: ResourceId,
    /// One word per material: 1 if it receives light but sends none.
    pub flags: ResourceId,
}

/// An additional view of the plan, with its G-buffer and direct light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtraView {
    /// Index into [`FramePlan::views`](halflight_frame_graph::FramePlan::views).
    pub view: usize,
    /// As [`Inputs::depth`].
    pub depth: ResourceId,
    /// As [`Inputs::normal`].
    pub normal: ResourceId,
    /// As [`Inputs::direct`].
    pub direct: ResourceId,
    /// As [`Inputs::albedo`].
    pub albedo: ResourceId,
    /// As [`Inputs::receive_only`].
    pub receive_only: Option<ReceiveOnlyInputs>,
}

impl ExtraView {
    /// The inputs of a technique in this view. `display` has those of the display.
    pub fn inputs<'a>(&self, display: &Inputs<'a>) -> Inputs<'a> {
        let &Self { depth, normal, direct, albedo, receive_only, .. } = self;
        Inputs {
            depth,
            normal,
            direct,
            albedo,
            receive_only,
            motion: None,
            material: None,
            scene: display.scene,
            extra_views: &[],
        }
    }
}
