//! Changes that must not change an image, or must change it in a known way. The drift of estimators that claim to be
//! unbiased is bounded; the drift of others is reported.

use glam::{Quat, Vec3};
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session},
};
use halflight_native::images::{Rgb, luminance};
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Settings, Value},
    plan_technique_of_scene,
};
use halflight_renderer::{
    gi::{rsm::has_reflective_shadow_maps, scene_voxels::has_scene_voxels},
    scene::traces_rays,
};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Mesh, Motion, Scene};

use super::{Suite, float16_textures};
use crate::{
    check::Check,
    scenes,
    settings::{parameter, with_small_shadows},
};

mod units;

const GROUP: &str = "invariances";
/// Small, and a multiple of the texel size of every level, so that mirroring maps texels onto texels.
const SIZE: [u32; 2] = [64, 32];
/// Number of frames that are averaged; their remaining noise is measured separately.
const FRAMES: u32 = 8;

/// One technique with some settings.
#[derive(Clone, Copy)]
struct Subject<'a> {
    technique: &'static Technique,
    settings: &'a Settings,
    check: &'a Check,
}

impl Subject<'_> {
    fn frames<'s>(&self, session: &Session<'s>, size: [u32; 2], seed: u32) -> Result<Frames<'s>, Error> {
        let settings = with_small_shadows(self.settings);
        session.frames(&Request { technique: self.technique, settings, size, seed, direct: None })
    }

    /// Indirect light of one frame; the final image of a technique without any.
    fn frame(&self, session: &Session, size: [u32; 2], seed: u32) -> Result<Vec<Rgb>, Error> {
        let mut frames = self.frames(session, size, seed)?;
        frames.run(0)?;
        light(&frames)
    }

    /// The mean of several frames.
    fn mean(&self, session: &Session, size: [u32; 2], seed: u32) -> Result<Vec<Rgb>, Error> {
        let mut frames = self.frames(session, size, seed)?;
        let output = if frames.plan().outputs.contains_key("indirect") { "indirect" } else { "final" };
        Ok(frames.mean_over_frames(output, FRAMES)?.0)
    }

    /// The mean of the image of `twin`, a changed copy of the scene, must not drift. `same_voxels` says that the voxels of the
    /// visibility grid cover the same parts of both.
    fn same_mean(&self, scene: &Session, twin: &Scene, same_voxels: bool) -> Result<Vec<Check>, Error> {
        let twin = Session::new(scene.native, twin);
        Ok(vec![self.drift_from(scene, &twin, self, same_voxels, SIZE)?])
    }

    /// Relative difference of the mean of the twin's image, with its own settings, to that of the scene.
    fn drift_from(
        &self,
        scene: &Session,
        twin: &Session,
        in_twin: &Subject,
        same_voxels: bool,
        size: [u32; 2],
    ) -> Result<Check, Error> {
        let (a, b) = (self.frame(scene, size, 0)?, in_twin.frame(twin, size, 0)?);
        let check = self.check.clone().bounded(DRIFT, drift(&a, &b), LARGEST_DRIFT, AT_EDGES);
        let check = check.detail(format!("root mean square {:.1e} of the mean", difference(&a, &b)));
        let frames = self.frames(scene, size, 0)?;
        // One ray hits or misses as a whole.
        let by_chance = has_reflective_shadow_maps(frames.plan())
            || traces_rays(frames.plan())
            || self.technique.name == "ray-march";
        if !check.is_red() || !by_chance {
            return Ok(check);
        }
        // Rounding alone can change which virtual point lights are chosen, or what a ray hits, so means of many frames are
        // compared with their noise.
        let [ours, theirs] = [(self, scene), (in_twin, twin)].map(|(subject, session)| {
            (0..SEEDS).map(|seed| Ok(mean(&subject.mean(session, size, seed)?))).collect::<Result<Vec<_>, Error>>()
        });
        let (ours, theirs) = (ours?, theirs?);
        let average = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let squares = |all: &[f64]| all.iter().map(|v| (v - average(all)).powi(2)).sum::<f64>();
        let variance = (squares(&ours) + squares(&theirs)) / f64::from(2 * (SEEDS - 1));
        let noise = (2.0 * variance / f64::from(SEEDS)).sqrt() / average(&ours);
        let drift = (average(&theirs) / average(&ours) - 1.0).abs();
        let check = check.detail(format!("means of {SEEDS} times {FRAMES} frames"));
        if has_scene_voxels(frames.plan()) && !same_voxels {
            let reason = "the voxel grid is aligned differently with the surfaces: the drift is reported";
            return Ok(check.reported(DRIFT, drift, reason));
        }
        if traces_rays(frames.plan()) && !same_voxels {
            let reason = "the cells of records are aligned differently with the surfaces: the drift is reported";
            return Ok(check.reported(DRIFT, drift, reason));
        }
        Ok(check.bounded(DRIFT, drift, LARGEST_DRIFT.max(5.0 * noise), AT_CHANCE))
    }
}

/// Largest drift of a mean by rounding alone.
const LARGEST_DRIFT: f64 = 2e-3;
const AT_EDGES: &str = "rounding alone: a pixel on an edge may show the other surface";
/// Number of seeds from which the noise of a mean is estimated.
const SEEDS: u32 = 6;
const AT_CHANCE: &str = "rounding changes the chosen virtual point lights or what a ray hits: five standard errors of the difference, estimated from other seeds";

const DRIFT: &str = "relative change of the mean";
const BITS: &str = "values that differ in a bit";

fn light(frames: &Frames) -> Result<Vec<Rgb>, Error> {
    match frames.read_rgb("indirect")? {
        Some(light) => Ok(light),
        None => Ok(frames.read_rgb("final")?.unwrap_or_default()),
    }
}

fn mean(image: &[Rgb]) -> f64 {
    image.iter().map(|&p| f64::from(luminance(p))).sum::<f64>() / image.len().max(1) as f64
}

/// Relative change of the mean; 0 where both are black.
fn drift(a: &[Rgb], b: &[Rgb]) -> f64 {
    let (a, b) = (mean(a), mean(b));
    if a == b { 0.0 } else { (b / a - 1.0).abs() }
}

/// Root mean square of the difference of two images, relative to the mean of the first; 0 where both are black.
fn difference(a: &[Rgb], b: &[Rgb]) -> f64 {
    let square = |(a, b): (&Rgb, &Rgb)| f64::from(luminance(*a) - luminance(*b)).powi(2);
    let root = (a.iter().zip(b).map(square).sum::<f64>() / a.len().max(1) as f64).sqrt();
    if root == 0.0 { 0.0 } else { root / mean(a) }
}

fn differing(a: &[Rgb], b: &[Rgb]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).filter(|(a, b)| a.to_bits() != b.to_bits()).count() as f64
}

type Row = fn(&Session, Subject) -> Result<Vec<Check>, Error>;

const ROWS: &[(&str, Row)] = &[
    ("two runs with one seed", one_seed),
    ("brightness scales with light", brightness),
    ("world units", units::units),
    ("translation of the whole scene", translation),
    ("rotation of the whole scene", rotation),
    ("mirroring", mirroring),
    ("sample count", sample_count),
    ("resolution", resolution),
    ("start resolution", start_resolution),
    ("odd sizes", odd_sizes),
    ("viewport offset", viewport_offset),
    ("splitting triangles", splitting),
    ("order of meshes", order),
    ("frames before a still image", frames_before),
];

pub(super) fn run(suite: &mut Suite) {
    let scene = scenes::lamp_court();
    let session = Session::new(suite.native, &scene);
    for (row, run) in ROWS {
        each(suite, row, |subject| run(&session, subject));
    }
    units::run(suite);
    let moving = uncovered();
    let session = Session::new(suite.native, &moving);
    with_history(suite, "what was hidden in the frame before has no history", &session, disoccluded);
    let still = scenes::lamp_court();
    let session = Session::new(suite.native, &still);
    let count = if suite.options.quick { 100 } else { 2000 };
    with_history(suite, "a long history", &session, |session, subject| long_history(session, subject, count));
    let cutting = cut();
    let session = Session::new(suite.native, &cutting);
    with_history(suite, "nothing of the frame before a cut is left", &session, after_a_cut);
}

/// Runs a row with all settings that keep a history, in a quick run too.
fn with_history(
    suite: &mut Suite,
    row: &str,
    session: &Session,
    run: impl Fn(&Session, Subject) -> Result<Vec<Check>, Error>,
) {
    if !suite.wants(GROUP, row) {
        return;
    }
    let all: Vec<_> = suite.switches.iter().map(|s| (s.technique, s.single.clone())).collect();
    for (technique, all) in all {
        let keeps = |settings: &&Settings| {
            plan_technique_of_scene(&session.facts, technique, settings, SIZE).is_ok_and(|plan| plan.has_history())
        };
        for settings in all.iter().filter(keeps) {
            let check = Check::new(GROUP, row, technique.name, settings);
            suite.guarded(check, |check| run(session, Subject { technique, settings, check }));
        }
    }
}

fn each(suite: &mut Suite, row: &str, run: impl Fn(Subject) -> Result<Vec<Check>, Error>) {
    if !suite.wants(GROUP, row) {
        return;
    }
    for (technique, mut all) in suite.singles() {
        all.extend(claimed(technique.name));
        for settings in &all {
            let check = Check::new(GROUP, row, technique.name, settings);
            suite.guarded(check, |check| run(Subject { technique, settings, check }));
        }
    }
}

fn one_seed(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // A new session, so that nothing is left from the run before.
    let again = Session::new(session.native, session.scene);
    let size = [47, 33];
    let (a, b) = (subject.frame(session, size, 7)?, subject.frame(&again, size, 7)?);
    let reason = "every random number is a hash of pixel, frame, stream and seed";
    Ok(vec![subject.check.clone().bounded(BITS, differing(&a, &b), 0.0, reason)])
}

fn brightness(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // A power of two changes exponents only.
    const FACTOR: f32 = 16.0;
    let mut bright = session.scene.clone();
    bright.materials.iter_mut().for_each(|material| material.emission = material.emission.map(|v| v * FACTOR));
    let twin = Session::new(session.native, &bright);
    let mut frames = subject.frames(session, SIZE, 0)?;
    frames.run(0)?;
    let plain = light(&frames)?;
    let other = subject.frame(&twin, SIZE, 0)?;
    // Below 2^-14 float16 has steps of 2^-24, and a driver may truncate, once in each texture that light passes through.
    // Below 2^-126 a float32 may become 0.
    let halves = float16_textures(frames.plan()) as f64;
    let bound = f64::from(FACTOR) * if halves > 0.0 { halves * 2f64.powi(-24) } else { 2f64.powi(-126) };
    let far = |(a, b): (&f32, &f32)| (f64::from(*a) * f64::from(FACTOR) - f64::from(*b)).abs();
    let worst = plain.iter().flatten().zip(other.iter().flatten()).map(far).fold(0.0, f64::max);
    let reason = "16 times the light changes exponents only; below the smallest normal number, 2^-126 or 2^-14, values are truncated";
    Ok(vec![subject.check.clone().bounded("largest difference, radiance", worst, bound, reason)])
}

/// The scene mirrored, rotated and translated.
fn moved(scene: &Scene, turn: Quat, by: Vec3, mirror: bool) -> Scene {
    let sign = Vec3::new(if mirror { -1.0 } else { 1.0 }, 1.0, 1.0);
    let direction = |v: [f32; 3]| (turn * (sign * Vec3::from(v))).to_array();
    let point = |v: [f32; 3]| (turn * (sign * Vec3::from(v)) + by).to_array();
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        mesh.positions.iter_mut().for_each(|v| *v = point(*v));
        mesh.normals.iter_mut().for_each(|v| *v = direction(*v));
        if mirror {
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    for light in &mut scene.lights {
        match light {
            Light::Directional { direction: d, .. } => *d = direction(*d),
            Light::Point { position, .. } => *position = point(*position),
            Light::Spot { position, direction: d, .. } => {
                *position = point(*position);
                *d = direction(*d);
            }
        }
    }
    let camera = &mut scene.camera;
    (camera.eye, camera.target, camera.up) = (point(camera.eye), point(camera.target), direction(camera.up));
    scene
}

fn translation(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // Small integers: coordinates lose three bits at most.
    let twin = moved(session.scene, Quat::IDENTITY, Vec3::new(8.0, -4.0, 16.0), false);
    subject.same_mean(session, &twin, false)
}

fn rotation(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    subject.same_mean(session, &moved(session.scene, turn, Vec3::ZERO, false), false)
}

fn mirroring(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let twin = moved(session.scene, Quat::IDENTITY, Vec3::ZERO, true);
    let twin = Session::new(session.native, &twin);
    let flip = |image: Vec<Rgb>| -> Vec<Rgb> {
        image.chunks_exact(SIZE[0] as usize).flat_map(|row| row.iter().rev()).copied().collect()
    };
    let image = subject.mean(session, SIZE, 0)?;
    let mut square = 0.0;
    for seed in 2..5 {
        square += difference(&image, &subject.mean(session, SIZE, seed)?).powi(2) / 3.0;
    }
    let noise = square.sqrt();
    let mirror = difference(&image, &flip(subject.mean(&twin, SIZE, 1)?));
    let reason = "2.3 times the difference to another seed, which is noise alone: all pixels share a frame's random start, so that \
                  eight frames are eight numbers and one in a thousand such ratios is larger (F of 8 and 24); plus 0.01 \
                  for pixels on edges";
    Ok(vec![
        subject
            .check
            .clone()
            .bounded("root mean square of the difference over the mean", mirror, 2.3 * noise + 0.01, reason)
            .detail(format!("noise {noise:.4}")),
    ])
}

/// Settings with which a technique claims to be unbiased.
fn claimed(technique: &str) -> Option<Settings> {
    // Every texel is weighted by the number of texels per sample, and no pyramid leaves surfaces out.
    (technique == "hierarchical").then(|| {
        let texel = ("hierarchical.disc_area".to_owned(), Value::Text("texel".into()));
        let full = ("hierarchical.start_resolution".to_owned(), Value::Text("full".into()));
        Settings::from([texel, full, ("hierarchical.levels".to_owned(), Value::Int(1))])
    })
}

/// Whether a technique with these settings claims that its mean does not depend on the sampling.
fn claims_no_bias(subject: Subject) -> bool {
    subject.technique.name == "exhaustive" || claimed(subject.technique.name).as_ref() == Some(subject.settings)
}

/// The drift between two means: bounded where the technique claims to be unbiased, otherwise reported.
fn drifted(subject: Subject, a: &[Rgb], b: &[Rgb], bound: f64, reason: &str) -> Vec<Check> {
    let check = subject.check.clone();
    vec![if claims_no_bias(subject) {
        check.bounded(DRIFT, drift(a, b), bound, reason)
    } else {
        check.reported(DRIFT, drift(a, b), "no claim: the drift is reported")
    }]
}

/// The settings with another value of a parameter.
fn with(subject: Subject, name: &str, value: Value) -> Settings {
    let mut settings = subject.settings.clone();
    settings.insert(format!("{}.{name}", subject.technique.name), value);
    settings
}

fn sample_count(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let Some(samples) = parameter(subject.technique, "samples") else { return Ok(Vec::new()) };
    let (Some(few), Some(many)) = (samples.grid.first(), samples.grid.last()) else { return Ok(Vec::new()) };
    let [few, many] = [few, many].map(|value| with(subject, "samples", value.clone()));
    let [few, many] = [&few, &many].map(|settings| Subject { settings, ..subject });
    let (a, b) = (few.mean(session, SIZE, 0)?, many.mean(session, SIZE, 0)?);
    // Pixels are independent except for the frame's shared random start: the error of the mean is that of a pixel over the
    // square root of their number, times a few for the shared start.
    let noise = difference(&a, &few.mean(session, SIZE, 1)?) / (a.len() as f64).sqrt();
    let reason = "eight times the noise of a mean of so many pixels, plus 0.01";
    Ok(drifted(subject, &a, &b, 8.0 * noise + 0.01, reason))
}

/// The lamp of the court covers 22 x 10 pixels in these images, and its edges are rounded to whole pixels: half a pixel on
/// every side.
const LAMP_EDGES: f64 = 1.0 / 22.0 + 1.0 / 10.0;
const WHOLE_PIXELS: &str =
    "the edges of a lamp of 22 x 10 pixels are rounded to whole pixels: half a pixel on every side";

fn resolution(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let a = subject.mean(session, SIZE, 0)?;
    let b = subject.mean(session, SIZE.map(|v| 2 * v), 0)?;
    Ok(drifted(subject, &a, &b, LAMP_EDGES, WHOLE_PIXELS))
}

fn start_resolution(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let Some(start) = parameter(subject.technique, "start_resolution") else { return Ok(Vec::new()) };
    let Kind::Choice(names) = start.kind else { return Ok(Vec::new()) };
    let mut checks = Vec::new();
    let mut finest: Option<Vec<Rgb>> = None;
    for name in names {
        let settings = with(subject, "start_resolution", Value::Text((*name).into()));
        let image = Subject { settings: &settings, ..subject }.mean(session, SIZE, 0)?;
        if let Some(finest) = &finest {
            let check = subject.check.clone().reported(DRIFT, drift(finest, &image), "no claim for so small an image");
            checks.push(check.detail(format!("{} to {name}", names[0])));
        } else {
            finest = Some(image);
        }
    }
    Ok(checks)
}

fn odd_sizes(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // The same field of view.
    let a = subject.mean(session, SIZE, 0)?;
    let b = subject.mean(session, [66, 33], 0)?;
    Ok(drifted(subject, &a, &b, LAMP_EDGES, WHOLE_PIXELS))
}

/// An image of twice the size with twice the tangents shows the same rays in its middle.
fn viewport_offset(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut wide = session.scene.clone();
    let half = 0.5 * wide.camera.vertical_fov_degrees.to_radians();
    wide.camera.vertical_fov_degrees = 2.0 * (2.0 * half.tan()).atan().to_degrees();
    let wide = Session::new(session.native, &wide);
    let read = |session: &Session, size: [u32; 2]| -> Result<Vec<f32>, Error> {
        let mut frames = subject.frames(session, size, 0)?;
        frames.run(0)?;
        Ok(frames.read_rgb("depth")?.unwrap_or_default().iter().map(|d| d[0]).collect())
    };
    let [w, h] = SIZE.map(|v| v as usize);
    let (small, large) = (read(session, SIZE)?, read(&wide, [2 * SIZE[0], 2 * SIZE[1]])?);
    let crop = (0..w * h).map(|i| large[(i / w + h / 2) * 2 * w + i % w + w / 2]);
    let wrong = small.iter().zip(crop).filter(|(a, b)| (*a - b).abs() > 1e-4 * a.max(*b)).count();
    let reason = "the same rays hit the same surfaces; rounding decides on edges, 1 % of the pixels";
    Ok(vec![subject.check.clone().bounded("pixels of other depth", wrong as f64, (w * h) as f64 / 100.0, reason)])
}

/// The mesh with every triangle split into four.
fn split(mesh: &Mesh) -> Mesh {
    let mut fine = Mesh { indices: Vec::new(), ..mesh.clone() };
    for &[a, b, c] in mesh.indices.as_chunks::<3>().0 {
        let mut middle = |a: u32, b: u32| {
            let [a, b] = [a as usize, b as usize];
            let half = |a: [f32; 3], b: [f32; 3]| std::array::from_fn(|i| 0.5 * (a[i] + b[i]));
            fine.positions.push(half(mesh.positions[a], mesh.positions[b]));
            fine.normals.push(half(mesh.normals[a], mesh.normals[b]));
            let (p, q) = (mesh.uvs[a], mesh.uvs[b]);
            fine.uvs.push([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
            fine.positions.len() as u32 - 1
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        fine.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
    }
    fine
}

fn splitting(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut twin = session.scene.clone();
    twin.meshes = twin.meshes.iter().map(split).collect();
    subject.same_mean(session, &twin, true)
}

fn order(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut twin = session.scene.clone();
    twin.meshes.reverse();
    let twin = Session::new(session.native, &twin);
    let (a, b) = (subject.frame(session, SIZE, 0)?, subject.frame(&twin, SIZE, 0)?);
    let reason = "the nearest surface is the same in any order; no two meshes coincide";
    Ok(vec![subject.check.clone().bounded(BITS, differing(&a, &b), 0.0, reason)])
}

fn frames_before(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut frames = subject.frames(session, SIZE, 0)?;
    let history = frames.plan().has_history();
    let mut run = |frame: u32| {
        frames.run(frame)?;
        light(&frames)
    };
    if !history {
        let (zero, _, again) = (run(0)?, run(1)?, run(0)?);
        let reason = "without a history a frame does not depend on earlier ones";
        return Ok(vec![subject.check.clone().bounded(BITS, differing(&zero, &again), 0.0, reason)]);
    }
    // A jump of the frame number is a cut: the image after it equals the first image of a new run.
    run(0)?;
    run(1)?;
    let after = run(40)?;
    let mut fresh = subject.frames(session, SIZE, 0)?;
    fresh.run(40)?;
    let reason = "a frame whose number is not the next one resets the history";
    Ok(vec![subject.check.clone().bounded(BITS, differing(&after, &light(&fresh)?), 0.0, reason)])
}

/// A block in front of a wall that moves aside by more than its width between two frames.
fn uncovered() -> Scene {
    let mut scene = scenes::lamp_court();
    scene.meshes.push(scenes::block(Vec3::new(-0.3, 0.4, 0.6), Vec3::new(0.1, 1.4, 0.7), 0));
    if let Some(mesh) = scene.meshes.last_mut() {
        mesh.object = Some(0);
    }
    let key = |frame, x| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes: vec![key(0, 0.0), key(3, 0.0), key(4, 0.6)] });
    scene
}

fn disoccluded(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut frames = subject.frames(session, SIZE, 0)?;
    let depth = |frames: &Frames| frames.read_rgb("depth").map(|depth| depth.unwrap_or_default());
    (0..=3).try_for_each(|frame| frames.run(frame).map(drop))?;
    let before = depth(&frames)?;
    frames.run(4)?;
    let mut fresh = subject.frames(session, SIZE, 0)?;
    fresh.run(4)?;
    let now = depth(&frames)?;
    // The wall is 1.5 times as far away as the block.
    let uncovered: Vec<usize> =
        (0..now.len()).filter(|&i| now[i][0] > 1.2 * before[i][0] && before[i][0] > 0.0).collect();
    let (with, without) = (light(&frames)?, light(&fresh)?);
    let wrong = uncovered.iter().filter(|&&i| with[i] != without[i]).count();
    let reason =
        "a surface that the frame before did not show has no history, so its light is that of this frame alone";
    let measure = "uncovered pixels with light of the frame before";
    let check = if traces_rays(frames.plan()) {
        let reason = "records of a cell, in world space, know other surfaces inside it and their rays";
        subject.check.clone().reported(measure, wrong as f64, reason)
    } else {
        subject.check.clone().bounded(measure, wrong as f64, 0.0, reason)
    };
    Ok(vec![check.detail(format!("of {} uncovered pixels", uncovered.len()))])
}

/// The mean of a static picture after very many frames, whose numbers pass the largest one, is that after a few.
fn long_history(session: &Session, subject: Subject, count: u32) -> Result<Vec<Check>, Error> {
    const EARLY: u32 = 64;
    let mut early = Vec::new();
    for seed in 0..SEEDS {
        let mut frames = subject.frames(session, SIZE, seed)?;
        (0..EARLY).try_for_each(|frame| frames.run(frame).map(drop))?;
        early.push(mean(&light(&frames)?));
    }
    let average = early.iter().sum::<f64>() / early.len() as f64;
    let variance = early.iter().map(|v| (v - average).powi(2)).sum::<f64>() / f64::from(SEEDS - 1);
    let mut frames = subject.frames(session, SIZE, 0)?;
    let first = u32::MAX - count / 2;
    (0..count).try_for_each(|frame| frames.run(first.wrapping_add(frame)).map(drop))?;
    let late = mean(&light(&frames)?);
    let bound = LARGEST_DRIFT.max(5.0 * variance.sqrt() / average);
    let reason = "five standard deviations of the mean after 64 frames, estimated from other seeds";
    let check = subject.check.clone().bounded(DRIFT, (late / average - 1.0).abs(), bound, reason);
    Ok(vec![check.detail(format!("{count} frames against {EARLY}"))])
}

/// The camera cuts to another position in frame 4.
fn cut() -> Scene {
    let mut scene = scenes::lamp_court();
    let key = |frame, x: f32, cut| CameraKeyframe { frame, eye: [x, 1.4, 4.0], target: [0.0, 0.8, 0.0], cut };
    scene.moves.camera = vec![key(0, 0.0, false), key(3, 0.05, false), key(4, 0.1, true)];
    scene
}

fn after_a_cut(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut frames = subject.frames(session, SIZE, 0)?;
    (0..=4).try_for_each(|frame| frames.run(frame).map(drop))?;
    let mut fresh = subject.frames(session, SIZE, 0)?;
    fresh.run(4)?;
    let differ = differing(&light(&frames)?, &light(&fresh)?);
    Ok(vec![subject.check.clone().bounded(BITS, differ, 0.0, "a cut resets the history")])
}
