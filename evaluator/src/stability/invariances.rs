//! What must not change an image, or must change it in a known way. For estimators that claim to be unbiased there is a
//! bound; for others the drift is told with its size.

use glam::{Quat, Vec3};
use halflight_native::images::{Rgb, luminance};
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Settings, Value},
    plan_technique_of_scene,
};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Mesh, Motion, Scene};

use super::{Check, Suite, extremes::scaled, parameter, scenes, with_small_shadows};
use crate::{
    Error,
    experiment::session::{Frames, Request, Session},
};

const GROUP: &str = "invariances";
/// Small, and whole texels of every level, so that a mirror maps texels onto texels.
const SIZE: [u32; 2] = [64, 32];
/// Frames that stand for a converged image; what noise they leave is measured beside it.
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

    /// A twin of the scene: the mean of its image may not drift. `same_cubes` where cubes of visibility cover the same parts of both.
    fn same_mean(&self, scene: &Session, twin: &Scene, same_cubes: bool) -> Result<Vec<Check>, Error> {
        let twin = Session::new(scene.native, twin);
        Ok(vec![self.drift_from(scene, &twin, self, same_cubes)?])
    }

    /// How far the mean of the twin's image with its own settings is from that of the scene.
    fn drift_from(&self, scene: &Session, twin: &Session, in_twin: &Subject, same_cubes: bool) -> Result<Check, Error> {
        let (a, b) = (self.frame(scene, SIZE, 0)?, in_twin.frame(twin, SIZE, 0)?);
        let check = self.check.clone().bounded(DRIFT, drift(&a, &b), LARGEST_DRIFT, AT_EDGES);
        let check = check.detail(format!("root mean square {:.1e} of the mean", difference(&a, &b)));
        let frames = self.frames(scene, SIZE, 0)?;
        let has = |folder: &str| frames.plan().passes.iter().any(|pass| pass.shader.starts_with(folder));
        if !check.is_red() || !has("light_views/") {
            return Ok(check);
        }
        // Rounding is enough for another choice of virtual lights: the means of many frames are held against their noise.
        let [ours, theirs] = [(self, scene), (in_twin, twin)].map(|(subject, session)| {
            (0..SEEDS).map(|seed| Ok(mean(&subject.mean(session, SIZE, seed)?))).collect::<Result<Vec<_>, Error>>()
        });
        let (ours, theirs) = (ours?, theirs?);
        let average = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let squares = |all: &[f64]| all.iter().map(|v| (v - average(all)).powi(2)).sum::<f64>();
        let variance = (squares(&ours) + squares(&theirs)) / f64::from(2 * (SEEDS - 1));
        let noise = (2.0 * variance / f64::from(SEEDS)).sqrt() / average(&ours);
        let drift = (average(&theirs) / average(&ours) - 1.0).abs();
        let check = check.detail(format!("means of {SEEDS} times {FRAMES} frames"));
        if has("scene_voxels/") && !same_cubes {
            let reason = "cubes of visibility lie elsewhere on its surfaces: the size of the drift is told";
            return Ok(check.told(DRIFT, drift, reason));
        }
        Ok(check.bounded(DRIFT, drift, LARGEST_DRIFT.max(5.0 * noise), AT_CHANCE))
    }
}

/// Largest drift of a mean that rounding alone makes.
const LARGEST_DRIFT: f64 = 2e-3;
const AT_EDGES: &str = "rounding alone: a pixel at an edge may show the other surface";
/// Seeds whose means tell how much noise is in them.
const SEEDS: u32 = 6;
const AT_CHANCE: &str =
    "rounding chooses other virtual lights: five standard errors of the difference, found from other seeds";

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
    ("world units", units),
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
    let moving = uncovered();
    let session = Session::new(suite.native, &moving);
    with_history(suite, "what was hidden in the frame before is found anew", &session, found_anew);
    let cutting = cut();
    let session = Session::new(suite.native, &cutting);
    with_history(suite, "nothing of the frame before a cut is left", &session, after_a_cut);
}

/// A row for settings that keep a history: all of them are sought out, in a quick run too.
fn with_history(suite: &mut Suite, row: &str, session: &Session, run: Row) {
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
    // A session of its own: nothing may be left over from the run before.
    let again = Session::new(session.native, session.scene);
    let size = [47, 33];
    let (a, b) = (subject.frame(session, size, 7)?, subject.frame(&again, size, 7)?);
    let reason = "every random number is a hash of pixel, frame, stream and seed";
    Ok(vec![subject.check.clone().bounded(BITS, differing(&a, &b), 0.0, reason)])
}

fn brightness(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // A power of two moves exponents and no mantissa.
    const FACTOR: f32 = 16.0;
    let mut bright = session.scene.clone();
    bright.materials.iter_mut().for_each(|material| material.emission = material.emission.map(|v| v * FACTOR));
    let twin = Session::new(session.native, &bright);
    let mut frames = subject.frames(session, SIZE, 0)?;
    frames.run(0)?;
    let plain = light(&frames)?;
    let other = subject.frame(&twin, SIZE, 0)?;
    // float16 has steps of 2^-24 below 2^-14, and a driver may cut off the rest, once in each texture that light passes;
    // float32 below 2^-126 may be taken for 0.
    let plan = frames.plan();
    let shown = ["indirect", "final"].iter().find_map(|name| plan.outputs.get(name));
    let halves = plan.resources.iter().enumerate().filter(|(index, resource)| {
        let is_half = resource.format() == Some(wgpu::TextureFormat::Rgba16Float);
        is_half && resource.name != "normal" && (resource.name != "final" || shown.is_some_and(|id| id.0 == *index))
    });
    let halves = halves.count() as f64;
    let bound = f64::from(FACTOR) * if halves > 0.0 { halves * 2f64.powi(-24) } else { 2f64.powi(-126) };
    let far = |(a, b): (&f32, &f32)| (f64::from(*a) * f64::from(FACTOR) - f64::from(*b)).abs();
    let worst = plain.iter().flatten().zip(other.iter().flatten()).map(far).fold(0.0, f64::max);
    let reason =
        "16 times the light moves exponents alone; under the least normal number, 2^-126 or 2^-14, steps are cut off";
    Ok(vec![subject.check.clone().bounded("largest difference, radiance", worst, bound, reason)])
}

/// The settings in units that are `factor` times smaller, where their ranges reach that far: lengths grow with the scene,
/// areas with their square, those that are left at their defaults, too.
fn in_units(subject: Subject, factor: f32) -> Option<Settings> {
    let mut settings = subject.settings.clone();
    for parameter in (subject.technique.parameters)() {
        let factor = match parameter.unit {
            "scene units" => f64::from(factor),
            "scene units squared" => f64::from(factor).powi(2),
            _ => continue,
        };
        let (Kind::Float(low, high), Value::Float(value)) =
            (&parameter.kind, settings.get(&parameter.key()).unwrap_or(&parameter.default))
        else {
            continue;
        };
        let scaled = value * factor;
        if scaled != *value {
            (*low..=*high).contains(&scaled).then_some(())?;
            settings.insert(parameter.key(), Value::Float(scaled));
        }
    }
    Some(settings)
}

fn units(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut worst: Option<Check> = None;
    for factor in [2f32.powi(-10), 2f32.powi(20), 1e3] {
        let Some(settings) = in_units(subject, factor) else { continue };
        let twin = scaled(session.scene, factor);
        let twin = Session::new(session.native, &twin);
        let in_twin = Subject { settings: &settings, ..subject };
        let check = subject.drift_from(session, &twin, &in_twin, true)?;
        let check = Check { detail: format!("times {factor}: {}", check.detail), ..check };
        if worst.as_ref().is_none_or(|worst| check.worst.is_nan() || check.worst > worst.worst) {
            worst = Some(check);
        }
    }
    Ok(worst.into_iter().collect())
}

/// The scene with every place and direction moved.
fn moved(scene: &Scene, turn: Quat, by: Vec3, mirror: bool) -> Scene {
    let sign = Vec3::new(if mirror { -1.0 } else { 1.0 }, 1.0, 1.0);
    let direction = |v: [f32; 3]| (turn * (sign * Vec3::from(v))).to_array();
    let place = |v: [f32; 3]| (turn * (sign * Vec3::from(v)) + by).to_array();
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        mesh.positions.iter_mut().for_each(|v| *v = place(*v));
        mesh.normals.iter_mut().for_each(|v| *v = direction(*v));
        if mirror {
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    for light in &mut scene.lights {
        match light {
            Light::Directional { direction: d, .. } => *d = direction(*d),
            Light::Point { position, .. } => *position = place(*position),
            Light::Spot { position, direction: d, .. } => {
                *position = place(*position);
                *d = direction(*d);
            }
        }
    }
    let camera = &mut scene.camera;
    (camera.eye, camera.target, camera.up) = (place(camera.eye), place(camera.target), direction(camera.up));
    scene
}

fn translation(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    // Small whole numbers: coordinates lose three bits at most.
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
    let reason = "2.3 times as far as another seed, which differs by noise alone: all pixels share a frame's random start, \
                  so eight frames are eight numbers, and one in a thousand such ratios is larger (F of 8 and 24); a \
                  hundredth more for pixels at edges";
    Ok(vec![
        subject
            .check
            .clone()
            .bounded("root mean square of the difference over the mean", mirror, 2.3 * noise + 0.01, reason)
            .detail(format!("noise {noise:.4}")),
    ])
}

/// Settings with which a technique claims that it is unbiased, beside those that follow from its parameters.
fn claimed(technique: &str) -> Option<Settings> {
    // Every texel counts as often as a sample stands for it, and no pyramid leaves surfaces out.
    (technique == "hierarchical").then(|| {
        let texel = ("hierarchical.disc_area".to_owned(), Value::Text("texel".into()));
        let full = ("hierarchical.start_resolution".to_owned(), Value::Text("full".into()));
        Settings::from([texel, full, ("hierarchical.levels".to_owned(), Value::Int(1))])
    })
}

/// Whether a technique with these settings claims that its mean does not depend on how it samples.
fn claims_no_bias(subject: Subject) -> bool {
    subject.technique.name == "exhaustive" || claimed(subject.technique.name).as_ref() == Some(subject.settings)
}

/// The drift between two means: bounded for who claims that there is none, otherwise told.
fn drifted(subject: Subject, a: &[Rgb], b: &[Rgb], bound: f64, reason: &str) -> Vec<Check> {
    let check = subject.check.clone();
    vec![if claims_no_bias(subject) {
        check.bounded(DRIFT, drift(a, b), bound, reason)
    } else {
        check.told(DRIFT, drift(a, b), "no claim: the size of the drift is told")
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
    // Pixels are independent but for their shared start: the mean's error is that of a pixel over their root, times a
    // few for the shared start.
    let noise = difference(&a, &few.mean(session, SIZE, 1)?) / (a.len() as f64).sqrt();
    let reason = "noise of a mean of so many pixels, eight times over, and a hundredth";
    Ok(drifted(subject, &a, &b, 8.0 * noise + 0.01, reason))
}

/// The lamp of the court is 22 pixels wide and 10 high in these pictures, and whole pixels stand for its edges: half a
/// one on every side.
const LAMP_EDGES: f64 = 1.0 / 22.0 + 1.0 / 10.0;
const WHOLE_PIXELS: &str = "whole pixels stand for the edges of a lamp of 22 x 10: half a pixel on every side";

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
            let check = subject.check.clone().told(DRIFT, drift(finest, &image), "no claim at so small a picture");
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

/// A picture of twice the size with twice the tangents shows the same rays in its middle.
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
    let reason =
        "the same rays meet the same surfaces; where one meets an edge, rounding decides: a pixel in a hundred";
    Ok(vec![subject.check.clone().bounded("pixels of other depth", wrong as f64, (w * h) as f64 / 100.0, reason)])
}

/// Every triangle in four.
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
        let reason = "without a history a frame knows nothing of those before it";
        return Ok(vec![subject.check.clone().bounded(BITS, differing(&zero, &again), 0.0, reason)]);
    }
    // A jump in the numbers of frames is a cut: the picture after it is the one that a new run begins with.
    run(0)?;
    run(1)?;
    let after = run(40)?;
    let mut fresh = subject.frames(session, SIZE, 0)?;
    fresh.run(40)?;
    let reason = "a frame whose number is not the next one begins anew";
    Ok(vec![subject.check.clone().bounded(BITS, differing(&after, &light(&fresh)?), 0.0, reason)])
}

/// A block before a wall that steps aside between two frames by more than its width.
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

fn found_anew(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut frames = subject.frames(session, SIZE, 0)?;
    let depth = |frames: &Frames| frames.read_rgb("depth").map(|depth| depth.unwrap_or_default());
    (0..=3).try_for_each(|frame| frames.run(frame).map(drop))?;
    let before = depth(&frames)?;
    frames.run(4)?;
    let mut fresh = subject.frames(session, SIZE, 0)?;
    fresh.run(4)?;
    let now = depth(&frames)?;
    // The wall stands half as far again behind the block.
    let uncovered: Vec<usize> =
        (0..now.len()).filter(|&i| now[i][0] > 1.2 * before[i][0] && before[i][0] > 0.0).collect();
    let (with, without) = (light(&frames)?, light(&fresh)?);
    let wrong = uncovered.iter().filter(|&&i| with[i] != without[i]).count();
    let reason = "a surface that the frame before did not show has no history, so its light is this frame's own";
    let check =
        subject.check.clone().bounded("uncovered pixels with light of the frame before", wrong as f64, 0.0, reason);
    Ok(vec![check.detail(format!("of {} uncovered pixels", uncovered.len()))])
}

/// The camera cuts to another place in frame 4.
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
    Ok(vec![subject.check.clone().bounded(BITS, differ, 0.0, "a cut begins anew")])
}
