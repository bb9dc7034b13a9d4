//! Bounds of single pixels in closed rooms, beside those of means: what the largest sample of each estimator allows.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Session},
};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};

use super::frame;
use crate::{
    check::{Check, percentile_999},
    settings::{bounces, value},
};

/// The largest indirect light of a pixel over the largest radiance that surfaces send.
pub(super) fn largest(
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let frames = frame(session, technique, settings, [64, 48])?;
    let Some(light) = frames.read_rgb("indirect")? else { return Ok(Vec::new()) };
    let direct = frames.read_rgb("direct")?.unwrap_or_default();
    let largest = |pixels: &[[f32; 3]]| f64::from(pixels.iter().flatten().fold(0.0f32, |a, &b| a.max(b)));
    let emitted = session.scene.materials.iter().flat_map(|material| material.emission);
    let sent = f64::from(emitted.fold(0.0f32, f32::max)).max(largest(&direct));
    let found = largest(&light);
    let check = Check { percentile: percentile_999(&light), largest: found, ..check.clone() };
    let metric = "largest indirect light over what the walls send";
    Ok(vec![match allowed(&frames, session, technique, settings)? {
        Some((bound, reason)) => {
            // Light may be stored as float16, whose largest rounding error is 2^-10 with truncation.
            let bound = bound * (1.0 + 2f64.powi(-10));
            check.bounded(metric, found / sent, bound, reason)
        }
        None => check.reported(metric, found / sent, "a sample may stand for many, and its form factor has no bound"),
    }])
}

/// The largest light that an estimator allows a pixel per unit of what surfaces send, and the reason; `None` where single
/// samples have no bound.
fn allowed(
    frames: &Frames,
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
) -> Result<Option<(f64, &'static str)>, Error> {
    let is = |name: &str, wanted: &str| value(technique, settings, name) == Some(Value::Text(wanted.into()));
    let whole = |name: &str| match value(technique, settings, name) {
        Some(Value::Int(number)) => number as f64,
        _ => 1.0,
    };
    Ok(match technique.name {
        "exhaustive" if is("form_factor", "eq4") => Some((1.02, "discs overlap a little in a corner")),
        "bitmask" if is("estimator", "published") => Some((1.0, "a sector sends its light once, times two cosines")),
        "bitmask" | "horizon" => {
            Some((FRAC_PI_2, "one slice may have the weight cos a + a sin a, which is pi/2 at a grazing angle"))
        }
        "ray-march" => Some((1.0, "a pixel is the mean of its rays")),
        "ssdo" => Some((1.0, "form factors that sum to more than 1 are divided by their sum")),
        "rsm" | "gtao" | "ssao" => Some((0.0, "only lamps and the sky send light, and there are none")),
        "hierarchical"
            if is("sources", "screen")
                && is("disc_area", "sample")
                && is("form_factor", "eq4")
                && bounces(technique, settings) <= 1 =>
        {
            let samples = whole("samples") * whole("levels");
            Some((samples, "Equation 4 is at most 1 for each sample of each level"))
        }
        "hybrid" if is("weighting", "radiometric") => {
            let far = of_virtual_point_lights(frames, session, technique, settings, whole("light_samples"))?;
            Some((
                1.0 + far,
                "near light is at most 1; each virtual point light beyond the near-field distance stands for many",
            ))
        }
        _ => None,
    })
}

/// Bytes and floats of a virtual point light: position, area, normal, the number of surfaces that it stands for, radiance.
const FLOATS: usize = 12;
const AREA: usize = 3;
const FACTOR: usize = 7;

/// The largest sum of form factors over the virtual point lights that one receiver reads, if each faces it at the
/// near-field distance.
fn of_virtual_point_lights(
    frames: &Frames,
    session: &Session,
    technique: &'static Technique,
    settings: &Settings,
    samples: f64,
) -> Result<f64, Error> {
    let Some(bytes) = frames.read_buffer("virtual_lights")? else { return Ok(0.0) };
    let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    let lights: Vec<&[f32]> = floats.chunks_exact(FLOATS).collect();
    let [low, high] = session.facts.bounds.map(Vec3::from);
    let near = value(technique, settings, "sources") != Some(Value::Text("lights".into()));
    let radius = match value(technique, settings, "radius") {
        _ if !near => 0.0,
        Some(Value::Float(radius)) if radius > 0.0 => radius,
        // The default, see `Inputs::nearby`.
        _ => f64::from(low.distance(high)) / 30.0,
    };
    let stride = (lights.len() / samples as usize).max(1);
    let weight = |light: &&[f32]| {
        let disc = f64::from(light[AREA]) / PI;
        let form_factor = if disc > 0.0 { disc / (radius * radius + disc) } else { 0.0 };
        stride as f64 * f64::from(light[FACTOR]) * form_factor
    };
    let read = |first: usize| lights.iter().skip(first).step_by(stride).map(weight).sum::<f64>();
    Ok((0..stride).map(read).fold(0.0, f64::max))
}
