//! Measures the cells of a grid on one scene at one size.

mod cell_frames;

use std::{cell::OnceCell, collections::BTreeMap, path::Path};

use halflight_frame_graph::FramePlan;
use halflight_metrics::{DisplayPair, LinearPair, MetricId, Values};
use halflight_native::{
    NativeGpu,
    cache::{Key, KeyInputs},
    images::{Image, Rgb, auto_exposure, tone_map_all},
    scene_hash::scene_hash,
};
use halflight_output::OutputFolder;
use halflight_renderer::{
    plan_technique_of_scene,
    scene::SceneFacts,
    truth::{Request as TruthRequest, Stop, Truth},
};
use halflight_scenes::{Scene, SceneNeeds};
use halflight_shared_shaders::SHADERS;
use halflight_techniques::{invocation::Invocation, parameters_of};
use serde_json::{Map, Value};

use self::cell_frames::{occlusion_radius, render};
use super::{
    COMMIT,
    cell_id::CellId,
    frames::{OcclusionReference, Shown, Times, modulate, occlusion_reference},
    grid::{Cell, Grid},
    machine,
    moving::Moving,
    reference,
    session::{Frames, Session},
    temporal,
};
use crate::{Error, format, measurement::Measurement, report::Pictures};

/// Frames of the scene's own passes. They are the same for all cells, so they are timed once.
const SCENE_FRAMES: u32 = 5;

/// What is measured: a scene at a size.
pub(super) struct Subject<'a> {
    /// The scene file.
    pub(super) path: &'a Path,
    /// Name of the scene in file names.
    pub(super) label: String,
    /// The scene as it is in its first frame.
    pub(super) still: &'a Scene,
    /// The scene as it moves.
    pub(super) moving: &'a Scene,
    /// Width and height, pixels.
    pub(super) size: [u32; 2],
}

/// How cells are measured.
#[derive(Clone, Copy)]
pub(super) struct RunnerOptions<'a> {
    /// Check every texture of each cell for NaN and infinity.
    pub(super) check: bool,
    /// The adapter as the command line names it, for the commands of rows; `None` for any.
    pub(super) adapter: Option<&'a str>,
}

/// Measures cells on one subject. The reference is traced when the first cell is measured.
pub(super) struct SceneRunner<'a> {
    native: &'a NativeGpu,
    grid: &'a Grid,
    options: RunnerOptions<'a>,
    folder: &'a OutputFolder,
    subject: Subject<'a>,
    /// Hash of the content of the scene.
    scene_hash: Key,
    /// Facts about the subject, for plans before anything is uploaded.
    facts: OnceCell<SceneFacts>,
    /// See [`SceneRunner::wants_light`] and [`SceneRunner::wants_gloss`].
    light: OnceCell<bool>,
    gloss: OnceCell<bool>,
    prepared: Option<Prepared<'a>>,
}

/// What all cells of a subject share.
struct Prepared<'a> {
    session: Session<'a>,
    reference: Truth,
    rel_error: Option<f64>,
    final_image: Vec<Rgb>,
    /// `albedo * indirect`.
    indirect: Vec<Rgb>,
    mask: Vec<bool>,
    /// Exposures of the final image and of indirect light, which is dimmer.
    exposure: f32,
    indirect_exposure: f32,
    /// Pictures of the reference, for every row.
    pictures: Map<String, Value>,
    /// Header of every image file: what does not depend on the cell.
    header: BTreeMap<String, String>,
    /// Ambient visibility, by radius.
    occlusion: Vec<OcclusionReference>,
    /// The G-buffer and direct light, and their times, by the settings of every frame and the technique's needs that
    /// shape them.
    scene_frames: BTreeMap<String, (Frames<'a>, Times)>,
}

impl<'a> SceneRunner<'a> {
    pub(super) fn new(
        native: &'a NativeGpu,
        grid: &'a Grid,
        options: RunnerOptions<'a>,
        folder: &'a OutputFolder,
        subject: Subject<'a>,
    ) -> Self {
        let scene_hash = scene_hash(subject.moving);
        let (facts, light, gloss) = (OnceCell::new(), OnceCell::new(), OnceCell::new());
        Self { native, grid, options, folder, subject, scene_hash, facts, light, gloss, prepared: None }
    }

    /// The name of a cell of this subject.
    pub(super) fn id(&self, cell: &Cell) -> CellId {
        CellId::new(self.scene_hash.as_str(), self.subject.size, cell)
    }

    /// Hash of the content of the scene.
    pub(super) fn scene_hash(&self) -> &str {
        self.scene_hash.as_str()
    }

    /// Hash of everything that a row depends on beside its cell and its adapter. The scene is in it by content, because
    /// its files may change under the same path.
    pub(super) fn context(&self) -> String {
        // Destructured, so that a new field of the grid cannot be left out. The others are in the names of cells.
        let Grid {
            frames,
            seed,
            direct_from_truth,
            truth_samples,
            truth_rel_error,
            bounces,
            preset,
            temporal,
            name: _,
            scenes: _,
            sizes: _,
            sweeps: _,
            only: _,
        } = self.grid;
        let mut inputs = KeyInputs::default();
        inputs.add_text(self.scene_hash.as_str()).add(&self.subject.size);
        inputs.add_text(&format!(
            "frames={frames} seed={seed} direct={direct_from_truth} truth={truth_samples},{truth_rel_error} \
             bounces={bounces} light={} glossy={} temporal={temporal} preset={preset} shaders={} commit={COMMIT}",
            self.wants_light(),
            self.wants_gloss(),
            shaders_hash()
        ));
        inputs.key().to_string()
    }

    /// Whether a row was measured on this adapter with this driver.
    pub(super) fn is_of_adapter(&self, row: &Measurement) -> bool {
        row.adapter == self.native.info.name && row.driver == self.driver() && row.backend == self.backend()
    }

    fn driver(&self) -> String {
        let info = &self.native.info;
        format!("{} {}", info.driver, info.driver_info).trim().to_owned()
    }

    fn backend(&self) -> String {
        format!("{:?}", self.native.info.backend)
    }

    /// The command of a finished row, for the path that the scene has now.
    pub(super) fn command_again(&self, cell: &Cell, command: &str) -> String {
        let frame = command.parse().ok().and_then(|known: Invocation| known.value("frame")?.parse().ok());
        self.row_command(cell, frame.unwrap_or(0)).to_string()
    }

    fn reference_command(&self, occlusion_radius: Option<f32>) -> Invocation {
        let Subject { path, size, .. } = self.subject;
        let out = if occlusion_radius.is_some() { "truth_ao.exr" } else { "truth.exr" };
        Invocation::evaluator("truth")
            .option("scene", path.display())
            .size(size)
            .option("bounces", if occlusion_radius.is_some() { 0 } else { self.grid.bounces })
            .option("samples-per-pixel", self.grid.truth_samples)
            .option("rel-error", self.grid.truth_rel_error)
            .option_unless("seed", self.grid.seed, 0)
            .flag("glossy", occlusion_radius.is_none() && self.wants_gloss())
            .option_if("ambient-occlusion", occlusion_radius)
            .option_if("adapter", self.options.adapter)
            .option("out", out)
    }

    /// The command that renders the image of a cell's row.
    fn row_command(&self, cell: &Cell, frame: u32) -> Invocation {
        let Subject { path, moving, size, .. } = self.subject;
        Invocation::render(path.display(), cell.technique.name, &cell.settings, size)
            .option("seed", self.grid.seed)
            .option_unless("frame", frame, 0)
            .option_unless("moving", cell.moving.to_string(), Moving::Nothing.to_string())
            // The frames of a row show the first pose.
            .option_if("pose", (!moving.moves.is_empty()).then_some(0))
            .option_if("direct", self.grid.direct_from_truth.then_some("truth"))
            .option_if("adapter", self.options.adapter)
            .option("out", "frame.exr")
    }

    /// The plan of a cell; `None` where it cannot be planned, which measuring reports.
    fn planned(&self, cell: &Cell) -> Option<FramePlan> {
        let facts = self.facts.get_or_init(|| SceneFacts::of(self.subject.still));
        plan_technique_of_scene(facts, cell.technique, &cell.settings, self.subject.size).ok()
    }

    /// Whether anything is measured against the reference's light: not where all cells find ambient visibility alone.
    fn wants_light(&self) -> bool {
        let only_occlusion = |cell: Cell| {
            self.planned(&cell)
                .is_some_and(|plan| occlusion_radius(&plan).is_some() && !plan.outputs.contains_key("indirect"))
        };
        *self.light.get_or_init(|| self.grid.direct_from_truth || !self.grid.cells().all(only_occlusion))
    }

    /// Whether the reference has glossy light: where any cell does, so that all cells are measured against one image.
    fn wants_gloss(&self) -> bool {
        let is_glossy = |cell: Cell| (cell.technique.needs)(&cell.settings).is_ok_and(|needs| needs.glossy_material);
        *self.gloss.get_or_init(|| SceneNeeds::of(self.subject.still).glossy && self.grid.cells().any(is_glossy))
    }

    fn prepare(&mut self) -> Result<(), Error> {
        if self.prepared.is_some() {
            return Ok(());
        }
        let (grid, size, still) = (self.grid, self.subject.size, self.subject.still);
        let light = self.wants_light();
        let request = TruthRequest {
            bounce1: light,
            bounces: if light { grid.bounces } else { 0 },
            seed: grid.seed,
            glossy: self.wants_gloss(),
            ..TruthRequest::new(still.camera, size)
        };
        let stop = Stop {
            samples_per_pixel: if light { grid.truth_samples } else { 1 },
            rel_error: light.then_some(grid.truth_rel_error),
            error_block: 8,
        };
        let traced = reference::trace(self.native, still, &request, stop)?;
        let reference = traced.truth;
        let final_image = reference::final_radiance(&reference);
        let zero = vec![[0.0; 3]; final_image.len()];
        let bounce = reference.indirect.as_ref().map_or(&zero, |estimate| &estimate.mean);
        let indirect = modulate(&reference.albedo, bounce);
        let mask: Vec<bool> = reference.depth.iter().map(|&d| d > 0.0).collect();
        let [exposure, indirect_exposure] = [&final_image, &indirect].map(|image| auto_exposure(image, Some(&mask)));
        let header = [
            ("scene", still.name.clone()),
            ("scene_hash", self.scene_hash.to_string()),
            ("inputs", traced.inputs.to_string()),
            ("camera", format!("{:?}", still.camera)),
            ("seed", grid.seed.to_string()),
            ("adapter", self.native.info.name.clone()),
            ("commit", COMMIT.to_owned()),
        ];
        let header = BTreeMap::from(header.map(|(key, value)| (key.to_owned(), value)));
        let pictures = Pictures { folder: self.folder, width: size[0], mask: Some(&mask) };
        let name = self.picture_name("truth_", &format!("{} {}", traced.inputs, reference.samples));
        let name = |kind: &str| format!("{name}{kind}");
        let mut file = Image { metadata: header.clone(), ..reference::image(&reference) };
        file.metadata.insert("command".into(), self.reference_command(None).to_string());
        // The rest follows from these, or needs more range than float16 has.
        file.channels.retain(|channel, _| ["", "Z", "albedo", "direct", "indirect"].contains(&layer(channel)));
        let pictures = Map::from_iter([
            ("truth_final".to_owned(), pictures.radiance(&name("_final"), &final_image, exposure)?),
            ("truth_indirect".to_owned(), pictures.radiance(&name("_indirect"), &indirect, indirect_exposure)?),
            ("truth_exr".to_owned(), pictures.exr(&name(""), &file)?),
        ]);
        let session = Session::new(self.native, still);
        self.prepared = Some(Prepared {
            pictures,
            header,
            session: if self.options.check { session.keep_all() } else { session },
            reference,
            rel_error: traced.rel_error,
            final_image,
            indirect,
            mask,
            exposure,
            indirect_exposure,
            occlusion: Vec::new(),
            scene_frames: BTreeMap::new(),
        });
        Ok(())
    }

    /// Name of pictures, which ends with a hash of what they depend on and of the adapter: pictures of one name are the
    /// same in all folders, so that folders can be merged.
    fn picture_name(&self, kind: &str, depends_on: &str) -> String {
        let Subject { label, size: [width, height], .. } = &self.subject;
        let mut inputs = KeyInputs::default();
        inputs.add_text(depends_on).add_text(&self.native.info.name).add_text(&self.driver()).add_text(&self.backend());
        let hash: String = inputs.key().as_str().chars().take(16).collect();
        format!("{label}_{width}x{height}_{kind}{hash}")
    }

    /// Times a cell, measures its image and writes its pictures. Returns its row and the commands that trace what it is
    /// measured against.
    pub(super) fn measure(&mut self, cell: &Cell, id: &CellId) -> Result<(Measurement, Vec<String>), Error> {
        self.prepare()?;
        let (grid, native) = (self.grid, self.native);
        let Subject { still, moving, size, .. } = self.subject;
        // Taken out while a cell is measured, so that the rest of the runner can be read.
        let mut prepared =
            self.prepared.take().ok_or_else(|| Error::Failed("the scene could not be prepared: run again".into()))?;
        let rendered = render(native, grid, cell, &self.subject, &mut prepared, self.options.check)?;
        let command = self.row_command(cell, rendered.shown_frame).to_string();
        let at_frame = rendered.shown_frame + 1;
        let mut header = prepared.header.clone();
        header.extend([
            ("technique".to_owned(), cell.technique.name.to_owned()),
            ("settings".to_owned(), format::settings(&cell.settings)),
            ("command".to_owned(), command.clone()),
        ]);
        let file = Image { metadata: header, ..Image::new(size[0], size[1]) };
        let name = self.picture_name("", id.as_str());
        let occlusion = match (&rendered.shown.open, rendered.occlusion_radius) {
            (Some(_), Some(radius)) => {
                Some(occlusion_reference(native, still, grid, size, radius, &mut prepared.occlusion)?)
            }
            _ => None,
        };
        let pictures = Pictures { folder: self.folder, width: size[0], mask: Some(&prepared.mask) };
        // A technique that only finds ambient visibility shows it where others show light.
        let (mut errors, images) = match (&rendered.shown.open, &occlusion, rendered.shown.lit) {
            (Some(open), Some(occlusion), false) => {
                let label = self.picture_name("truth_ao_", &occlusion.inputs);
                occlusion_alone(open, occlusion, &prepared.mask, &pictures, [&name, &label], file)?
            }
            _ => light(&rendered.shown, occlusion.as_ref(), &prepared, &pictures, &name, file)?,
        };
        let against_light = (rendered.shown.lit || occlusion.is_none()) && self.wants_light();
        let references = against_light.then(|| self.reference_command(None));
        let references =
            references.into_iter().chain(occlusion.map(|known| self.reference_command(Some(known.radius))));
        let references = references.map(|command| command.to_string()).collect();
        errors.set(MetricId::NoiseStd, rendered.noise);
        let mut row = Measurement {
            scene: still.name.clone(),
            camera: "default".into(),
            width: size[0],
            height: size[1],
            technique: cell.technique.name.into(),
            parameters: parameters_of(cell.technique)
                .iter()
                .filter_map(|parameter| Some((parameter.key(), json(cell.settings.get(&parameter.key())?))))
                .collect(),
            left_out: (cell.technique.sources)(&cell.settings)
                .map(|sources| sources.left_out(&SceneNeeds::of(still)).join(", "))
                .unwrap_or_default(),
            section: cell.section.clone(),
            moving: if cell.moving == Moving::Nothing { String::new() } else { cell.moving.to_string() },
            at_frame: (rendered.has_history || cell.at_frame.is_some()).then_some(at_frame),
            time_ms_static: rendered.times.technique_static,
            first_frame_ms: rendered.times.first_frame,
            frame_ms_median: rendered.scene_ms[0] + rendered.times.technique.map_or(0.0, |timing| timing.median),
            frame_ms_static: Some(rendered.scene_ms[1] + rendered.times.technique_static.unwrap_or_default()),
            pass_ms: rendered.passes.into_iter().map(|(name, ms)| (name, ms.into())).collect(),
            memory_bytes: rendered.memory_bytes,
            frame_bytes: rendered.frame_bytes,
            scene_bytes: prepared.session.scene_bytes(),
            errors,
            adapter: native.info.name.clone(),
            driver: self.driver(),
            backend: self.backend(),
            software_adapter: native.is_software(),
            machine: machine::name(),
            processor: machine::processor(),
            commit: COMMIT.into(),
            preset: grid.preset.clone(),
            seed: grid.seed.into(),
            command,
            images,
            ..Measurement::default()
        };
        row.frames = grid.frames;
        if let Some(technique) = &rendered.times.technique {
            row.set_time(technique);
        }
        if grid.temporal {
            row.temporal = temporal::measure(native, moving, cell.technique, &cell.settings, size, grid.seed)?;
        }
        self.prepared = Some(prepared);
        Ok((row, references))
    }
}

/// Errors and pictures of a technique that finds ambient visibility and no light. `names` are those of the cell's and of
/// the reference's pictures.
fn occlusion_alone(
    open: &[Rgb],
    occlusion: &OcclusionReference,
    mask: &[bool],
    pictures: &Pictures,
    [name, reference_name]: [&str; 2],
    mut file: Image,
) -> Result<(Values, Map<String, Value>), Error> {
    let reference = occlusion.image();
    file.set_channel("ambient_occlusion.Y", open.iter().map(|v| v[0]).collect());
    let images = Map::from_iter([
        ("final".to_owned(), pictures.radiance(&format!("{name}_final"), open, 1.0)?),
        ("error".to_owned(), pictures.error(&format!("{name}_error"), open, &reference)?),
        ("exr".to_owned(), pictures.exr(name, &file)?),
        ("truth_final".to_owned(), pictures.radiance(reference_name, &reference, 1.0)?),
    ]);
    let mut errors = Values::default();
    errors.measure_occlusion(&LinearPair::new(open, &reference, Some(mask)));
    errors.set(MetricId::TruthRelError, occlusion.rel_error);
    Ok((errors, images))
}

/// Errors and pictures of a technique that finds light, and perhaps ambient visibility as well.
fn light(
    shown: &Shown,
    occlusion: Option<&OcclusionReference>,
    prepared: &Prepared,
    pictures: &Pictures,
    name: &str,
    mut file: Image,
) -> Result<(Values, Map<String, Value>), Error> {
    let Prepared { final_image, indirect, mask, exposure, indirect_exposure, rel_error, .. } = prepared;
    let display = [&shown.image, final_image].map(|image| tone_map_all(image, *exposure));
    file.set_rgb("", &shown.image);
    file.set_rgb("indirect", &shown.incident);
    if let Some(open) = &shown.open {
        file.set_channel("ambient_occlusion.Y", open.iter().map(|v| v[0]).collect());
    }
    let mut images = Map::from_iter([
        ("final".to_owned(), pictures.radiance(&format!("{name}_final"), &shown.image, *exposure)?),
        ("indirect".to_owned(), pictures.radiance(&format!("{name}_indirect"), &shown.indirect, *indirect_exposure)?),
        ("error".to_owned(), pictures.error(&format!("{name}_error"), &shown.indirect, indirect)?),
        ("exr".to_owned(), pictures.exr(name, &file)?),
    ]);
    images.extend(prepared.pictures.clone());
    let mut errors = Values::default();
    errors.measure_indirect(&LinearPair::new(&shown.indirect, indirect, Some(mask)), pictures.width);
    errors.measure_final(&DisplayPair {
        width: pictures.width,
        linear: [&shown.image, final_image],
        display: [&display[0], &display[1]],
        mask: Some(mask),
    });
    errors.set(MetricId::TruthRelError, *rel_error);
    if let (Some(open), Some(occlusion)) = (&shown.open, occlusion) {
        errors.measure_occlusion(&LinearPair::new(open, &occlusion.image(), Some(mask)));
    }
    Ok((errors, images))
}

/// Hash of all shaders. The commit does not tell shaders apart that were edited since.
pub(super) fn shaders_hash() -> Key {
    let mut inputs = KeyInputs::default();
    for shader in SHADERS {
        inputs.add_text(shader.name).add_text(shader.source);
    }
    inputs.key()
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
