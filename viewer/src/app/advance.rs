//! One step of the application: updates sides, exposure, reference and errors as far as the device is ready.

use eframe::egui;
use halflight_metrics::tone::auto_exposure;
use web_time::{Duration, Instant};

use super::{REST, Viewer};
use crate::{
    benchmark,
    plot::{Trade, Tried},
    readback::TextureReading,
    reference::Subject,
    show::Look,
    side::{Moment, Progress, Side},
    stage::Stage,
    state::View,
};

/// Time between two passes of the interface while a software adapter traces: about that of its batches.
const SOFTWARE_PAUSE: Duration = Duration::from_millis(300);
/// Depth that is shown as middle grey, as a fraction of the diagonal of what is looked at.
const DEPTH_RANGE: f32 = 0.25;

impl Viewer {
    /// Updates everything from the state, as far as the device is ready.
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
        stage.look_from(camera);
        let frame = if stage.is_animated() { self.frame() } else { 0 };
        let subject = Subject { camera, lights: stage.scene.lights.clone(), size: self.state.size, frame };
        if self.reference.reset_unless(&subject) {
            self.reference_done = false;
            self.trade = Trade::default();
        }
        // A static scene has the same noise in every frame, unless a light is playing.
        let frame = if stage.is_animated() || self.playing.is_some() { self.frame() } else { 0 };
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
        if !busy && !measuring && self.state.reference && resting && !self.reference_done {
            match self.reference.step(&self.gpu, &stage, &subject) {
                Ok(more) => self.reference_done = !more,
                Err(error) => {
                    self.state.reference = false;
                    self.say(error.to_string());
                }
            }
        }
        busy |= self.measure_error();
        for (side, open) in self.sides.iter_mut().zip(self.checking) {
            if let Some(side) = side.as_mut().filter(|side| open && side.is_settled() && !side.is_measuring()) {
                busy |= side.check(&self.gpu);
            }
        }
        self.stage = Some(stage);
        // The interface shows the current results in the next pass.
        let ready = drawn && self.exposure_reading.is_none() && self.playing.is_none();
        self.settled = ready && self.ready;
        busy |= ready && !self.settled;
        self.ready = ready;
        if busy || self.playing.is_some() {
            ctx.request_repaint();
        } else if self.state.reference && !self.reference_done && !measuring {
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
            if let Some(side) = self.sides[index].take() {
                side.destroy();
            }
            self.side_errors[index] = None;
            return Progress::Idle;
        }
        let (gpu, size) = (&self.gpu, self.state.size);
        let configuration = &self.state.sides[index];
        // Other textures take over the memory of single steps, unless somebody looks at them.
        let keep_all = self.checking[index] || matches!(self.state.view, View::Texture(_));
        let updated = match &mut self.sides[index] {
            Some(side) => side.update(gpu, stage, configuration, size, keep_all),
            None => Side::new(gpu, stage, configuration, size, keep_all).map(|side| {
                self.sides[index] = Some(side);
                true
            }),
        };
        match updated {
            Ok(changed) => {
                self.side_errors[index] = None;
                if changed {
                    self.changed = Instant::now();
                }
            }
            Err(error) => self.side_errors[index] = Some(error.to_string()),
        }
        let other = self.sides[1 - index].as_ref().is_some_and(Side::is_measuring);
        let Some(side) = &mut self.sides[index] else { return Progress::Idle };
        if let Some(exposure) = self.state.exposure.map(f32::exp2).or(self.exposure) {
            let look = Look { exposure, range: stage.diagonal() * DEPTH_RANGE };
            let reference = self.reference.found.as_ref().map(|found| (&found.textures, found.version));
            if side.look(gpu, &self.state.view, look, reference, renderer) {
                self.ready = false;
                ctx.request_repaint();
            }
        }
        let rounds = if self.benchmark { benchmark::ROUNDS } else { 1 };
        // Measurements start after the first picture. Only one side is measured at a time.
        let measure = !other && self.playing.is_none() && (self.exposure.is_some() || self.state.exposure.is_some());
        side.draw(ctx, gpu, stage, moment, measure, rounds)
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
            self.exposure_reading = Some((subject.clone(), TextureReading::new(&self.gpu, direct)));
        }
    }

    /// Compares the sides with the reference; true while a result is pending.
    fn measure_error(&mut self) -> bool {
        let Some(reference) = &self.reference.found else { return false };
        let mut waiting = false;
        for side in self.sides.iter_mut().flatten().filter(|side| side.is_settled()) {
            side.read_light(&self.gpu);
            match &side.light {
                Some(light) if side.compared_with != reference.version => {
                    let [pixels, blocks] = reference.rel_mse(light);
                    (side.rel_mse, side.block_rel_mse) = (Some(pixels), Some(blocks));
                    side.compared_with = reference.version;
                }
                Some(_) => {}
                None => waiting = true,
            }
            if let (Some(milliseconds), Some(rel_mse)) = (side.times.technique(), side.rel_mse)
                && side.is_measured()
                && reference.is_settled()
            {
                // The reference's own noise is subtracted.
                let rel_mse = (rel_mse - reference.noise.unwrap_or(0.0)).max(0.0);
                self.trade.add(Tried { configuration: side.configuration().clone(), milliseconds, rel_mse });
            }
        }
        waiting
    }
}
