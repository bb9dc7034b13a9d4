//! Smaller pictures while something moves, where the device is too slow for whole ones.
//!
//! They are drawn by sides of their own. The sides of the whole picture keep their times, and continue when everything is still.

use eframe::egui;
use web_time::{Duration, Instant};

use super::Viewer;
use crate::{
    side::{Inputs, Moment, Side, Wanted},
    stage::Stage,
    state::View,
};

/// Time of a frame that is aimed at.
const FRAME_MS: f64 = 1000.0 / 30.0;
/// Frames longer than this make the picture smaller, those shorter than the second make it larger. In between nothing changes,
/// because times scatter.
const BOUNDS_MS: [f64; 2] = [1.25 * FRAME_MS, 0.4 * FRAME_MS];
/// Width and height of the picture, as shares of those of the whole one.
const SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.375, 0.25];
/// Least width and height, pixels.
const LEAST: u32 = 32;
/// Time without motion after which the whole picture is drawn.
const STILL: Duration = Duration::from_millis(250);
/// Time between two changes of the size.
const PAUSE: Duration = Duration::from_millis(400);

/// The picture while something moves.
pub(super) struct Motion {
    /// Whether it may be smaller.
    pub(super) allowed: bool,
    /// When something has moved last.
    last: Option<Instant>,
    /// Index into [`SHARES`].
    share: usize,
    resized: Instant,
    sides: [Option<Side>; 2],
    /// Whether its sides are on the screen.
    shown: bool,
}

impl Default for Motion {
    fn default() -> Self {
        Self { allowed: true, last: None, share: 0, resized: Instant::now(), sides: [None, None], shown: false }
    }
}

/// The largest share whose frame takes at most [`FRAME_MS`], if that of this share takes so long. The time is taken to grow with
/// the number of pixels.
fn fitting_share(share: usize, frame_ms: f64) -> usize {
    let fits = |&other: &usize| frame_ms * (SHARES[other] / SHARES[share]).powi(2) <= FRAME_MS;
    (0..SHARES.len()).find(fits).unwrap_or(SHARES.len() - 1)
}

impl Motion {
    /// Something has moved.
    pub(super) fn moved(&mut self) {
        self.last = Some(Instant::now());
    }

    fn size(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        [width, height].map(|side| ((f64::from(side) * SHARES[self.share]).round() as u32).max(LEAST.min(side)))
    }

    /// Changes the size after a frame that took so long.
    fn adapt(&mut self, frame_ms: f64) {
        let [long, short] = BOUNDS_MS;
        if self.resized.elapsed() < PAUSE || (short..long).contains(&frame_ms) {
            return;
        }
        let fitting = fitting_share(self.share, frame_ms);
        if fitting != self.share {
            (self.share, self.resized) = (fitting, Instant::now());
        }
    }

    /// The sides of the smaller picture, where that is on the screen.
    pub(super) fn sides(&self) -> Option<&[Option<Side>; 2]> {
        self.shown.then_some(&self.sides)
    }

    /// The size of the smaller picture, where that is on the screen.
    pub(super) fn shown_size(&self) -> Option<[u32; 2]> {
        Some(self.sides()?[0].as_ref()?.plan().display_size)
    }

    /// Gives up its sides.
    pub(super) fn take(&mut self) -> impl Iterator<Item = Side> {
        (self.share, self.shown) = (0, false);
        std::mem::take(&mut self.sides).into_iter().flatten()
    }

    /// Frees what earlier passes of the interface have painted: see [`Side::free_old`].
    pub(super) fn free_old(&mut self) {
        self.sides.iter_mut().flatten().for_each(Side::free_old);
    }
}

/// Time of the last frame of all sides, which are drawn one after the other, milliseconds.
fn frame_ms(sides: &[Option<Side>; 2]) -> Option<f64> {
    sides.iter().flatten().filter_map(|side| side.frame_ms).reduce(f64::max)
}

impl Viewer {
    /// Whether the last frame of what moves was drawn.
    pub(super) fn has_drawn(&self) -> bool {
        let sides = if self.motion.share > 0 { &self.motion.sides } else { &self.sides };
        sides.iter().flatten().all(Side::is_drawn)
    }

    /// The sides that are on the screen.
    pub(super) fn visible_sides(&self) -> &[Option<Side>; 2] {
        self.motion.sides().unwrap_or(&self.sides)
    }

    /// Whether the picture is drawn in a smaller size now.
    pub(super) fn is_smaller(&mut self) -> bool {
        let moving = self.playing.is_some() || self.motion.last.is_some_and(|last| last.elapsed() < STILL);
        if !moving || !self.motion.allowed || self.benchmark || self.best.is_running() {
            (self.motion.last, self.motion.share) = (None, 0);
            return false;
        }
        if self.motion.share == 0
            && let Some(ms) = frame_ms(&self.sides)
        {
            self.motion.adapt(ms);
        }
        self.motion.share > 0
    }

    /// Draws the smaller picture; false if a side cannot be drawn in that size.
    pub(super) fn advance_smaller(
        &mut self,
        stage: &Stage,
        moment: Moment,
        ctx: &egui::Context,
        renderer: &mut eframe::egui_wgpu::Renderer,
    ) -> bool {
        let (size, view) = (self.motion.size(self.state.size), self.view());
        let keep_all = matches!(view, View::Texture(_));
        let look = self.look(stage, false);
        let wanted = Wanted { measure: false, rounds: 0, of_scene: false, smooth: false };
        for index in 0..2 {
            if index == 1 && !self.state.compare {
                self.closed.extend(self.motion.sides[index].take());
                continue;
            }
            let slot = &mut self.motion.sides[index];
            let inputs = Inputs { stage, configuration: &self.state.sides[index], size, keep_all };
            let made = Side::bring_up(slot, &self.gpu, inputs);
            let (Ok(_), Some(side)) = (made, slot) else {
                (self.motion.share, self.motion.shown) = (0, false);
                return false;
            };
            if let Some(look) = look {
                let reference = self.reference.found.as_ref().map(|found| (&found.textures, found.version));
                side.look(&self.gpu, &view, look, reference, renderer);
            }
            side.draw(ctx, &self.gpu, stage, moment, wanted);
        }
        if self.motion.sides.iter().flatten().all(Side::is_drawn) {
            self.motion.shown = true;
            if let Some(ms) = frame_ms(&self.motion.sides) {
                self.motion.adapt(ms);
            }
        }
        true
    }

    /// Shows the whole picture again once it shows this moment.
    pub(super) fn end_smaller(&mut self, moment: Moment) {
        if self.motion.shown && self.sides.iter().flatten().all(|side| side.shows(moment)) {
            self.motion.shown = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_follows_the_time_of_a_frame() {
        // Three quarters of both sides are 0.56 of the pixels, half are a quarter, and so on.
        for (share, ms, wanted) in [
            (0, 20.0, 0),
            (0, 45.0, 1),
            (0, 100.0, 2),
            (0, 200.0, 3),
            (0, 1e4, 4),
            (4, 5.0, 2),
            (4, 2.0, 0),
            (2, 8.0, 0),
        ] {
            assert_eq!(fitting_share(share, ms), wanted, "{share} {ms}");
        }
        let motion = Motion { share: 4, ..Motion::default() };
        assert_eq!((motion.size([640, 360]), motion.size([64, 20])), ([160, 90], [32, 20]));
    }
}
