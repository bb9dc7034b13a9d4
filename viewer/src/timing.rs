//! How long the passes take: timestamps where they can be trusted, otherwise by repetition.

use std::{
    collections::VecDeque,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, Waker},
};

use halflight_frame_graph::{CompiledGraph, Gpu, Part};
use web_time::Instant;

/// Measurements of a pass that its median is taken over.
const KEPT: usize = 31;
/// Time that the repetitions of one pass should take, milliseconds: long beside a browser's rounding of clocks.
const REPEATED_MS: f64 = 40.0;
/// Repetitions of a pass of which nothing is known yet.
const FIRST_REPEATS: u32 = 4;
/// Most repetitions of a pass in one submission.
const MOST_REPEATS: u32 = 64;

/// How passes are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Timestamps around each pass.
    Timestamps,
    /// Each pass many times over, because the device has no timestamps.
    NoTimestamps,
    /// Each pass many times over, because the browser rounds timestamps.
    CoarseTimestamps,
    /// Each pass many times over, because the adapter is software, which writes timestamps when it likes.
    Software,
}

impl Method {
    /// What somebody has to know of the numbers.
    pub fn note(self) -> &'static str {
        match self {
            Self::Timestamps => "measured by timestamps on the device",
            Self::NoTimestamps => {
                "this browser or device gives no timestamps: each pass is repeated and timed by the clock"
            }
            Self::CoarseTimestamps => {
                "this browser rounds timestamps: each pass is repeated and timed by the clock instead"
            }
            Self::Software => {
                "a software adapter, whose timestamps do not tell passes apart: each pass is repeated and timed by the \
                 clock; compare by ratio only"
            }
        }
    }
}

/// Whether these timestamps, nanoseconds, were rounded by a browser: to 100 microseconds or to 2^16 nanoseconds.
pub fn is_coarse(nanoseconds: &[u64]) -> bool {
    [100_000, 1 << 16].iter().any(|step| nanoseconds.iter().all(|time| time % step == 0)) && !nanoseconds.is_empty()
}

/// Running times of the passes of a plan.
#[derive(Debug, Default)]
pub struct Times {
    passes: Vec<(String, Part, VecDeque<f64>)>,
    /// Whether each pass runs in the first frame alone, and so is no part of a frame's time.
    once: Vec<bool>,
}

impl Times {
    /// No measurement yet of these passes.
    pub fn new(recording: &CompiledGraph) -> Self {
        let pass = |pass: &halflight_frame_graph::Pass| (pass.name.clone(), pass.part, VecDeque::new());
        let passes = &recording.plan().passes;
        Self { passes: passes.iter().map(pass).collect(), once: passes.iter().map(|pass| pass.once).collect() }
    }

    /// Takes in a measurement of a pass, milliseconds.
    pub fn add(&mut self, pass: usize, milliseconds: f64) {
        if let Some((_, _, kept)) = self.passes.get_mut(pass) {
            kept.push_back(milliseconds);
            if kept.len() > KEPT {
                kept.pop_front();
            }
        }
    }

    /// Name, part and running median of each pass, milliseconds; NaN where nothing was measured.
    pub fn medians(&self) -> impl Iterator<Item = (&str, Part, f64)> {
        self.passes.iter().map(|(name, part, kept)| (name.as_str(), *part, median(kept)))
    }

    /// Sum of the medians of a part's passes, milliseconds; those that run once are left out, as in the evaluator's tables.
    pub fn of_part(&self, wanted: Part) -> f64 {
        let in_every_frame = self.medians().zip(&self.once).filter(|(_, once)| !**once).map(|(pass, _)| pass);
        in_every_frame.filter(|(_, part, _)| *part == wanted).map(|(_, _, ms)| ms).sum()
    }

    /// Sum of the medians of a technique's passes, milliseconds; none before every pass was measured.
    pub fn technique(&self) -> Option<f64> {
        let sum = self.of_part(Part::Technique);
        (sum.is_finite() && !self.passes.is_empty()).then_some(sum)
    }

    /// Fewest measurements that any pass has.
    pub fn rounds(&self) -> usize {
        self.passes.iter().map(|(_, _, kept)| kept.len()).min().unwrap_or(0)
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

/// Work on the device, and when it was done.
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
    /// Submits, and notes the time.
    pub fn submit(queue: &wgpu::Queue, commands: Option<wgpu::CommandBuffer>) -> Self {
        let end: Arc<Mutex<End>> = Arc::default();
        let noted = end.clone();
        let start = Instant::now();
        queue.submit(commands);
        queue.on_submitted_work_done(move || {
            let mut end = noted.lock().unwrap_or_else(PoisonError::into_inner);
            end.at = Some(Instant::now());
            end.waker.take().into_iter().for_each(Waker::wake);
        });
        Self { start, end }
    }

    /// Milliseconds from submission to the end, once there is one.
    pub fn milliseconds(&self) -> Option<f64> {
        Some(self.end()?.duration_since(self.start).as_secs_f64() * 1e3)
    }

    /// When it was done.
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

/// One round of repetitions: each pass once, then many times over in one submission. The difference is free of what a
/// submission costs by itself. While a round runs the interface is not painted, because its own painting would be timed,
/// too.
pub struct Round {
    found: Arc<Mutex<Found>>,
}

#[derive(Default)]
struct Found {
    passes: Vec<(usize, f64)>,
    over: bool,
}

impl Drop for Round {
    fn drop(&mut self) {
        // Ends the round: its textures may be gone before its next submission.
        self.found.lock().unwrap_or_else(PoisonError::into_inner).over = true;
    }
}

impl Round {
    /// Starts a round; `times` says how often each pass is repeated. `ended` is called at the end.
    pub fn start(gpu: &Gpu, recording: &CompiledGraph, times: &Times, ended: impl Fn() + 'static) -> Self {
        let encode = |pass: usize, repeats: u32| {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            recording.record_repeated(&mut encoder, pass, repeats);
            encoder.finish()
        };
        let jobs: Vec<_> = times
            .medians()
            .enumerate()
            .map(|(pass, (_, _, ms))| {
                let repeats = if ms.is_finite() { (REPEATED_MS / ms.max(0.01)) as u32 } else { FIRST_REPEATS };
                let repeats = repeats.clamp(2, MOST_REPEATS);
                (pass, repeats, encode(pass, 1), encode(pass, 1 + repeats))
            })
            .collect();
        let found: Arc<Mutex<Found>> = Arc::default();
        let (results, queue) = (found.clone(), gpu.queue.clone());
        let round = async move {
            // What was submitted before, such as the painting of the interface, is waited for.
            Work::submit(&queue, None).await;
            for (pass, repeats, once, many) in jobs {
                if results.lock().unwrap_or_else(PoisonError::into_inner).over {
                    return;
                }
                let once = Work::submit(&queue, Some(once)).await;
                let many = Work::submit(&queue, Some(many)).await;
                let each = (many - once).max(0.0) / f64::from(repeats);
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

    /// Takes over what was found so far; true where the round is over.
    pub fn collect(&self, times: &mut Times) -> bool {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found.passes.drain(..).for_each(|(pass, ms)| times.add(pass, ms));
        found.over
    }
}

/// In a window nobody else waits for the device, and a clock that is read once a frame would tell nothing.
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
    fn a_median_is_robust_and_runs() {
        let mut times = Times { passes: vec![("gather".into(), Part::Technique, VecDeque::new())], once: vec![false] };
        assert_eq!(times.technique(), None);
        for value in [3.0, 900.0, 1.0, 2.0] {
            times.add(0, value);
        }
        assert_eq!(times.technique(), Some(2.5));
        (0..KEPT).for_each(|_| times.add(0, 7.0));
        assert_eq!((times.technique(), times.rounds()), (Some(7.0), KEPT));
    }

    #[test]
    fn rounded_timestamps_are_recognised() {
        assert!(is_coarse(&[100_000, 300_000, 0]));
        assert!(is_coarse(&[65_536, 0, 655_360]));
        assert!(!is_coarse(&[100_000, 300_001]));
        assert!(!is_coarse(&[]));
    }
}
