//! Bad input: each gives one sentence that names the file and line, key or name, and the fix. What the program can repair
//! it repairs, with a warning.

use std::path::Path;

use halflight_evaluator::experiment::grid::Grid;
use halflight_native::AdapterChoice;
use halflight_renderer::parameters::Settings;
use halflight_scenes::{MemoryFiles, Scene, load_scene};
use halflight_techniques::preset::Preset;

use super::Suite;
use crate::check::Check;

const GROUP: &str = "bad input";

const TRIANGLE: &str = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
const SCENE: &str = "[[model]]\npath = 'm.obj'\n[camera]\neye = [0.0, 0.0, 3.0]\ntarget = [0.0, 0.0, 0.0]\n";
const GRID: &str = "scenes = ['s.toml']\nsize = ['16x9']\n[[sweep]]\ntechnique = 'hierarchical'\n";

/// The row, the file that is replaced, its text (`None`: the file is missing), and what the sentence must contain.
type Row = (&'static str, &'static str, Option<&'static str>, &'static [&'static str]);

/// Files that are refused.
const REFUSED: &[Row] = &[
    ("a missing scene file", "s.toml", None, &["s.toml", "no such file", "check"]),
    ("a missing OBJ", "m.obj", None, &["s.toml:2", "m.obj"]),
    ("an OBJ with an index out of range", "m.obj", Some("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), &["m.obj:4"]),
    ("an OBJ without faces", "m.obj", Some("v 0 0 0\n"), &["m.obj", "face"]),
    ("a NaN vertex", "m.obj", Some("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"), &["m.obj:3", "nan", "finite"]),
    ("a scene file that is no TOML", "s.toml", Some("name ="), &["s.toml:1", "TOML"]),
    (
        "an unknown key of a scene file",
        "s.toml",
        Some("[[modle]]\npath = 'm.obj'\n"),
        &["s.toml:1", "did you mean `model`"],
    ),
    (
        "a value out of range in a scene file",
        "s.toml",
        Some(
            "[[model]]\npath = 'm.obj'\n[camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 260.0\n",
        ),
        &["s.toml:6", "260", "1 to 170"],
    ),
];

/// Files that are repaired, with a warning.
const REPAIRED: &[Row] = &[
    ("a missing MTL", "m.mtl", None, &["m.mtl"]),
    ("a missing texture", "m.mtl", Some("newmtl m\nmap_Kd gone.png\n"), &["m.mtl", "gone.png", "checker"]),
    ("a broken texture", "m.mtl", Some("newmtl m\nmap_Kd broken.png\n"), &["m.mtl", "broken.png", "checker"]),
    ("albedo above 1 in an MTL", "m.mtl", Some("newmtl m\nKd 7 1 1\n"), &["m.mtl", "Kd", "clamped"]),
];

/// Grid files that are refused: row, text to replace, its replacement, and what the sentence must contain.
const GRIDS: &[(&str, &str, &str, &[&str])] = &[
    ("an unknown key of a grid file", "size", "siez", &["g.toml:2", "did you mean `size`"]),
    ("a value out of range in a grid file", "16x9", "0x9", &["g.toml:2", "1 to 16384"]),
    (
        "an unknown technique in a grid file",
        "'hierarchical'",
        "'hierarchcal'",
        &["g.toml:4", "did you mean hierarchical"],
    ),
    (
        "an unknown parameter in a grid file",
        "[[sweep]]\n",
        "[[sweep]]\nfixed = { sampels = 3 }\n",
        &["did you mean `samples`"],
    ),
    ("a parameter out of range in a grid file", "[[sweep]]\n", "[[sweep]]\nfixed = { samples = 0 }\n", &["1 to 1024"]),
];

pub(super) fn run(suite: &mut Suite) {
    let load = |file: &str, text: Option<&str>| -> Result<Scene, String> {
        let good = [
            ("s.toml", SCENE.to_owned()),
            ("m.obj", TRIANGLE.to_owned()),
            ("m.mtl", "newmtl m\nKd 1 1 1\n".to_owned()),
            ("broken.png", "no picture".to_owned()),
        ];
        let files: MemoryFiles = good
            .into_iter()
            .filter_map(|(name, good)| if name == file { Some((name, text?.to_owned())) } else { Some((name, good)) })
            .collect();
        load_scene(&files, Path::new("s.toml")).map_err(|e| e.to_string())
    };
    for &(row, file, text, parts) in REFUSED {
        suite.sentence(row, parts, || load(file, text).err());
    }
    for &(row, file, text, parts) in REPAIRED {
        suite.sentence(row, parts, || load(file, text).ok().map(|scene| scene.warnings.join(" ")));
    }
    for &(row, from, to, parts) in GRIDS {
        let text = GRID.replace(from, to);
        suite.sentence(row, parts, || Grid::parse(Path::new("g.toml"), &text).err().map(|e| e.to_string()));
    }
    let preset = "technique = 'hierarchical'\n[settings]\nsamples = 0\n";
    suite.sentence("a value out of range in a preset", &["p.toml:3", "1 to 1024"], || {
        Preset::read(Path::new("p.toml"), preset).err().map(|e| e.to_string())
    });
    suite.sentence("no adapter of that name", &["no such adapter name", "choose one of"], || {
        let choice = AdapterChoice::Named("no such adapter name".into());
        halflight_native::NativeGpu::open(&choice).err().map(|e| e.to_string())
    });
}

impl Suite<'_> {
    /// A row whose message must be one line that contains these parts.
    fn sentence(&mut self, row: &str, parts: &[&str], say: impl FnOnce() -> Option<String>) {
        if !self.wants(GROUP, row) {
            return;
        }
        self.guarded(Check::new(GROUP, row, "readers", &Settings::new()), |check| {
            let sentence = say().unwrap_or_else(|| "no message".into());
            let missing = parts.iter().filter(|part| !sentence.contains(**part)).count() + sentence.lines().count() - 1;
            let reason = "one sentence that names the position and the fix";
            let check = check.clone().bounded("parts that the sentence lacks", missing as f64, 0.0, reason);
            Ok(vec![check.detail(sentence)])
        });
    }
}
