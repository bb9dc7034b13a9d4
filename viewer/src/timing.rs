//! How long the passes take: timestamps where they can be trusted, otherwise by repetition.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

use halflight_renderer::{Gpu, Recording, plan::Part};
use web_time::Instant;

/// Measurements of a pass that its median is taken over.
const KEPT: usize = 31;
/// Time that the repetitions of one pass should take, milliseconds: long beside a browser's rounding of clocks.
const REPEATED_MS: f64 = 40.0;
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
}

impl Times {
    /// No measurement yet of these passes.
    pub fn new(recording: &Recording) -> Self {
        let pass = |pass: &halflight_renderer::plan::Pass| (pass.name.clone(), pass.part, VecDeque::new());
        Self { passes: recording.plan().passes.iter().map(pass).collect() }
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

    /// Sum of the medians of a technique's passes, milliseconds; none before every pass was measured.
    pub fn technique(&self) -> Option<f64> {
        let sum: f64 = self.medians().filter(|(_, part, _)| *part == Part::Technique).map(|(_, _, ms)| ms).sum();
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
pub struct Work {
    start: Instant,
    end: Arc<Mutex<Option<Instant>>>,
}

impl Work {
    /// Submits, and notes the time.
    pub fn submit(gpu: &Gpu, commands: Option<wgpu::CommandBuffer>) -> Self {
        let end = Arc::new(Mutex::new(None));
        let noted = end.clone();
        let start = Instant::now();
        gpu.queue.submit(commands);
        gpu.queue.on_submitted_work_done(move || {
            *noted.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        });
        Self { start, end }
    }

    /// Milliseconds from submission to the end, once there is one.
    pub fn milliseconds(&self) -> Option<f64> {
        let end = (*self.end.lock().unwrap_or_else(PoisonError::into_inner))?;
        Some(end.duration_since(self.start).as_secs_f64() * 1e3)
    }
}

/// Times each pass by repetition: once, then many times over in one submission; the difference is free of what a
/// submission costs by itself.
#[derive(Default)]
pub struct Repeater {
    pass: usize,
    once: Option<f64>,
    running: Option<(Work, u32)>,
}

impl Repeater {
    /// Goes on where the device is ready; false while it waits for it.
    pub fn step(&mut self, gpu: &Gpu, recording: &Recording, times: &mut Times) -> bool {
        let mut next = 1;
        if let Some((work, repeats)) = &self.running {
            // In a window nobody else waits for the device, and a clock read once a frame would tell nothing.
            #[cfg(not(target_arch = "wasm32"))]
            let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
            let Some(took) = work.milliseconds() else { return false };
            match self.once {
                Some(once) => {
                    times.add(self.pass, (took - once).max(0.0) / f64::from(repeats - 1));
                    self.once = None;
                    self.pass = (self.pass + 1) % recording.plan().passes.len().max(1);
                }
                None => {
                    self.once = Some(took);
                    next = 1 + (REPEATED_MS / took.max(0.1)).clamp(1.0, f64::from(MOST_REPEATS)) as u32;
                }
            }
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if self.pass < recording.plan().passes.len() {
            recording.record_repeated(&mut encoder, self.pass, next);
        }
        self.running = Some((Work::submit(gpu, Some(encoder.finish())), next));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_robust_and_runs() {
        let mut times = Times { passes: vec![("gather".into(), Part::Technique, VecDeque::new())] };
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
