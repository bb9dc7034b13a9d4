//! A lit floor with a wall on its edge: indirect light in absolute units against its closed form.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight_evaluator::{
    Error,
    experiment::session::{Request, Session},
};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{Light, Scene};

use super::{Suite, closed_forms::GROUP};
use crate::{check::Check, oracle::GBuffer, scenes};

/// Width and height of the image.
const SIZE: [u32; 2] = [192, 144];
/// Number of frames that are averaged.
const FRAMES: u32 = 8;
/// Albedo of both planes.
const ALBEDO: f32 = 0.8;

/// A floor of 4 x 2 and a wall of 4 x 2 that meet at z = 0, both entirely in view. A sun lights only the floor, whose
/// outgoing radiance is 1.
pub fn corner() -> Scene {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    Scene {
        name: "corner".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * x, -2.0 * z, 0),
            scenes::quad(Vec3::new(-2.0, 0.0, 0.0), 4.0 * x, 2.0 * y, 0),
        ],
        materials: vec![scenes::grey(ALBEDO)],
        lights: vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [PI as f32 / ALBEDO; 3] }],
        camera: scenes::camera([0.0, 2.6, 4.4], [0.0, 0.7, 0.75], 55.0),
        ..Scene::default()
    }
}

/// Form factor from a small surface at `distance` from the edge to a perpendicular rectangle that is `height` high and
/// reaches from `left` to `right` along the edge (Howell, catalogue of configuration factors, C-17).
fn perpendicular_rectangle(distance: f64, height: f64, left: f64, right: f64) -> f64 {
    let side = |width: f64| {
        let slant = distance.hypot(height);
        (width / distance).atan() - distance / slant * (width / slant).atan()
    };
    (side(right) - side(left)) / (2.0 * PI)
}

/// Form factor from a point of [`corner`] with this normal to the other plane.
pub fn seen_of_the_other(p: DVec3, normal: DVec3) -> f64 {
    let distance = if normal.y > 0.5 { p.z } else { p.y };
    perpendicular_rectangle(distance.max(1e-6), 2.0, -2.0 - p.x, 2.0 - p.x)
}

/// A technique that claims absolute units: its name, one setting besides the defaults, the largest relative error of the
/// mean, and the reason for that bound.
type Claim = (&'static str, Option<(&'static str, &'static str)>, f64, &'static str);

const CLAIMS: [Claim; 4] = [
    ("radiance-cache", Some(("bounces", "1")), 0.05, "exact rays; records average over cells"),
    ("exhaustive", None, 0.02, "all pixels are summed; the edge itself is under a pixel wide"),
    ("bitmask", None, 0.05, "the mean is promised within 5 % where nothing is occluded"),
    ("hybrid", Some(("start_resolution", "full")), 0.05, "the mean is promised within 5 % where nothing is occluded"),
];

fn settings_of(&(technique, setting, ..): &Claim) -> Settings {
    setting.iter().map(|(key, value)| (format!("{technique}.{key}"), Value::parse(value))).collect()
}

pub(super) fn run(suite: &mut Suite) {
    let row = "a lit floor before a wall: light in absolute units";
    if !suite.wants(GROUP, row) {
        return;
    }
    let scene = corner();
    let session = Session::new(suite.native, &scene);
    let quick = suite.options.quick;
    for (technique, mut all) in suite.singles() {
        let claim = CLAIMS.iter().find(|(name, ..)| *name == technique.name);
        // A quick run tests only the claims.
        all.retain(|settings| !quick && claim.is_none_or(|claim| settings_of(claim) != *settings));
        all.extend(claim.map(settings_of));
        for settings in all {
            let check = Check::new(GROUP, row, technique.name, &settings);
            suite.guarded(check, |check| light_on_the_wall(&session, technique, &settings, check));
        }
    }
}

fn light_on_the_wall(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let request = Request { technique, settings: settings.clone(), size: SIZE, seed: 0, direct: None };
    let mut frames = session.frames(&request)?;
    frames.run(0)?;
    if frames.read_rgb("indirect")?.is_none() {
        return Ok(Vec::new());
    }
    let to_world = frames.view().world_to_view.as_dmat4().inverse();
    let shown = GBuffer::read(&frames);
    // The exhaustive sum uses no random numbers.
    let count = if technique.name == "exhaustive" { 1 } else { FRAMES };
    let light = frames.mean_over_frames("indirect", count)?.0;
    let (mut found, mut exact) = (0.0, 0.0);
    for (pixel, light) in shown.pixels.iter().zip(&light).filter(|(pixel, _)| pixel.depth > 0.0) {
        let normal = to_world.transform_vector3(pixel.normal);
        if normal.y < 0.5 {
            found += f64::from(light[0]);
            exact += seen_of_the_other(to_world.transform_point3(pixel.position), normal);
        }
    }
    let off = (found / exact - 1.0).abs();
    let measure = "relative error of the mean";
    let check = check.clone().detail(format!("{:.4} of the closed form", found / exact));
    let claim = CLAIMS.iter().find(|claim| claim.0 == technique.name && settings_of(claim) == *settings);
    Ok(vec![match claim {
        Some((_, _, bound, reason)) => check.bounded(measure, off, *bound, reason),
        None => check.reported(measure, off, "no claim: a radius, coarse texels or another estimator change the mean"),
    }])
}
