//! A progress bar with the time left on a terminal, plain lines elsewhere.

use std::{
    cell::Cell,
    io::IsTerminal,
    time::{Duration, Instant},
};

use halflight_output::terminal;
use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines.
const PLAIN_INTERVAL: Duration = Duration::from_secs(15);

/// Progress of one long step.
pub struct Progress {
    bar: Option<ProgressBar>,
    what: String,
    total: u64,
    start: Instant,
    last: Cell<Instant>,
}

impl Progress {
    /// Begins a step of this many parts.
    pub fn new(what: &str, total: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{prefix} {bar:30} {pos}/{len} {eta} left  {msg}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(total).with_style(style).with_prefix(what.to_owned())
        });
        Self { bar, what: what.into(), total, start: Instant::now(), last: Cell::new(Instant::now()) }
    }

    /// Says how many parts are done.
    pub fn set(&self, done: u64, message: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(message.to_owned());
            bar.set_position(done);
        } else if self.last.get().elapsed() > PLAIN_INTERVAL {
            self.last.set(Instant::now());
            let left = if done > 0 {
                let seconds =
                    self.start.elapsed().as_secs_f64() * (self.total.saturating_sub(done)) as f64 / done as f64;
                format!(", about {seconds:.0} s left")
            } else {
                String::new()
            };
            terminal::note(format_args!("{}: {done}/{}{left}  {message}", self.what, self.total));
        }
    }

    /// Ends the step with a line that stays.
    pub fn finish(&self, message: &str) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        terminal::note(message);
    }
}
