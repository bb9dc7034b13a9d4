//! A plan and its shaders as files that other engines play: what `evaluator export` writes.
//!
//! The planner is a function of settings and size. [`export`] plans for many sizes and many values of each setting, and
//! writes how the plan depends on them. Where it finds no rule, the file says that it is valid for one size, or that a
//! setting needs another export.

use halflight_frame_graph::{FramePlan, Resource, ResourceId, ResourceKind, Work};
use halflight_renderer::{
    gi::{Reach, Technique},
    parameters::Settings,
    plan_technique,
};

use crate::Error;

mod comments;
pub mod document;
mod names;
mod numbers;
mod passes;
mod refusal;
pub mod rules;
pub mod sample;
mod settings;
mod shader;

use document::{Display, Document, HistoryPair, Input, Output, Texture, VERSION};
use numbers::Probes;
use rules::{Axis, Side};

/// A plan as files.
#[derive(Clone, Debug)]
pub struct Export {
    /// What plan.json says.
    pub document: Document,
    /// Name and text of each shader file.
    pub shaders: Vec<(String, String)>,
    /// The plan of the exported size.
    pub plan: FramePlan,
}

/// Exports a technique with these settings for a display of this size, pixels.
///
/// # Errors
/// A setting that its declaration does not allow, or one that needs buffers of the scene.
pub fn export(technique: &Technique, settings: &Settings, size: [u32; 2]) -> Result<Export, Error> {
    let settings = (technique.complete)(settings).map_err(|e| Error::BadInput(e.to_string()))?;
    let plan = planned(technique, &settings, size)?;
    if plan.passes.is_empty() {
        return Err(Error::BadInput(format!(
            "{} plans no pass with these settings: there is nothing to export",
            technique.name
        )));
    }
    refusal::check(technique, &settings, &plan)?;
    let probes = Probes::new(technique, &settings, &plan)?;
    let live = settings::LiveSettings::find(technique, &settings, &probes);
    let (passes, shaders) = passes::passes(technique, &plan, &probes);
    let mut notes = plan.notes.clone();
    notes.extend(left_out(technique, &settings, &plan)?);
    let document = Document {
        version: VERSION,
        program: format!("halflight {}, commit {}", env!("CARGO_PKG_VERSION"), crate::experiment::COMMIT),
        command: halflight_techniques::invocation::Invocation::evaluator("export")
            .technique(technique.name, &settings)
            .size(size)
            .to_string(),
        technique: technique.name,
        summary: technique.summary,
        display: Display {
            exported: size,
            valid: if probes.any_size() { "any" } else { "exported" },
            reason: probes.reason(),
        },
        notes,
        settings: live.document(&settings),
        inputs: inputs(&plan),
        outputs: outputs(&plan),
        textures: textures(&plan, &probes),
        histories: histories(&plan),
        uniforms: passes::uniforms(&plan, &probes, &live),
        passes,
    };
    Ok(Export { document, shaders, plan })
}

/// The plan on textures of the caller, without the passes that only make the final image: an engine adds light to its own.
fn planned(technique: &Technique, settings: &Settings, size: [u32; 2]) -> Result<FramePlan, Error> {
    let mut plan = plan_technique(technique, settings, size)
        .map_err(|error| refusal::explain(technique, settings, size, error))?;
    if let Some(image) = plan.outputs.remove("final") {
        let is_read = |plan: &FramePlan| plan.passes.iter().any(|pass| pass.reads_and_writes().0.contains(&image));
        if !is_read(&plan) {
            plan.passes.retain(|pass| pass.reads_and_writes().1 != [image]);
        }
    }
    Ok(plan)
}

/// What an exported plan does not do, one sentence each.
fn left_out(technique: &Technique, settings: &Settings, plan: &FramePlan) -> Result<Vec<String>, Error> {
    let mut notes = Vec::new();
    if plan.outputs.contains_key("indirect") {
        notes.push("The final image is direct + albedo * indirect: no pass of the plan adds them.".to_owned());
    }
    let sources = (technique.sources)(settings).map_err(|e| Error::BadInput(e.to_string()))?;
    if sources.sky != Reach::Nowhere {
        let name = technique.name;
        notes.push(format!("The light of the sky is left out: {name} tests it in voxels of the scene."));
    }
    Ok(notes)
}

fn used(plan: &FramePlan) -> Vec<(ResourceId, &Resource)> {
    let is_used = |id: ResourceId| {
        let bound = |id: ResourceId| plan.passes.iter().any(|pass| pass.bindings.iter().any(|&(_, other)| other == id));
        // Both textures of a history are used if one is.
        let pair = plan.resources.iter().enumerate().find_map(|(index, resource)| match resource.kind {
            ResourceKind::Previous { of, .. } if of == id => Some(ResourceId(index)),
            _ => None,
        });
        bound(id)
            || pair.is_some_and(bound)
            || matches!(plan.resources[id.0].kind, ResourceKind::Previous { of, .. } if bound(of))
    };
    let all = plan.resources.iter().enumerate().map(|(index, resource)| (ResourceId(index), resource));
    all.filter(|&(id, _)| is_used(id)).collect()
}

/// What the inputs are: name, meaning, formats.
const INPUTS: [(&str, &str, &[&str]); 4] = [
    (
        "depth",
        "Planar view depth in scene units, positive, in the first channel: the distance from the plane of the eye. 0 where \
         there is no surface.",
        &["r32float", "rgba32float"],
    ),
    (
        "normal",
        "Unit normal in view space (right-handed, +y up, the camera looks along -z), towards the eye. Its channels are \
         signed: a format of 0 to 1 must be decoded before.",
        &["rgba16float", "rgba32float"],
    ),
    (
        "direct",
        "Linear radiance after direct light and emission: what surfaces send to the eye without indirect light.",
        &["rgba16float", "rgba32float"],
    ),
    ("albedo", "Linear diffuse reflectance, 0 to 1.", &["rgba8unorm", "rgba16float", "rgba32float"]),
];

fn inputs(plan: &FramePlan) -> Vec<Input> {
    let used = used(plan);
    let is_used = |name: &str| used.iter().any(|(_, resource)| resource.name == name);
    let input = |(name, doc, formats): (&str, _, _)| Input { name: name.to_owned(), doc, formats };
    INPUTS.into_iter().filter(|(name, ..)| is_used(name)).map(input).collect()
}

fn outputs(plan: &FramePlan) -> Vec<Output> {
    let made =
        |&(_, &id): &(&&'static str, &ResourceId)| !matches!(plan.resources[id.0].kind, ResourceKind::External { .. });
    let output = |(name, id): (&&'static str, &ResourceId)| Output {
        name,
        texture: plan.resources[id.0].name.clone(),
        doc: match *name {
            "indirect" => "Irradiance divided by pi, linear, without albedo: final = direct + albedo * indirect.",
            "ambient_occlusion" => "Ambient visibility in the first channel: 1 is open, 0 is closed.",
            _ => "A result of the technique.",
        },
    };
    plan.outputs.iter().filter(made).map(output).collect()
}

fn histories(plan: &FramePlan) -> Vec<HistoryPair> {
    let pair = |(_, resource): (ResourceId, &Resource)| match resource.kind {
        ResourceKind::Previous { of, .. } => {
            Some(HistoryPair { now: plan.resources[of.0].name.clone(), before: resource.name.clone() })
        }
        _ => None,
    };
    used(plan).into_iter().filter_map(pair).collect()
}

/// A format as WebGPU names it.
fn format_name(format: wgpu::TextureFormat) -> String {
    format!("{format:?}").to_lowercase().replace("srgb", "-srgb")
}

fn textures(plan: &FramePlan, probes: &Probes) -> Vec<Texture> {
    let texture = |(id, resource): (ResourceId, &Resource)| {
        let (format, layers) = match resource.kind {
            ResourceKind::Texture { format, layers, .. } => (format, layers),
            ResourceKind::Previous { format, .. } => (format, 1),
            _ => return None,
        };
        let side = |axis: usize, natural| {
            probes.side(natural, 1, |plan| match plan.resources[id.0].kind {
                ResourceKind::Texture { size, .. } | ResourceKind::Previous { size, .. } => size[axis],
                _ => 0,
            })
        };
        Some(Texture {
            name: resource.name.clone(),
            format: format_name(format),
            size: [side(0, Axis::Width), side(1, Axis::Height)],
            layers,
            mips: 1,
            usage: passes::usage(plan, id),
            reason: resource.reason.clone(),
        })
    };
    used(plan).into_iter().filter_map(texture).collect()
}

/// Invocations of a pass along x and y; none for a pass that draws.
fn invocations(work: &Work) -> [u32; 2] {
    match work {
        Work::Dispatch { size, .. } => *size,
        Work::Draw { .. } | Work::Voxelize { .. } => [0; 2],
    }
}

impl Probes {
    /// The rule of a number of texels or workgroups. At the exported size alone, it is that number.
    fn side(&self, natural: Axis, per: u32, value: impl Fn(&FramePlan) -> u32) -> Side {
        Side::fit(&self.values(&value), natural, per).unwrap_or(Side::Fixed { fixed: value(self.exported()) })
    }
}
