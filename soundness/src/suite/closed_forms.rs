//! Scenes whose light is known in closed form.

use glam::Vec3;
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session},
};
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Settings, Value},
};
use halflight_renderer::{gi::rsm::has_reflective_shadow_maps, scene::traces_rays};
use halflight_scenes::Scene;

use super::Suite;
use crate::{
    check::Check,
    scenes::{self, bundled},
    settings::{parameter, with_small_shadows},
};

mod single_pixels;

pub(super) const GROUP: &str = "closed forms";

/// Largest change of a unit normal's length by float16. A driver may truncate instead of rounding, which changes each
/// coordinate by up to 2^-11, and the length by sqrt(3) times that.
pub(super) const SHORT_NORMAL: f64 = 8.46e-4;

pub(super) fn run(suite: &mut Suite) {
    each(suite, "a pixel alone receives nothing", &scenes::court(), alone);
    each(suite, "a plane does not light itself", &plane(), plane_alone);
    let row = "a furnace: no point receives more than its walls send";
    each(suite, row, &bundled("furnace"), single_pixels::largest);
    each(
        suite,
        "a white room: no point receives more than its lamp sends",
        &scenes::white_room(),
        single_pixels::largest,
    );
    each(suite, "everything glows: no surface in view is without light", &scenes::glowing_bars(), none_is_black);
    each(suite, "normals of unit length where vertex normals part", &parted_normals(), unit_normals);
    each(suite, "the final image is the sum of its parts", &scenes::lamp_court(), sum_of_parts);
    bouncing(suite);
}

type Row = fn(&Session, &'static Technique, &Settings, &Check) -> Result<Vec<Check>, Error>;

/// Runs a row with every technique, one value at a time.
fn each(suite: &mut Suite, row: &str, scene: &Scene, run: Row) {
    if !suite.wants(GROUP, row) {
        return;
    }
    let session = Session::new(suite.native, scene).keep_all();
    for (technique, all) in suite.singles() {
        for settings in all {
            let check = Check::new(GROUP, row, technique.name, &settings);
            suite.guarded(check, |check| run(&session, technique, &settings, check));
        }
    }
}

fn frame<'a>(
    session: &Session<'a>,
    technique: &'static Technique,
    settings: &Settings,
    size: [u32; 2],
) -> Result<Frames<'a>, Error> {
    let settings = with_small_shadows(settings);
    let mut frames = session.frames(&Request { technique, settings, size, seed: 0, direct: None })?;
    frames.run(0)?;
    Ok(frames)
}

fn mean(frames: &Frames, output: &str) -> Result<f64, Error> {
    let pixels = frames.read_rgb(output)?.unwrap_or_default();
    Ok(pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * pixels.len()).max(1) as f64)
}

fn alone(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [1, 1])?;
    let light = mean(&frames, "indirect")?;
    // Reflective shadow maps and rays find more than the screen shows.
    if has_reflective_shadow_maps(frames.plan()) || traces_rays(frames.plan()) {
        let reason = "surfaces off the screen light it";
        return Ok(vec![check.clone().reported("indirect light", light, reason)]);
    }
    let reason = "a surface does not light itself, and nothing else is in view";
    Ok(vec![check.clone().bounded("indirect light", light, 0.0, reason)])
}

/// One lit plane over the whole screen.
fn plane() -> Scene {
    let mut scene = scenes::court();
    scene.name = "plane".into();
    scene.meshes = vec![scenes::quad(Vec3::new(-50.0, -1.0, 50.0), 100.0 * Vec3::X, -100.0 * Vec3::Z, 0)];
    scene.camera = scenes::camera([0.0, 1.0, 3.0], [0.3, -1.0, -0.5], 40.0);
    scene
}

fn plane_alone(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [64, 48])?;
    let share = mean(&frames, "indirect")? / mean(&frames, "direct")?;
    // Normals are stored with 11 bits, positions with 24: a cosine of 5e-4 on both sides, in one of two directions,
    // over a plane that fills the view would give 1e-3 at most.
    let reason = "no part of a plane sees another; normals of 11 bits tilt it by 5e-4 on both sides";
    Ok(vec![check.clone().bounded("indirect light over the plane's radiance", share, 1e-3, reason)])
}

/// Settings under which the hierarchical technique promises that no surface is black in a scene where everything glows:
/// those of the filters, the storage and the form factor.
const KEEPS_LIGHT: [&str; 7] =
    ["start_resolution", "pyramid_filter", "upsampling_kernel", "storage", "disc_area", "form_factor", "temporal_a"];

fn none_is_black(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [96, 64])?;
    let Some(light) = frames.read_rgb("indirect")? else { return Ok(Vec::new()) };
    let depth = frames.read_rgb("depth")?.unwrap_or_default();
    let black = light.iter().zip(&depth).filter(|(light, depth)| depth[0] > 0.0 && **light == [0.0; 3]).count();
    let measure = "surface pixels without indirect light";
    let promised = technique.name == "hierarchical"
        && settings.keys().all(|key| KEEPS_LIGHT.iter().any(|name| key.ends_with(&format!(".{name}"))));
    let check = check.clone().detail(format!("of {} pixels", light.len()));
    Ok(vec![if promised || technique.name == "exhaustive" {
        let reason = "every surface faces emissive ones; where all bilateral weights are zero, the texel nearest in depth is used";
        check.bounded(measure, black as f64, 0.0, reason)
    } else {
        check.reported(measure, black as f64, "a ray or a ring may miss all that glows")
    }])
}

/// The court with vertex normals on its back wall that differ by 120 degrees.
fn parted_normals() -> Scene {
    let mut scene = scenes::court();
    scene.name = "parted normals".into();
    let (a, b) = (Vec3::new(-0.87, 0.0, 0.5).to_array(), Vec3::new(0.87, 0.0, 0.5).to_array());
    scene.meshes[1].normals = vec![a, b, b, a];
    scene
}

fn unit_normals(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [64, 48])?;
    let (normals, depth) =
        (frames.read_rgb("normal")?.unwrap_or_default(), frames.read_rgb("depth")?.unwrap_or_default());
    let length = |n: &[f32; 3]| n.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>().sqrt();
    let seen = normals.iter().zip(&depth).filter(|(_, depth)| depth[0] > 0.0);
    let worst = seen.map(|(normal, _)| (length(normal) - 1.0).abs()).fold(0.0, f64::max);
    let reason = "float16 keeps 11 bits of each coordinate: sqrt(3) 2^-11";
    Ok(vec![check.clone().bounded("deviation of a normal's length from 1", worst, SHORT_NORMAL, reason)])
}

fn sum_of_parts(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [64, 48])?;
    let Some(light) = frames.read_rgb("indirect")? else { return Ok(Vec::new()) };
    let read = |name| frames.read_rgb(name).map(|pixels| pixels.unwrap_or_default());
    let (whole, direct, albedo) = (read("final")?, read("direct")?, read("albedo")?);
    // A truncated 11-bit number is off by up to 2^-10. A driver may decode 8-bit sRGB albedo with an error of half a code,
    // which the transfer function amplifies by 2.4 at most.
    let half_step =
        |albedo: f64| 2.4 * albedo * 0.5 / (255.0 * (1.055 * albedo.powf(1.0 / 2.4) - 0.055).max(1.0 / 255.0));
    let mut worst = 0.0f64;
    for (((whole, direct), albedo), light) in whole.iter().zip(&direct).zip(&albedo).zip(&light) {
        for c in 0..3 {
            let [whole, direct, albedo, light] = [whole[c], direct[c], albedo[c], light[c]].map(f64::from);
            let parts = direct + albedo * light;
            let allowed = 2f64.powi(-10) * parts.max(2f64.powi(-14)) + half_step(albedo) * light;
            worst = worst.max((whole - parts).abs() / allowed);
        }
    }
    let reason = "direct + albedo * indirect, stored with 11 bits at least and albedo with 8";
    Ok(vec![check.clone().bounded("largest difference over what storage allows", worst, 1.0, reason)])
}

/// Bounces in a closed white room, where a bounce cannot send more than it received.
fn bouncing(suite: &mut Suite) {
    let row = "bounces in a closed white room";
    if !suite.wants(GROUP, row) {
        return;
    }
    let scene = scenes::white_room();
    let session = Session::new(suite.native, &scene).keep_all();
    for (technique, all) in suite.singles() {
        let Some(declared) = parameter(technique, "bounces") else { continue };
        let Kind::Int(_, most) = declared.kind else { continue };
        for settings in all.into_iter().filter(|settings| !settings.contains_key(&declared.key())) {
            let check = Check::new(GROUP, row, technique.name, &settings);
            suite.guarded(check, |check| {
                let light = |bounces: i64| {
                    let mut settings = settings.clone();
                    settings.insert(declared.key(), Value::Int(bounces));
                    mean(&frame(&session, technique, &settings, [48, 32])?, "indirect")
                };
                let [before, now, after] = [light(most - 2)?, light(most - 1)?, light(most)?];
                let growth = if after == now { 0.0 } else { (after - now) / (now - before) };
                let reason = "with albedo 1 a bounce brings at most what the one before brought: the sum stays under \
                              the geometric series";
                Ok(vec![
                    check
                        .clone()
                        .bounded("light of the last bounce over that of the one before", growth, 1.0, reason)
                        .detail(format!("mean of {most} bounces {after:.4}")),
                ])
            });
        }
    }
}
