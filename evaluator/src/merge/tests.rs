#![allow(clippy::unwrap_used)]
//! Folders without pictures, written by hand: nothing here needs a device.

use std::{fs, ops::Range};

use halflight_metrics::MetricId;

use super::*;
use crate::{
    experiment::manifest::SceneContent,
    measurement::{Measurement, read_json},
};

const SAMPLES: Range<usize> = 1..9;

/// Folders of one test, gone when it is over.
struct Place(PathBuf);

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl Place {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("halflight-merge-{test}-{}", std::process::id()));
        drop(fs::remove_dir_all(&path));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a folder with these of the grid's cells.
    fn folder(&self, name: &str, cells: &[usize], change: impl Fn(&mut Manifest, &mut Vec<Record>)) -> PathBuf {
        let grid = grid("");
        let mut manifest = Manifest {
            commit: "c0ffee".into(),
            shaders: "5".into(),
            grid: grid.to_toml(),
            scenes: vec![SceneContent { name: "room".into(), hash: "abc".into() }],
            contexts: vec!["context".into()],
            command: format!("evaluator run --out {name}"),
            warnings: vec![format!("something of {name}")],
        };
        let all: Vec<Record> = grid.cells().enumerate().map(|(index, cell)| record(index, &cell)).collect();
        let mut records: Vec<Record> = cells.iter().map(|&index| all[index].clone()).collect();
        change(&mut manifest, &mut records);
        let path = self.path(name);
        manifest.write(&path.join(MANIFEST)).unwrap();
        let lines: Vec<u8> = records.iter().flat_map(|record| line(record).unwrap()).collect();
        fs::write(path.join(CELLS), lines).unwrap();
        path
    }

    fn refused(&self, second: impl Fn(&mut Manifest, &mut Vec<Record>), parts: &[&str]) {
        let folders = [self.folder("first", &[0, 1, 2, 3], |_, _| ()), self.folder("second", &[3, 4], second)];
        let said = merge(&folders, &self.path("out"), String::new()).unwrap_err().to_string();
        for part in parts.iter().chain(&["/second cannot be merged with ", "/first: "]) {
            assert!(said.contains(part), "{said:?} does not say {part:?}");
        }
        assert!(!self.path("out").exists(), "nothing is written");
    }
}

fn grid(more: &str) -> Grid {
    let list: Vec<String> = SAMPLES.map(|samples| samples.to_string()).collect();
    let text = format!(
        "scenes = ['room.toml']\nsize = ['16x9']\nframes = 2\n{more}\n[[sweep]]\ntechnique = 'hierarchical'\n\
         grid = {{ samples = [{}] }}\n",
        list.join(", ")
    );
    Grid::parse(Path::new("rooms.toml"), &text).unwrap()
}

fn record(index: usize, cell: &crate::experiment::grid::Cell) -> Record {
    let mut row = Measurement {
        scene: "room".into(),
        technique: "hierarchical".into(),
        adapter: "GPU".into(),
        time_ms_median: 1.0 + index as f64,
        machine: "node".into(),
        ..Measurement::default()
    };
    // No decimal fraction: a number that is cut or rounded on its way would show.
    row.errors.set(MetricId::IndirectRmse, Some(0.1 * (index as f64).sqrt()));
    row.errors.set(MetricId::TruthRelError, Some(0.001));
    let id = CellId::new("abc", [16, 9], cell);
    Record { cell: id.to_string(), context: "context".into(), references: vec!["evaluator truth".into()], row }
}

fn nothing(_: &mut Manifest, _: &mut Vec<Record>) {}

#[test]
fn parts_give_the_rows_of_the_whole_in_the_order_of_the_grid() {
    let place = Place::new("parts");
    let whole = place.folder("whole", &[0, 1, 2, 3, 4, 5, 6, 7], nothing);
    let parts = [
        place.folder("a", &[5, 0, 2], nothing),
        place.folder("b", &[7, 6], nothing),
        // Measured twice with the same results: the times of the first folder stay.
        place.folder("c", &[4, 1, 3, 0], |_, records| records[3].row.time_ms_median = 99.0),
    ];
    for (folders, out) in [(vec![whole], "one"), (parts.to_vec(), "many")] {
        let merged = merge(&folders, &place.path(out), "evaluator merge".into()).unwrap();
        assert_eq!(merged, Merged { found: 8, cells: 8 });
        assert!(!place.path(out).join(MISSING).exists());
    }
    let rows = |name: &str| read_json(&place.path(name).join("results.json")).unwrap();
    assert_eq!(rows("many"), rows("one"));
    assert_eq!((rows("many").len(), rows("many")[0].time_ms_median), (8, 1.0));
    let page = fs::read_to_string(place.path("many/index.html")).unwrap();
    assert!(page.contains("something of a") && page.contains("something of c"), "warnings of all parts");
    // What was merged can be merged again.
    let merged = merge(&[place.path("many")], &place.path("again"), "evaluator merge".into()).unwrap();
    assert_eq!((merged.missing(), rows("again")), (0, rows("one")));
}

#[test]
fn missing_cells_are_counted_and_are_a_grid_that_completes_the_merge() {
    let place = Place::new("missing");
    let first = place.folder("first", &[0, 1, 2], nothing);
    // The last line is cut off in its middle.
    let cut = place.folder("cut", &[3, 4, 5], nothing);
    let bytes = fs::read(cut.join(CELLS)).unwrap();
    fs::write(cut.join(CELLS), &bytes[..bytes.len() - 40]).unwrap();
    let out = place.path("out");
    let merged = merge(&[first.clone(), cut.clone()], &out, String::new()).unwrap();
    assert_eq!((merged.found, merged.missing()), (5, 3));
    let tables = fs::read_to_string(out.join("tables.md")).unwrap();
    assert!(tables.contains("cells.jsonl: line 3 is cut off") && tables.contains("3 cells are missing"), "{tables}");
    let missing = Grid::read(&out.join(MISSING)).unwrap();
    let only = missing.only.clone().unwrap();
    let wanted: Vec<String> = grid("").cells().map(|cell| CellId::new("abc", [16, 9], &cell).to_string()).collect();
    assert_eq!(only.iter().collect::<std::collections::BTreeSet<_>>(), wanted[5..].iter().collect());
    assert_eq!((missing.name.as_str(), missing.len()), ("rooms", 8));
    // A folder of the missing grid completes the others.
    let rest = place.folder("rest", &[5, 6, 7], |manifest, _| manifest.grid = missing.to_toml());
    assert_eq!(merge(&[first, cut, rest], &out, String::new()).unwrap(), Merged { found: 8, cells: 8 });
    assert!(!out.join(MISSING).exists(), "that of the earlier merge is gone");
}

#[test]
fn rows_of_two_adapters_stay_apart() {
    let place = Place::new("adapters");
    let other = |_: &mut Manifest, records: &mut Vec<Record>| {
        for record in records {
            record.row.adapter = "another GPU".into();
            record.row.errors.set(MetricId::IndirectRmse, Some(0.5));
        }
    };
    let folders = [place.folder("a", &[0, 1, 2, 3, 4, 5, 6, 7], nothing), place.folder("b", &[1], other)];
    let merged = merge(&folders, &place.path("out"), String::new()).unwrap();
    assert_eq!(merged, Merged { found: 8, cells: 8 });
    let rows = read_json(&place.path("out/results.json")).unwrap();
    let adapters: Vec<&str> = rows.iter().map(|row| row.adapter.as_str()).collect();
    assert_eq!((rows.len(), adapters[1], adapters[2]), (9, "GPU", "another GPU"));
}

#[test]
fn mixtures_are_refused_with_the_folder_and_the_key() {
    let place = Place::new("mixtures");
    place.refused(|manifest, _| manifest.commit = "beef".into(), &["`commit` is beef there and c0ffee here"]);
    place.refused(|manifest, _| manifest.shaders = "6".into(), &["`shaders` is 6 there and 5 here"]);
    let content = |manifest: &mut Manifest, _: &mut Vec<Record>| manifest.scenes[0].hash = "def".into();
    place.refused(content, &["`scenes` is room with content def there", "content abc here"]);
    for (more, key) in [
        ("truth_samples = 7", "`truth_samples` is 7 there and 256 here"),
        ("truth_rel_error = 0.5", "`truth_rel_error` is 0.5 there and 0.01 here"),
        ("bounces = 2", "`bounces` is 2 there and 1 here"),
        ("seed = 3", "`seed` is 3 there and 0 here"),
        ("direct = 'truth'", "`direct` is truth there and rendered here"),
    ] {
        place.refused(|manifest, _| manifest.grid = grid(more).to_toml(), &[key]);
    }
    let sweep = |manifest: &mut Manifest, _: &mut Vec<Record>| {
        manifest.grid = manifest.grid.replace("8]", "8, 16]");
    };
    place.refused(sweep, &["`sweep`", "8, 16]) there", "--resume"]);
    let twice = |_: &mut Manifest, records: &mut Vec<Record>| {
        records[0].row.errors.set(MetricId::IndirectRmse, Some(0.25));
    };
    let id = CellId::new("abc", [16, 9], &grid("").cells().nth(3).unwrap()).to_string();
    place.refused(twice, &["`indirect_rmse` 0.25 there and 0.17", &id, "hierarchical of room"]);
    // Against a reference with other samples.
    let with_reference = |name: &'static str| {
        move |_: &mut Manifest, records: &mut Vec<Record>| {
            for record in records {
                record.row.images.insert("truth_exr".into(), name.into());
            }
        }
    };
    let folders = [
        place.folder("first", &[0], with_reference("images/a.exr")),
        place.folder("second", &[1], with_reference("images/b.exr")),
    ];
    let said = merge(&folders, &place.path("out"), String::new()).unwrap_err().to_string();
    assert!(
        said.contains("`reference` of room") && said.contains("images/b.exr") && said.contains("/second"),
        "{said}"
    );
    // A picture of one name with other contents.
    for (folder, bytes) in folders.iter().zip([b"one", b"two"]) {
        fs::create_dir_all(folder.join("images")).unwrap();
        fs::write(folder.join("images/a.exr"), bytes).unwrap();
    }
    place.folder("second", &[1], with_reference("images/a.exr"));
    let said = merge(&folders, &place.path("out"), String::new()).unwrap_err().to_string();
    assert!(said.contains("`images/a.exr` shows something else"), "{said}");
    // Rows of an older program in a folder of the same are left out, and no folder at all is bad input.
    let stale = place.folder("stale", &[0, 1], |_, records| records[0].context = "older".into());
    let merged = merge(&[stale], &place.path("out"), String::new()).unwrap();
    assert_eq!(merged.found, 1);
    let said = merge(&[place.path("nowhere")], &place.path("out"), String::new()).unwrap_err();
    assert!(said.to_string().contains("run.json") && said.exit_code() == 2, "{said}");
    let said = merge(&[place.path("first")], &place.path("first"), String::new()).unwrap_err().to_string();
    assert!(said.contains("is one of the folders to merge"), "{said}");
}
