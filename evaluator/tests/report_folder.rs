//! The command `evaluator run` as a user meets it: what the folder holds, and what --resume repeats.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::SystemTime,
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

    /// When each cell's file was last written.
    fn cells(&self) -> Vec<SystemTime> {
        let mut files: Vec<_> =
            fs::read_dir(self.out().join("cells")).unwrap().map(|file| file.unwrap().path()).collect();
        files.sort();
        files.iter().map(|file| fs::metadata(file).unwrap().modified().unwrap()).collect()
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
    // As a run that was killed in the second cell leaves it.
    fs::remove_file(place.out().join("cells/0001.json")).unwrap();
    place.run(&["--resume"]);
    let again = place.cells();
    assert_eq!((again[0], again[2]), (written[0], written[2]));
    assert!(again[1] > written[1]);
    let errors = |json: &[u8]| -> Vec<_> {
        let rows: Vec<halflight_evaluator::measurement::Measurement> = serde_json::from_slice(json).unwrap();
        rows.into_iter().map(|row| row.errors).collect()
    };
    let [_, json, ..] = tables(&place);
    assert_eq!(errors(&json), errors(&first[1]), "a repeated cell has the errors it had: seeds decide all");
}
