//! `evaluator plan`.

use std::{fmt, io::Write, path::PathBuf};

use clap::Args;
use halflight_frame_graph::{Demand, DeviceLimits, FramePlan, ResourceId};
use halflight_native::files::write_whole;
use halflight_output::terminal;
use halflight_renderer::{PlanInputs, parameters::Settings, plan_frame, plan_within, scene::SceneFacts};
use halflight_techniques::invocation::parse_size;
use serde::Serialize;

use super::{SceneArgs, TechniqueArgs, print_json, print_warnings};
use crate::{
    Error,
    experiment::session::{open_adapter, open_scene},
    plan_graph,
};

#[derive(Args)]
pub(super) struct PlanArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Image size, pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Check the plan against what every browser guarantees, or against an adapter.
    #[arg(long, value_name = "WHOSE", value_parser = ["browser", "device"])]
    limits: Option<String>,
    /// Adapter of --limits device: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Draw the plan as a graph, too: an SVG picture.
    #[arg(long, value_name = "FILE.svg")]
    graph: Option<PathBuf>,
}

/// A plan, and its check if there is one.
#[derive(Serialize)]
struct Checked<'a> {
    #[serde(flatten)]
    plan: &'a FramePlan,
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<Check>,
}

/// A plan against the limits of a device.
#[derive(Serialize)]
struct Check {
    /// Whose limits.
    of: String,
    /// Why the device cannot hold the plan, and what would fit; `None` if it can.
    too_large: Option<String>,
    /// The largest demand of each limit.
    demands: Vec<Demand>,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.too_large {
            None => writeln!(f, "\nThe plan fits {}", self.of)?,
            Some(sentence) => writeln!(f, "\nThe plan does not fit {}: {sentence}", self.of)?,
        }
        self.demands.iter().try_for_each(|demand| writeln!(f, "      {demand}"))
    }
}

/// A plan as JSON; `when` of a pass says when it runs, and `in_memory_of` of a resource whose memory it uses, too. All
/// bytes are whole numbers.
fn with_schedule(checked: &Checked) -> Result<serde_json::Value, Error> {
    let mut value = serde_json::to_value(checked).map_err(|e| Error::Failed(e.to_string()))?;
    let passes = value["passes"].as_array_mut().into_iter().flatten();
    for (pass, when) in passes.zip(checked.plan.schedule()) {
        pass["when"] = when.to_string().into();
    }
    let (plan, memory) = (checked.plan, checked.plan.memory());
    let resources = value["resources"].as_array_mut().into_iter().flatten();
    for (index, resource) in resources.enumerate() {
        let owner = memory.owner(ResourceId(index));
        resource["bytes"] = plan.resources[index].bytes().into();
        if owner.0 != index {
            resource["in_memory_of"] = plan.resources[owner.0].name.as_str().into();
        }
    }
    value["bytes"] = serde_json::json!({
        "allocated": plan.bytes(),
        "live_at_once": plan.live_bytes(),
        "technique_allocated": plan.technique_bytes(),
        "technique_live_at_once": plan.live_technique_bytes(),
    });
    Ok(value)
}

pub(super) fn plan(args: &PlanArgs) -> Result<(), Error> {
    let (technique, settings) = args.technique.resolve()?;
    let scene = open_scene(&args.scene.scene)?;
    print_warnings(&scene.warnings);
    let facts = SceneFacts::of(&scene);
    let make = |settings: &Settings, size| plan_frame(&facts, technique, settings, size, Default::default());
    let mut plan = make(&settings, args.size).map_err(|e| Error::BadInput(e.to_string()))?;
    let limits = match args.limits.as_deref() {
        None => None,
        Some("device") => {
            let native = open_adapter(&args.adapter)?;
            Some((native.info.name.clone(), native.gpu.limits()))
        }
        Some(_) => Some(("every browser".to_owned(), DeviceLimits::browser())),
    };
    let check = |(of, device): (String, DeviceLimits)| {
        let inputs = PlanInputs { parameters: &(technique.parameters)(), settings: &settings, size: args.size };
        let too_large = plan_within(&device, &facts, inputs, &make).err().map(|error| error.to_string());
        Check { of, too_large, demands: plan.demands(&device, &|name| facts.size.buffer(name)) }
    };
    let limits = limits.map(check);
    plan.notes.extend(scene.warnings);
    if let Some(path) = &args.graph {
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("svg")) {
            return Err(Error::BadInput(format!("--graph {} is no .svg: name it so", path.display())));
        }
        let picture = plan_graph::svg(&plan);
        write_whole(path, |file| file.write_all(picture.as_bytes())).map_err(|e| Error::unwritable(path, e))?;
    }
    if args.json {
        return print_json(&with_schedule(&Checked { plan: &plan, limits })?);
    }
    terminal::print(&plan)?;
    limits.map_or(Ok(()), |check| Ok(terminal::print(check)?))
}
