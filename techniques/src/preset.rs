//! Presets: a technique with its settings in a small TOML file. The viewer saves and loads them, the evaluator takes them
//! with `--preset`, and a `[[sweep]]` of a grid reads its settings through the same functions.
//!
//! ```toml
//! technique = "hierarchical"
//! [settings]
//! samples = 16
//! start_resolution = "half"
//! ```

use std::{fmt::Write, path::Path};

use halflight_scenes::{
    SceneError,
    keys::{Source, Table, Value as TomlValue},
    nearest_name,
};
use toml::de::DeValue;

use halflight_renderer::gi::Technique;
use halflight_renderer::parameters::{Parameter, Settings, Value};

/// A technique with settings. Missing settings have their defaults.
#[derive(Clone, Debug)]
pub struct Preset {
    /// The technique.
    pub technique: &'static Technique,
    /// Settings by `technique.parameter`.
    pub settings: Settings,
}

impl Preset {
    /// Reads a preset file. `path` is for messages.
    ///
    /// # Errors
    /// One sentence with file, line, key and the fix.
    pub fn read(path: &Path, text: &str) -> Result<Self, SceneError> {
        let source = Source { path, text };
        let document = source.parse()?;
        let file = Table::file(source, &document, &["technique", "settings"])?;
        let name = file.required("technique", file.text("technique")?, "technique = \"hierarchical\"")?;
        let technique = crate::technique(name).map_err(|e| file.error("technique", format_args!("is wrong: {e}")))?;
        let declared = crate::parameters_of(technique);
        let mut settings = Settings::new();
        for (key, value) in file.entries("settings")? {
            let parameter = declaration(source, technique, &declared, key, value)?;
            settings.insert(parameter.key(), check(source, parameter, value)?);
        }
        Ok(Self { technique, settings })
    }

    /// The text of a file that reads back as this preset.
    pub fn to_toml(&self) -> String {
        let mut text = format!("technique = \"{}\"\n\n[settings]\n", self.technique.name);
        let own = format!("{}.", self.technique.name);
        for (key, value) in &self.settings {
            // Only settings of another owner, such as direct light, need their full name. TOML quotes the dot.
            let key = key.strip_prefix(&own).map_or_else(|| format!("\"{key}\""), str::to_owned);
            // Writing to a String cannot fail.
            let _ = match value {
                Value::Text(name) => writeln!(text, "{key} = \"{name}\""),
                // Debug keeps the decimal point of a whole number: 20.0, not 20.
                Value::Float(number) => writeln!(text, "{key} = {number:?}"),
                other => writeln!(text, "{key} = {other}"),
            };
        }
        text
    }
}

/// The declaration of a key in a file: `samples` or `hierarchical.samples`.
///
/// # Errors
/// If there is no such parameter: file, line and the nearest name.
pub fn declaration<'a>(
    source: Source,
    technique: &Technique,
    declared: &'a [Parameter],
    key: &str,
    value: &TomlValue,
) -> Result<&'a Parameter, SceneError> {
    let full = if key.contains('.') { key.to_owned() } else { format!("{}.{key}", technique.name) };
    declared.iter().find(|parameter| parameter.key() == full).ok_or_else(|| {
        let names: Vec<&str> = declared.iter().map(|parameter| parameter.name).collect();
        let hint = nearest_name(key, names.iter().copied())
            .map_or_else(|| format!("use {}", names.join(", ")), |near| format!("did you mean `{near}`?"));
        source.error(value.span(), format_args!("unknown key `{key}` of the technique {}; {hint}", technique.name))
    })
}

/// A value of a file, checked against its declaration.
///
/// # Errors
/// If it is out of range: file, line and the allowed values.
pub fn check(source: Source, parameter: &Parameter, value: &TomlValue) -> Result<Value, SceneError> {
    let read = match value.get_ref() {
        DeValue::String(text) => Some(Value::Text(text.to_string())),
        DeValue::Boolean(v) => Some(Value::Bool(*v)),
        DeValue::Integer(v) => i64::from_str_radix(v.as_str(), v.radix()).ok().map(Value::Int),
        DeValue::Float(v) => v.as_str().parse().ok().map(Value::Float),
        _ => None,
    };
    let read = read.ok_or_else(|| {
        source.error(value.span(), format_args!("`{}` must be {}", parameter.name, parameter.range()))
    })?;
    parameter.check(&read).map_err(|e| source.error(value.span(), e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preset_reads_back() {
        for technique in crate::TECHNIQUES {
            let mut settings: Settings =
                crate::parameters_of(technique).into_iter().map(|p| (p.key(), p.default)).collect();
            if let Some(radius) = settings.get_mut("hierarchical.radius") {
                *radius = Value::Float(20.5);
            }
            let preset = Preset { technique, settings };
            let read = Preset::read(Path::new("p.toml"), &preset.to_toml()).expect("its own text");
            assert_eq!((read.technique.name, read.settings), (technique.name, preset.settings));
        }
    }

    #[test]
    fn bad_presets_name_the_line_and_the_mend() {
        for (text, wanted) in [
            ("technique = 'hierarchcal'", "p.toml:1: `technique` is wrong: no technique is called"),
            ("[settings]\nsamples = 16", "`technique` is missing"),
            ("technique = 'hierarchical'\n[settings]\nsampels = 16", "p.toml:3: unknown key `sampels`"),
            (
                "technique = 'hierarchical'\n[settings]\nsamples = 0",
                "p.toml:3: hierarchical.samples = 0 is out of range",
            ),
            ("technique = ", "p.toml:1: not valid TOML"),
        ] {
            let sentence = Preset::read(Path::new("p.toml"), text).expect_err("a bad preset").to_string();
            assert!(sentence.contains(wanted), "{sentence:?} does not say {wanted:?}");
        }
    }
}
