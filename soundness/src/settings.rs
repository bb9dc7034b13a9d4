//! Settings of a technique, as the stress tests set and print them.

use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Parameter, Settings, Value},
};

/// Settings as text, without the technique's name.
pub(crate) fn words(settings: &Settings) -> String {
    let word = |(key, value): (&String, &Value)| format!("{}={value}", key.rsplit('.').next().unwrap_or(key));
    settings.iter().map(word).collect::<Vec<_>>().join(" ")
}

/// The settings with shadow maps small enough for 64 lights.
pub(crate) fn with_small_shadows(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    settings.insert("direct.shadow_map_size".into(), Value::Int(64));
    settings
}

/// A technique's parameter of this name.
pub(crate) fn parameter(technique: &Technique, name: &str) -> Option<Parameter> {
    (technique.parameters)().into_iter().find(|parameter| parameter.name == name)
}

/// The value of a technique's parameter of this name with these settings; `None` if it has no such parameter.
pub(crate) fn value(technique: &Technique, settings: &Settings, name: &str) -> Option<Value> {
    let declared = parameter(technique, name)?;
    Some(settings.get(&declared.key()).unwrap_or(&declared.default).clone())
}

/// Number of bounces with these settings.
pub(crate) fn bounces(technique: &Technique, settings: &Settings) -> u32 {
    let key = format!("{}.bounces", technique.name);
    match (settings.get(&key), parameter(technique, "bounces").map(|p| (p.kind, p.default))) {
        (Some(Value::Int(bounces)), Some((Kind::Int(..), _))) => u32::try_from(*bounces).unwrap_or(1),
        (None, Some((Kind::Int(..), Value::Int(bounces)))) => u32::try_from(bounces).unwrap_or(1),
        _ => 1,
    }
}
