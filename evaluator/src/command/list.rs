//! `evaluator list`.

use clap::{Args, ValueEnum};
use halflight_output::terminal;
use halflight_renderer::frame_parameters;
use halflight_techniques::{TECHNIQUES, parameters_of};
use serde_json::json;

use super::print_json;
use crate::Error;

#[derive(Args)]
pub(super) struct ListArgs {
    /// What to list.
    what: What,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    Techniques,
    Parameters,
    Adapters,
    Scenes,
}

pub(super) fn main(args: &ListArgs) -> Result<(), Error> {
    let rows: Vec<serde_json::Value> = match args.what {
        What::Techniques => TECHNIQUES.iter().map(|t| json!({ "name": t.name, "summary": t.summary })).collect(),
        What::Parameters => {
            let mut all: Vec<_> = TECHNIQUES.iter().flat_map(parameters_of).collect();
            // Those of every frame come last.
            let of_frames = frame_parameters();
            all.sort_by_key(|p| of_frames.iter().position(|other| other.key() == p.key()));
            all.dedup_by_key(|p| p.key());
            all.iter()
                .map(|p| {
                    let summary = format!("{} (default {}; {}{})", p.doc, p.default, p.range(), unit(p.unit));
                    json!({
                        "name": p.key(), "default": p.default, "range": p.range(), "unit": p.unit,
                        "grid": p.grid, "doc": p.doc, "summary": summary
                    })
                })
                .collect()
        }
        What::Adapters => (1..)
            .zip(halflight_native::adapters())
            .map(|(number, info)| {
                let driver = format!("{} {}", info.driver, info.driver_info);
                let summary = format!("--adapter {number}: {:?}, {:?}, {driver}", info.device_type, info.backend);
                json!({ "name": info.name, "number": number, "summary": summary })
            })
            .collect(),
        What::Scenes => halflight_scenes::bundled::NAMES
            .iter()
            .map(|name| json!({ "name": name, "summary": format!("bundled: scenes/{name}.toml") }))
            .collect(),
    };
    if args.json {
        return print_json(&rows);
    }
    let text = |row: &serde_json::Value, key: &str| row[key].as_str().unwrap_or_default().to_owned();
    let lines = rows.iter().map(|row| format!("{:<34} {}\n", text(row, "name"), text(row, "summary")));
    Ok(terminal::print(lines.collect::<String>())?)
}

fn unit(unit: &str) -> String {
    if matches!(unit, "" | "1") { String::new() } else { format!(" {unit}") }
}
