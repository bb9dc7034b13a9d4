//! Everything that a picture depends on, as plain data: the contents of a link and of an undo step.

use std::{collections::BTreeMap, ops::RangeInclusive};

use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{Camera, Light};
use halflight_techniques::{TECHNIQUES, parameters_of, technique};

use crate::error::Metric;

/// Name of a scene that was dropped onto the viewer. A link cannot open it.
pub const DROPPED: &str = "dropped";

/// Keys of bookmarks.
pub const BOOKMARKS: RangeInclusive<u8> = 4..=9;

/// Sizes in the menu, pixels.
pub const SIZES: [[u32; 2]; 5] = [[320, 180], [640, 360], [960, 540], [1280, 720], [1920, 1080]];

/// What the picture shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum View {
    /// An output of the plan by its name, for example `final`.
    Output(&'static str),
    /// The relative error of `albedo * indirect` against the reference.
    Error,
    /// The path-traced reference.
    Reference,
    /// A texture of the plan by its name, for example `surfels_8`.
    Texture(String),
}

/// Outputs that a view can show, with descriptions.
pub const OUTPUTS: [(&str, &str); 7] = [
    ("final", "direct + albedo * indirect"),
    ("direct", "radiance of surfaces under direct light alone"),
    ("indirect", "incident indirect light (irradiance / pi), without albedo"),
    ("ambient_occlusion", "ambient visibility within a radius: 1 (white) is open, 0 is occluded"),
    ("albedo", "diffuse reflectance"),
    ("normal", "normals in view space"),
    ("depth", "planar view depth; near is bright"),
];

impl View {
    /// Its name in links.
    pub fn name(&self) -> &str {
        match self {
            Self::Output(name) => name,
            Self::Error => "error",
            Self::Reference => "truth",
            Self::Texture(name) => name,
        }
    }

    /// The view of this name in links. Any other name is that of a texture.
    pub fn of(name: &str) -> Self {
        match (name, OUTPUTS.iter().find(|(output, _)| *output == name)) {
            (_, Some((output, _))) => Self::Output(output),
            ("error", _) => Self::Error,
            ("truth", _) => Self::Reference,
            _ => Self::Texture(name.to_owned()),
        }
    }
}

/// A technique and its settings that differ from the defaults.
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
    /// Bounces of indirect light that it computes; `None` if its technique has no such setting.
    pub fn bounces(&self) -> Option<Bounces> {
        let key = format!("{}.bounces", self.technique);
        let declared = parameters_of(self.technique()).into_iter().find(|parameter| parameter.key() == key)?;
        match self.settings.get(&key).unwrap_or(&declared.default) {
            // A technique whose default is 0 has all of them by it. Otherwise 0 is none.
            Value::Int(0) if declared.default == Value::Int(0) => Some(Bounces::All),
            Value::Int(number) => Some(Bounces::Number(u32::try_from(*number).unwrap_or(0))),
            _ => None,
        }
    }

    /// The technique's declaration.
    pub fn technique(&self) -> &'static Technique {
        // The name always comes from the list of techniques, so the fallback is never used.
        technique(self.technique).unwrap_or(&TECHNIQUES[0])
    }

    /// Sets a value. A value equal to the default is removed, so that links stay short.
    pub fn set(&mut self, key: &str, value: Value) {
        let default = parameters_of(self.technique()).into_iter().find(|p| p.key() == key).map(|p| p.default);
        if default.as_ref() == Some(&value) {
            self.settings.remove(key);
        } else {
            self.settings.insert(key.to_owned(), value);
        }
    }
}

/// Bounces of indirect light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bounces {
    /// A number of them.
    Number(u32),
    /// All of them.
    All,
}

/// A change to a light of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightChange {
    /// World position; has no effect on a directional light.
    pub position: [f32; 3],
    /// Direction of travel; has no effect on a point light.
    pub direction: [f32; 3],
    /// Factor of irradiance or intensity, 0..=100.
    pub strength: f32,
}

impl LightChange {
    /// The identity change.
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
    /// Camera; `None` for the scene's own.
    pub camera: Option<Camera>,
    /// Kept cameras by their key, 4 to 9.
    pub bookmarks: BTreeMap<u8, Camera>,
    /// Changes to the scene's lights, by index.
    pub lights: Vec<(usize, LightChange)>,
    /// What the picture shows.
    pub view: View,
    /// Exposure in stops; `None` for automatic exposure.
    pub exposure: Option<f32>,
    /// Configurations A and B.
    pub sides: [Configuration; 2],
    /// Whether B is shown beside A.
    pub compare: bool,
    /// Position of the divider, 0..1 of the picture's width.
    pub divider: f32,
    /// Whether pictures are averaged over parts of a pixel while everything is still.
    pub antialiasing: bool,
    /// Whether the path tracer runs while the camera is still.
    pub reference: bool,
    /// Frame number of an animated scene.
    pub frame: u32,
    /// Seed of every random number.
    pub seed: u32,
    /// The metric of the errors that are shown.
    pub metric: Metric,
}

impl Default for State {
    fn default() -> Self {
        Self {
            scene: "cornell".into(),
            size: [640, 360],
            camera: None,
            bookmarks: BTreeMap::new(),
            lights: Vec::new(),
            view: View::Output("final"),
            exposure: None,
            sides: Default::default(),
            compare: false,
            divider: 0.5,
            antialiasing: true,
            reference: true,
            frame: 0,
            seed: 0,
            metric: Metric::default(),
        }
    }
}

impl State {
    /// Bounces of the reference: the most that a shown side computes, at least one. Otherwise light that a side rightly has
    /// would count as its error.
    pub fn reference_bounces(&self) -> Bounces {
        let shown = self.sides.iter().take(if self.compare { 2 } else { 1 });
        shown.filter_map(Configuration::bounces).fold(Bounces::Number(1), Ord::max)
    }

    /// The lights of a scene after the changes.
    pub fn lights(&self, lights: &[Light]) -> Vec<Light> {
        let changed = |(index, light): (usize, &Light)| match self.lights.iter().find(|(at, _)| *at == index) {
            Some((_, change)) => change.apply(light),
            None => *light,
        };
        lights.iter().enumerate().map(changed).collect()
    }

    /// Sets the change of a light. An identity change is removed.
    pub fn change_light(&mut self, index: usize, light: &Light, change: LightChange) {
        self.lights.retain(|(at, _)| *at != index);
        if change != LightChange::none(light) {
            self.lights.push((index, change));
            self.lights.sort_by_key(|(at, _)| *at);
        }
    }

    /// Keeps a camera as the first free bookmark. Returns its key; `None` if all are taken.
    pub fn bookmark(&mut self, camera: Camera) -> Option<u8> {
        let key = BOOKMARKS.clone().find(|key| !self.bookmarks.contains_key(key))?;
        self.bookmarks.insert(key, camera);
        Some(key)
    }

    /// Opens another scene and resets everything that belongs to the old one.
    pub fn open(&mut self, scene: &str) {
        self.scene = scene.to_owned();
        (self.camera, self.exposure, self.frame) = (None, None, 0);
        self.lights.clear();
        self.bookmarks.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_has_the_bounces_of_the_sides() {
        let mut state = State::default();
        assert_eq!(state.reference_bounces(), Bounces::Number(1));
        state.sides[0].set("hierarchical.bounces", Value::Int(3));
        assert_eq!(state.reference_bounces(), Bounces::Number(3));
        state.sides[1] = Configuration { technique: "radiance-cache", ..Configuration::default() };
        // B is not shown.
        assert_eq!(state.reference_bounces(), Bounces::Number(3));
        state.compare = true;
        assert_eq!(state.reference_bounces(), Bounces::All);
        state.sides[1].set("radiance-cache.bounces", Value::Int(2));
        assert_eq!(state.reference_bounces(), Bounces::Number(3));
        state.sides[0] = Configuration { technique: "none", ..Configuration::default() };
        assert_eq!(state.reference_bounces(), Bounces::Number(2));
    }
}
