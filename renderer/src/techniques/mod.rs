//! The techniques: each is one module here and one WGSL folder, and a line in [`TECHNIQUES`].

use glam::Vec3;

pub use crate::parameters::SettingsError;
use crate::{
    DirectLight, SceneFacts,
    parameters::{Parameter, Settings},
    plan::{FramePlan, ResourceId},
};

pub mod bitmask;
pub mod exhaustive;
pub mod gtao;
pub mod hierarchical;
pub mod horizon;
pub mod hybrid;
pub mod ray_march;
pub mod rsm;
pub mod ssao;
pub mod ssdo;

/// What a technique reads, all at full resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
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
    pub scene: Option<SceneInputs>,
}

/// Part of the diagonal of the scene's bounding box within which light is nearby, where a setting leaves it open.
const NEARBY: f32 = 1.0 / 30.0;

impl Inputs {
    /// The radius within which surfaces are nearby, scene units: this one, or where it is 0 a share of the scene.
    ///
    /// # Errors
    /// Where there is no scene to take it from.
    pub(crate) fn nearby(&self, radius: f32, technique: &str) -> Result<f32, SettingsError> {
        self.length_or_share(radius, &format!("{technique}.radius"))
    }

    /// As [`Self::nearby`], for the parameter of this key.
    pub(crate) fn length_or_share(&self, length: f32, key: &str) -> Result<f32, SettingsError> {
        match self.scene {
            _ if length > 0.0 => Ok(length),
            Some(SceneInputs { bounds: [low, high], .. }) => Ok(NEARBY * Vec3::from(high).distance(low.into())),
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

/// Facts that decide how a technique reads the scene's buffers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneInputs {
    /// Some material has a cut-out texture.
    pub alpha_tested: bool,
    /// Some material has a specular part.
    pub glossy: bool,
    /// Some material lets light through.
    pub translucent: bool,
    /// Some mesh encloses solid matter.
    pub solid_meshes: bool,
    /// Some mesh does not, and has no cut-outs.
    pub open_meshes: bool,
    /// Some mesh moves.
    pub moving: bool,
    /// Light arrives from outside the geometry.
    pub environment: bool,
    /// Some material has a texture.
    pub textured: bool,
    /// Lower and upper corner of the bounding box over all frames, world space.
    pub bounds: [[f32; 3]; 2],
    /// Number of triangles.
    pub triangles: u32,
}

impl SceneInputs {
    /// Those of a scene with these facts.
    pub fn of(facts: &SceneFacts) -> Self {
        let needs = &facts.needs;
        Self {
            alpha_tested: needs.alpha_tested,
            glossy: needs.glossy,
            translucent: needs.translucent,
            solid_meshes: needs.watertight_meshes > 0,
            open_meshes: needs.open_meshes > needs.cut_out_meshes,
            moving: needs.moving_objects > 0,
            environment: needs.environment,
            textured: needs.textured,
            bounds: facts.bounds,
            triangles: facts.triangles,
        }
    }
}

/// Channels of the G-buffer that exist only where a technique with its settings asks for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GBufferNeeds {
    /// Index of each pixel's material, in a scene that has glossy ones.
    pub glossy_material: bool,
    /// Index of each pixel's material, in a scene that has translucent ones.
    pub translucent_material: bool,
    /// G-buffers of the scene's extra cameras, in a scene that has some.
    pub extra_cameras: bool,
}

impl GBufferNeeds {
    /// Those of a technique that needs nothing more.
    pub const NONE: Self = Self { glossy_material: false, translucent_material: false, extra_cameras: false };
}

/// A way to find indirect light.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Name in files and tables.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: fn() -> Vec<Parameter>,
    /// Fills in defaults and checks values; settings of other techniques are left out.
    pub complete: fn(&Settings) -> Result<Settings, SettingsError>,
    /// What it reads of the G-buffer beyond depth, normal, direct light and albedo.
    pub needs: fn(&Settings) -> Result<GBufferNeeds, SettingsError>,
    /// Appends passes that turn the inputs into `indirect`, which it returns; `None` where it finds none. Other results
    /// it adds to the plan's outputs: `ambient_occlusion`, `glossy`. What it keeps between frames is a
    /// [`crate::plan::History`] of the plan.
    pub plan: fn(&mut FramePlan, &Inputs, &Settings) -> Result<Option<ResourceId>, SettingsError>,
}

/// Every technique.
pub static TECHNIQUES: &[Technique] = &[
    hierarchical::TECHNIQUE,
    bitmask::TECHNIQUE,
    hybrid::TECHNIQUE,
    gtao::TECHNIQUE,
    horizon::TECHNIQUE,
    ray_march::TECHNIQUE,
    rsm::TECHNIQUE,
    ssdo::TECHNIQUE,
    ssao::TECHNIQUE,
    exhaustive::TECHNIQUE,
    NONE,
];

/// No indirect light at all: what every technique has to beat.
const NONE: Technique = Technique {
    name: "none",
    summary: "no indirect light: the error that every technique starts from",
    parameters: Vec::new,
    complete: |_| Ok(Settings::new()),
    needs: |_| Ok(GBufferNeeds::NONE),
    plan: |_, _, _| Ok(None),
};

/// The technique of this name.
///
/// # Errors
/// One sentence that suggests the nearest name.
pub fn technique(name: &str) -> Result<&'static Technique, SettingsError> {
    TECHNIQUES.iter().find(|technique| technique.name == name).ok_or_else(|| {
        let names: Vec<&str> = TECHNIQUES.iter().map(|technique| technique.name).collect();
        let hint = halflight_scenes::nearest_name(name, names.iter().copied())
            .map_or(String::new(), |near| format!("did you mean {near}? "));
        SettingsError(format!("no technique is called \"{name}\": {hint}choose one of {}", names.join(", ")))
    })
}

/// What any technique with these settings needs of the G-buffer: for a scene whose technique is chosen later.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn needs_of_any(settings: &Settings) -> Result<GBufferNeeds, SettingsError> {
    TECHNIQUES.iter().try_fold(GBufferNeeds::NONE, |all, technique| {
        let own = (technique.needs)(settings)?;
        Ok(GBufferNeeds {
            glossy_material: all.glossy_material || own.glossy_material,
            translucent_material: all.translucent_material || own.translucent_material,
            extra_cameras: all.extra_cameras || own.extra_cameras,
        })
    })
}

/// Every parameter that takes effect with a technique: its own and those of direct light.
pub fn parameters_of(technique: &Technique) -> Vec<Parameter> {
    let mut all = (technique.parameters)();
    all.extend(DirectLight::parameters());
    all
}
