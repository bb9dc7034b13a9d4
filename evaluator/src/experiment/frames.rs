//! What the frames of a cell show, how much they differ, and how long they take.

use halflight_frame_graph::{Part, When, non_finite::ValueCounts};
use halflight_native::{NativeGpu, frames::FrameTime, images::Rgb};
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_scenes::Scene;

use super::{grid::Grid, reference, session::Frames};
use crate::{Error, measurement::Timing};

/// The path tracer's ambient visibility.
#[derive(Clone)]
pub(super) struct OcclusionReference {
    pub(super) radius: f32,
    /// Hash of what was traced, and the number of samples.
    pub(super) inputs: String,
    pub(super) mean: Vec<f32>,
    pub(super) rel_error: Option<f64>,
}

impl OcclusionReference {
    /// As a grey image.
    pub(super) fn image(&self) -> Vec<Rgb> {
        self.mean.iter().map(|&v| [v; 3]).collect()
    }
}

/// Ambient visibility within a radius: as precise as the grid's reference, traced once for all cells that ask for it.
pub(super) fn occlusion_reference(
    native: &NativeGpu,
    scene: &Scene,
    grid: &Grid,
    size: [u32; 2],
    radius: f32,
    known: &mut Vec<OcclusionReference>,
) -> Result<OcclusionReference, Error> {
    if let Some(traced) = known.iter().find(|known| known.radius == radius) {
        return Ok(traced.clone());
    }
    let request =
        TruthRequest { ambient_occlusion: Some(radius), seed: grid.seed, ..TruthRequest::new(scene.camera, size) };
    let stop = Stop { samples_per_pixel: grid.truth_samples, rel_error: Some(grid.truth_rel_error), error_block: 8 };
    let traced = reference::trace(native, scene, &request, stop)?;
    let inputs = format!("{} {}", traced.inputs, traced.truth.samples);
    let mean = traced.truth.ambient_occlusion.map(|estimate| estimate.mean).unwrap_or_default();
    let reference = OcclusionReference { radius, inputs, mean, rel_error: traced.rel_error };
    known.push(reference.clone());
    Ok(reference)
}

/// What a frame shows: final radiance, `albedo * indirect`, `indirect` itself, and ambient visibility where the technique
/// finds it.
pub(crate) struct Shown {
    pub(crate) image: Vec<Rgb>,
    pub(crate) indirect: Vec<Rgb>,
    pub(crate) incident: Vec<Rgb>,
    pub(crate) open: Option<Vec<Rgb>>,
    /// Whether there is light besides ambient visibility.
    pub(crate) lit: bool,
}

impl Shown {
    pub(crate) fn read(frames: &Frames) -> Result<Self, Error> {
        let output = |name| frames.read_rgb(name);
        let missing = || Error::Failed("the plan has no final image".into());
        let image = output("final")?.ok_or_else(missing)?;
        let black = || vec![[0.0; 3]; image.len()];
        let found = output("indirect")?;
        let lit = found.is_some();
        let incident = found.unwrap_or_else(black);
        let indirect = output("albedo")?.map_or_else(black, |albedo| modulate(&albedo, &incident));
        let open = output("ambient_occlusion")?.map(|open| open.iter().map(|v| [v[0]; 3]).collect());
        Ok(Self { image, indirect, incident, open, lit })
    }

    /// The image that errors and noise are measured on.
    pub(crate) fn measured(&self) -> &[Rgb] {
        self.open.as_ref().filter(|_| !self.lit).unwrap_or(&self.indirect)
    }
}

/// Deviation over frames under a static camera.
#[derive(Default)]
pub(super) struct Noise {
    count: f64,
    sums: Vec<f64>,
    squares: f64,
}

impl Noise {
    pub(super) fn add(&mut self, image: &[Rgb]) {
        self.count += 1.0;
        self.sums.resize(3 * image.len(), 0.0);
        for (sum, &v) in self.sums.iter_mut().zip(image.iter().flatten()) {
            *sum += f64::from(v);
            self.squares += f64::from(v) * f64::from(v);
        }
    }

    /// Standard deviation of one frame, root mean square over pixels and channels; `None` from one frame.
    pub(super) fn deviation(&self) -> Option<f64> {
        let of_means: f64 = self.sums.iter().map(|sum| sum * sum / self.count).sum();
        let freedom = (self.count - 1.0) * self.sums.len() as f64;
        (freedom > 0.0).then(|| ((self.squares - of_means).max(0.0) / freedom).sqrt())
    }
}

pub(super) struct Times {
    /// Passes of the technique; `None` where it has none.
    pub(super) technique: Option<Timing>,
    pub(super) total: Timing,
    /// Median of all passes where only the frame number has changed, ms.
    pub(super) total_static: f64,
    /// The same of the technique's passes; `None` where it has none.
    pub(super) technique_static: Option<f64>,
    /// Passes that run once, ms; `None` where there are none.
    pub(super) first_frame: Option<f64>,
    /// Median of each pass.
    pub(super) passes: Vec<(String, f64)>,
}

/// Frames that are timed while nothing changes.
const STATIC_FRAMES: u32 = 3;

/// Which frames are run and which are timed.
#[derive(Clone, Copy)]
pub(super) struct Sequence {
    /// First frame.
    pub(super) first: u32,
    /// Frame after the last one.
    pub(super) end: u32,
    /// Frames that are timed: the last ones.
    pub(super) timed: u32,
    /// How often the sequence is run.
    pub(super) rounds: u32,
}

impl Sequence {
    /// Frames `0..count`, all of them timed.
    pub(super) fn all(count: u32) -> Self {
        Self { first: 0, end: count, timed: count, rounds: 1 }
    }

    /// Frames up to counted frame `at`, from 1, after `before` others. Times are those of the last `timed` frames that are
    /// counted; where there are fewer, and none before, the sequence is run again until as many are timed. Without a
    /// `history` frames that are not timed are left out.
    pub(super) fn up_to(before: u32, at: u32, timed: u32, history: bool) -> Self {
        let end = before + at.max(1);
        let own = timed.clamp(1, at.max(1));
        let rounds = if before == 0 { timed.div_ceil(own).max(1) } else { 1 };
        Self { first: if history { 0 } else { end - own }, end, timed: own, rounds }
    }
}

/// Runs a warm-up frame, then the frames of a sequence; `after` sees each timed one. Then runs a few frames in which only the
/// frame number changes.
pub(super) fn time_frames(
    frames: &mut Frames,
    sequence: Sequence,
    mut after: impl FnMut(&Frames, u32) -> Result<(), Error>,
) -> Result<Times, Error> {
    let first = frames.run(0)?;
    let once: Vec<_> = frames.plan().schedule().iter().map(|when| *when == When::Once).collect();
    let once = first.passes.iter().zip(once).filter(|(_, once)| *once).map(|(pass, _)| pass.milliseconds);
    let once = once.reduce(|a, b| a + b);
    let mut totals = Vec::new();
    let mut techniques = Vec::new();
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    let Sequence { first, end, timed, rounds } = sequence;
    for frame in (0..rounds).flat_map(|_| first..end) {
        let time = frames.run(frame)?;
        if frame + timed < end {
            continue;
        }
        totals.push(sum(&time, |_| true));
        techniques.push(sum(&time, |part| part == Part::Technique));
        passes.resize_with(time.passes.len(), Default::default);
        for (slot, pass) in passes.iter_mut().zip(&time.passes) {
            slot.0.clone_from(&pass.name);
            slot.1.push(pass.milliseconds);
        }
        after(frames, frame)?;
    }
    let mut at_rest = Vec::new();
    // Frame numbers go on, so that a temporal filter does.
    for frame in end..end + STATIC_FRAMES {
        at_rest.push(frames.run_due(frame)?);
    }
    let at_rest = |wanted: fn(Part) -> bool| {
        let sums: Vec<_> = at_rest.iter().map(|time| sum(time, wanted)).collect();
        Timing::of(&sums).map(|timing| timing.median)
    };
    let has_technique = frames.plan().passes.iter().any(|pass| pass.part == Part::Technique);
    Ok(Times {
        technique: Timing::of(&techniques).filter(|_| has_technique),
        total_static: at_rest(|_| true).unwrap_or_default(),
        technique_static: at_rest(|part| part == Part::Technique).filter(|_| has_technique),
        first_frame: once,
        total: Timing::of(&totals)
            .ok_or_else(|| Error::Failed("no frame was timed: set frames to at least 1".into()))?,
        passes: passes.into_iter().filter_map(|(name, times)| Timing::of(&times).map(|t| (name, t.median))).collect(),
    })
}

/// Time of the passes of these parts of a frame, ms.
fn sum(time: &FrameTime, wanted: impl Fn(Part) -> bool) -> f64 {
    time.passes.iter().filter(|pass| wanted(pass.part)).map(|pass| pass.milliseconds).sum()
}

/// Fails where a texture or buffer of a plan holds NaN or infinity. The check runs on the device.
///
/// # Errors
/// The texture or buffer and the number of bad values.
pub fn check_textures(all: &[&Frames]) -> Result<(), Error> {
    for frames in all {
        for found in frames.scan()? {
            if found.not_finite() > 0 {
                let ValueCounts { name, values, nan, infinite, .. } = found;
                return Err(Error::Failed(format!(
                    "{name} holds {nan} NaN and {infinite} infinities among {values} values"
                )));
            }
        }
    }
    Ok(())
}

/// `albedo * light`, pixel by pixel.
pub(crate) fn modulate(albedo: &[Rgb], light: &[Rgb]) -> Vec<Rgb> {
    albedo.iter().zip(light).map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_ends_with_the_measured_frame() {
        let of = |before, at, history| {
            let Sequence { first, end, timed, rounds } = Sequence::up_to(before, at, 10, history);
            [first, end, timed, rounds]
        };
        // First, end, timed frames and rounds: a frame that comes early is timed again and again.
        assert_eq!(of(0, 1, true), [0, 1, 1, 10]);
        assert_eq!(of(0, 8, true), [0, 8, 8, 2]);
        assert_eq!(of(0, 32, true), [0, 32, 10, 1]);
        assert_eq!(of(0, 32, false), [22, 32, 10, 1]);
        // Frames before a change of lights are run once and not timed.
        assert_eq!(of(120, 8, true), [0, 128, 8, 1]);
    }
}
