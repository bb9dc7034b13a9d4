//! A technique of indirect illumination, as the registry lists it.

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_scenes::SceneNeeds;

use super::Inputs;
use crate::parameters::{Parameter, Settings, SettingsError};

/// Optional channels of the G-buffer that a technique with its settings requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GBufferNeeds {
    /// Index of each pixel's material, in a scene with glossy materials.
    pub glossy_material: bool,
    /// Index of each pixel's material, in a scene with translucent materials.
    pub translucent_material: bool,
    /// G-buffers of the scene's extra cameras, if there are some.
    pub extra_cameras: bool,
}

impl GBufferNeeds {
    /// No optional channels.
    pub const NONE: Self = Self { glossy_material: false, translucent_material: false, extra_cameras: false };
}

/// Where a technique finds the light of a kind of source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Nowhere: it takes none of it.
    Nowhere,
    /// On surfaces that a camera sees.
    Screen,
    /// In the whole scene.
    Scene,
}

/// The sources whose light a technique takes as indirect light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSources {
    /// Directional, point and spot lights: what surfaces reflect of them.
    pub lamps: Reach,
    /// Emitting surfaces.
    pub emitters: Reach,
    /// The environment.
    pub sky: Reach,
}

impl LightSources {
    /// No indirect light at all.
    pub const NONE: Self = Self { lamps: Reach::Nowhere, emitters: Reach::Nowhere, sky: Reach::Nowhere };

    /// Lamps and emitters on the screen, no sky.
    pub const SCREEN: Self = Self { lamps: Reach::Screen, emitters: Reach::Screen, sky: Reach::Nowhere };

    /// Kinds of light that a scene with these needs has: how much of them is taken, and names of all of it and of the part
    /// off the screen.
    fn present(self, needs: &SceneNeeds) -> impl Iterator<Item = (Reach, [&'static str; 2])> {
        let kinds = [
            (needs.lights > 0, self.lamps, ["lamps", "lamps off the screen"]),
            (needs.emitters, self.emitters, ["emitters", "emitters off the screen"]),
            (needs.environment, self.sky, ["the sky", "the sky off the screen"]),
        ];
        kinds.into_iter().filter(|(present, ..)| *present).map(|(_, reach, names)| (reach, names))
    }

    /// Whether some light of a scene with these needs is taken.
    pub fn takes_any(self, needs: &SceneNeeds) -> bool {
        self.present(needs).any(|(reach, _)| reach != Reach::Nowhere)
    }

    /// What is left out of a scene with these needs, in words; empty if nothing is.
    pub fn left_out(self, needs: &SceneNeeds) -> Vec<&'static str> {
        let left_out = self.present(needs).filter_map(|(reach, names)| match reach {
            Reach::Nowhere => Some(names[0]),
            Reach::Screen => Some(names[1]),
            Reach::Scene => None,
        });
        left_out.collect()
    }
}

/// A technique of indirect illumination.
#[derive(Clone, Copy, Debug)]
pub struct Technique {
    /// Name in files and tables.
    pub name: &'static str,
    /// Name in words.
    pub title: &'static str,
    /// Summary in one sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: fn() -> Vec<Parameter>,
    /// Names of its main parameters, at most five: those that interfaces show first.
    pub main: &'static [&'static str],
    /// Fills in defaults and checks values. Settings of other techniques are ignored.
    pub complete: fn(&Settings) -> Result<Settings, SettingsError>,
    /// The optional G-buffer channels that it reads.
    pub needs: fn(&Settings) -> Result<GBufferNeeds, SettingsError>,
    /// The sources whose light it takes.
    pub sources: fn(&Settings) -> Result<LightSources, SettingsError>,
    /// Adds the passes that compute `indirect` from the inputs, and returns it; `None` if there is no indirect light.
    /// Other results are added to the plan's outputs: `ambient_occlusion`, `glossy`. State between frames is a
    /// [`halflight_frame_graph::History`] of the plan.
    pub plan: fn(&mut FramePlan, &Inputs, &Settings) -> Result<Option<ResourceId>, SettingsError>,
}

impl Technique {
    /// What it leaves out of a scene with these needs, as a sentence; `None` if nothing is left out.
    ///
    /// # Errors
    /// A setting that its declaration does not allow.
    pub fn left_out(&self, settings: &Settings, needs: &SceneNeeds) -> Result<Option<String>, SettingsError> {
        let left_out = (self.sources)(settings)?.left_out(needs);
        Ok((!left_out.is_empty())
            .then(|| format!("{} leaves out indirect light of {}", self.name, left_out.join(", of "))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_light_that_a_scene_has_is_left_out() {
        let all = SceneNeeds { lights: 1, emitters: true, environment: true, ..SceneNeeds::default() };
        assert_eq!(LightSources::NONE.left_out(&all), ["lamps", "emitters", "the sky"]);
        assert_eq!(LightSources::SCREEN.left_out(&all), ["lamps off the screen", "emitters off the screen", "the sky"]);
        let everything = LightSources { lamps: Reach::Scene, emitters: Reach::Scene, sky: Reach::Scene };
        assert!(everything.left_out(&all).is_empty());
        assert!(LightSources::NONE.left_out(&SceneNeeds::default()).is_empty());
        let sky = SceneNeeds { environment: true, ..SceneNeeds::default() };
        assert!(!LightSources::SCREEN.takes_any(&sky) && everything.takes_any(&sky));
        assert!(LightSources::SCREEN.takes_any(&all) && !everything.takes_any(&SceneNeeds::default()));
    }
}
