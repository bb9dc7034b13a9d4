//! `evaluator recommend` against the exhaustive sweep of the same candidates: docs/recommend.md.
//!
//!     cargo run --release -p halflight-evaluator --example recommend -- --scene atrium --scene bars
//!
//! Every candidate is measured once at full and once at reduced size. The searches are then answered from these numbers, so
//! that the load of the computer cannot change between a search and the sweep that it is compared with. Each answer is
//! measured once more at the end. Times of that are compared with those of the sweep.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::{collections::HashMap, error::Error, path::PathBuf};

use clap::Parser;
use halflight_evaluator::{
    experiment::session::{open_adapter, open_scene},
    recommend::{ADVICE, Measurer, Measuring},
};
use halflight_metrics::percentile;
use halflight_recommend::{Cell, Family, Goal, Measured, Outcome, Request, Search, metric};
use halflight_renderer::scene::SceneFacts;
use halflight_techniques::{invocation::parse_size, technique};

#[derive(Parser)]
struct Args {
    /// Scene; may be given many times.
    #[arg(long = "scene", required = true)]
    scenes: Vec<PathBuf>,
    /// Full size, pixels.
    #[arg(long, default_value = "256x144", value_parser = parse_size)]
    size: [u32; 2],
    /// Reduced size, pixels.
    #[arg(long, default_value = "128x72", value_parser = parse_size)]
    reduced: [u32; 2],
    /// Metric that decides.
    #[arg(long, default_value = "block_rel_mse")]
    metric: String,
    /// Bounces of the reference.
    #[arg(long, default_value_t = 12)]
    bounces: u32,
    /// Whether the camera moves.
    #[arg(long)]
    moving: bool,
}

/// Techniques with the parameters that are swept.
const SWEPT: [(&str, &[&str]); 6] = [
    ("radiance-cache", &["rays", "spacing"]),
    ("hierarchical", &["start_resolution", "samples", "visibility", "bounces"]),
    ("bitmask", &["resolution", "slices", "steps"]),
    ("horizon", &["slices", "steps"]),
    ("hybrid", &["start_resolution", "light_samples"]),
    ("rsm", &["start_resolution", "samples"]),
];

/// Budgets, as quantiles of the times of all candidates.
const BUDGETS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// What the searches ask for: technique, settings and size.
type Sweep = HashMap<String, Outcome>;

fn key(cell: &Cell) -> String {
    format!("{} {:?} {:?}", cell.technique.name, cell.settings, cell.size)
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let native = open_adapter("any")?;
    let metric = metric(&args.metric)?;
    println!("{} by {}, full size {:?}, reduced {:?}\n", native.info.name, metric.title, args.size, args.reduced);
    println!(
        "| scene | budget, ms | answer | time, ms | model | again | {} | model | best | regret | cells |",
        metric.title
    );
    println!("|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    for path in &args.scenes {
        let scene = open_scene(path)?.posed(0);
        let facts = SceneFacts::of(&scene);
        let measuring = Measuring { moving: args.moving, bounces: args.bounces, seed: 0 };
        let mut measurer = Measurer::new(&native, &scene, metric, measuring);
        let families: Vec<Family> = SWEPT
            .iter()
            .map(|(name, axes)| Ok(Family::of(technique(name)?).restricted(axes)))
            .collect::<Result<_, Box<dyn Error>>>()?;
        let sweep = sweep(&mut measurer, &families, &args)?;
        // Each distinct candidate at full size.
        let mut seen = Vec::new();
        let mut points: Vec<[f64; 2]> = Vec::new();
        for family in &families {
            for candidate in family.candidates() {
                let Some(planned) = family.plan(&facts, &candidate, args.size) else { continue };
                let cell = Cell::full_size(family.technique, family.settings(&candidate), args.size);
                if let (false, Some(Outcome::Measured(measured))) =
                    (seen.contains(&planned.fingerprint), sweep.get(&key(&cell)))
                {
                    points.push([percentile(&mut measured.times.clone(), 0.5), mean(measured)]);
                }
                seen.push(planned.fingerprint);
            }
        }
        for share in BUDGETS {
            let budget = percentile(&mut points.iter().map(|point| point[0]).collect::<Vec<_>>(), share);
            let request = Request {
                goal: Goal::Budget(budget),
                metric,
                size: args.size,
                reduced: args.reduced,
                most_cells: None,
                advice: &ADVICE,
            };
            let mut search = Search::new(request, facts.clone(), families.clone())?;
            while let Some(cell) = search.next(0.0) {
                let outcome = match sweep.get(&key(&cell)) {
                    Some(known) => known.clone(),
                    None => measurer.measure(&cell, 60.0)?,
                };
                search.report(outcome);
            }
            let kept = points.iter().filter(|point| point[0] <= budget).map(|point| point[1]);
            let best = kept.fold(f64::INFINITY, f64::min);
            let answer = match search.answer() {
                Ok(answer) => answer,
                Err(sentence) => {
                    println!("| {} | {budget:.2} | {sentence} ||||||{best:.4}|||", scene.name);
                    continue;
                }
            };
            let point = &answer.point;
            let cell = Cell::full_size(point.technique, point.settings.clone(), args.size);
            let again = match measurer.measure(&cell, 60.0)? {
                Outcome::Measured(measured) => percentile(&mut measured.times.clone(), 0.5),
                Outcome::TooSlow(_) | Outcome::Refused(_) => f64::NAN,
            };
            let [model_time, model_error] = answer.predicted.unwrap_or([f64::NAN; 2]);
            println!(
                "| {} | {budget:.2} | {} | {:.2} | {model_time:.2} | {again:.2} | {:.4} | {model_error:.4} | {best:.4} | \
                 {:.3} | {}/{} |",
                scene.name,
                point.label(),
                point.time_ms.value,
                point.error.value,
                point.error.value / best,
                answer.cells,
                points.len()
            );
        }
    }
    Ok(())
}

/// Measures every candidate at both sizes.
fn sweep(measurer: &mut Measurer, families: &[Family], args: &Args) -> Result<Sweep, Box<dyn Error>> {
    let mut sweep = Sweep::new();
    for size in [args.reduced, args.size] {
        let none = Cell::full_size(technique("none")?, Default::default(), size);
        sweep.insert(key(&none), measurer.measure(&none, 60.0)?);
        for family in families {
            for candidate in family.candidates() {
                let cell = Cell::full_size(family.technique, family.settings(&candidate), size);
                let outcome = measurer.measure(&cell, 60.0)?;
                sweep.insert(key(&cell), outcome);
            }
            eprintln!("{} at {size:?}: {} cells", family.technique.name, sweep.len());
        }
    }
    Ok(sweep)
}

fn mean(measured: &Measured) -> f64 {
    measured.errors.iter().sum::<f64>() / measured.errors.len() as f64
}
