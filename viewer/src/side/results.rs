//! What is read back from the frames of a side: its light, its errors, and the NaN/Inf check.

use halflight_frame_graph::{Gpu, non_finite::ValueCounts};

use super::Side;
use crate::{
    error::Errors,
    readback::TextureReading,
    reference::Reference,
    seen::{Key, Seen},
};

impl Side {
    /// Reads back the indirect light of the last frame, once per change. It is black if the technique has no such output.
    pub fn read_light(&mut self, gpu: &Gpu) {
        if self.light.is_some() || self.moment.is_none() {
            return;
        }
        match (&self.indirect, self.graph.output("indirect")) {
            (None, Some(texture)) => self.indirect = Some(TextureReading::new(gpu, texture)),
            (Some(reading), _) => {
                if let Some(texels) = reading.take() {
                    self.light = Some(texels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
                    self.indirect = None;
                }
            }
            (None, None) => {
                let [width, height] = self.graph.plan().display_size;
                self.light = Some(vec![[0.0; 3]; width as usize * height as usize]);
            }
        }
    }

    /// Forgets its errors, because the reference shows something else.
    pub fn forget_errors(&mut self) {
        (self.errors, self.seen, self.compared_with) = (Errors::default(), Seen::default(), 0);
    }

    /// Continues to compute FLIP against this reading of the reference, whose noise is the FLIP between it and the one before;
    /// true while there is more to do.
    pub fn compare_seen(&mut self, gpu: &Gpu, key: Key, reference: &Reference, noise: f64) -> bool {
        if self.seen.taken == Some(key) {
            return false;
        }
        let Some(flip) = self.seen.step(gpu, self.graph.output("final"), key, reference) else { return true };
        self.seen.taken = Some(key);
        self.errors.update_seen(flip, noise, reference.lit);
        false
    }

    /// Runs the NaN/Inf check on the last frame, once per change; true while the device works on it.
    pub fn check(&mut self, gpu: &Gpu) -> bool {
        self.check.step(gpu, &self.graph)
    }

    /// The results of the NaN/Inf check, once they are known.
    pub fn check_results(&self) -> Option<&[ValueCounts]> {
        self.check.results()
    }
}
