//! One step of the application: updates sides, exposure, reference and errors as far as the device is ready.

use eframe::egui;
use halflight_metrics::tone::auto_exposure;
use web_time::{Duration, Instant};

use super::{REST, Viewer};
use crate::{
    best::Step,
    error::Metric,
    messages::Severity,
    plot::{Trade, Tried},
    readback::TextureReading,
    reference::{ALL_BOUNCES, Subject},
    show::Look,
    side::{Inputs, Moment, NotMade, Progress, Side, SideTime, Wanted},
    stage::Stage,
    state::{Bounces, View},
};

/// Time between two passes of the interface while a software adapter traces: about that of its batches.
const SOFTWARE_PAUSE: Duration = Duration::from_millis(300);
/// The same while a frame is drawn, in case that something else than the frame is waited for.
const SOFTWARE_WAIT: Duration = Duration::from_millis(100);
/// The same while it measures configurations: a step often waits for less.
const SOFTWARE_STEP: Duration = Duration::from_millis(30);
/// Depth that is shown as middle grey, as a fraction of the diagonal of what is looked at.
const DEPTH_RANGE: f32 = 0.25;

impl Viewer {
    /// Updates everything from the state, as far as the device is ready.
    pub(super) fn advance(&mut self, ctx: &egui::Context, renderer: &mut eframe::egui_wgpu::Renderer) {
        #[cfg(not(target_arch = "wasm32"))]
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        self.settled = false;
        if !self.load(ctx) {
            self.ready = false;
            return;
        }
        let camera = self.camera();
        let Some(mut stage) = self.stage.take() else { return };
        let lights = self.lights_now(&stage);
        if stage.relight(&self.gpu, lights) {
            self.changed = Instant::now();
        }
        stage.look_from(camera);
        let frame = if stage.is_animated() { self.frame() } else { 0 };
        let bounces = match self.state.reference_bounces() {
            Bounces::All => ALL_BOUNCES,
            Bounces::Number(bounces) => bounces.min(ALL_BOUNCES),
        };
        let subject = Subject { camera, lights: stage.scene.lights.clone(), size: self.state.size, frame, bounces };
        if self.reference.reset_unless(&subject) {
            self.reference_done = false;
            self.trade = Trade::default();
            self.sides.iter_mut().flatten().for_each(Side::forget_errors);
        }
        // A static scene has the same noise in every frame, unless a light is playing.
        let frame = if stage.is_animated() || self.playing.is_some() { self.frame() } else { 0 };
        let moment = Moment { camera, frame, seed: self.state.seed };
        let (mut busy, mut drawn, mut measuring, mut smoothing) = (false, true, false, false);
        let smaller = self.is_smaller() && self.advance_smaller(&stage, moment, ctx, renderer);
        if smaller {
            (busy, drawn) = (true, false);
        }
        for index in (0..2).filter(|_| !smaller) {
            match self.advance_side(index, &stage, moment, ctx, renderer) {
                Progress::Idle => {}
                Progress::Waiting => drawn = false,
                Progress::Busy => busy = true,
                Progress::Measuring => measuring = true,
                Progress::Smoothing => smoothing = true,
            }
            drawn &= self.sides[index].as_ref().is_none_or(Side::is_settled);
        }
        self.end_smaller(moment);
        self.expose(&subject);
        if self.exposure_reading.is_some() {
            busy = true;
        }
        let resting = self.playing.is_none() && self.changed.elapsed() > REST;
        let searching = self.best.is_running();
        if resting && (searching || self.state.reference) {
            self.load_posed(ctx, &mut stage, subject.frame);
        }
        if busy || measuring {
            self.best.interrupt();
        } else if searching && resting && stage.traceable(subject.frame).is_some() {
            match self.step_best(ctx, &stage, &subject) {
                Some(Step::Measuring) => measuring = true,
                _ => ctx.request_repaint_after(if self.software { SOFTWARE_STEP } else { Duration::ZERO }),
            }
        }
        let quiet = !busy && !measuring && !smoothing && !searching;
        if quiet && self.state.reference && resting && !self.reference_done {
            match self.reference.step(&self.gpu, &stage, &subject) {
                Ok(more) => self.reference_done = !more,
                Err(error) => {
                    self.state.reference = false;
                    self.messages.add(Severity::Warning, format!("{error}; the reference is switched off"));
                }
            }
        }
        busy |= self.measure_error();
        busy |= self.finish_focus();
        busy |= self.finish_saving();
        for (side, open) in self.sides.iter_mut().zip(self.checking) {
            if let Some(side) = side.as_mut().filter(|side| open && side.is_settled() && !side.is_measuring()) {
                busy |= side.check(&self.gpu);
            }
        }
        self.stage = Some(stage);
        // The interface shows the current results in the next pass.
        let ready = drawn && self.exposure_reading.is_none() && self.playing.is_none();
        self.settled = ready && self.ready;
        let again = ready && !self.settled;
        self.ready = ready;
        if again {
            ctx.request_repaint();
        } else if busy || smoothing || self.playing.is_some() {
            // In a browser, the device says when a frame is complete. Painting takes a software adapter as long as much of its
            // work, so there nothing is painted meanwhile.
            let told = cfg!(target_arch = "wasm32") && self.software && self.state.metric != Metric::Flip;
            ctx.request_repaint_after(if told { SOFTWARE_WAIT } else { Duration::ZERO });
        } else if self.state.reference && !self.reference_done && !measuring && !searching {
            // A software adapter paints the interface slowly, so it spends most of its time on tracing.
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
            // It may be painted in this pass.
            self.closed.extend(self.sides[index].take());
            self.side_errors[index] = None;
            return Progress::Idle;
        }
        // A device works in order: the picture of A is on the screen before the work for B begins.
        if index == 1 && self.first_picture.is_none() && self.side_errors[0].is_none() {
            return Progress::Waiting;
        }
        let view = self.view();
        let (gpu, size) = (&self.gpu, self.state.size);
        let configuration = &self.state.sides[index];
        // Other textures take over the memory of single steps, unless somebody looks at them.
        let keep_all = self.checking[index] || matches!(view, View::Texture(_));
        let inputs = Inputs { stage, configuration, size, keep_all };
        match Side::bring_up(&mut self.sides[index], gpu, inputs) {
            Ok(changed) => {
                self.side_errors[index] = None;
                if changed {
                    self.changed = Instant::now();
                }
            }
            Err(reason) => {
                self.side_errors[index] = Some(reason.to_string());
                if matches!(reason, NotMade::Waits) {
                    return Progress::Waiting;
                }
            }
        }
        let rounds = self.rounds();
        let other = self.sides[1 - index].as_ref().map(|side| (side.is_measuring(), side.times.rounds()));
        let measures = |side: &Side| matches!(side.time(rounds), SideTime::Measuring { .. });
        let timed = !self.sides.iter().flatten().any(measures);
        let look = self.look(stage, self.state.antialiasing);
        let Some(side) = &mut self.sides[index] else { return Progress::Idle };
        if let Some(look) = look {
            let reference = self.reference.found.as_ref().map(|found| (&found.textures, found.version));
            if side.look(gpu, &view, look, reference, renderer) {
                self.ready = false;
                ctx.request_repaint();
            }
        }
        // The sides take turns, so that both are measured under the same load, and not at once.
        let own = side.times.rounds();
        let turn = other.is_none_or(|(measuring, done)| !measuring && (own <= done || done >= rounds));
        // Measurements start after the first picture, and when nothing else works on the scene.
        let measure = turn
            && self.playing.is_none()
            && self.loads.step().is_none()
            && (self.exposure.is_some() || self.state.exposure.is_some());
        // Times would count the samples, too, and a software adapter finds the errors first.
        let known = side.errors.get(self.state.metric).is_some() || self.reference_done || !self.state.reference;
        let still = self.playing.is_none() && self.changed.elapsed() > REST && !self.best.is_running();
        let smooth = still && timed && !self.benchmark && (known || !self.software);
        let wanted = Wanted { measure, rounds, of_scene: self.benchmark || self.listing[index], smooth };
        side.draw(ctx, gpu, stage, moment, wanted)
    }

    /// How pictures are shown; `None` while their exposure is not known.
    pub(super) fn look(&self, stage: &Stage, averaged: bool) -> Option<Look> {
        Some(Look { exposure: self.exposure_in_use()?, range: stage.diagonal() * DEPTH_RANGE, averaged })
    }

    /// Determines the exposure from the direct light of side A, which does not depend on a technique's settings.
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
            let ctx = self.ctx.clone();
            let reading = TextureReading::then(&self.gpu, direct, move || ctx.request_repaint());
            self.exposure_reading = Some((subject.clone(), reading));
        }
    }

    /// Compares the sides with the reference; true while a result is pending.
    fn measure_error(&mut self) -> bool {
        let rounds = self.rounds();
        let exposure = self.exposure_in_use();
        let Some(reference) = &self.reference.found else { return false };
        let mut waiting = false;
        // FLIP takes long, so it is computed only while it is shown.
        let key = exposure.filter(|_| self.state.metric == Metric::Flip).map(|of| (reference.version, of.to_bits()));
        let has_two = !reference.pictures[1].is_empty();
        let noise = key.filter(|_| has_two).and_then(|key| {
            let [latest, before] = &reference.pictures;
            let noise = self.reference_noise.step(key, reference, || Some([latest, before]));
            waiting |= noise.is_none();
            noise
        });
        for side in self.sides.iter_mut().flatten().filter(|side| side.is_settled()) {
            side.read_light(&self.gpu);
            match &side.light {
                Some(light) if side.compared_with != reference.version => {
                    reference.compare(light, &mut side.errors);
                    side.compared_with = reference.version;
                }
                Some(_) => {}
                None => waiting = true,
            }
            if let (Some(key), Some(noise)) = (key, noise) {
                waiting |= side.compare_seen(&self.gpu, key, reference, noise);
            }
            let errors = Metric::ALL.map(|metric| side.errors.get(metric).map(|error| error.value()));
            let milliseconds = match side.time(rounds) {
                SideTime::Known(ms) => ms,
                SideTime::NoPasses => 0.0,
                SideTime::Measuring { .. } => continue,
            };
            if errors.iter().any(Option::is_some) {
                self.trade.add(Tried { configuration: side.configuration().clone(), milliseconds, errors });
            }
        }
        waiting
    }
}
