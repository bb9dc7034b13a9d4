//! One step of the application: sides, exposure, truth and errors in line with the state, as far as the device is ready.

use eframe::egui;
use halflight_metrics::tone::auto_exposure;
use web_time::{Duration, Instant};

use super::{REST, Viewer};
use crate::{
    background::Subject,
    benchmark,
    plot::{Trade, Tried},
    readback::TextureReading,
    show::Look,
    stage::{Moment, Progress, Side, Stage},
};

/// Time between two passes of the interface while a software adapter traces: that of its batches.
const SOFTWARE_PAUSE: Duration = Duration::from_millis(300);
/// Part of the scene's diagonal whose depth shows as middle grey.
const DEPTH_RANGE: f32 = 0.25;

impl Viewer {
    /// Brings everything in line with the state and works on it as far as the device is ready.
    pub(super) fn advance(&mut self, ctx: &egui::Context, renderer: &mut eframe::egui_wgpu::Renderer) {
        #[cfg(not(target_arch = "wasm32"))]
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        self.settled = false;
        if !self.load() {
            self.ready = false;
            if self.loaded != self.state.scene {
                ctx.request_repaint();
            }
            return;
        }
        let camera = self.camera();
        let Some(mut stage) = self.stage.take() else { return };
        let lights = self.lights_now(&stage);
        if stage.relight(&self.gpu, lights) {
            self.changed = Instant::now();
        }
        let frame = if stage.moves() { self.frame() } else { 0 };
        let subject = Subject { camera, lights: stage.scene.lights.clone(), size: self.state.size, frame };
        if self.background.leave(&subject) {
            self.truth_done = false;
            self.trade = Trade::default();
        }
        // A still scene shows the same noise at rest, and another one in every frame that plays.
        let frame = if stage.moves() || self.playing.is_some() { self.frame() } else { 0 };
        let moment = Moment { camera, frame, seed: self.state.seed };
        let (mut busy, mut drawn, mut measuring) = (false, true, false);
        for index in 0..2 {
            match self.advance_side(index, &stage, moment, ctx, renderer) {
                Progress::Idle => {}
                Progress::Busy => busy = true,
                Progress::Measuring => measuring = true,
            }
            drawn &= self.sides[index].as_ref().is_none_or(Side::is_settled);
        }
        self.expose(&subject);
        if self.exposure_reading.is_some() {
            busy = true;
        }
        let resting = self.playing.is_none() && self.changed.elapsed() > REST;
        if !busy && !measuring && self.state.truth && resting && !self.truth_done {
            match self.background.step(&self.gpu, &stage, &subject) {
                Ok(more) => self.truth_done = !more,
                Err(error) => {
                    self.state.truth = false;
                    self.say(error.to_string());
                }
            }
        }
        busy |= self.judge();
        for (side, open) in self.sides.iter_mut().zip(self.checking) {
            if let Some(side) = side.as_mut().filter(|side| open && side.is_settled() && !side.is_measuring()) {
                busy |= side.scan(&self.gpu);
            }
        }
        self.stage = Some(stage);
        // What is ready now is painted in the next pass.
        let ready = drawn && self.exposure_reading.is_none() && self.playing.is_none();
        self.settled = ready && self.ready;
        busy |= ready && !self.settled;
        self.ready = ready;
        if busy || self.playing.is_some() {
            ctx.request_repaint();
        } else if self.state.truth && !self.truth_done && !measuring {
            // Software paints the interface as slowly as it traces: most of its time belongs to the tracer.
            let wait = if self.software { SOFTWARE_PAUSE } else { Duration::ZERO };
            ctx.request_repaint_after(wait);
        }
    }

    /// Draws and measures a side.
    fn advance_side(
        &mut self,
        index: usize,
        stage: &Stage,
        moment: Moment,
        ctx: &egui::Context,
        renderer: &mut eframe::egui_wgpu::Renderer,
    ) -> Progress {
        let wanted = index == 0 || self.state.compare;
        if !wanted {
            if let Some(side) = self.sides[index].take() {
                side.destroy();
            }
            self.complaints[index] = None;
            return Progress::Idle;
        }
        let (gpu, size) = (&self.gpu, self.state.size);
        let configuration = &self.state.sides[index];
        let followed = match &mut self.sides[index] {
            Some(side) => side.follow(gpu, stage, configuration, size),
            None => Side::new(gpu, stage, configuration, size).map(|side| {
                self.sides[index] = Some(side);
                true
            }),
        };
        match followed {
            Ok(changed) => {
                self.complaints[index] = None;
                if changed {
                    self.changed = Instant::now();
                }
            }
            Err(error) => self.complaints[index] = Some(error.to_string()),
        }
        let other = self.sides[1 - index].as_ref().is_some_and(Side::is_measuring);
        let Some(side) = &mut self.sides[index] else { return Progress::Idle };
        if let Some(exposure) = self.state.exposure.map(f32::exp2).or(self.exposure) {
            let look = Look { exposure, range: stage.diagonal() * DEPTH_RANGE };
            let truth = self.background.known.as_ref().map(|known| (&known.textures, known.version));
            if side.look(gpu, &self.state.view, look, truth, renderer) {
                self.ready = false;
                ctx.request_repaint();
            }
        }
        let rounds = if self.benchmark { benchmark::ROUNDS } else { 1 };
        // The first picture comes before any measurement, and one side is measured at a time.
        let measure = !other && self.playing.is_none() && (self.exposure.is_some() || self.state.exposure.is_some());
        side.draw(ctx, gpu, stage, moment, measure, rounds)
    }

    /// Finds the exposure from the direct light of A, which no setting of a technique changes.
    fn expose(&mut self, subject: &Subject) {
        if let Some((of, reading)) = &self.exposure_reading {
            if let Some(texels) = reading.take() {
                let pixels: Vec<_> = texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
                let same_picture = self.exposure.is_none() || of == subject;
                if same_picture {
                    (self.exposure, self.exposure_of) = (Some(auto_exposure(&pixels, None)), Some(of.clone()));
                }
                self.exposure_reading = None;
            }
            return;
        }
        let resting = self.playing.is_none() && self.changed.elapsed() > REST;
        let due = self.exposure.is_none() || (resting && self.exposure_of.as_ref() != Some(subject));
        if let (true, Some(side)) = (due, self.sides[0].as_ref().filter(|side| side.is_drawn()))
            && let Some(direct) = side.output("direct")
        {
            self.exposure_reading = Some((subject.clone(), TextureReading::new(&self.gpu, direct)));
        }
    }

    /// Holds the sides against the truth; true while a result is on its way.
    fn judge(&mut self) -> bool {
        let Some(known) = &self.background.known else { return false };
        let mut waiting = false;
        for side in self.sides.iter_mut().flatten().filter(|side| side.is_settled()) {
            side.read_light(&self.gpu);
            match &side.light {
                Some(light) if side.judged != known.version => {
                    side.rel_mse = Some(known.rel_mse(light));
                    side.judged = known.version;
                }
                Some(_) => {}
                None => waiting = true,
            }
            if let (Some(milliseconds), Some(rel_mse)) = (side.times.technique(), side.rel_mse)
                && side.is_measured()
                && known.is_settled()
            {
                // What the truth's own noise adds is taken off.
                let rel_mse = (rel_mse - known.noise.unwrap_or(0.0)).max(0.0);
                self.trade.add(Tried { configuration: side.configuration().clone(), milliseconds, rel_mse });
            }
        }
        waiting
    }
}
