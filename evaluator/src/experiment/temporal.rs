//! What a technique does over time: flicker of a static image, ghosts after a change, error along a path.

use halflight_native::{NativeGpu, images::Rgb};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{Keyframe, Motion, Moves, Scene};

use super::session::{Frames, Request, Session};
use crate::{
    Error,
    measurement::temporal::{AFTER, CHECKPOINTS, Temporal, WARM_UP, WINDOW},
};

/// Unfiltered frames of another seed in a reference.
const REFERENCE: u32 = 64;
/// A residue under this is none: it is what noise leaves.
const NO_RESIDUE: f64 = 1e-3;

/// Measures a technique on a scene, at this size.
///
/// # Errors
/// As [`Session::frames`].
pub fn measure(
    native: &NativeGpu,
    scene: &Scene,
    technique: &'static Technique,
    settings: &Settings,
    size: [u32; 2],
    seed: u32,
) -> Result<Temporal, Error> {
    let run = Run { native, technique, settings, size, seed };
    let mut measured = Temporal { still_std: run.still(&scene.posed(0))?, ..Temporal::default() };
    if measured.still_std.is_none() {
        // Without indirect light there is nothing to measure.
        return Ok(measured);
    }
    if !scene.moves.objects.is_empty() || !scene.moves.lights.is_empty() {
        (measured.ghost_half_life, measured.recover) = run.jump(scene)?;
    }
    if !scene.moves.is_empty() {
        measured.path_rmse = Some(run.path(scene)?);
    }
    Ok(measured)
}

struct Run<'a> {
    native: &'a NativeGpu,
    technique: &'static Technique,
    settings: &'a Settings,
    size: [u32; 2],
    seed: u32,
}

impl Run<'_> {
    fn frames<'s>(&self, session: &Session<'s>, settings: Settings, seed: u32) -> Result<Frames<'s>, Error> {
        session.frames(&Request { technique: self.technique, settings, size: self.size, seed, direct: None })
    }

    /// The expected image of a static scene, and its depth.
    fn reference(&self, still: &Scene) -> Result<(Vec<Rgb>, Vec<f32>), Error> {
        let mut settings = self.settings.clone();
        let key = format!("{}.temporal_a", self.technique.name);
        if let Some(a) = settings.get_mut(&key) {
            *a = Value::Float(0.0);
        }
        let session = Session::new(self.native, still);
        let mut frames = self.frames(&session, settings, self.seed.wrapping_add(1))?;
        let mut mean = Mean::default();
        for frame in 0..REFERENCE {
            frames.run(frame)?;
            mean.add(&light(&frames)?);
        }
        Ok((mean.image(), depth(&frames)?))
    }

    fn still(&self, still: &Scene) -> Result<Option<f64>, Error> {
        let session = Session::new(self.native, still);
        let mut frames = self.frames(&session, self.settings.clone(), self.seed)?;
        if !frames.plan().outputs.contains_key("indirect") {
            return Ok(None);
        }
        let mut mean = Mean::default();
        let mut shown = Vec::new();
        for frame in 0..WARM_UP + WINDOW {
            frames.run(frame)?;
            if frame >= WARM_UP {
                let image = light(&frames)?;
                mean.add(&image);
                shown.push(image);
            }
        }
        let middle = mean.image();
        let all = vec![true; middle.len()];
        let squares: f64 = shown.iter().map(|image| rms(image, &middle, &all).powi(2)).sum();
        Ok(Some((squares / f64::from(WINDOW - 1)).sqrt()))
    }

    /// Half-life of ghosts on what stayed in view, and frames until what was uncovered recovers; `None` where the
    /// jump changes or uncovers nothing.
    fn jump(&self, scene: &Scene) -> Result<(Option<f64>, Option<f64>), Error> {
        let jump = jumping(scene);
        let (before, after) = (jump.posed(0), jump.posed(WARM_UP));
        let ((old, depth_before), (new, depth_after)) = (self.reference(&before)?, self.reference(&after)?);
        let pixels = || depth_before.iter().zip(&depth_after);
        let stayed: Vec<bool> = pixels().map(|(a, b)| a == b && *b > 0.0).collect();
        let uncovered: Vec<bool> = pixels().map(|(a, b)| a != b && *b > 0.0).collect();
        let session = Session::new(self.native, &jump);
        let mut frames = self.frames(&session, self.settings.clone(), self.seed)?;
        let (mut residues, mut errors) = (vec![1.0], Vec::new());
        for frame in 0..WARM_UP + AFTER {
            frames.run(frame)?;
            if frame >= WARM_UP {
                let image = light(&frames)?;
                residues.extend(residue(&image, &old, &new, &stayed));
                errors.push(rms(&image, &new, &uncovered));
            }
        }
        let last = errors.iter().rev().take(16).sum::<f64>() / 16.0;
        let recover = errors.iter().position(|&error| error <= 1.25 * last).map(|frame| (frame + 1) as f64);
        Ok((half_life(&residues), recover.filter(|_| uncovered.contains(&true))))
    }

    fn path(&self, scene: &Scene) -> Result<f64, Error> {
        let last = scene.moves.last_frame();
        // In the middle of each part of the path: cuts and rests tend to be at the ends.
        let checkpoints: Vec<u32> = (0..CHECKPOINTS).map(|i| last * (2 * i + 1) / (2 * CHECKPOINTS)).collect();
        let session = Session::new(self.native, scene);
        let mut frames = self.frames(&session, self.settings.clone(), self.seed)?;
        let mut squares = 0.0;
        for frame in 0..=last {
            frames.run(frame)?;
            if checkpoints.contains(&frame) {
                let (expected, depth) = self.reference(&scene.posed(frame))?;
                let shown: Vec<bool> = depth.iter().map(|&d| d > 0.0).collect();
                squares += rms(&light(&frames)?, &expected, &shown).powi(2);
            }
        }
        Ok((squares / f64::from(CHECKPOINTS)).sqrt())
    }
}

/// The scene in its first pose for [`WARM_UP`] frames, then with everything but the camera in its last pose.
fn jumping(scene: &Scene) -> Scene {
    let last = scene.moves.last_frame();
    let jump = |motion: &Motion| {
        let at = |frame, from| Keyframe { frame, ..motion.at(from) };
        Motion { keyframes: vec![at(0, 0), at(WARM_UP - 1, 0), at(WARM_UP, last)], ..motion.clone() }
    };
    Scene {
        camera: scene.pose(0).camera,
        moves: Moves {
            objects: scene.moves.objects.iter().map(jump).collect(),
            lights: scene.moves.lights.iter().map(|(light, motion)| (*light, jump(motion))).collect(),
            camera: Vec::new(),
        },
        ..scene.clone()
    }
}

/// `albedo * indirect` of the last frame.
fn light(frames: &Frames) -> Result<Vec<Rgb>, Error> {
    let missing = || Error::Failed("the plan has no albedo".into());
    let albedo = frames.read_rgb("albedo")?.ok_or_else(missing)?;
    let Some(indirect) = frames.read_rgb("indirect")? else { return Ok(vec![[0.0; 3]; albedo.len()]) };
    Ok(albedo.iter().zip(&indirect).map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect())
}

fn depth(frames: &Frames) -> Result<Vec<f32>, Error> {
    let missing = || Error::Failed("the plan has no depth".into());
    Ok(frames.read("depth")?.ok_or_else(missing)?.iter().map(|texel| texel[0]).collect())
}

#[derive(Default)]
struct Mean {
    sums: Vec<[f64; 3]>,
    count: f64,
}

impl Mean {
    fn add(&mut self, image: &[Rgb]) {
        self.sums.resize(image.len(), [0.0; 3]);
        self.count += 1.0;
        for (sum, pixel) in self.sums.iter_mut().zip(image) {
            sum.iter_mut().zip(pixel).for_each(|(sum, &v)| *sum += f64::from(v));
        }
    }

    fn image(&self) -> Vec<Rgb> {
        self.sums.iter().map(|sum| sum.map(|v| (v / self.count.max(1.0)) as f32)).collect()
    }
}

/// Root mean square difference over the wanted pixels; 0 where there are none.
fn rms(a: &[Rgb], b: &[Rgb], wanted: &[bool]) -> f64 {
    let pixels = a.iter().zip(b).zip(wanted).filter(|(_, wanted)| **wanted).map(|(pair, _)| pair);
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in pixels {
        sum += a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        count += 3.0;
    }
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

/// Share of the old image in this one: its difference from the new image, projected onto what changed. Noise that has
/// nothing to do with the change falls out. `None` where nothing changed.
fn residue(image: &[Rgb], old: &[Rgb], new: &[Rgb], wanted: &[bool]) -> Option<f64> {
    let (mut product, mut square) = (0.0, 0.0);
    for (i, _) in wanted.iter().enumerate().filter(|(_, wanted)| **wanted) {
        for c in 0..3 {
            let change = f64::from(old[i][c]) - f64::from(new[i][c]);
            product += (f64::from(image[i][c]) - f64::from(new[i][c])) * change;
            square += change * change;
        }
    }
    (square > 0.0).then(|| product / square)
}

/// Frames until a residue that starts with 1 is a half, between two frames by its logarithm.
fn half_life(residues: &[f64]) -> Option<f64> {
    let after = residues.iter().position(|&residue| residue <= 0.5)?;
    let [a, b] = [residues[after - 1], residues[after]].map(|residue| residue.max(NO_RESIDUE).ln());
    Some((after - 1) as f64 + (a - 0.5_f64.ln()) / (a - b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_half_life_of_an_exponential_is_that_of_its_formula() {
        for a in [0.5_f64, 0.8, 0.9, 0.97] {
            let residues: Vec<f64> = (0..100).map(|k| a.powi(k)).collect();
            let expected = 0.5_f64.ln() / a.ln();
            // Its logarithm is a line, so nothing but rounding is lost between frames.
            assert!((half_life(&residues).expect("it falls") - expected).abs() < 1e-9, "{a}");
        }
        assert!(half_life(&[1.0, 0.0]).expect("at once") < 0.11);
        assert_eq!(half_life(&[1.0, 0.9, 0.8]), None);
    }

    #[test]
    fn a_residue_is_the_share_of_the_old_image() {
        let (old, new) = ([[4.0, 2.0, 0.0], [1.0; 3]], [[0.0, 1.0, 0.0], [1.0; 3]]);
        let mixed = [[1.0, 1.25, 0.0], [9.0; 3]];
        assert_eq!(residue(&mixed, &old, &new, &[true, true]), Some(0.25));
        assert_eq!(residue(&mixed, &old, &new, &[false, true]), None);
    }
}
