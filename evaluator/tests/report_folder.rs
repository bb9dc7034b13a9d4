//! The command `evaluator run` as a user meets it: what the folder holds, and what --resume repeats.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use halflight_evaluator::measurement::read_json;
use halflight_native::images::Image;

const GRID: &str = "
preset = 'soler2009_fig5'
scenes = ['scenes/cornell.toml']
size = ['40x32']
direct = 'truth'
frames = 2
truth_samples = 4
truth_rel_error = 1.0
[[sweep]]
technique = 'hierarchical'
fixed = { samples = 16 }
grid = { form_factor = ['eq3', 'eq4'] }
[[sweep]]
technique = 'none'
";

/// A folder for one test, gone when it is over.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("halflight-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("grid.toml"), GRID).unwrap();
        Self(folder)
    }

    fn out(&self) -> PathBuf {
        self.0.join("out")
    }

    fn run(&self, arguments: &[&str]) {
        let status = Command::new(env!("CARGO_BIN_EXE_evaluator"))
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
            .env("HALFLIGHT_CACHE", self.0.join("cache"))
            .args(["run", "--grid"])
            .arg(self.0.join("grid.toml"))
            .arg("--out")
            .arg(self.out())
            .args(arguments)
            .status()
            .unwrap();
        assert!(status.success(), "{status}");
    }

    /// The finished cells as they stand in their file, one a line.
    fn cells(&self) -> Vec<String> {
        fs::read_to_string(self.out().join("cells.jsonl")).unwrap().lines().map(str::to_owned).collect()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_folder_holds_pictures_image_files_and_the_figure() {
    let place = Place::new("folder");
    place.run(&["--check"]);
    let out = place.out();
    let rows = read_json(&out.join("results.json")).unwrap();
    assert_eq!(rows.len(), 3);
    for row in &rows {
        for kind in ["final", "indirect", "error", "exr", "truth_final", "truth_indirect", "truth_exr"] {
            assert!(out.join(row.image(kind).unwrap()).is_file(), "{kind}");
        }
    }
    let keys: Vec<&str> = rows[0].parameters.keys().map(String::as_str).collect();
    assert_eq!(
        keys[..2],
        ["hierarchical.start_resolution", "hierarchical.levels"],
        "in the order of their declaration"
    );

    let cell = Image::read(&out.join(rows[1].image("exr").unwrap())).unwrap();
    let truth = Image::read(&out.join(rows[1].image("truth_exr").unwrap())).unwrap();
    assert_eq!((cell.width, cell.height), (40, 32));
    for key in ["scene", "inputs", "camera", "seed", "adapter", "commit", "technique", "settings"] {
        assert!(!cell.metadata[key].is_empty(), "{key}");
    }
    assert!(cell.metadata["settings"].contains("hierarchical.form_factor=eq4"));
    // The parts make the whole: direct light was the truth's own. float16 keeps 11 bits, and three values are rounded.
    let whole = cell.rgb("").unwrap();
    let (indirect, albedo, direct) =
        (cell.rgb("indirect").unwrap(), truth.rgb("albedo").unwrap(), truth.rgb("direct").unwrap());
    let surface = truth.surface_mask().unwrap();
    let mut lit = 0;
    for i in (0..whole.len()).filter(|&i| surface[i]) {
        for c in 0..3 {
            let sum = direct[i][c] + albedo[i][c] * indirect[i][c];
            // The renderer's albedo is that of a texel at the pixel's centre, in 8 bits; the truth's is a mean over the pixel.
            let tolerance = 0.02 + 0.1 * sum;
            assert!((whole[i][c] - sum).abs() < tolerance, "pixel {i}: {} against {sum}", whole[i][c]);
        }
        lit += usize::from(indirect[i][1] > 0.0);
    }
    assert!(2 * lit > surface.iter().filter(|&&s| s).count(), "most surfaces receive light");

    for file in [
        "index.html",
        "results.csv",
        "tables.md",
        "plots/slice.svg",
        "plots/time-vs-flip.svg",
        "plots/time-vs-relmse.svg",
    ] {
        assert!(out.join(file).is_file(), "{file}");
    }
    assert!(fs::read_to_string(out.join("index.html")).unwrap().contains("Equation 3 against Equation 4"));
}

#[test]
fn resume_repeats_only_what_is_missing() {
    let place = Place::new("resume");
    place.run(&[]);
    let tables = |place: &Place| {
        ["results.csv", "results.json", "tables.md", "index.html"].map(|file| fs::read(place.out().join(file)).unwrap())
    };
    let (first, written) = (tables(&place), place.cells());
    place.run(&["--resume"]);
    assert!(tables(&place) == first, "the same tables");
    assert_eq!(place.cells(), written, "no cell was repeated");
    // As a run that was killed in the second cell leaves it, with half of its line.
    let half = &written[1][..written[1].len() / 2];
    fs::write(place.out().join("cells.jsonl"), format!("{}\n{}\n{half}", written[0], written[2])).unwrap();
    place.run(&["--resume"]);
    let again = place.cells();
    assert_eq!((again.len(), &again[0], &again[1]), (4, &written[0], &written[2]));
    let cell = |line: &String| line.split_once(',').unwrap().0.to_owned();
    assert_eq!(cell(&again[3]), cell(&written[1]), "measured again under the same name");
    assert!(again[3] != written[1], "its times differ");
    let errors = |json: &[u8]| -> Vec<_> {
        let rows: Vec<halflight_evaluator::measurement::Measurement> = serde_json::from_slice(json).unwrap();
        rows.into_iter().map(|row| row.errors).collect()
    };
    let [_, json, ..] = tables(&place);
    assert_eq!(errors(&json), errors(&first[1]), "a repeated cell has the errors it had: seeds decide all");
}

#[test]
fn a_grid_that_grows_measures_only_what_is_new() {
    let place = Place::new("grows");
    place.run(&["--shard", "0/2"]);
    let first = place.cells();
    fs::write(place.0.join("grid.toml"), GRID.replace("['eq3', 'eq4']", "['eq4', 'eq3'], levels = [4, 2]")).unwrap();
    let grown = place.0.join("grid.toml");
    place.run(&["--shard", "0/2", "--resume"]);
    let second = place.cells();
    assert_eq!(second[..first.len()], first, "finished cells stay, wherever the grid has them now");
    place.run(&["--shard", "1/2", "--resume"]);
    let third = place.cells();
    assert_eq!(third[..second.len()], second);
    let cells: std::collections::BTreeSet<&str> = third.iter().map(|line| line.split_once(',').unwrap().0).collect();
    assert_eq!((third.len(), cells.len()), (5, 5), "each of the cells of {} once", grown.display());
    // The same scene elsewhere is the same scene: nothing is measured, and commands name the new path.
    let elsewhere = place.0.join("elsewhere.toml");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/cornell.toml"), &elsewhere).unwrap();
    place.run(&["--resume", "--scene", elsewhere.to_str().unwrap()]);
    assert_eq!(place.cells(), third);
    let rows = read_json(&place.out().join("results.json")).unwrap();
    assert!(rows.len() == 5 && rows.iter().all(|row| row.command.contains("elsewhere.toml")));
}
