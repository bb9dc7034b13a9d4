//! The frames of one cell: which are run, shown and timed.

use std::collections::btree_map::Entry;

use halflight_frame_graph::FramePlan;
use halflight_native::NativeGpu;
use halflight_renderer::{frame_parameters, gi::Technique, parameters::Settings};

use super::{
    super::{
        frames::{Noise, Sequence, Shown, Times, check_textures, time_frames},
        grid::{Cell, Grid},
        moving::Moving,
        session::{Request, Session},
    },
    Prepared, SCENE_FRAMES, Subject,
};
use crate::Error;

/// What the frames of a cell gave.
pub(super) struct Rendered {
    pub(super) shown: Shown,
    /// Number of the frame that is shown, from 0. Frames before a change of lights are not counted.
    pub(super) shown_frame: u32,
    /// Whether frames build on frames before.
    pub(super) has_history: bool,
    pub(super) noise: Option<f64>,
    pub(super) times: Times,
    /// Median of each pass, those of the scene first, ms.
    pub(super) passes: Vec<(String, f64)>,
    /// Median time of G-buffer and direct light, ms: with everything changed, and with nothing but the frame number.
    pub(super) scene_ms: [f64; 2],
    /// Textures and buffers of the technique.
    pub(super) memory_bytes: u64,
    /// Textures and buffers of the whole frame.
    pub(super) frame_bytes: u64,
    pub(super) occlusion_radius: Option<f32>,
}

/// Runs the frames of a cell.
///
/// # Errors
/// A setting out of range, a texture that fails the check, or a device that was lost.
pub(super) fn render(
    native: &NativeGpu,
    grid: &Grid,
    cell: &Cell,
    subject: &Subject,
    prepared: &mut Prepared,
    check: bool,
) -> Result<Rendered, Error> {
    let (session, size) = (&prepared.session, subject.size);
    let shape = shape_of_scene(cell.technique, &cell.settings)?;
    let (scene_frames, scene_times) = match prepared.scene_frames.entry(shape) {
        Entry::Occupied(ready) => ready.into_mut(),
        Entry::Vacant(slot) => {
            let mut frames = session.scene_frames(&cell.settings, size)?;
            let times = time_frames(&mut frames, Sequence::all(SCENE_FRAMES), |_, _| Ok(()))?;
            slot.insert((frames, times))
        }
    };
    let direct = grid.direct_from_truth.then_some(prepared.reference.direct.as_slice());
    let request = Request { technique: cell.technique, settings: cell.settings.clone(), size, seed: grid.seed, direct };
    let at = cell.at_frame.unwrap_or(grid.frames);
    // A moving view has a G-buffer of its own in each frame.
    let moves = cell.moving != Moving::Nothing;
    let (moved, before) = moves.then(|| cell.moving.apply(subject.still.clone(), at)).unzip();
    let before = before.unwrap_or(0);
    let moved = moved.as_ref().map(|scene| Session::new(native, scene));
    let moved = if check { moved.map(Session::keep_all) } else { moved };
    let mut frames = match &moved {
        Some(moved) => moved.frames(&request)?,
        None => session.technique_frames(&request, scene_frames)?,
    };
    let has_history = frames.plan().has_history();
    let is_one_frame = cell.at_frame.is_some() || moves;
    let sequence =
        if is_one_frame { Sequence::up_to(before, at, grid.frames, has_history) } else { Sequence::all(grid.frames) };
    // A filter over frames shows what it can do in the last one.
    let shown_frame = if is_one_frame || has_history { sequence.end - 1 } else { 0 };
    let mut noise = Noise::default();
    let mut shown: Option<Shown> = None;
    let times = time_frames(&mut frames, sequence, |frames, frame| {
        if frame != shown_frame && is_one_frame {
            return Ok(());
        }
        let image = Shown::read(frames)?;
        // Frames before the measured one show another view or an image that has yet to converge.
        if !is_one_frame {
            noise.add(image.measured());
        }
        if frame == shown_frame {
            shown = Some(image);
        }
        Ok(())
    })?;
    if check {
        check_textures(&[scene_frames, &frames])?;
    }
    // Some plans hold the passes of the scene themselves.
    let own = |name: &String| times.passes.iter().any(|(own, _)| own == name);
    let of_scene: Vec<_> = scene_times.passes.iter().filter(|(name, _)| !own(name)).cloned().collect();
    let whole = [scene_frames.plan(), frames.plan()].map(FramePlan::bytes);
    Ok(Rendered {
        frame_bytes: if of_scene.is_empty() { whole[1] } else { whole.iter().sum() },
        passes: [of_scene, times.passes.clone()].concat(),
        shown: shown.ok_or_else(|| Error::Failed("no frame was rendered: set frames to at least 1".into()))?,
        shown_frame: shown_frame - before,
        has_history,
        noise: noise.deviation(),
        times,
        scene_ms: [scene_times.total.median, scene_times.total_static],
        memory_bytes: frames.plan().technique_bytes(),
        occlusion_radius: occlusion_radius(frames.plan()),
    })
}

/// What G-buffer and direct light depend on: cells that have it in common share them.
fn shape_of_scene(technique: &Technique, settings: &Settings) -> Result<String, Error> {
    let needs = (technique.needs)(settings).map_err(|e| Error::BadInput(e.to_string()))?;
    let of_frame = frame_parameters();
    let own = settings.iter().filter(|(key, _)| of_frame.iter().any(|parameter| parameter.key() == **key));
    Ok([format!("{needs:?}")].into_iter().chain(own.map(|(key, value)| format!(" {key}={value}"))).collect())
}

/// Radius of a plan's ambient visibility, scene units; `None` where it finds none.
pub(super) fn occlusion_radius(plan: &FramePlan) -> Option<f32> {
    plan.attributes.get("ambient_occlusion.radius").copied()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use halflight_renderer::parameters::Value;
    use halflight_techniques::technique;

    use super::*;

    #[test]
    fn cells_share_what_the_camera_sees_unless_a_setting_changes_it() {
        let shape = |key: &str, value: &str| {
            let settings = Settings::from([(key.to_owned(), Value::parse(value))]);
            shape_of_scene(technique("none").unwrap(), &settings).unwrap()
        };
        let plain = shape_of_scene(technique("none").unwrap(), &Settings::new()).unwrap();
        assert_eq!(shape("hierarchical.levels", "3"), plain);
        let others =
            [("gbuffer.texture_filter", "mips"), ("gbuffer.texture_filter", "bilinear"), ("direct.storage", "float16")];
        let shapes: std::collections::BTreeSet<String> = others.iter().map(|(key, value)| shape(key, value)).collect();
        assert!(shapes.len() == 3 && !shapes.contains(&plain), "{shapes:?}");
    }
}
