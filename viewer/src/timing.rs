//! Times of passes: by timestamps where these are reliable, otherwise by repetition.

use std::{
    collections::VecDeque,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, Waker},
};

use halflight_frame_graph::{CompiledGraph, Dependency, Gpu, Part, Pass, When};
use web_time::Instant;

/// Number of measurements of a pass that its median is taken over.
const KEPT: usize = 31;
/// Target time of the repetitions of one pass, milliseconds: long compared with a browser's clock resolution.
const REPEATED_MS: f64 = 40.0;
/// Repetitions of a pass before its first measurement.
const FIRST_REPEATS: u32 = 2;
/// Largest number of repetitions in one submission.
const MOST_REPEATS: u32 = 64;

/// How passes are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Timestamps around each pass.
    Timestamps,
    /// By repetition, because the device has no timestamps.
    NoTimestamps,
    /// By repetition, because the browser rounds timestamps.
    CoarseTimestamps,
    /// By repetition, because a software adapter defers work, so its timestamps do not separate passes.
    Software,
}

impl Method {
    /// A note for the user about the numbers.
    pub fn note(self) -> &'static str {
        match self {
            Self::Timestamps => "measured with timestamps on the device",
            Self::NoTimestamps => {
                "this browser or device has no timestamps, so each pass is repeated and timed with the system clock"
            }
            Self::CoarseTimestamps => {
                "this browser rounds timestamps, so each pass is repeated and timed with the system clock"
            }
            Self::Software => {
                "timestamps of a software adapter do not separate passes, so each pass is repeated and timed with the \
                 system clock; compare ratios only"
            }
        }
    }
}

/// Whether a browser rounded these timestamps (nanoseconds) to 100 microseconds or to 2^16 nanoseconds.
pub fn is_coarse(nanoseconds: &[u64]) -> bool {
    [100_000, 1 << 16].iter().any(|step| nanoseconds.iter().all(|time| time % step == 0)) && !nanoseconds.is_empty()
}

/// Running medians of the times of a plan's passes.
#[derive(Debug, Default)]
pub struct Times {
    passes: Vec<(String, Part, VecDeque<f64>)>,
    /// When each pass runs. Passes that run only in the first frame do not count to the time of a frame.
    when: Vec<When>,
    /// Times of all passes of the technique together, which then have none of their own.
    together: Option<VecDeque<f64>>,
    /// Whether passes of the scene are measured, too. Their times are shown in a list only, and can take longer than the
    /// technique.
    pub of_scene: bool,
}

fn add(kept: &mut VecDeque<f64>, milliseconds: f64) {
    kept.push_back(milliseconds);
    if kept.len() > KEPT {
        kept.pop_front();
    }
}

impl Times {
    /// The passes of a compiled graph, without measurements. By repetition, passes that keep buffers from frame to frame are
    /// measured together: one that runs twice in a frame changes them twice.
    pub fn new(graph: &CompiledGraph, method: Method) -> Self {
        let pass = |pass: &Pass| (pass.name.clone(), pass.part, VecDeque::new());
        let passes = &graph.plan().passes;
        let keeps_buffers = graph.has_history() && !graph.plan().has_previous_images();
        Self {
            passes: passes.iter().map(pass).collect(),
            when: graph.plan().schedule(),
            together: (keeps_buffers && method != Method::Timestamps).then(VecDeque::new),
            of_scene: method == Method::Timestamps,
        }
    }

    /// Adds a measurement of a pass, milliseconds.
    pub fn add(&mut self, pass: usize, milliseconds: f64) {
        if let Some((_, _, kept)) = self.passes.get_mut(pass) {
            add(kept, milliseconds);
        }
    }

    /// Whether a part's passes are measured together.
    pub fn are_together(&self, part: Part) -> bool {
        part == Part::Technique && self.together.is_some()
    }

    /// Name, part and running median of each pass, milliseconds; NaN without measurements.
    pub fn medians(&self) -> impl Iterator<Item = (&str, Part, f64)> {
        self.passes.iter().map(|(name, part, kept)| (name.as_str(), *part, median(kept)))
    }

    /// Sum of the medians of a part's passes, milliseconds. Passes that run once do not count, as in the evaluator's
    /// tables.
    pub fn of_part(&self, wanted: Part) -> f64 {
        self.of_passes(|part, when| part == wanted && *when != When::Once)
    }

    /// Sum of the medians of all passes that run more than once, milliseconds: a frame in which everything has changed.
    pub fn changed_frame(&self) -> f64 {
        self.of_passes(|_, when| *when != When::Once)
    }

    /// Sum of the medians of the passes that run in every frame, milliseconds: a frame in which only the frame number has
    /// changed.
    pub fn static_frame(&self) -> f64 {
        self.of_passes(|_, when| matches!(when, When::EveryFrame(_)))
    }

    fn of_passes(&self, wanted: impl Fn(Part, &When) -> bool) -> f64 {
        let alone = |part: Part| !self.are_together(part);
        let passes = self.medians().zip(&self.when).filter(|((_, part, _), when)| alone(*part) && wanted(*part, when));
        let together = self.together.iter().filter(|_| wanted(Part::Technique, &When::EveryFrame(Dependency::Frame)));
        passes.map(|((_, _, ms), _)| ms).chain(together.map(median)).sum()
    }

    /// When a pass runs.
    pub fn when(&self, pass: usize) -> Option<&When> {
        self.when.get(pass)
    }

    /// Sum of the medians of a technique's passes, milliseconds; `None` until every pass is measured.
    pub fn technique(&self) -> Option<f64> {
        let sum = self.of_part(Part::Technique);
        (sum.is_finite() && !self.passes.is_empty()).then_some(sum)
    }

    /// Time of the technique in each round, milliseconds. Passes that run once do not count.
    pub fn of_technique(&self) -> Vec<f64> {
        let alone = self.counted().filter(|(_, part, _)| !self.are_together(*part)).map(|(_, _, kept)| kept);
        let all: Vec<_> = alone.chain(&self.together).collect();
        let rounds = all.iter().map(|kept| kept.len()).min().unwrap_or(0);
        (0..rounds).map(|round| all.iter().map(|kept| kept[kept.len() - rounds + round]).sum()).collect()
    }

    /// Name and running median of each pass of the technique, milliseconds. Passes that are measured together have equal
    /// shares.
    pub fn of_technique_passes(&self) -> Vec<(String, f64)> {
        let count = self.counted().count() as f64;
        let share = self.together.as_ref().map(|together| median(together) / count);
        self.counted().map(|(name, _, kept)| (name.clone(), share.unwrap_or_else(|| median(kept)))).collect()
    }

    /// The passes of the technique that run more than once.
    fn counted(&self) -> impl Iterator<Item = &(String, Part, VecDeque<f64>)> {
        let counts =
            |(pass, when): &(&(String, Part, VecDeque<f64>), &When)| pass.1 == Part::Technique && **when != When::Once;
        self.passes.iter().zip(&self.when).filter(counts).map(|(pass, _)| pass)
    }

    /// Whether a pass is measured by itself.
    fn is_alone(&self, part: Part) -> bool {
        !self.are_together(part) && (self.of_scene || part == Part::Technique)
    }

    /// Smallest number of measurements of any pass that is measured. Without such passes it is the largest number.
    pub fn rounds(&self) -> usize {
        let alone = self.passes.iter().filter(|(_, part, _)| self.is_alone(*part)).map(|(_, _, kept)| kept);
        alone.chain(&self.together).map(VecDeque::len).min().unwrap_or(usize::MAX)
    }
}

fn median(values: &VecDeque<f64>) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// Submitted work and the time at which it was complete.
#[derive(Clone)]
pub struct Work {
    start: Instant,
    end: Arc<Mutex<End>>,
}

#[derive(Default)]
struct End {
    at: Option<Instant>,
    waker: Option<Waker>,
}

impl Work {
    /// Submits commands and records the time.
    pub fn submit(queue: &wgpu::Queue, commands: Option<wgpu::CommandBuffer>) -> Self {
        Self::submit_then(queue, commands, || {})
    }

    /// As [`Self::submit`], and calls `done` when they are complete.
    pub fn submit_then(
        queue: &wgpu::Queue,
        commands: Option<wgpu::CommandBuffer>,
        done: impl FnOnce() + Send + 'static,
    ) -> Self {
        let end: Arc<Mutex<End>> = Arc::default();
        let recorded = end.clone();
        let start = Instant::now();
        queue.submit(commands);
        queue.on_submitted_work_done(move || {
            let mut end = recorded.lock().unwrap_or_else(PoisonError::into_inner);
            end.at = Some(Instant::now());
            end.waker.take().into_iter().for_each(Waker::wake);
            drop(end);
            done();
        });
        Self { start, end }
    }

    /// Milliseconds from submission to completion, once complete.
    pub fn milliseconds(&self) -> Option<f64> {
        Some(self.end()?.duration_since(self.start).as_secs_f64() * 1e3)
    }

    /// The time of completion, once complete.
    pub fn end(&self) -> Option<Instant> {
        self.end.lock().unwrap_or_else(PoisonError::into_inner).at
    }
}

impl Future for Work {
    type Output = f64;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<f64> {
        self.end.lock().unwrap_or_else(PoisonError::into_inner).waker = Some(context.waker().clone());
        self.milliseconds().map_or(Poll::Pending, Poll::Ready)
    }
}

/// A round of repetitions: each pass once, then several times in one submission. The difference does not contain the
/// overhead of a submission. The interface is not painted during a round, because that would be timed, too.
///
/// Passes that are measured together run in their order, so that each repetition is one more frame. Their time is the mean over
/// one submission.
pub struct Round {
    found: Arc<Mutex<Found>>,
}

#[derive(Default)]
struct Found {
    /// Number of the pass, or `None` for the passes that are measured together, and milliseconds.
    passes: Vec<(Option<usize>, f64)>,
    over: bool,
}

impl Drop for Round {
    fn drop(&mut self) {
        // Ends the round, because its textures may be freed before its next submission.
        self.found.lock().unwrap_or_else(PoisonError::into_inner).over = true;
    }
}

impl Round {
    /// Starts a round. `times` determines how often each pass is repeated. `ended` is called at the end.
    pub fn start(gpu: &Gpu, graph: &CompiledGraph, times: &Times, ended: impl Fn() + 'static) -> Self {
        let passes = || times.medians().enumerate();
        let together: Vec<usize> =
            passes().filter(|(_, (_, part, _))| times.are_together(*part)).map(|(pass, _)| pass).collect();
        let alone = passes().filter(|(_, (_, part, _))| times.is_alone(*part));
        let encode = |pass: Option<usize>, repeats: u32| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            match pass {
                Some(pass) => graph.record_repeated(&mut encoder, pass, repeats),
                None => {
                    let frames = (0..repeats).flat_map(|_| &together);
                    frames.for_each(|&pass| graph.record_repeated(&mut encoder, pass, 1));
                }
            }
            encoder.finish()
        };
        let all = alone.map(|(pass, (_, _, ms))| (Some(pass), ms));
        let jobs: Vec<_> = all
            .chain(times.together.iter().map(|kept| (None, median(kept))))
            .map(|(pass, ms)| {
                let repeats = if ms.is_finite() { (REPEATED_MS / ms.max(0.01)) as u32 } else { FIRST_REPEATS };
                let repeats = repeats.clamp(1, MOST_REPEATS);
                // Frames get cheaper while buffers converge, so a difference of two submissions would be too small. The
                // overhead of one is small beside a frame.
                let once = pass.map(|_| encode(pass, 1));
                let many = encode(pass, repeats + u32::from(once.is_some()));
                (pass, repeats, once, many)
            })
            .collect();
        let found: Arc<Mutex<Found>> = Arc::default();
        let (results, queue) = (found.clone(), gpu.queue.clone());
        let round = async move {
            // Wait for earlier submissions, such as the painting of the interface.
            Work::submit(&queue, None).await;
            // Checked before every submission: the textures of a dropped round may be destroyed.
            let is_over = || results.lock().unwrap_or_else(PoisonError::into_inner).over;
            for (pass, repeats, once, many) in jobs {
                if is_over() {
                    return;
                }
                let overhead = match once {
                    Some(once) => Work::submit(&queue, Some(once)).await,
                    None => 0.0,
                };
                if is_over() {
                    return;
                }
                let many = Work::submit(&queue, Some(many)).await;
                let each = (many - overhead).max(0.0) / f64::from(repeats);
                results.lock().unwrap_or_else(PoisonError::into_inner).passes.push((pass, each));
            }
            results.lock().unwrap_or_else(PoisonError::into_inner).over = true;
            ended();
        };
        #[cfg(target_arch = "wasm32")]
        wasm_bindgen_futures::spawn_local(round);
        #[cfg(not(target_arch = "wasm32"))]
        block_on(round, &gpu.device);
        Self { found }
    }

    /// Moves the measurements so far to `times`; true if the round is over.
    pub fn collect(&self, times: &mut Times) -> bool {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        for (pass, ms) in found.passes.drain(..) {
            match (pass, &mut times.together) {
                (Some(pass), _) => times.add(pass, ms),
                (None, Some(together)) => add(together, ms),
                (None, None) => {}
            }
        }
        found.over
    }
}

/// Runs a round to its end. A desktop window polls the device once per frame only, which is too coarse for times.
#[cfg(not(target_arch = "wasm32"))]
fn block_on(round: impl Future<Output = ()>, device: &wgpu::Device) {
    let mut round = std::pin::pin!(round);
    let mut context = Context::from_waker(Waker::noop());
    while round.as_mut().poll(&mut context).is_pending() {
        if device.poll(wgpu::PollType::wait_indefinitely()).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_median_ignores_outliers() {
        let mut times = Times {
            passes: vec![("gather".into(), Part::Technique, VecDeque::new())],
            when: vec![When::EveryFrame(Dependency::Frame)],
            together: None,
            of_scene: true,
        };
        assert_eq!(times.technique(), None);
        for value in [3.0, 900.0, 1.0, 2.0] {
            times.add(0, value);
        }
        assert_eq!(times.technique(), Some(2.5));
        (0..KEPT).for_each(|_| times.add(0, 7.0));
        assert_eq!((times.technique(), times.rounds()), (Some(7.0), KEPT));
    }

    #[test]
    fn passes_that_are_measured_together_count_once() {
        let pass = |name: &str, part| (name.to_owned(), part, VecDeque::new());
        let mut times = Times {
            passes: vec![pass("direct", Part::Direct), pass("draw", Part::Technique), pass("trace", Part::Technique)],
            when: vec![When::EveryFrame(Dependency::Frame); 3],
            together: Some(VecDeque::new()),
            of_scene: true,
        };
        times.add(0, 5.0);
        assert_eq!((times.technique(), times.rounds()), (None, 0));
        times.together = Some([7.0].into());
        assert_eq!((times.technique(), times.rounds(), times.changed_frame()), (Some(7.0), 1, 12.0));
        assert_eq!(times.of_part(Part::Direct), 5.0);
    }

    #[test]
    fn rounds_of_a_technique_are_sums_over_its_passes() {
        let pass = |name: &str, part, kept: &[f64]| (name.to_owned(), part, kept.iter().copied().collect());
        let often = When::EveryFrame(Dependency::Frame);
        let mut times = Times {
            passes: vec![
                pass("direct", Part::Direct, &[9.0, 9.0]),
                pass("once", Part::Technique, &[70.0]),
                pass("gather", Part::Technique, &[1.0, 2.0, 4.0]),
                // One measurement less: the latest ones belong together.
                pass("filter", Part::Technique, &[0.5, 0.25]),
            ],
            when: vec![often.clone(), When::Once, often.clone(), often],
            together: None,
            of_scene: false,
        };
        assert_eq!(times.of_technique(), [2.5, 4.25]);
        assert_eq!(times.of_technique_passes(), [("gather".to_owned(), 2.0), ("filter".to_owned(), 0.375)]);
        times.together = Some([6.0, 8.0, 7.0].into());
        assert_eq!(times.of_technique(), [6.0, 8.0, 7.0]);
        assert_eq!(times.of_technique_passes(), [("gather".to_owned(), 3.5), ("filter".to_owned(), 3.5)]);
    }

    #[test]
    fn only_passes_that_are_measured_count_as_rounds() {
        let pass = |part, count| ("pass".to_owned(), part, VecDeque::from(vec![1.0; count]));
        let mut times = Times {
            passes: vec![pass(Part::Direct, 0), pass(Part::Technique, 3)],
            when: vec![When::EveryFrame(Dependency::Frame); 2],
            ..Times::default()
        };
        assert_eq!(times.rounds(), 3);
        times.of_scene = true;
        assert_eq!(times.rounds(), 0);
        // Without a technique there is nothing to wait for.
        (times.of_scene, times.passes) = (false, vec![pass(Part::Direct, 0)]);
        assert_eq!(times.rounds(), usize::MAX);
    }

    #[test]
    fn rounded_timestamps_are_recognized() {
        assert!(is_coarse(&[100_000, 300_000, 0]));
        assert!(is_coarse(&[65_536, 0, 655_360]));
        assert!(!is_coarse(&[100_000, 300_001]));
        assert!(!is_coarse(&[]));
    }
}
