//! Runs a grid: each cell is timed and measured against the reference, and each finished cell is kept at once.

use std::{fs, path::Path};

use halflight_metrics::MetricId;
use halflight_native::NativeGpu;
use halflight_output::{OutputFolder, terminal};
use halflight_renderer::parameters::Settings;
use halflight_scenes::Scene;
use halflight_techniques::invocation::Invocation;

use super::{
    cell_file::CellFile,
    grid::{Cell, Grid},
    scene_runner::{RunnerOptions, SceneRunner, Subject},
    session::open_scene,
};
use crate::{Error, measurement::Measurement, progress::Progress, report::Report};

/// How to run a grid.
pub struct RunOptions<'a> {
    /// The report folder.
    pub out: &'a Path,
    /// Keep the cells that an earlier run of the same grid finished.
    pub resume: bool,
    /// Run only the cells whose number is `.0` modulo `.1`.
    pub shard: (usize, usize),
    /// The command line, for the report.
    pub command: Invocation,
    /// Check every texture of each cell for NaN and infinity.
    pub check: bool,
}

/// Runs a grid and writes its report folder.
///
/// # Errors
/// Bad input (a scene, a setting, a folder that cannot be written or holds files of the user), or a device that was
/// lost. Finished cells stay in the folder.
pub fn run(native: &NativeGpu, grid: &Grid, options: &RunOptions) -> Result<(), Error> {
    let scenes =
        grid.scenes.iter().map(|path| Ok((path.as_path(), open_scene(path)?))).collect::<Result<Vec<_>, Error>>()?;
    for (_, scene) in &scenes {
        scene.warnings.iter().for_each(|warning| terminal::note(format_args!("warning: {warning}")));
    }
    let total = scenes.len() * grid.sizes.len() * grid.cells.len();
    let folder = prepare_folder(options, total)?;
    let mut report = empty_report(grid, options, &scenes);
    let progress = Progress::new(&grid.name, total as u64);
    let settings = RunnerOptions { check: options.check, adapter: options.command.value("adapter") };
    let mut number = 0;
    for (index, (path, scene)) in scenes.iter().enumerate() {
        for &size in &grid.sizes {
            // Images are measured against the reference of the first frame.
            let still = scene.posed(0);
            let label = file_label(&scenes, index);
            let subject = Subject { path, label, still: &still, moving: scene, size };
            let mut runner = SceneRunner::new(native, grid, settings, &folder, subject);
            report.references.extend(runner.reference_commands());
            for cell in &grid.cells {
                let file = CellFile::new(&folder, number);
                number += 1;
                let key = runner.key(cell);
                let finished = file.finished(&key);
                let is_fresh = finished.is_none();
                if is_fresh && file.number() % options.shard.1 != options.shard.0 {
                    continue;
                }
                let row = match finished {
                    Some(row) => row,
                    None => {
                        let row = runner.measure(cell, file.number())?;
                        file.keep(&key, &row)?;
                        progress.set(number as u64, &describe(cell));
                        row
                    }
                };
                for warning in [noisy_reference(&row, grid.truth_rel_error), left_out(&row)].into_iter().flatten() {
                    if !report.warnings.contains(&warning) {
                        report.warnings.push(warning);
                    }
                }
                report.measurements.push(row);
                if is_fresh {
                    // A run that ends here, for whatever reason, leaves a report of what it finished.
                    report.write(&folder)?;
                }
            }
        }
    }
    report.write(&folder)?;
    progress.finish(&format!(
        "{}: {} of {total} cells in {}",
        grid.name,
        report.measurements.len(),
        options.out.join("index.html").display()
    ));
    Ok(())
}

/// The report folder. Its files are claimed before anything is measured, so that a folder that holds files of the user is
/// refused at once.
fn prepare_folder(options: &RunOptions, cells: usize) -> Result<OutputFolder, Error> {
    let folder = OutputFolder::open(options.out);
    for name in Report::FILES {
        folder.claim(name)?;
    }
    for number in 0..cells {
        CellFile::new(&folder, number).claim()?;
    }
    for name in ["images", "plots"] {
        let path = options.out.join(name);
        fs::create_dir_all(&path).map_err(|e| Error::unwritable(&path, e))?;
    }
    if !options.resume {
        CellFile::remove_all(&folder)?;
    }
    Ok(folder)
}

fn empty_report(grid: &Grid, options: &RunOptions, scenes: &[(&Path, Scene)]) -> Report {
    Report {
        title: format!("Halflight: {}", grid.name),
        summary: format!(
            "{} configurations on {} at {}, {} frames each, against a path-traced reference of {}.",
            grid.cells.len(),
            scenes.iter().map(|(_, scene)| scene.name.clone()).collect::<Vec<_>>().join(", "),
            grid.sizes.iter().map(|[w, h]| format!("{w}x{h}")).collect::<Vec<_>>().join(", "),
            grid.frames,
            if grid.bounces > 1 { format!("{} bounces", grid.bounces) } else { "one bounce".into() }
        ),
        command: options.command.to_string(),
        references: Vec::new(),
        warnings: scenes.iter().flat_map(|(_, scene)| scene.warnings.clone()).collect(),
        measurements: Vec::new(),
    }
}

/// The name of a scene in the names of its pictures: without characters that a file name cannot have, and with a number
/// where another scene of the grid has the same name.
fn file_label(scenes: &[(&Path, Scene)], index: usize) -> String {
    let label = |scene: &Scene| -> String {
        let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' };
        scene.name.chars().map(plain).collect()
    };
    let own = label(&scenes[index].1);
    match scenes[..index].iter().filter(|(_, scene)| label(scene) == own).count() {
        0 => own,
        same => format!("{own}-{}", same + 1),
    }
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
    format!("{} {}", cell.technique.name, changed.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_two_scenes_never_share_a_name_and_stay_in_their_folder() {
        let scene = |name: &str| (Path::new("s.toml"), Scene { name: name.into(), ..Scene::default() });
        let scenes = ["room", "room", "../up", "a b", "room"].map(scene);
        let labels: Vec<String> = (0..scenes.len()).map(|index| file_label(&scenes, index)).collect();
        assert_eq!(labels, ["room", "room-2", ".._up", "a_b", "room-3"]);
    }
}
