//! `evaluator recommend`: the settings for a budget. `halflight_recommend` chooses what to measure; this module measures
//! it on a device, keeps what was measured, and writes the answer.

use std::{path::Path, time::Instant};

use halflight_metrics::Metric;
use halflight_native::{NativeGpu, scene_hash::scene_hash};
use halflight_output::OutputFolder;
use halflight_recommend::{Advice, Answer, Family, Goal, Interval, NoAnswer, Outcome, Point, Request, Search, Stage};
use halflight_renderer::{gi::Technique, parameters::Value, plan_technique_of_scene, scene::SceneFacts, truth::is_lit};
use halflight_scenes::Scene;
use halflight_techniques::TECHNIQUES;

use crate::{
    Error,
    experiment::COMMIT,
    explain::{self, Explanation},
    progress::Progress,
};

mod measure;
mod output;
mod store;

pub use measure::{Measurer, Measuring, SETTLED_FRAME};
pub use output::Report;

/// What to recommend, and how long to look for it.
#[derive(Clone, Debug)]
pub struct Options {
    /// What is asked for.
    pub goal: Goal,
    /// The metric that decides.
    pub metric: &'static Metric,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Techniques to choose from; empty for all.
    pub techniques: Vec<&'static Technique>,
    /// How cells are measured.
    pub measuring: Measuring,
    /// Time for the search, minutes. The explanation of what remains comes after it.
    pub minutes: f64,
}

/// Pixels per row of an explanation: its exhaustive sum takes time with the fourth power.
const EXPLAINED_WIDTH: u32 = 128;
/// Frames and samples per pixel of an explanation: enough to name the largest part.
const EXPLAINED: [u32; 2] = [16, 32];
/// Widths of the reduced size, pixels. Below the first, techniques of screen space find other light than at full size;
/// above the last, nothing is gained.
const REDUCED_WIDTHS: [u32; 2] = [128, 320];

/// The size of the cells that are measured first: a quarter of the width and of the height, between 128 and 320 pixels
/// wide.
pub fn reduced(size: [u32; 2]) -> [u32; 2] {
    let width = (size[0] / 4).clamp(REDUCED_WIDTHS[0], REDUCED_WIDTHS[1]).min(size[0]);
    let height = (f64::from(size[1]) * f64::from(width) / f64::from(size[0])).round();
    [width, (height as u32).max(1)]
}

/// All candidates of these techniques; of all techniques where none is named.
pub fn families(techniques: &[&'static Technique]) -> Vec<Family> {
    let all = || TECHNIQUES.iter().map(Family::of).collect();
    if techniques.is_empty() { all() } else { techniques.iter().map(|technique| Family::of(technique)).collect() }
}

/// What would help, by the options of the command.
pub const ADVICE: Advice = Advice {
    other_techniques: "name another technique with --technique, or leave it out to search all",
    more_time: "raise --budget-ms or lower --size",
    larger_error: "raise --error-bound, or give the search more --minutes",
    other_metric: "another --metric",
};

/// What a search found, and how.
pub struct Found {
    /// The answer, or why there is none.
    pub answer: Result<Answer, NoAnswer>,
    /// The frame whose error counts, from 1, where the answer builds on frames before; `None` where all frames are alike.
    pub frame: Option<u32>,
    /// Time and error of the answer, measured once more after the search.
    pub achieved: Option<[Interval; 2]>,
    /// Seconds that the search took.
    pub seconds: f64,
    /// Whether time ended the search.
    pub stopped: bool,
}

/// Searches. With a folder, measured cells are kept in it; `resume` takes those of an earlier search.
///
/// # Errors
/// Bad input, a folder that cannot be written, or a device that was lost. That there is no answer is none.
pub fn recommend(
    native: &NativeGpu,
    scene: &Scene,
    options: &Options,
    folder: Option<&OutputFolder>,
    resume: bool,
) -> Result<Found, Error> {
    let found = |answer| Found { answer, frame: None, achieved: None, seconds: 0.0, stopped: false };
    if !is_lit(scene) {
        return Ok(found(Err(NoAnswer(format!(
            "{} has no light, so there is no indirect light to compute: add a [[light]], an emitting material or an \
             [environment]",
            scene.name
        )))));
    }
    let facts = SceneFacts::of(scene);
    let request = Request {
        goal: options.goal,
        metric: options.metric,
        size: options.size,
        reduced: reduced(options.size),
        most_cells: None,
        advice: &ADVICE,
    };
    let mut search = match Search::new(request, facts.clone(), families(&options.techniques)) {
        Ok(search) => search,
        Err(sentence) => return Ok(found(Err(sentence))),
    };
    let start = Instant::now();
    let spent = || start.elapsed().as_secs_f64() / (60.0 * options.minutes);
    let key = format!(
        "scene={} metric={} {:?} adapter={} {} commit={COMMIT}",
        scene_hash(scene),
        options.metric.key,
        options.measuring,
        native.info.name,
        native.info.driver_info
    );
    let mut store = store::Store::open(folder, resume, key)?;
    let mut measurer = Measurer::new(native, scene, options.metric, options.measuring.clone());
    let progress = Progress::new(&format!("search on {}", scene.name), 100);
    while let Some(cell) = search.next(spent()) {
        let outcome = match store.get(&cell) {
            Some(known) => known,
            None => {
                let left = (1.0 - spent()).max(0.0) * 60.0 * options.minutes;
                let outcome = measurer.measure(&cell, left)?;
                store.keep(&cell, &outcome)?;
                outcome
            }
        };
        search.report(outcome);
        let stage = match cell.stage {
            Stage::Defaults => "each technique once",
            Stage::Effects => "single settings",
            Stage::Combinations => "combinations",
            Stage::Verification | Stage::Done => "full size",
        };
        let [width, height] = cell.size;
        let message = format!("cell {}, {stage}, {width}x{height}: {}", search.cells(), cell.technique.name);
        progress.set((100.0 * search.progress(spent())) as u64, &message);
    }
    let stopped = spent() >= 1.0;
    let mut answer = search.answer();
    let (mut achieved, mut frame) = (None, None);
    if let Ok(answer) = &mut answer {
        let Point { technique, settings, .. } = &answer.point;
        let plan = plan_technique_of_scene(&facts, technique, settings, options.size);
        frame = plan.is_ok_and(|plan| plan.has_history()).then_some(SETTLED_FRAME);
        let point = &answer.point;
        let cell = halflight_recommend::Cell::full_size(point.technique, point.settings.clone(), options.size);
        if let Outcome::Measured(again) = measurer.measure(&cell, 0.0)? {
            let error = Interval::of_mean(&again.errors, again.reference_noise);
            achieved = Some([Interval::of_median(&again.times), error]);
        }
        answer.remains = if frame.is_none() { remains(native, scene, options, answer) } else { None };
    }
    let seconds = start.elapsed().as_secs_f64();
    progress.finish(&format!("search on {}: {} cells in {seconds:.0} s", scene.name, search.cells()));
    Ok(Found { answer, frame, achieved, seconds, stopped })
}

/// What remains of the error of the first bounce, from an explanation of a small image; `None` where it cannot be explained.
fn remains(native: &NativeGpu, scene: &Scene, options: &Options, answer: &Answer) -> Option<String> {
    let mut settings = answer.point.settings.clone();
    if let Some(bounces) = settings.get_mut(&format!("{}.bounces", answer.point.technique.name)) {
        *bounces = Value::Int(1);
    }
    let width = options.size[0].min(EXPLAINED_WIDTH);
    let height = (options.size[1] * width / options.size[0]).max(1);
    let [frames, samples_per_pixel] = EXPLAINED;
    let explained = explain::Options {
        technique: answer.point.technique,
        settings,
        size: [width, height],
        seed: options.measuring.seed,
        frame: 1,
        frames,
        samples_per_pixel,
        cache: Some(halflight_native::cache::Cache::standard()),
        direct_from_truth: false,
    };
    Explanation::measure(native, scene, &explained).ok().map(|explanation| {
        if options.measuring.bounces == 1 {
            explanation.advice
        } else {
            format!("of the first bounce: {}", explanation.advice)
        }
    })
}

/// Checks that the folder of an answer can be written, and reserves its files.
///
/// # Errors
/// If it holds files of these names that the program did not write, or cannot be written.
pub fn claim(folder: &Path) -> Result<OutputFolder, Error> {
    let folder = OutputFolder::open(folder);
    for name in output::FILES.into_iter().chain([store::FILE]) {
        folder.claim(name)?;
    }
    Ok(folder)
}
