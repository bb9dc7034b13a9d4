//! What a technique reads.

use glam::Vec3;
use halflight_frame_graph::ResourceId;

use crate::{
    parameters::SettingsError,
    scene::{EmittingTriangle, SceneFacts, ShadowLayer},
};

/// What a technique reads, all at full resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<'a> {
    /// Planar view depth, 0 where there is no surface.
    pub depth: ResourceId,
    /// View-space unit normal facing the eye.
    pub normal: ResourceId,
    /// Radiance after direct light: the source of indirect light.
    pub direct: ResourceId,
    /// Diffuse reflectance.
    pub albedo: ResourceId,
    /// What moves, where something does and the temporal filter follows it.
    pub motion: Option<MotionInputs>,
    /// Index of each pixel's material, where the plan has glossy light or light that passes translucent surfaces.
    pub material: Option<ResourceId>,
    /// Surfaces that receive light and send none, where the scene has any; `direct` is already without theirs.
    pub receive_only: Option<ReceiveOnlyInputs>,
    /// The scene itself; `None` where only textures are given.
    pub scene: Option<&'a SceneFacts>,
    /// Views besides the display's that gather light too, each with its own G-buffer.
    pub extra_views: &'a [ExtraView],
}

/// Part of the diagonal of the scene's bounding box within which light is nearby, where a setting leaves it open.
const NEARBY: f32 = 1.0 / 30.0;

impl<'a> Inputs<'a> {
    /// What the lights of the scene look at; empty in an unlit scene, or without one.
    pub fn shadow_layers(&self) -> &'a [ShadowLayer] {
        self.scene.map_or(&[], |scene| &scene.shadow_layers)
    }

    /// Triangles of the scene that emit light; empty in a scene that has none, or without one.
    pub fn emitters(&self) -> &'a [EmittingTriangle] {
        self.scene.map_or(&[], |scene| &scene.emitters)
    }

    /// Whether light may come from elsewhere than the screen: from lights or emitters of the scene. Without a scene it
    /// may, and who asks for it is told that the scene is missing.
    pub fn may_be_lit(&self) -> bool {
        self.scene.is_none() || !self.shadow_layers().is_empty() || !self.emitters().is_empty()
    }

    /// The radius within which surfaces are nearby, scene units: this one, or where it is 0 a share of the scene.
    ///
    /// # Errors
    /// Where there is no scene to take it from.
    pub fn nearby(&self, radius: f32, technique: &str) -> Result<f32, SettingsError> {
        self.length_or_share(radius, &format!("{technique}.radius"))
    }

    /// As [`Self::nearby`], for the parameter of this key.
    pub fn length_or_share(&self, length: f32, key: &str) -> Result<f32, SettingsError> {
        match self.scene {
            _ if length > 0.0 => Ok(length),
            Some(SceneFacts { bounds: [low, high], .. }) => Ok(NEARBY * Vec3::from(*high).distance((*low).into())),
            None => Err(SettingsError(format!(
                "{key} = 0 takes its length from the scene and only textures were given: give a length"
            ))),
        }
    }
}

/// Which moving object each pixel shows, and where it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionInputs {
    /// Index into `objects`, 0 for what stands still.
    pub object: ResourceId,
    /// `array<Object>` of common/scene.wgsl.
    pub objects: ResourceId,
}

/// Which pixels receive light and send none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiveOnlyInputs {
    /// Index of each pixel's material.
    pub material: ResourceId,
    /// One word a material: 1 where it only receives.
    pub flags: ResourceId,
}

/// A view of the plan besides the display's, with its G-buffer and direct light.
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
    /// What a technique reads to gather in this view; `display` is what it reads for the display's.
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
