//! The techniques. Each one is a module here, a folder of WGSL, and an entry of [`TECHNIQUES`].

pub mod bitmask;
pub mod exhaustive;
pub mod gtao;
pub mod hierarchical;
pub mod horizon;
pub mod hybrid;
pub mod invocation;
pub mod link;
pub mod preset;
pub mod radiance_cache;
pub mod ray_march;
pub mod rsm;
pub mod ssao;
pub mod ssdo;

use halflight_renderer::{
    frame_parameters,
    gi::{GBufferNeeds, LightSources, Technique},
    parameters::{Parameter, Settings, SettingsError},
};

/// All techniques.
pub static TECHNIQUES: &[Technique] = &[
    radiance_cache::TECHNIQUE,
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

/// No indirect light: the baseline that every technique has to beat.
const NONE: Technique = Technique {
    name: "none",
    title: "No indirect light",
    summary: "no indirect light: the baseline of every technique",
    parameters: Vec::new,
    main: &[],
    complete: |_| Ok(Settings::new()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources::NONE),
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

/// G-buffer channels that any technique with these settings needs, for a scene whose technique is chosen later.
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

/// All parameters of a technique: its own and those of every frame.
pub fn parameters_of(technique: &Technique) -> Vec<Parameter> {
    let mut all = (technique.parameters)();
    all.extend(frame_parameters());
    all
}

#[cfg(test)]
mod tests {
    use halflight_renderer::gi::{Spacing, UpsamplingKernel};
    use halflight_shared_shaders::SHADERS;

    use crate::{TECHNIQUES, bitmask::Ambient, hierarchical::GlossyImportance};

    #[test]
    fn main_parameters_are_declared_and_few() {
        for technique in TECHNIQUES {
            let own = (technique.parameters)();
            let is_declared = |name: &&str| own.iter().any(|parameter| parameter.name == *name);
            assert!(technique.main.iter().all(is_declared), "{}: {:?}", technique.name, technique.main);
            assert!(technique.main.len() <= 5 && !technique.title.is_empty(), "{}", technique.name);
        }
    }

    /// Shaders receive choices as numbers. Their names for these numbers must have the values of the Rust enums.
    #[test]
    fn constants_of_choices_have_the_same_values_in_wgsl() {
        for (name, value) in [
            ("SPACING_CONSTANT", Spacing::Constant as u32),
            // No shader names the nearest kernel: it is what is left.
            ("KERNEL_LINEAR", UpsamplingKernel::Linear as u32),
            ("KERNEL_SPLINE", UpsamplingKernel::Spline as u32),
            ("AMBIENT_NORMAL", Ambient::Normal as u32),
            ("AMBIENT_BENT_NORMAL", Ambient::BentNormal as u32),
            ("AMBIENT_BITMASK", Ambient::Bitmask as u32),
            ("IMPORTANCE_OF_2010", GlossyImportance::Paper as u32),
            ("IMPORTANCE_OF_LOBE", GlossyImportance::Lobe as u32),
        ] {
            let mut shaders = 0;
            for shader in SHADERS {
                let declaration = format!("{name}: u32 = ");
                let Some((_, rest)) = shader.source.split_once(&declaration) else { continue };
                let number = rest.split([';', 'u']).next().unwrap_or_default();
                assert_eq!(number.parse(), Ok(value), "{name} in {}", shader.name);
                shaders += 1;
            }
            assert!(shaders > 0, "no shader declares {name}");
        }
    }
}
