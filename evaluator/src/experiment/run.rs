//! Runs a grid: each cell is timed and measured against the reference, and each finished cell is kept at once.

use std::{
    fs,
    path::Path,
    time::{Duration, Instant},
};

use halflight_metrics::MetricId;
use halflight_native::NativeGpu;
use halflight_output::{OutputFolder, terminal};
use halflight_renderer::parameters::Settings;
use halflight_scenes::Scene;
use halflight_techniques::invocation::Invocation;

use super::{
    COMMIT,
    cell_id::CellId,
    cell_log::{CELLS, CellLog, Record},
    grid::{Cell, Grid},
    manifest::{MANIFEST, Manifest, SceneContent},
    moving::Moving,
    scene_runner::{RunnerOptions, SceneRunner, Subject, shaders_hash},
    session::open_scene,
    shard::Shard,
};
use crate::{Error, measurement::Measurement, progress::Progress, report::Report};

/// How to run a grid.
pub struct RunOptions<'a> {
    /// The report folder.
    pub out: &'a Path,
    /// Keep the cells that an earlier run of the same grid finished.
    pub resume: bool,
    /// Measure only the cells of this part.
    pub shard: Shard,
    /// The command line, for the report.
    pub command: Invocation,
    /// Check every texture of each cell for NaN and infinity.
    pub check: bool,
}

/// A report is written again where this many times as long has passed as the last one took: then it takes a tenth of a
/// run at most.
const REPORT_PAUSE: u32 = 10;

/// Runs a grid and writes its report folder.
///
/// # Errors
/// Bad input (a scene, a setting, a folder that cannot be written or holds files of the user), or a device that was
/// lost. Finished cells stay in the folder.
pub fn run(native: &NativeGpu, grid: &Grid, options: &RunOptions) -> Result<(), Error> {
    if grid.direct_from_truth && grid.sweeps.iter().any(|sweep| sweep.moving != [Moving::Nothing]) {
        return Err(Error::BadInput(format!(
            "path-traced direct light is that of one frame, and a sweep of the grid {} has `moving`: take direct light \
             \"rendered\", or leave `moving` out",
            grid.name
        )));
    }
    let scenes =
        grid.scenes.iter().map(|path| Ok((path.as_path(), open_scene(path)?))).collect::<Result<Vec<_>, Error>>()?;
    for (_, scene) in &scenes {
        scene.warnings.iter().for_each(|warning| terminal::note(format_args!("warning: {warning}")));
    }
    // Images are measured against the reference of the first frame.
    let stills: Vec<Scene> = scenes.iter().map(|(_, scene)| scene.posed(0)).collect();
    let folder = prepare_folder(options)?;
    let settings = RunnerOptions { check: options.check, adapter: options.command.value("adapter") };
    let mut runners = Vec::new();
    for ((path, scene), still) in scenes.iter().zip(&stills) {
        for &size in &grid.sizes {
            let subject = Subject { path, label: file_label(scene), still, moving: scene, size };
            runners.push(SceneRunner::new(native, grid, settings, &folder, subject));
        }
    }
    let manifest = manifest(grid, options, &scenes, &runners);
    let (mut log, cut) =
        if options.resume { CellLog::resume(&folder)? } else { (CellLog::empty(&folder)?, Default::default()) };
    cut.sentence(&options.out.join(CELLS)).iter().for_each(|cut| terminal::note(format_args!("warning: {cut}")));
    let mut report = empty_report(grid, &manifest.scenes, options.command.to_string(), manifest.warnings.clone());
    let planned = plan(grid, options.shard, &runners, &manifest.contexts, &log)?;
    manifest.write(&folder.claim(MANIFEST)?)?;
    let progress = Progress::new(&grid.name, planned.len() as u64);
    let (mut written, mut pause) = (Instant::now(), Duration::ZERO);
    for (number, Planned { runner: index, cell, id, finished }) in planned.into_iter().enumerate() {
        let runner = &mut runners[index];
        let record = match finished {
            Some(mut record) => {
                record.row.command = runner.command_again(&cell, &record.row.command);
                record.row.section.clone_from(&cell.section);
                add(&mut report, record, grid.truth_rel_error);
                continue;
            }
            None => runner.measure(&cell, &id).and_then(|(row, references)| {
                let context = manifest.contexts[index].clone();
                let record = Record { cell: id.to_string(), context, references, row };
                log.keep(&record)?;
                Ok(record)
            }),
        };
        // A run that ends here, for whatever reason, leaves a report of what it finished.
        let record = record.inspect_err(|_| drop(report.write(&folder)))?;
        add(&mut report, record, grid.truth_rel_error);
        progress.set(number as u64 + 1, &describe(&cell));
        if written.elapsed() >= pause {
            let start = Instant::now();
            report.write(&folder)?;
            (written, pause) = (Instant::now(), start.elapsed() * REPORT_PAUSE);
        }
    }
    report.write(&folder)?;
    progress.finish(&format!(
        "{}: {} of {} cells in {}",
        grid.name,
        report.measurements.len(),
        grid.len() * runners.len() as u64,
        options.out.join("index.html").display()
    ));
    Ok(())
}

/// A cell of this run.
struct Planned {
    /// Index of the scene at a size.
    runner: usize,
    cell: Cell,
    id: CellId,
    /// What an earlier run left.
    finished: Option<Record>,
}

/// The cells of a shard and those that are finished, in the order of the grid. Other cells are named and forgotten.
fn plan(
    grid: &Grid,
    shard: Shard,
    runners: &[SceneRunner],
    contexts: &[String],
    log: &CellLog,
) -> Result<Vec<Planned>, Error> {
    let mut planned = Vec::new();
    let mut unknown = grid.only.clone().unwrap_or_default();
    for (index, (runner, context)) in runners.iter().zip(contexts).enumerate() {
        for cell in grid.cells() {
            let id = runner.id(&cell);
            unknown.remove(id.as_str());
            let finished = log.finished(&id, context, |row| runner.is_of_adapter(row)).cloned();
            let is_wanted = grid.only.as_ref().is_none_or(|only| only.contains(id.as_str())) && shard.holds(&id);
            if finished.is_some() || is_wanted {
                planned.push(Planned { runner: index, cell, id, finished });
            }
        }
    }
    match unknown.first() {
        None => Ok(planned),
        Some(id) => Err(Error::BadInput(format!(
            "`only` of the grid {} names {id}, and {} more, which the grid does not have: a scene, a size or a setting has \
             changed since; merge the folders again to write a new grid of the missing cells",
            grid.name,
            unknown.len() - 1
        ))),
    }
}

fn manifest(grid: &Grid, options: &RunOptions, scenes: &[(&Path, Scene)], runners: &[SceneRunner]) -> Manifest {
    let content = |(index, (_, scene)): (usize, &(&Path, Scene))| SceneContent {
        name: scene.name.clone(),
        hash: runners[index * grid.sizes.len()].scene_hash().to_owned(),
    };
    Manifest {
        commit: COMMIT.into(),
        shaders: shaders_hash().to_string(),
        grid: grid.to_toml(),
        scenes: scenes.iter().enumerate().map(content).collect(),
        contexts: runners.iter().map(SceneRunner::context).collect(),
        command: options.command.to_string(),
        warnings: scenes.iter().flat_map(|(_, scene)| scene.warnings.clone()).collect(),
    }
}

/// Adds a row to a report, with its references and with what is to be told about it.
pub(crate) fn add(report: &mut Report, record: Record, truth_rel_error: f32) {
    let add = |list: &mut Vec<String>, text: String| {
        if !list.contains(&text) {
            list.push(text);
        }
    };
    record.references.into_iter().for_each(|command| add(&mut report.references, command));
    let told = [noisy_reference(&record.row, truth_rel_error), left_out(&record.row)];
    told.into_iter().flatten().for_each(|warning| add(&mut report.warnings, warning));
    report.measurements.push(record.row);
}

/// The report folder. Its files are claimed before anything is measured, so that a folder that holds files of the user is
/// refused at once.
fn prepare_folder(options: &RunOptions) -> Result<OutputFolder, Error> {
    let folder = OutputFolder::open(options.out);
    for name in Report::FILES.into_iter().chain([MANIFEST, CELLS]) {
        folder.claim(name)?;
    }
    for name in ["images", "plots"] {
        let path = options.out.join(name);
        fs::create_dir_all(&path).map_err(|e| Error::unwritable(&path, e))?;
    }
    if !options.resume {
        folder.remove(|name| name == CELLS)?;
    }
    Ok(folder)
}

/// A report of a grid without rows.
pub(crate) fn empty_report(grid: &Grid, scenes: &[SceneContent], command: String, warnings: Vec<String>) -> Report {
    Report {
        title: format!("Halflight: {}", grid.name),
        summary: format!(
            "{} configurations on {} at {}, {} frames each, against a path-traced reference of {}.",
            grid.len(),
            scenes.iter().map(|scene| scene.name.clone()).collect::<Vec<_>>().join(", "),
            grid.sizes.iter().map(|[w, h]| format!("{w}x{h}")).collect::<Vec<_>>().join(", "),
            grid.frames,
            if grid.bounces > 1 { format!("{} bounces", grid.bounces) } else { "one bounce".into() }
        ),
        command,
        references: Vec::new(),
        warnings,
        measurements: Vec::new(),
    }
}

/// The name of a scene in the names of its pictures, without characters that a file name cannot have.
fn file_label(scene: &Scene) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    scene.name.chars().map(plain).collect()
}

/// A warning where the reference stopped at its number of samples, before it was as precise as asked.
fn noisy_reference(row: &Measurement, asked: f32) -> Option<String> {
    let Measurement { scene, width, height, .. } = row;
    let Some(reached) = row.errors.get(MetricId::TruthRelError) else {
        return Some(format!(
            "the reference of {scene} at {width}x{height} found too little light to tell its error: raise truth_samples, \
             or check that light reaches what the camera sees"
        ));
    };
    if reached <= f64::from(asked) * 1.05 {
        return None;
    }
    Some(format!(
        "the reference of {scene} at {width}x{height} reached a relative error of {reached:.3} over 8x8 blocks, not the \
         {asked} asked for: raise truth_samples"
    ))
}

/// What to tell about a row whose technique leaves out the light of a whole kind of source. Light off the screen is in
/// the column `left_out` alone, because every technique of screen space leaves it out. The baseline without indirect light
/// needs no warning.
fn left_out(row: &Measurement) -> Option<String> {
    if row.technique == "none" {
        return None;
    }
    let kinds: Vec<_> =
        row.left_out.split(", ").filter(|kind| !kind.is_empty() && !kind.contains("off the screen")).collect();
    (!kinds.is_empty())
        .then(|| format!("{} leaves out indirect light of {} in {}", row.technique, kinds.join(", of "), row.scene))
}

/// A cell's settings that differ from the defaults, in words.
fn describe(cell: &Cell) -> String {
    let defaults = (cell.technique.complete)(&Settings::new()).unwrap_or_default();
    let changed = cell.settings.iter().filter(|(key, value)| defaults.get(*key) != Some(value));
    let changed: Vec<String> =
        changed.map(|(key, value)| format!("{}={value}", key.rsplit('.').next().unwrap_or(key))).collect();
    let frame = cell.at_frame.map(|frame| format!("frame {frame}"));
    let moving = (cell.moving != Moving::Nothing).then(|| format!("moving {}", cell.moving));
    let words = [cell.technique.name.to_owned()].into_iter().chain(changed).chain(frame).chain(moving);
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stay_in_their_folder() {
        let label = |name: &str| file_label(&Scene { name: name.into(), ..Scene::default() });
        assert_eq!(["room", "../up", "a b"].map(label), ["room", ".._up", "a_b"]);
    }
}
