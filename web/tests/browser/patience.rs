//! When a test gives up waiting.
//!
//! A fixed time limit fails on a busy computer, where the browser is slow but works. The limits here do not depend on
//! the load: a wait goes on while the browser uses the processor, and its work is limited in processor time. A wait
//! fails when the browser has become idle without the wanted result, or has worked for much longer than it needs.

use std::time::{Duration, Instant};

/// Processor time that one wait may use, seconds. The most expensive wait, five rounds of the benchmark page, uses about
/// a sixth of it.
const BUDGET: f64 = 600.0;

/// Share of one processor below which the browser counts as idle. An idle page that is polled uses 1 to 2 %. With as many
/// busy programs as processors, a page that works still gets more than 25 %.
const IDLE_SHARE: f64 = 0.05;

/// Time for which the browser must be idle before a wait fails.
const IDLE_TIME: Duration = Duration::from_secs(20);

/// The progress of one wait.
pub struct Patience {
    first: Option<f64>,
    window: Option<(Instant, f64)>,
}

impl Patience {
    /// A wait that begins now.
    pub fn new() -> Self {
        Self { first: None, window: None }
    }

    /// Restarts the idle time, after any other sign of progress.
    pub fn progress(&mut self) {
        self.window = None;
    }

    /// Takes the processor time that the browser has used since it started, seconds.
    ///
    /// # Errors
    /// The reason to give up.
    pub fn check(&mut self, used: f64, now: Instant) -> Result<(), String> {
        let first = *self.first.get_or_insert(used);
        let (since, before) = *self.window.get_or_insert((now, used));
        if used - first > BUDGET {
            return Err(format!("the browser has worked for {:.0} s of processor time", used - first));
        }
        let elapsed = now.duration_since(since).as_secs_f64();
        // The sum over all processes falls when one of them ends: that is a change, too.
        let worked = used < before || used - before > IDLE_SHARE * elapsed;
        if elapsed < IDLE_TIME.as_secs_f64() {
            return Ok(());
        }
        if !worked {
            let share = 100.0 * (used - before) / elapsed;
            return Err(format!("the browser has been idle for {elapsed:.0} s ({share:.1} % of a processor)"));
        }
        self.window = Some((now, used));
        Ok(())
    }
}

#[test]
fn a_wait_ends_when_the_browser_is_idle_or_has_worked_for_too_long() {
    let start = Instant::now();
    let at = |seconds| start + Duration::from_secs(seconds);
    // A slow browser: a quarter of a processor, for as long as it takes.
    let mut slow = Patience::new();
    assert!((0..2000).all(|second| slow.check(100.0 + 0.25 * second as f64, at(second)).is_ok()));
    let error = (2000..4000).find_map(|second| slow.check(100.0 + 0.25 * second as f64, at(second)).err());
    assert!(error.is_some_and(|error| error.contains("has worked for 600 s")));
    // An idle one.
    let mut idle = Patience::new();
    assert!((0..20).all(|second| idle.check(0.01 * second as f64, at(second)).is_ok()));
    assert!(idle.check(0.2, at(20)).is_err_and(|error| error.contains("idle for 20 s (1.0 %")));
    // Other progress counts, too.
    idle.progress();
    assert!(idle.check(0.2, at(21)).is_ok());
}
