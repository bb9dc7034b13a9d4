//! World units: everything scaled, lights too, is the same picture.

use halflight_evaluator::{Error, experiment::session::Session};
use halflight_renderer::parameters::{Kind, Settings, Value};
use halflight_scenes::{LENGTHS, Light, Scene};

use super::{super::Suite, SIZE, Subject, each};
use crate::{
    check::Check,
    scenes::{self, scaled},
};

/// Between powers of two every number of a frame is rounded otherwise.
const BETWEEN: [f32; 4] = [1.1, 3.0, 7.0, 10.0];
/// Coarse levels of an image of this size have an odd number of texels, whose middle ones show both sides of a box alike.
const UNEVEN: [u32; 2] = [64, 36];
/// Factors beside those that bring the scene to both ends of what is accepted.
const FAR_APART: [f32; 2] = [1e-12, 1e12];
/// Squares and cubes of lengths leave the range of float32.
const BEYOND: [f32; 2] = [1e-20, 1e18];

pub(super) fn run(suite: &mut Suite) {
    // Its walls are symmetric, so that many surfaces are equally far away.
    let scene = scenes::bundled("cornell");
    let session = Session::new(suite.native, &scene);
    each(suite, "world units between powers of two", |subject| worst_of(&session, subject, &BETWEEN, UNEVEN));
    let scene = every_light();
    let session = Session::new(suite.native, &scene);
    each(suite, "world units from end to end of what is accepted", |subject| far_apart(&session, subject));
    each(suite, "world units beyond are refused", |subject| beyond(&session, subject));
}

/// The court with a light of each kind and a plate that glows.
fn every_light() -> Scene {
    let mut scene = scenes::lamp_court();
    scene.name = "court with every kind of light".into();
    scene.lights = vec![
        scenes::sun(),
        Light::Point { position: [-1.2, 1.9, 0.3], intensity: [2.0, 2.5, 3.0] },
        Light::Spot {
            position: [1.4, 2.2, 0.9],
            direction: [-0.3, -1.0, -0.6],
            intensity: [5.0, 4.0, 3.0],
            half_angle_degrees: 35.0,
            full_intensity_half_angle_degrees: 15.0,
        },
    ];
    scene
}

/// The settings for a scene that is `factor` times larger: lengths scale with it and areas with its square, also those at
/// their defaults. `None` where a value leaves its range.
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

/// The largest drift over these factors, in an image of this size.
fn worst_of(session: &Session, subject: Subject, factors: &[f32], size: [u32; 2]) -> Result<Vec<Check>, Error> {
    let mut worst: Option<Check> = None;
    for &factor in factors {
        let Some(settings) = in_units(subject, factor) else { continue };
        let twin = scaled(session.scene, factor);
        let twin = Session::new(session.native, &twin);
        let in_twin = Subject { settings: &settings, ..subject };
        let check = subject.drift_from(session, &twin, &in_twin, true, size)?;
        let check = Check { detail: format!("times {factor}: {}", check.detail), ..check };
        if worst.as_ref().is_none_or(|worst| check.worst.is_nan() || check.worst > worst.worst) {
            worst = Some(check);
        }
    }
    Ok(worst.into_iter().collect())
}

pub(super) fn units(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    worst_of(session, subject, &[2f32.powi(-10), 2f32.powi(20), 1e3], SIZE)
}

fn far_apart(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let (low, high) = session.scene.bounds().unwrap_or_default();
    // A little inside, because scaled corners are rounded.
    let [smallest, largest] = [1.001 * LENGTHS.start(), 0.999 * LENGTHS.end()];
    let ends = [smallest, largest].map(|length| (length / f64::from(low.distance(high))) as f32);
    worst_of(session, subject, &[FAR_APART, ends].concat(), SIZE)
}

fn beyond(session: &Session, subject: Subject) -> Result<Vec<Check>, Error> {
    let mut wrong = Vec::new();
    for factor in BEYOND {
        let twin = scaled(session.scene, factor);
        let twin = Session::new(session.native, &twin);
        match subject.frame(&twin, [16, 9], 0) {
            Ok(_) => wrong.push(format!("times {factor} is accepted")),
            Err(Error::BadInput(sentence)) if sentence.lines().count() == 1 && sentence.contains("scale") => {}
            Err(error) => wrong.push(format!("times {factor}: {error}")),
        }
    }
    let reason = "one sentence that names the scene, its size, the range and the fix";
    let check = subject.check.clone().bounded("scales without that sentence", wrong.len() as f64, 0.0, reason);
    Ok(vec![check.detail(wrong.join("; "))])
}
