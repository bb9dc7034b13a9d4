//! Keyframes of a scene file: the lists called `moves`.

use glam::DVec3;

use super::keys::Table;
use crate::{CameraKeyframe, Keyframe, Light, Motion, SceneError};

/// Largest frame number: more than a day at 10 frames a second, and exact in float32.
const LAST_FRAME: u32 = 1_000_000;

/// The tables of `moves` with their frames, in order; empty if the key is absent.
fn keyframes<'a>(table: &Table<'a>, keys: &[&str]) -> Result<Vec<(u32, Table<'a>)>, SceneError> {
    let tables = table.tables("moves", keys)?;
    if table.has("moves") && tables.is_empty() {
        return Err(table.error("moves", "is empty; remove it or write for example `moves = [{ frame = 0 }]`"));
    }
    let mut read: Vec<(u32, Table)> = Vec::new();
    for keyframe in tables {
        let frame = keyframe.required("frame", keyframe.integer("frame", 0..=LAST_FRAME)?, "frame = 0")?;
        if let Some((last, _)) = read.last().filter(|(last, _)| *last >= frame) {
            return Err(keyframe.error(
                "frame",
                format_args!("is {frame}, but the keyframe before it is at {last}; sort keyframes by ascending frame"),
            ));
        }
        read.push((frame, keyframe));
    }
    Ok(read)
}

fn any(table: &Table, key: &str) -> Result<[f32; 3], SceneError> {
    Ok(table.vector(key, "finite numbers", |_| true)?.unwrap_or_default())
}

/// The motion of a model whose origin is at `centre`, and its pivot; `None` for a static model.
pub(super) fn model(table: &Table, centre: [f32; 3]) -> Result<Option<(Motion, DVec3)>, SceneError> {
    let pivot = table.position("pivot")?;
    let exact = pivot.unwrap_or(centre.map(f64::from));
    let mut motion = Motion { pivot: exact.map(|x| x as f32), keyframes: Vec::new() };
    for (frame, keyframe) in keyframes(table, &["frame", "translate", "rotate_degrees", "scale"])? {
        let scale = keyframe.scale("scale")?.unwrap_or([1.0; 3]);
        if scale.iter().any(|&s| s <= 0.0) {
            // An interpolation to a negative scale would pass through 0.
            return Err(keyframe.error("scale", "must be above 0 in a keyframe; mirror the model with `transform`"));
        }
        let (translate, rotate_degrees) = (any(&keyframe, "translate")?, any(&keyframe, "rotate_degrees")?);
        motion.keyframes.push(Keyframe { frame, translate, rotate_degrees, scale });
    }
    if motion.keyframes.is_empty() {
        return match pivot {
            Some(_) => Err(table.error("pivot", "has no effect without `moves`; remove it or add `moves`")),
            None => Ok(None),
        };
    }
    Ok(Some((motion, exact.into())))
}

/// The motion of a light; `None` for a static light.
pub(super) fn light(table: &Table, light: &Light) -> Result<Option<Motion>, SceneError> {
    // Keys without effect are refused rather than ignored.
    let keys: &[&str] = match light {
        Light::Directional { .. } => &["frame", "rotate_degrees"],
        Light::Point { .. } => &["frame", "translate"],
        Light::Spot { .. } => &["frame", "translate", "rotate_degrees"],
    };
    let mut motion = Motion::default();
    for (frame, keyframe) in keyframes(table, keys)? {
        let (translate, rotate_degrees) = (any(&keyframe, "translate")?, any(&keyframe, "rotate_degrees")?);
        motion.keyframes.push(Keyframe { frame, translate, rotate_degrees, ..Keyframe::default() });
    }
    Ok(Some(motion).filter(|motion| !motion.keyframes.is_empty()))
}

/// The path of the camera, relative to `origin`; empty for a static camera.
pub(super) fn camera(table: &Table, origin: DVec3) -> Result<Vec<CameraKeyframe>, SceneError> {
    let read = |(frame, keyframe): (u32, Table)| {
        let [eye, target] = eye_and_target(&keyframe, "moves.eye", origin)?;
        Ok(CameraKeyframe { frame, eye, target, cut: keyframe.boolean("cut")?.unwrap_or(false) })
    };
    keyframes(table, &["frame", "eye", "target", "cut"])?.into_iter().map(read).collect()
}

/// The eye and the target of a camera, relative to `origin`. They must be different; `key` is the key of the eye.
pub(super) fn eye_and_target(table: &Table, key: &str, origin: DVec3) -> Result<[[f32; 3]; 2], SceneError> {
    let relative = |position: [f64; 3]| (DVec3::from(position) - origin).as_vec3().to_array();
    let eye = table.required("eye", table.position("eye")?, "eye = [0.0, 1.0, 5.0]")?;
    let target = table.position("target")?;
    if let (Some(target), Some(value)) = (target, table.get("target"))
        && relative(target) == relative(eye)
    {
        return Err(table.wrong("target", value, format_args!("[x, y, z], finite numbers, different from `{key}`")));
    }
    let target = table.required("target", target, "target = [0.0, 1.0, 0.0]")?;
    Ok([eye, target].map(relative))
}
