//! Antialiasing: the mean of several pictures of one view, whose cameras are turned by parts of a pixel.

use eframe::egui::Context;
use glam::Mat4;
use halflight_frame_graph::{Changed, Gpu, View};

use super::{Moment, Side};
use crate::{stage::Stage, state, timing::Work};

/// Pictures of one view that are averaged.
const SAMPLES: u32 = 8;

/// The camera of a sample, turned by less than half a pixel: a Halton sequence of bases 2 and 3. Sample 0 is the view itself.
fn turned(mut view: View, sample: u32) -> View {
    if sample == 0 {
        return view;
    }
    let radical = |base: u32| {
        let (mut value, mut digit, mut rest) = (0.0, 1.0, sample);
        while rest > 0 {
            digit /= base as f32;
            value += digit * (rest % base) as f32;
            rest /= base;
        }
        value - 0.5
    };
    let pixel = |axis: usize| 2.0 * view.tan_half_fov[axis] / view.display_size[axis] as f32;
    let rotation = Mat4::from_rotation_y(radical(2) * pixel(0)) * Mat4::from_rotation_x(radical(3) * pixel(1));
    view.world_to_view = rotation * view.world_to_view;
    view
}

impl Side {
    /// Whether pictures of this view can be averaged: it shows an output of the frame, and no filter over frames would take the
    /// samples for motion.
    pub(super) fn can_average(&self, view: &state::View) -> bool {
        matches!(view, state::View::Output(_)) && !self.graph.plan().has_previous_images()
    }

    /// Continues to average pictures; true while there is more to do.
    pub(super) fn smooth(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, moment: Moment) -> bool {
        if self.smoothing.as_ref().is_some_and(|work| work.milliseconds().is_none()) {
            return true;
        }
        self.smoothing = None;
        let averaged = self.show.is_some() && self.shown.as_ref().is_some_and(|(_, look, _)| look.averaged);
        if !averaged || self.samples > SAMPLES {
            return false;
        }
        // The errors are those of the view itself.
        self.read_light(gpu);
        if self.light.is_some() {
            self.record_sample(ctx, gpu, stage, moment);
        }
        true
    }

    /// Draws the view again, turned by a part of a pixel, and averages the pictures. The last time it is not turned and not
    /// averaged, so that all textures are those of the view.
    fn record_sample(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, moment: Moment) {
        let (seen, changed) = self.seen(gpu, stage, moment, false);
        let sample = if self.samples < SAMPLES { self.samples } else { 0 };
        let seen = turned(seen, sample);
        for commands in self.graph.commands(gpu, &seen, Changed::Only(&changed)) {
            gpu.queue.submit([commands]);
        }
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("sample") });
        if let (Some(show), true) = (&self.show, sample > 0) {
            show.record(gpu, &mut encoder, &View { frame: sample, ..seen }, Changed::Anything);
        }
        self.samples += 1;
        let ctx = ctx.clone();
        self.smoothing = Some(Work::submit_then(&gpu.queue, Some(encoder.finish()), move || ctx.request_repaint()));
    }

    /// Samples in the picture that are complete.
    pub fn samples(&self) -> u32 {
        (self.samples - u32::from(self.smoothing.is_some())).min(SAMPLES)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use halflight_renderer::scene::camera_view;
    use halflight_scenes::Camera;

    use super::*;

    #[test]
    fn samples_are_parts_of_a_pixel_apart() {
        let view = camera_view(&Camera::default(), [640, 360], 0.1);
        // Where a distant point in the centre of the view is seen, pixels from the centre.
        let seen: Vec<[f32; 2]> = (0..SAMPLES)
            .map(|sample| {
                let view = turned(view, sample);
                let p = view.world_to_view.transform_vector3(Vec3::from(Camera::default().eye) * -1e3);
                [0, 1].map(|axis| p[axis] / -p.z / view.tan_half_fov[axis] * view.display_size[axis] as f32 / 2.0)
            })
            .collect();
        assert_eq!(seen[0], [0.0; 2]);
        assert!(seen.iter().flatten().all(|offset| offset.abs() < 0.5), "{seen:?}");
        // No two are at the same place, and their mean is the view itself: a sample has 1/8 of the weight.
        let apart = |a: &[f32; 2], b: &[f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let nearest = (0..seen.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| apart(&seen[i], &seen[j]));
        assert!(nearest.fold(f32::MAX, f32::min) > 0.1, "{seen:?}");
        let mean = [0, 1].map(|axis| seen.iter().map(|offset| offset[axis]).sum::<f32>() / SAMPLES as f32);
        assert!(mean.iter().all(|offset| offset.abs() < 0.125), "{mean:?}");
    }
}
