//! Runs a grid: every cell is timed and held against truth, and each finished cell is kept at once.

mod frames;

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fs,
    path::{Path, PathBuf},
};

use halflight_frame_graph::scan::Scanned;
use halflight_native::{
    NativeGpu,
    files::write_whole,
    images::{Image, Rgb, auto_exposure, tone_map_all},
};
use halflight_renderer::{
    parameters::Settings,
    plan_technique_of_scene,
    scene::SceneFacts,
    truth::{Request as TruthRequest, Stop, Truth},
};
use halflight_scenes::{Scene, SceneNeeds};
use halflight_techniques::parameters_of;
use serde_json::{Map, Value};

use self::frames::{Noise, OcclusionTruth, Shown, modulate, occlusion_truth, time_frames};
use crate::{
    Error,
    grid::{Cell, Grid},
    measurement::{Errors, Measurement},
    metrics::{DisplayPair, display_errors, linear_errors},
    progress::Progress,
    report::{Pictures, Report},
    session::{Frames, Request, Session, open_scene},
    temporal, truth,
};

/// Frames of the scene's own passes; they are the same for all cells, so they are timed once.
const SCENE_FRAMES: u32 = 5;

/// How to run a grid.
pub struct RunOptions<'a> {
    /// The report folder.
    pub out: &'a Path,
    /// Keep the cells that an earlier run of the same grid finished.
    pub resume: bool,
    /// Run only the cells whose number is `.0` modulo `.1`.
    pub shard: (usize, usize),
    /// The command line, for the report.
    pub command: String,
    /// Look through every texture of each cell for NaN and infinity.
    pub check: bool,
}

/// Commit that this program was built from.
pub const COMMIT: &str = env!("HALFLIGHT_COMMIT");

/// Runs a grid and writes its report folder.
///
/// # Errors
/// Bad input (a scene, a setting, a folder that cannot be written), or a device that was lost. Cells that
/// were finished stay in the folder.
pub fn run(native: &NativeGpu, grid: &Grid, options: &RunOptions) -> Result<(), Error> {
    let cells_folder = options.out.join("cells");
    if !options.resume && cells_folder.exists() {
        fs::remove_dir_all(&cells_folder).map_err(|e| Error::unwritable(&cells_folder, e))?;
    }
    for folder in [&cells_folder, &options.out.join("images"), &options.out.join("plots")] {
        fs::create_dir_all(folder).map_err(|e| Error::unwritable(folder, e))?;
    }
    let scenes =
        grid.scenes.iter().map(|path| open_scene(path).map(|scene| (path, scene))).collect::<Result<Vec<_>, _>>()?;
    let mut report = Report {
        title: format!("Halflight: {}", grid.name),
        summary: format!(
            "{} configurations on {} at {}, {} frames each, against path-traced truth of {}.",
            grid.cells.len(),
            scenes.iter().map(|(_, scene)| scene.name.clone()).collect::<Vec<_>>().join(", "),
            grid.sizes.iter().map(|[w, h]| format!("{w}x{h}")).collect::<Vec<_>>().join(", "),
            grid.frames,
            if grid.bounces > 1 { format!("{} bounces", grid.bounces) } else { "one bounce".into() }
        ),
        command: options.command.clone(),
        warnings: scenes.iter().flat_map(|(_, scene)| scene.warnings.clone()).collect(),
        measurements: Vec::new(),
    };
    let total = scenes.len() * grid.sizes.len() * grid.cells.len();
    let progress = Progress::new(&grid.name, total as u64);
    let mut number = 0;
    for (path, scene) in &scenes {
        for &size in &grid.sizes {
            // Images are held against the truth of the first frame.
            let still = scene.posed(0);
            let mut runner = Runner { native, grid, options, scene: &still, moving: scene, path, size, prepared: None };
            for cell in &grid.cells {
                let place = CellPlace { number, file: cells_folder.join(format!("{number:04}.json")) };
                number += 1;
                let key = runner.key(cell);
                let finished = place.finished(&key);
                let is_fresh = finished.is_none();
                if is_fresh && place.number % options.shard.1 != options.shard.0 {
                    continue;
                }
                let row = match finished {
                    Some(row) => row,
                    None => {
                        let row = runner.measure(cell, place.number)?;
                        place.keep(&key, &row)?;
                        progress.set(number as u64, &describe(cell));
                        row
                    }
                };
                let warning = noisy_truth(&row, grid.truth_rel_error);
                report.warnings.extend(warning.filter(|warning| !report.warnings.contains(warning)));
                report.measurements.push(row);
                if is_fresh {
                    // A run that ends here, for whatever reason, leaves a report of what it finished.
                    report.write(options.out)?;
                }
            }
        }
    }
    report.write(options.out)?;
    progress.finish(&format!(
        "{}: {} of {total} cells in {}",
        grid.name,
        report.measurements.len(),
        options.out.join("index.html").display()
    ));
    Ok(())
}

/// What to say where the truth stopped at its number of samples, before it was as precise as asked.
fn noisy_truth(row: &Measurement, asked: f32) -> Option<String> {
    let Measurement { scene, width, height, .. } = row;
    let reached = row.errors.truth_rel_error.filter(|&reached| reached > f64::from(asked) * 1.05)?;
    Some(format!(
        "truth of {scene} at {width}x{height} reached a relative error of {reached:.3} over 8x8 blocks, not the {asked} asked \
         for: raise truth_samples"
    ))
}

/// A cell's settings that differ from the defaults, in words.
fn describe(cell: &Cell) -> String {
    let defaults = (cell.technique.complete)(&Settings::new()).unwrap_or_default();
    let changed = cell.settings.iter().filter(|(key, value)| defaults.get(*key) != Some(value));
    let changed: Vec<String> =
        changed.map(|(key, value)| format!("{}={value}", key.rsplit('.').next().unwrap_or(key))).collect();
    format!("{} {}", cell.technique.name, changed.join(" "))
}

struct CellPlace {
    number: usize,
    file: PathBuf,
}

impl CellPlace {
    /// The row of an earlier run, if it was the same cell.
    fn finished(&self, key: &str) -> Option<Measurement> {
        let text = fs::read_to_string(&self.file).ok()?;
        let mut stored: Map<String, Value> = serde_json::from_str(&text).ok()?;
        (stored.get("key")?.as_str()? == key).then_some(())?;
        serde_json::from_value(stored.remove("row")?).ok()
    }

    fn keep(&self, key: &str, row: &Measurement) -> Result<(), Error> {
        let stored = serde_json::json!({ "key": key, "row": row });
        let text = serde_json::to_string_pretty(&stored).map_err(|e| Error::Failed(e.to_string()))?;
        write_whole(&self.file, |file| std::io::Write::write_all(file, text.as_bytes()))
            .map_err(|e: std::io::Error| Error::unwritable(&self.file, e))
    }
}

/// Everything of one scene at one size that its cells share.
struct Prepared<'a> {
    session: Session<'a>,
    truth: Truth,
    truth_rel_error: f64,
    truth_final: Vec<Rgb>,
    truth_indirect: Vec<Rgb>,
    mask: Vec<bool>,
    /// Of the final image, and of indirect light, which is dimmer.
    exposure: f32,
    indirect_exposure: f32,
    /// Pictures of the truth, for every row.
    pictures: Map<String, Value>,
    /// Header of every image file: what does not depend on the cell.
    header: BTreeMap<String, String>,
    /// Openness within a radius, by the radius.
    occlusion: Vec<OcclusionTruth>,
    /// What the scene's own passes left, and their median time in milliseconds, by the direct-light
    /// settings and the technique's needs that shape them.
    scene_frames: BTreeMap<String, (Frames<'a>, f64)>,
}

struct Runner<'a> {
    native: &'a NativeGpu,
    grid: &'a Grid,
    options: &'a RunOptions<'a>,
    /// The scene as it is in its first frame.
    scene: &'a Scene,
    /// The scene as it moves.
    moving: &'a Scene,
    path: &'a Path,
    size: [u32; 2],
    prepared: Option<Prepared<'a>>,
}

impl<'a> Runner<'a> {
    /// What a finished cell must agree on to count as this one.
    fn key(&self, cell: &Cell) -> String {
        let Grid { frames, seed, direct_from_truth, truth_samples, truth_rel_error, preset, temporal, .. } = self.grid;
        let [w, h] = self.size;
        let glossy = if self.wants_gloss() { ",glossy" } else { "" };
        let bounces = if self.grid.bounces > 1 { format!(",{} bounces", self.grid.bounces) } else { String::new() };
        format!(
            "{} {w}x{h} {} {} frames={frames} seed={seed} direct={direct_from_truth} truth={truth_samples},{truth_rel_error}{glossy}{bounces} \
             temporal={temporal} preset={preset} adapter={} commit={COMMIT}",
            self.path.display(),
            cell.technique.name,
            settings_text(&cell.settings),
            self.native.info.name
        )
    }

    /// Whether anything is held against the truth's light: not where all cells find openness alone.
    fn wants_light(&self) -> bool {
        let facts = SceneFacts::of(self.scene);
        let only_openness = |cell: &Cell| {
            plan_technique_of_scene(&facts, cell.technique, &cell.settings, self.size).is_ok_and(|plan| {
                plan.attributes.contains_key("ambient_occlusion.radius") && !plan.outputs.contains_key("indirect")
            })
        };
        self.grid.direct_from_truth || !self.grid.cells.iter().all(only_openness)
    }

    /// Whether the truth shows glossy light: where any cell does, so that all cells are held against one image.
    fn wants_gloss(&self) -> bool {
        let glossy = SceneNeeds::of(self.scene).glossy;
        glossy
            && self
                .grid
                .cells
                .iter()
                .any(|cell| (cell.technique.needs)(&cell.settings).is_ok_and(|needs| needs.glossy_material))
    }

    fn prepare(&mut self) -> Result<&mut Prepared<'a>, Error> {
        if self.prepared.is_none() {
            let mut request = TruthRequest::new(self.scene.camera, self.size);
            let light = self.wants_light();
            (request.bounce1, request.bounces) = (light, if light { self.grid.bounces } else { 0 });
            request.seed = self.grid.seed;
            request.glossy = self.wants_gloss();
            let stop = Stop {
                samples_per_pixel: if light { self.grid.truth_samples } else { 1 },
                rel_error: light.then_some(self.grid.truth_rel_error),
                error_block: 8,
            };
            let traced = truth::trace(self.native, self.scene, &request, stop)?;
            let truth = traced.truth;
            let truth_final = truth::final_radiance(&truth);
            let zero = vec![[0.0; 3]; truth_final.len()];
            let bounce = truth.indirect.as_ref().map_or(&zero, |estimate| &estimate.mean);
            let truth_indirect = modulate(&truth.albedo, bounce);
            let mask: Vec<bool> = truth.depth.iter().map(|&d| d > 0.0).collect();
            let [exposure, indirect_exposure] =
                [&truth_final, &truth_indirect].map(|image| auto_exposure(image, Some(&mask)));
            let header = [
                ("scene", self.scene.name.clone()),
                ("inputs", traced.inputs.to_string()),
                ("camera", format!("{:?}", self.scene.camera)),
                ("seed", self.grid.seed.to_string()),
                ("adapter", self.native.info.name.clone()),
                ("commit", COMMIT.to_owned()),
            ];
            let header = BTreeMap::from(header.map(|(key, value)| (key.to_owned(), value)));
            let pictures = Pictures { folder: self.options.out, width: self.size[0], mask: Some(&mask) };
            let name = |kind: &str| format!("{}_{}x{}_truth{kind}", self.scene.name, self.size[0], self.size[1]);
            let mut file = Image { metadata: header.clone(), ..truth::image(&truth) };
            // The rest follows from these, or needs more range than float16 has.
            file.channels.retain(|channel, _| ["", "Z", "albedo", "direct", "indirect"].contains(&layer(channel)));
            let pictures = Map::from_iter([
                ("truth_final".to_owned(), pictures.radiance(&name("_final"), &truth_final, exposure)?),
                (
                    "truth_indirect".to_owned(),
                    pictures.radiance(&name("_indirect"), &truth_indirect, indirect_exposure)?,
                ),
                ("truth_exr".to_owned(), pictures.exr(&name(""), &file)?),
            ]);
            self.prepared = Some(Prepared {
                pictures,
                header,
                session: Session::new(self.native, self.scene),
                truth,
                truth_rel_error: traced.rel_error,
                truth_final,
                truth_indirect,
                mask,
                exposure,
                indirect_exposure,
                occlusion: Vec::new(),
                scene_frames: BTreeMap::new(),
            });
        }
        self.prepared.as_mut().ok_or_else(|| Error::Failed("the scene could not be prepared: run again".into()))
    }

    fn measure(&mut self, cell: &Cell, number: usize) -> Result<Measurement, Error> {
        let (grid, size, options, native) = (self.grid, self.size, self.options, self.native);
        let (scene, moving, path) = (self.scene, self.moving, self.path);
        let prepared = self.prepare()?;
        let session = &prepared.session;
        let needs = (cell.technique.needs)(&cell.settings).map_err(|e| Error::BadInput(e.to_string()))?;
        let direct = cell.settings.iter().filter(|(key, _)| key.starts_with("direct."));
        let shape: String =
            [format!("{needs:?}")].into_iter().chain(direct.map(|(key, value)| format!(" {key}={value}"))).collect();
        let (scene_frames, scene_ms) = match prepared.scene_frames.entry(shape) {
            Entry::Occupied(ready) => ready.into_mut(),
            Entry::Vacant(place) => {
                let mut frames = session.scene_frames(&cell.settings, size)?;
                let time = time_frames(&mut frames, SCENE_FRAMES, |_, _| Ok(()))?.total.median;
                place.insert((frames, time))
            }
        };
        let direct = grid.direct_from_truth.then_some(prepared.truth.direct.as_slice());
        let request =
            Request { technique: cell.technique, settings: cell.settings.clone(), size, seed: grid.seed, direct };
        let mut frames = session.technique_frames(&request, scene_frames)?;
        let occlusion_radius = frames.plan().attributes.get("ambient_occlusion.radius").copied();
        let mut noise = Noise::default();
        let mut first: Option<Shown> = None;
        // A filter over frames shows what it can do in the last one.
        let wanted = if frames.plan().has_history() { grid.frames - 1 } else { 0 };
        let times = time_frames(&mut frames, grid.frames, |frames, frame| {
            let shown = Shown::read(frames)?;
            noise.add(shown.measured());
            if frame == wanted {
                first = Some(shown);
            }
            Ok(())
        })?;
        if options.check {
            check_textures(&[scene_frames, &frames])?;
        }
        let shown = first.ok_or_else(|| Error::Failed("no frame was rendered: set frames to at least 1".into()))?;
        // What only finds openness is held against the truth's; its image stands where others show light.
        let open_truth = match (&shown.open, occlusion_radius) {
            (Some(_), Some(radius)) => {
                Some(occlusion_truth(native, scene, grid, size, radius, &mut prepared.occlusion)?)
            }
            _ => None,
        };
        let Prepared { truth_final, truth_indirect, mask, exposure, indirect_exposure, .. } = prepared;
        let pictures = Pictures { folder: options.out, width: size[0], mask: Some(mask) };
        let name = |kind: &str| format!("{}_{}x{}_{number:04}{kind}", scene.name, size[0], size[1]);
        let mut file = Image { metadata: prepared.header.clone(), ..Image::new(size[0], size[1]) };
        file.metadata.insert("technique".into(), cell.technique.name.into());
        file.metadata.insert("settings".into(), settings_text(&cell.settings));
        let (mut errors, images) = if let (Some(open), Some(truth), false) = (&shown.open, &open_truth, shown.lit) {
            let reference: Vec<Rgb> = truth.mean.iter().map(|&v| [v; 3]).collect();
            file.set_channel("ambient_occlusion.Y", open.iter().map(|v| v[0]).collect());
            let truth_name = format!("{}_{}x{}_truth_ao_{:e}", scene.name, size[0], size[1], truth.radius);
            let images = [
                ("final", pictures.radiance(&name("_final"), open, 1.0)?),
                ("error", pictures.error(&name("_error"), open, &reference)?),
                ("exr", pictures.exr(&name(""), &file)?),
                ("truth_final", pictures.radiance(&truth_name, &reference, 1.0)?),
            ];
            let mut errors = Errors::of_occlusion(&linear_errors(open, &reference, Some(mask)));
            errors.truth_rel_error = Some(truth.rel_error);
            (errors, images.map(|(kind, picture)| (kind.to_owned(), picture)).into_iter().collect::<Map<_, _>>())
        } else {
            let display = [&shown.image, truth_final].map(|image| tone_map_all(image, *exposure));
            let pair = DisplayPair {
                width: size[0],
                linear: [&shown.image, truth_final],
                display: [&display[0], &display[1]],
                mask: Some(mask),
            };
            file.set_rgb("", &shown.image);
            file.set_rgb("indirect", &shown.incident);
            if let Some(open) = &shown.open {
                file.set_channel("ambient_occlusion.Y", open.iter().map(|v| v[0]).collect());
            }
            let mut images = Map::from_iter([
                ("final".to_owned(), pictures.radiance(&name("_final"), &shown.image, *exposure)?),
                ("indirect".to_owned(), pictures.radiance(&name("_indirect"), &shown.indirect, *indirect_exposure)?),
                ("error".to_owned(), pictures.error(&name("_error"), &shown.indirect, truth_indirect)?),
                ("exr".to_owned(), pictures.exr(&name(""), &file)?),
            ]);
            images.extend(prepared.pictures.clone());
            let linear = linear_errors(&shown.indirect, truth_indirect, Some(mask));
            let mut errors = Errors::new(&linear, &display_errors(&pair));
            errors.truth_rel_error = Some(prepared.truth_rel_error);
            if let (Some(open), Some(truth)) = (&shown.open, &open_truth) {
                let reference: Vec<Rgb> = truth.mean.iter().map(|&v| [v; 3]).collect();
                errors = errors.and_occlusion(&linear_errors(open, &reference, Some(mask)));
            }
            (errors, images)
        };
        errors.noise_std = noise.deviation();
        let mut row = Measurement {
            scene: scene.name.clone(),
            camera: "default".into(),
            width: size[0],
            height: size[1],
            technique: cell.technique.name.into(),
            parameters: parameters_of(cell.technique)
                .iter()
                .filter_map(|parameter| Some((parameter.key(), json(cell.settings.get(&parameter.key())?))))
                .collect(),
            frame_ms_median: *scene_ms + times.technique.map_or(0.0, |timing| timing.median),
            pass_ms: times.passes.into_iter().map(|(name, ms)| (name, ms.into())).collect(),
            memory_bytes: frames.plan().technique_bytes(),
            errors,
            adapter: native.info.name.clone(),
            driver: format!("{} {}", native.info.driver, native.info.driver_info).trim().to_owned(),
            backend: format!("{:?}", native.info.backend),
            software_adapter: native.is_software(),
            commit: COMMIT.into(),
            preset: grid.preset.clone(),
            seed: grid.seed.into(),
            command: reproduce(path, cell, size, grid.seed, wanted),
            images,
            ..Measurement::default()
        };
        row.frames = grid.frames;
        if let Some(technique) = &times.technique {
            row.set_time(technique);
        }
        if grid.temporal {
            row.temporal = temporal::measure(native, moving, cell.technique, &cell.settings, size, grid.seed)?;
        }
        Ok(row)
    }
}

/// Fails where a texture or buffer of a plan holds NaN or infinity. The device looks through them.
///
/// # Errors
/// The texture or buffer and the number of bad values.
pub fn check_textures(all: &[&Frames]) -> Result<(), Error> {
    for frames in all {
        for found in frames.scan()? {
            if found.not_finite() > 0 {
                let Scanned { name, values, nan, infinite, .. } = found;
                return Err(Error::Failed(format!(
                    "{name} holds {nan} NaN and {infinite} infinities among {values} values"
                )));
            }
        }
    }
    Ok(())
}

fn settings_text(settings: &Settings) -> String {
    settings.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
}

/// `albedo.R` -> `albedo`; the final image's channels and `Z` stand alone.
fn layer(channel: &str) -> &str {
    match channel.split_once('.') {
        Some((layer, _)) => layer,
        None if channel == "Z" => channel,
        None => "",
    }
}

fn json(value: &halflight_renderer::parameters::Value) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

fn reproduce(path: &Path, cell: &Cell, [w, h]: [u32; 2], seed: u32, frame: u32) -> String {
    let sets: Vec<String> = cell.settings.iter().map(|(key, value)| format!("--set {key}={value}")).collect();
    let frame = if frame > 0 { format!(" --frame {frame}") } else { String::new() };
    format!(
        "evaluator render --scene {} --technique {} {} --size {w}x{h} --seed {seed}{frame} --out frame.exr",
        path.display(),
        cell.technique.name,
        sets.join(" ")
    )
}
