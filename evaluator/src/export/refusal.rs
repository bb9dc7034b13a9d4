//! Why a technique cannot be exported: it needs the scene.

use std::collections::BTreeSet;

use halflight_frame_graph::{FramePlan, ResourceKind, Work};
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Settings, SettingsError, Value},
    plan_technique, plan_technique_of_scene,
    scene::SceneFacts,
};
use halflight_scenes::bundled;

use super::INPUTS;
use crate::Error;

/// Triangles and buffers that are not textures of the caller, by name.
fn scene_resources(plan: &FramePlan) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for pass in &plan.passes {
        if let Work::Draw { .. } | Work::Voxelize { .. } = pass.work {
            found.insert("its triangles".to_owned());
        }
    }
    for resource in &plan.resources {
        match resource.kind {
            ResourceKind::External { .. } if !INPUTS.iter().any(|(name, ..)| resource.name == *name) => {
                found.insert(resource.name.clone());
            }
            _ => {}
        }
    }
    found
}

/// Checks that a plan reads textures only.
///
/// # Errors
/// One sentence that names what else it needs.
pub(super) fn check(technique: &Technique, settings: &Settings, plan: &FramePlan) -> Result<(), Error> {
    let needs = |settings: &Settings| (technique.needs)(settings).map_err(|error| Error::BadInput(error.to_string()));
    if needs(settings)?.glossy_material {
        let without = choices(technique, settings, &|changed| needs(changed).is_ok_and(|needs| !needs.glossy_material));
        return Err(Error::BadInput(format!(
            "{} cannot be exported with these settings: glossy light needs the material of each pixel and the buffer \
             scene.materials, and a plan for other engines reads textures of light and surfaces only; {}",
            technique.name,
            fix(&without)
        )));
    }
    let buffer = |kind: &ResourceKind| matches!(kind, ResourceKind::Data { .. } | ResourceKind::Buffer { .. });
    let mut needs = scene_resources(plan);
    needs.extend(
        plan.resources.iter().filter(|r| buffer(&r.kind)).map(|resource| format!("the buffer {}", resource.name)),
    );
    if needs.is_empty() {
        return Ok(());
    }
    Err(Error::BadInput(format!(
        "{} cannot be exported: it needs {}, and a plan for other engines reads textures only",
        technique.name,
        list(&needs)
    )))
}

/// Why the technique cannot be planned on textures alone: the planner's sentence where a setting is all that is wrong,
/// otherwise what it needs of a scene, with the settings that leave it out.
pub(super) fn explain(technique: &Technique, settings: &Settings, size: [u32; 2], error: SettingsError) -> Error {
    // A length of 0 stands for a share of the scene.
    let with_lengths = |settings: &Settings| {
        let mut settings = settings.clone();
        for parameter in (technique.parameters)().iter().filter(|parameter| parameter.unit == "scene units") {
            let value = settings.entry(parameter.key()).or_insert(parameter.default.clone());
            if *value == Value::Float(0.0) {
                *value = Value::Float(1.0);
            }
        }
        settings
    };
    let full = with_lengths(settings);
    if plan_technique(technique, &full, size).is_ok() {
        return Error::BadInput(error.to_string());
    }
    let Ok(needs) = needs_of_scene(technique, settings, size) else { return Error::BadInput(error.to_string()) };
    let without = choices(technique, &full, &|changed| {
        let planned = plan_technique(technique, changed, size);
        planned.is_ok_and(|plan| !plan.passes.is_empty() && scene_resources(&plan).is_empty())
    });
    Error::BadInput(format!(
        "{} cannot be exported with these settings: it needs {} of the scene, and a plan for other engines reads textures \
         only; {}",
        technique.name,
        list(&needs),
        fix(&without)
    ))
}

/// Single choices that make the settings as `wanted`, as options of a command line.
fn choices(technique: &Technique, settings: &Settings, wanted: &dyn Fn(&Settings) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    for parameter in (technique.parameters)() {
        let Kind::Choice(names) = parameter.kind else { continue };
        for name in names {
            let mut changed = settings.clone();
            changed.insert(parameter.key(), Value::Text((*name).to_owned()));
            if wanted(&changed) {
                found.push(format!("--set {}={name}", parameter.key()));
            }
        }
    }
    found
}

fn fix(without: &[String]) -> String {
    without.first().map_or("no setting leaves that out".to_owned(), |first| format!("leave that out by {first}"))
}

/// What the technique binds and draws of a scene with a lamp.
fn needs_of_scene(technique: &Technique, settings: &Settings, size: [u32; 2]) -> Result<BTreeSet<String>, String> {
    let scene = bundled::scene("cornell").map_err(|error| error.to_string())?;
    let facts = SceneFacts::of(&scene);
    let plan = plan_technique_of_scene(&facts, technique, settings, size).map_err(|error| error.to_string())?;
    let needs = scene_resources(&plan);
    if needs.is_empty() { Err("nothing".to_owned()) } else { Ok(needs) }
}

fn list(words: &BTreeSet<String>) -> String {
    words.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}
