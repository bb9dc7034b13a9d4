//! Everything that a picture depends on, as plain data: what a link holds, and what undo steps through.

use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{Camera, Light};
use halflight_techniques::{parameters_of, technique};

/// Name of a scene that was dropped onto the viewer; no link can bring it back.
pub const DROPPED: &str = "dropped";

/// Sizes to choose from, pixels.
pub const SIZES: [[u32; 2]; 5] = [[320, 180], [640, 360], [960, 540], [1280, 720], [1920, 1080]];

/// What the picture shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum View {
    /// An output of the plan by its name, for example `final`.
    Output(&'static str),
    /// How far `albedo * indirect` is from the truth.
    Error,
    /// The path-traced picture.
    Truth,
    /// A texture of the plan by its name, for example `surfels_8`.
    Texture(String),
}

/// Outputs that a view can show, with what they are.
pub const OUTPUTS: [(&str, &str); 7] = [
    ("final", "direct + albedo * indirect"),
    ("direct", "light that surfaces send on after direct light alone"),
    ("indirect", "incident indirect light, without albedo"),
    ("ambient_occlusion", "openness within a radius: white is open"),
    ("albedo", "diffuse reflectance"),
    ("normal", "normals in view space"),
    ("depth", "distance along the camera's axis; near is bright"),
];

impl View {
    /// Its name in links.
    pub fn name(&self) -> &str {
        match self {
            Self::Output(name) => name,
            Self::Error => "error",
            Self::Truth => "truth",
            Self::Texture(name) => name,
        }
    }

    /// The view of this name; a name that is none of the fixed ones is that of a texture.
    pub fn of(name: &str) -> Self {
        match (name, OUTPUTS.iter().find(|(output, _)| *output == name)) {
            (_, Some((output, _))) => Self::Output(output),
            ("error", _) => Self::Error,
            ("truth", _) => Self::Truth,
            _ => Self::Texture(name.to_owned()),
        }
    }
}

/// A technique and those of its settings that are not left at their defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// The technique.
    pub technique: &'static str,
    /// Settings by `technique.parameter`.
    pub settings: Settings,
}

impl Default for Configuration {
    fn default() -> Self {
        Self { technique: "hierarchical", settings: Settings::new() }
    }
}

impl Configuration {
    /// The technique's declaration.
    pub fn technique(&self) -> &'static Technique {
        // The name always comes from the list itself; the first technique is only there for the types.
        technique(self.technique).unwrap_or(&halflight_techniques::TECHNIQUES[0])
    }

    /// Sets a value; one that equals the default is not kept, so that links stay short.
    pub fn set(&mut self, key: &str, value: Value) {
        let default = parameters_of(self.technique()).into_iter().find(|p| p.key() == key).map(|p| p.default);
        if default.as_ref() == Some(&value) {
            self.settings.remove(key);
        } else {
            self.settings.insert(key.to_owned(), value);
        }
    }
}

/// A change to a light of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightChange {
    /// World position; of no effect on a directional light.
    pub position: [f32; 3],
    /// Direction of travel; of no effect on a point light.
    pub direction: [f32; 3],
    /// Factor of its brightness, 0..=100.
    pub strength: f32,
}

impl LightChange {
    /// The change that changes nothing.
    pub fn none(light: &Light) -> Self {
        let (position, direction) = match *light {
            Light::Directional { direction, .. } => ([0.0; 3], direction),
            Light::Point { position, .. } => (position, [0.0, -1.0, 0.0]),
            Light::Spot { position, direction, .. } => (position, direction),
        };
        Self { position, direction, strength: 1.0 }
    }

    /// The changed light.
    pub fn apply(&self, light: &Light) -> Light {
        let scaled = |v: [f32; 3]| v.map(|v| v * self.strength);
        match *light {
            Light::Directional { irradiance, .. } => {
                Light::Directional { direction: self.direction, irradiance: scaled(irradiance) }
            }
            Light::Point { intensity, .. } => Light::Point { position: self.position, intensity: scaled(intensity) },
            Light::Spot { intensity, half_angle_degrees, full_intensity_half_angle_degrees, .. } => Light::Spot {
                position: self.position,
                direction: self.direction,
                intensity: scaled(intensity),
                half_angle_degrees,
                full_intensity_half_angle_degrees,
            },
        }
    }
}

/// Everything that a picture depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name of a bundled scene, or [`DROPPED`].
    pub scene: String,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Camera, where it is not the scene's own.
    pub camera: Option<Camera>,
    /// Changes to the scene's lights, by their place.
    pub lights: Vec<(usize, LightChange)>,
    /// What the picture shows.
    pub view: View,
    /// Exposure in stops, where it is not found from the picture.
    pub exposure: Option<f32>,
    /// Configurations A and B.
    pub sides: [Configuration; 2],
    /// Whether B is shown beside A.
    pub compare: bool,
    /// Place of the divider, 0..1 of the picture's width.
    pub divider: f32,
    /// Whether the path tracer works while the camera rests.
    pub truth: bool,
    /// Number of the frame that a scene stands at, where something moves in it.
    pub frame: u32,
    /// Seed of every random number.
    pub seed: u32,
}

impl Default for State {
    fn default() -> Self {
        Self {
            scene: "cornell".into(),
            size: [640, 360],
            camera: None,
            lights: Vec::new(),
            view: View::Output("final"),
            exposure: None,
            sides: Default::default(),
            compare: false,
            divider: 0.5,
            truth: true,
            frame: 0,
            seed: 0,
        }
    }
}

impl State {
    /// The lights of a scene after the changes.
    pub fn lights(&self, lights: &[Light]) -> Vec<Light> {
        let changed = |(index, light): (usize, &Light)| match self.lights.iter().find(|(at, _)| *at == index) {
            Some((_, change)) => change.apply(light),
            None => *light,
        };
        lights.iter().enumerate().map(changed).collect()
    }

    /// Changes a light; a change that changes nothing is not kept.
    pub fn change_light(&mut self, index: usize, light: &Light, change: LightChange) {
        self.lights.retain(|(at, _)| *at != index);
        if change != LightChange::none(light) {
            self.lights.push((index, change));
            self.lights.sort_by_key(|(at, _)| *at);
        }
    }

    /// Takes another scene; what belonged to the old one goes.
    pub fn open(&mut self, scene: &str) {
        self.scene = scene.to_owned();
        (self.camera, self.exposure, self.frame) = (None, None, 0);
        self.lights.clear();
    }
}
