//! Grid files: scenes, sizes and sweeps of parameters.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use halflight_renderer::{gi::Technique, parameters::Settings};
use halflight_scenes::{
    SceneError,
    keys::{Source, Table},
};
use halflight_techniques::invocation::parse_size;

use super::moving::Moving;
use crate::Error;

mod sweep;
mod text;

pub use sweep::{MOST_FRAMES, Sweep};

/// A grid file, read and checked.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Heading of its report: that of the file, or the file's name without its ending.
    pub name: String,
    /// Published table that the rows belong to; empty for none.
    pub preset: String,
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// Sizes, pixels.
    pub sizes: Vec<[u32; 2]>,
    /// Timed frames a cell, after warm-up.
    pub frames: u32,
    /// Seed of every random number.
    pub seed: u32,
    /// Whether techniques read path-traced direct light instead of the rendered one.
    pub direct_from_truth: bool,
    /// Most samples a pixel of the reference.
    pub truth_samples: u32,
    /// Relative error over blocks of 8x8 pixels at which the reference may stop before that.
    pub truth_rel_error: f32,
    /// Bounces of the reference's indirect light.
    pub bounces: u32,
    /// Whether to measure behaviour over time as well: hundreds of frames more for each cell.
    pub temporal: bool,
    /// Combinations of settings, in the order of the file.
    pub sweeps: Vec<Sweep>,
    /// The only cells to measure, by their [`CellId`](super::cell_id::CellId); `None` for all.
    pub only: Option<BTreeSet<String>>,
}

/// Most configurations of a grid, over all scenes and sizes. Each is looked at before anything is measured, and takes a
/// second or more to measure.
const MOST_CELLS: u64 = 2_000_000;

/// One configuration.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The technique.
    pub technique: &'static Technique,
    /// All its settings.
    pub settings: Settings,
    /// What moves in its frames.
    pub moving: Moving,
    /// The frame that is measured, counted from 1; `None` for the last of [`Grid::frames`], or without a history the first.
    pub at_frame: Option<u32>,
    /// Part of the report that shows it; empty for the first.
    pub section: String,
}

const KEYS: [&str; 13] = [
    "name",
    "preset",
    "scenes",
    "size",
    "frames",
    "seed",
    "direct",
    "truth_samples",
    "truth_rel_error",
    "bounces",
    "temporal",
    "only",
    "sweep",
];

impl Grid {
    /// Reads a grid file. Scenes are looked for from the working directory, then beside the file.
    ///
    /// # Errors
    /// One sentence with file, line, key and the fix.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::BadInput(format!("cannot read {}: {e}; check --grid", path.display())))?;
        Self::parse(path, &text).map_err(|e| Error::BadInput(e.to_string()))
    }

    /// Reads the text of a grid file; `path` appears in messages.
    ///
    /// # Errors
    /// As [`Grid::read`], without the file being read.
    pub fn parse(path: &Path, text: &str) -> Result<Self, SceneError> {
        let source = Source { path, text };
        let document = source.parse()?;
        let file = Table::file(source, &document, &KEYS)?;
        let scenes = file.required("scenes", file.texts("scenes")?, "scenes = [\"scenes/atrium.toml\"]")?;
        let sizes = file.required("size", file.texts("size")?, "size = [\"1280x720\"]")?;
        let direct = file.text("direct")?.unwrap_or("rendered");
        if !["rendered", "truth"].contains(&direct) {
            return Err(file.error("direct", format_args!("is \"{direct}\"; choose \"rendered\" or \"truth\"")));
        }
        let tables = file.tables("sweep", &["technique", "section", "moving", "at_frames", "fixed", "grid"])?;
        let sweeps = tables.iter().map(Sweep::read).collect::<Result<Vec<_>, _>>()?;
        // Never expanded: a product grows fast.
        let count = sweeps.iter().fold(0u64, |sum, sweep| sum.saturating_add(sweep.len()));
        let count = count.saturating_mul(scenes.len() as u64).saturating_mul(sizes.len() as u64);
        if count > MOST_CELLS {
            return Err(file.error(
                "sweep",
                format_args!(
                    "gives {count} configurations over all scenes and sizes, of a second or more each; at most \
                     {MOST_CELLS} are run: list fewer values, or split the sweep into several files"
                ),
            ));
        }
        if sweeps.is_empty() {
            return Err(
                file.error("sweep", "is missing; write for example `[[sweep]]` and `technique = \"hierarchical\"`")
            );
        }
        let only = file.texts("only")?;
        Ok(Self {
            name: match file.text("name")? {
                Some(name) => name.to_owned(),
                None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            },
            preset: file.text("preset")?.unwrap_or_default().to_owned(),
            scenes: scenes.into_iter().map(|scene| find(path, scene)).collect(),
            sizes: sizes
                .into_iter()
                .map(|size| parse_size(size).map_err(|e| file.error("size", format_args!("holds \"{size}\": {e}"))))
                .collect::<Result<_, _>>()?,
            frames: file.integer("frames", 1..=10_000)?.unwrap_or(10),
            seed: file.integer("seed", 0..=u32::MAX)?.unwrap_or(0),
            direct_from_truth: direct == "truth",
            truth_samples: file.integer("truth_samples", 1..=1 << 20)?.unwrap_or(256),
            truth_rel_error: file.number("truth_rel_error", 0.0001..=1.0)?.unwrap_or(0.01),
            bounces: file.integer("bounces", 1..=64)?.unwrap_or(1),
            temporal: file.boolean("temporal")?.unwrap_or(false),
            sweeps,
            only: only.map(|only| only.into_iter().map(str::to_owned).collect()),
        })
    }

    /// Configurations of one scene at one size, in the order of the file. Each is made when it is asked for.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + '_ {
        self.sweeps.iter().flat_map(|sweep| (0..sweep.len()).map(|index| sweep.cell(index)))
    }

    /// Number of configurations of one scene at one size.
    pub fn len(&self) -> u64 {
        self.sweeps.iter().map(Sweep::len).sum()
    }

    /// Whether it has no configuration. A grid file has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn find(grid: &Path, scene: &str) -> PathBuf {
    let beside = grid.parent().unwrap_or(Path::new("")).join(scene);
    if !Path::new(scene).exists() && beside.exists() { beside } else { scene.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Grid, SceneError> {
        Grid::parse(Path::new("g.toml"), text)
    }

    #[test]
    fn a_sweep_expands_to_all_combinations() {
        let grid = parse(
            "scenes = ['a.toml']\nsize = ['64x36']\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { radius = 20 }\n\
             grid = { start_resolution = ['half', 'quarter'], samples = [16, 64, 256] }",
        )
        .expect("a good grid");
        let cells: Vec<Cell> = grid.cells().collect();
        assert_eq!((cells.len(), grid.len()), (6, 6));
        let keys = ["hierarchical.radius", "hierarchical.start_resolution", "hierarchical.samples"];
        let of = |i: usize| keys.map(|key| cells[i].settings[key].to_string()).join(" ");
        assert_eq!(of(0), "20 half 16");
        assert_eq!(of(1), "20 half 64");
        assert_eq!(of(5), "20 quarter 256");
        // As every value that has a default, these two are complete, in the notation of their declaration.
        assert!(cells[0].settings.contains_key("hierarchical.levels"));
    }

    #[test]
    fn frames_and_motion_are_axes() {
        let grid = parse(
            "scenes = ['a.toml']\nsize = ['64x36']\n[[sweep]]\ntechnique = 'radiance-cache'\nat_frames = [1, 8, 32]\n\
             moving = ['nothing', 'camera']\ngrid = { spacing = [8, 12] }\n[[sweep]]\ntechnique = 'none'",
        )
        .expect("a good grid");
        let of = |cell: Cell| (cell.moving, cell.at_frame, cell.settings.get("radiance-cache.spacing").cloned());
        let cells: Vec<_> = grid.cells().map(of).collect();
        assert_eq!((cells.len(), grid.len()), (13, 13));
        let spacing = |value: f64| Some(halflight_renderer::parameters::Value::Float(value));
        assert_eq!(cells[0], (Moving::Nothing, Some(1), spacing(8.0)));
        assert_eq!(cells[2], (Moving::Nothing, Some(32), spacing(8.0)));
        assert_eq!(cells[3], (Moving::Camera, Some(1), spacing(8.0)));
        assert_eq!(cells[11], (Moving::Camera, Some(32), spacing(12.0)));
        assert_eq!(cells[12], (Moving::Nothing, None, None));
    }

    #[test]
    fn a_grid_that_nobody_could_run_is_counted_and_refused() {
        let list = |count: u32| (1..=count).map(|v| v.to_string()).collect::<Vec<_>>().join(",");
        let text = format!(
            "scenes = ['a', 'b']\nsize = ['1x1', '2x2']\n[[sweep]]\ntechnique = 'hierarchical'\n\
             grid = {{ samples = [{}], levels = [{}], samples_per_ray = [{}] }}",
            list(1024),
            list(8),
            list(64)
        );
        let sentence = parse(&text).expect_err("too many").to_string();
        assert!(sentence.contains("2097152 configurations") && sentence.starts_with("g.toml:3"), "{sentence}");
    }

    #[test]
    fn bad_grids_name_the_line_and_the_mend() {
        let sweep = "[[sweep]]\ntechnique = 'hierarchical'\n";
        for (text, wanted) in [
            ("scenes = ['a']\nsiez = ['1x1']\n", "g.toml:2: unknown key `siez`; did you mean `size`?"),
            ("scenes = ['a']\nsize = ['1by1']\n[[sweep]]\ntechnique='none'", "g.toml:2: `size` holds \"1by1\""),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}grid = {{ sampels = [1] }}"), "did you mean `samples`?"),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}grid = {{ samples = [0] }}"), "give 1 to 1024"),
            ("scenes = ['a']\nsize = ['1x1']\n[[sweep]]\ntechnique = 'hierarchcal'", "did you mean hierarchical?"),
            ("scenes = ['a']\nsize = ['1x1']\n", "`sweep` is missing"),
            (
                &format!("scenes = ['a']\nsize = ['1x1']\n{sweep}at_frames = [1, 0]"),
                "g.toml:5: `sweep.at_frames` is [1, 0]; it must be a list of numbers of frames from 1 to 256 in rising order, \
                 for example [1, 8, 32, 128]",
            ),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}at_frames = [8, 8]"), "`sweep.at_frames` is [8, 8]"),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}at_frames = []"), "`sweep.at_frames` is []"),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}at_frames = [257]"), "from 1 to 256"),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}at_frames = 8"), "`sweep.at_frames` is 8"),
            (
                &format!("scenes = ['a']\nsize = ['1x1']\n{sweep}moving = ['camera', 'sun']"),
                "g.toml:5: `sweep.moving` is ['camera', 'sun']; it must be a list of different words of `nothing`, `camera` or \
                 `lights`",
            ),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}moving = 'camera'"), "`sweep.moving` is 'camera'"),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}moving = []"), "`sweep.moving` is []"),
            (
                &format!("scenes = ['a']\nsize = ['1x1']\n{sweep}moving = ['lights', 'lights']"),
                "`sweep.moving` is ['lights', 'lights']",
            ),
            (&format!("scenes = ['a']\nsize = ['1x1']\n{sweep}frames = [8]"), "unknown key `sweep.frames`"),
        ] {
            let sentence = parse(text).expect_err("a bad grid").to_string();
            assert!(sentence.contains(wanted), "{sentence:?} does not say {wanted:?}");
        }
    }
}
