//! "Best for 4 ms": searches the settings with the lowest error within a time, in the background.
//!
//! `halflight-recommend` names the next cell to measure. A cell is a [`Side`] that nobody sees, drawn and timed as A and B
//! are, and compared with a reference of its own size.

mod words;

use eframe::egui::Context;
use halflight_frame_graph::Gpu;
use halflight_recommend::{Answer, Cell, Family, Goal, Measured, NoAnswer, Outcome, Request, Search, Stage as Part};
use halflight_renderer::{gi::Technique, truth::is_lit};
use halflight_techniques::TECHNIQUES;
use web_time::{Duration, Instant};

pub use words::{found, not_found, so_far};

use crate::{
    error::{Estimate, Metric},
    reference::{Reference, ReferenceTracer, Subject},
    side::{Inputs, Moment, Progress, Side, SideTime, Wanted},
    stage::Stage,
    state::Configuration,
    timing::Method,
};

/// Time for a search. The answer that is the best by then is verified after it.
const TIME: Duration = Duration::from_secs(90);
/// Share of the time that each of the two references may take.
const REFERENCE_SHARE: f64 = 0.15;
/// Noise at which a reference is precise enough, as a share of the error of no indirect light. Both are squares. It is not
/// part of the errors: these are estimated without it.
const NOISE: f64 = 0.002;
/// Share of a reference's noise by which an error may be off: that of two halves is known to about a fifth.
const NOISE_LEFT: f64 = 0.2;
/// Width of the cells that are measured first, as a share of the picture's, and its least and largest value, pixels. As for
/// `evaluator recommend`.
const REDUCED: (u32, [u32; 2]) = (4, [128, 320]);
/// Rounds of repetitions of a cell, and of one that is verified.
const ROUNDS: [usize; 2] = [3, 7];
/// Share of the budget that is searched for where passes are timed by repetition. Two measurements of one configuration
/// differ by about a tenth there, and the answer has to keep its budget when it is measured again.
const KEPT_BY_REPETITION: f64 = 0.9;
/// Candidates that are planned between two passes of the interface: about ten milliseconds.
const PLANNED: usize = 16;
/// A technique that is a reference itself, not a choice: it takes seconds for each frame.
const NOT_FOR_FRAMES: &str = "exhaustive";

/// What is searched for.
#[derive(Clone, Debug)]
pub struct Question {
    /// Time of the technique's passes, milliseconds.
    pub budget_ms: f64,
    /// The metric that decides.
    pub metric: Metric,
    /// Techniques to choose from; empty for all.
    pub techniques: Vec<&'static Technique>,
}

/// Where a search stands after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// It goes on in the next pass.
    Working,
    /// A round of repetitions runs, which painting would disturb. It requests the next pass itself.
    Measuring,
    /// It is over: see [`BestSearch::answer`].
    Done,
}

/// A cell that is being measured.
struct Running {
    cell: Cell,
    side: Option<Box<Side>>,
}

/// A reference of one size.
#[derive(Default)]
struct OwnReference {
    tracer: ReferenceTracer,
    since: Option<Instant>,
    /// The reading that `black` belongs to.
    version: u64,
    /// The error of no indirect light.
    black: Option<Estimate>,
    /// Whether it is not refined any more.
    ready: bool,
}

/// A search that runs.
pub struct BestSearch {
    /// What is searched for.
    pub question: Question,
    /// The picture, at full size.
    subject: Subject,
    lit: bool,
    search: Search,
    /// Of the reduced and of the full size.
    references: [OwnReference; 2],
    running: Option<Running>,
    started: Instant,
    hurried: bool,
    so_far: Option<Answer>,
}

/// The size of the cells that are measured first.
fn reduced(size: [u32; 2]) -> [u32; 2] {
    let (part, [least, most]) = REDUCED;
    let width = (size[0] / part).clamp(least, most).min(size[0]);
    let height = (f64::from(size[1]) * f64::from(width) / f64::from(size[0])).round();
    [width, (height as u32).max(1)]
}

impl BestSearch {
    /// A search on this picture.
    ///
    /// # Errors
    /// One sentence where there is nothing to choose from.
    pub fn new(question: Question, stage: &Stage, subject: Subject, method: Method) -> Result<Self, NoAnswer> {
        let all = || TECHNIQUES.iter().filter(|technique| technique.name != NOT_FOR_FRAMES).collect();
        let techniques = if question.techniques.is_empty() { all() } else { question.techniques.clone() };
        // All others have their defaults, as in the interface while it is folded.
        let families =
            techniques.into_iter().map(|technique| Family::of(technique).restricted(technique.main)).collect();
        let kept = if method == Method::Timestamps { 1.0 } else { KEPT_BY_REPETITION };
        let request = Request {
            goal: Goal::Budget(question.budget_ms * kept),
            metric: halflight_recommend::metric(question.metric.column()).map_err(NoAnswer)?,
            size: subject.size,
            reduced: reduced(subject.size),
            most_cells: None,
            advice: &words::ADVICE,
        };
        Ok(Self {
            question,
            lit: is_lit(&stage.scene),
            search: Search::new(request, stage.facts.clone(), families)?,
            subject,
            references: Default::default(),
            running: None,
            started: Instant::now(),
            hurried: false,
            so_far: None,
        })
    }

    /// Whether it is about this picture.
    pub fn shows(&self, subject: &Subject) -> bool {
        self.subject == *subject
    }

    /// Measures only what the best so far needs to be the answer.
    pub fn hurry(&mut self) {
        self.hurried = true;
    }

    /// Number of cells that were measured.
    pub fn cells(&self) -> usize {
        self.search.cells()
    }

    /// A share of the work that is done, 0..=1.
    pub fn progress(&self) -> f64 {
        self.search.progress(self.spent())
    }

    /// What it does now.
    pub fn doing(&self) -> &'static str {
        match (&self.running, self.search.stage()) {
            (Some(Running { cell, side: None }), _) if !self.references[self.index(cell)].ready => {
                "tracing a reference"
            }
            (_, Part::Defaults) => "trying each technique",
            (_, Part::Effects) => "trying single settings",
            (_, Part::Combinations) => "trying combinations",
            (_, Part::Verification | Part::Done) => "measuring the best at full size",
        }
    }

    /// The best so far.
    pub fn so_far(&self) -> Option<&Answer> {
        self.so_far.as_ref()
    }

    /// What was found.
    ///
    /// # Errors
    /// One sentence where there is no answer.
    pub fn answer(&mut self) -> Result<Answer, NoAnswer> {
        self.search.answer()
    }

    /// Frees what it has on the device.
    pub fn destroy(mut self) {
        self.stop_cell();
    }

    /// Stops a round of repetitions that other work would disturb. It is repeated later.
    pub fn interrupt(&mut self) {
        if let Some(Running { side: Some(side), .. }) = &mut self.running {
            side.interrupt();
        }
    }

    fn stop_cell(&mut self) {
        if let Some(Running { side: Some(side), .. }) = self.running.take() {
            side.destroy();
        }
    }

    fn spent(&self) -> f64 {
        if self.hurried { 1.0 } else { self.started.elapsed().as_secs_f64() / TIME.as_secs_f64() }
    }

    /// 1 for cells at full size.
    fn index(&self, cell: &Cell) -> usize {
        usize::from(cell.size == self.subject.size)
    }

    /// Continues as far as the device is ready.
    ///
    /// # Errors
    /// One sentence where the scene cannot be traced on the device.
    pub fn step(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, seed: u32) -> Result<Step, NoAnswer> {
        let Some(running) = &self.running else {
            if self.search.plan_ahead(PLANNED) {
                return Ok(Step::Working);
            }
            let Some(cell) = self.search.next(self.spent()) else { return Ok(Step::Done) };
            self.running = Some(Running { cell, side: None });
            return Ok(Step::Working);
        };
        let index = self.index(&running.cell);
        if !self.references[index].ready {
            let size = running.cell.size;
            self.refine(gpu, stage, index, size)?;
            return Ok(Step::Working);
        }
        let outcome = match self.measure(ctx, gpu, stage, seed) {
            Ok(outcome) => outcome,
            Err(step) => return Ok(step),
        };
        self.stop_cell();
        self.search.report(outcome);
        self.so_far = self.search.answer().ok();
        Ok(Step::Working)
    }

    /// Traces a reference until it is precise enough or has taken its share of the time.
    fn refine(&mut self, gpu: &Gpu, stage: &Stage, index: usize, size: [u32; 2]) -> Result<(), NoAnswer> {
        let metric = self.question.metric;
        let hurried = self.hurried;
        let own = &mut self.references[index];
        let since = *own.since.get_or_insert_with(Instant::now);
        let more = match self.lit {
            true => own.tracer.step(gpu, stage, &Subject { size, ..self.subject.clone() }),
            false => Ok(false),
        };
        let more = more.map_err(|error| NoAnswer(error.to_string()))?;
        let long = hurried || since.elapsed() > TIME.mul_f64(REFERENCE_SHARE);
        if let Some(reference) = own.tracer.found.as_ref().filter(|reference| reference.version != own.version) {
            own.version = reference.version;
            own.black = reference.estimate(&black(size), metric);
        }
        let precise = own.black.is_some_and(|black| black.noise <= NOISE * black.square);
        own.ready = !more || precise || (long && own.black.is_some());
        Ok(())
    }

    /// Measures a cell as far as the device is ready: its result, or what it waits for.
    fn measure(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, seed: u32) -> Result<Outcome, Step> {
        let Some(Running { cell, side }) = &mut self.running else { return Err(Step::Working) };
        let full = cell.size == self.subject.size;
        let reference = &self.references[usize::from(full)];
        let metric = self.question.metric;
        let noise = reference.black.map_or(0.0, |black| black.noise);
        let measured = |times, passes, error: Estimate| {
            let errors = vec![metric.of_square(error.square.max(0.0))];
            Outcome::Measured(Measured { times, passes, errors, reference_noise: metric.of_square(NOISE_LEFT * noise) })
        };
        if cell.technique.name == "none" {
            // The error of nothing is known without a measurement; without a surface it is not defined.
            let surfaces = reference.tracer.found.as_ref().is_none_or(Reference::has_surfaces);
            let unlit = Estimate { square: 0.0, noise: 0.0 };
            return Ok(match surfaces {
                true => measured(Vec::new(), Vec::new(), reference.black.unwrap_or(unlit)),
                false => Outcome::Measured(Measured { errors: vec![f64::NAN], ..Measured::default() }),
            });
        }
        let side = match side {
            Some(side) => side,
            None => {
                let settings = cell.settings.clone();
                let configuration = Configuration { technique: cell.technique.name, settings };
                let inputs = Inputs { stage, configuration: &configuration, size: cell.size, keep_all: false };
                match Side::new(gpu, inputs) {
                    Ok(new) => side.insert(Box::new(new)),
                    Err(refused) => return Ok(Outcome::Refused(refused.to_string())),
                }
            }
        };
        let rounds = ROUNDS[usize::from(cell.stage == Part::Verification)];
        // Repetitions continue a history. Timed frames replace the light that was read.
        let measure = side.method == Method::Timestamps || side.light.is_some();
        let moment = Moment { camera: self.subject.camera, frame: self.subject.frame, seed };
        match side.draw(ctx, gpu, stage, moment, Wanted { measure, rounds, of_scene: false, smooth: false }) {
            Progress::Busy | Progress::Waiting => return Err(Step::Working),
            Progress::Measuring => {
                let slow = side.times.technique().filter(|&ms| ms > cell.slowest_ms);
                return slow.map(Outcome::TooSlow).ok_or(Step::Measuring);
            }
            Progress::Idle | Progress::Smoothing => side.read_light(gpu),
        }
        let times = match side.time(rounds) {
            SideTime::Known(_) => side.times.of_technique(),
            SideTime::NoPasses => vec![0.0],
            SideTime::Measuring { .. } => return Err(Step::Working),
        };
        let Some(light) = &side.light else { return Err(Step::Working) };
        let found = reference.tracer.found.as_ref().and_then(|reference| reference.estimate(light, metric));
        match found {
            Some(estimate) => Ok(measured(times, side.times.of_technique_passes(), estimate)),
            None => Ok(Outcome::Refused("the reference has too few samples: search again".into())),
        }
    }
}

/// A picture without indirect light.
fn black(size: [u32; 2]) -> Vec<[f32; 3]> {
    vec![[0.0; 3]; size[0] as usize * size[1] as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_first_measured_at_a_quarter_of_the_width() {
        assert_eq!(reduced([1280, 720]), [320, 180]);
        assert_eq!(reduced([640, 360]), [160, 90]);
        assert_eq!(reduced([3840, 2160]), [320, 180]);
        // A small picture is its own reduced size.
        assert_eq!(reduced([96, 54]), [96, 54]);
        assert_eq!(reduced([300, 1]), [128, 1]);
    }
}
