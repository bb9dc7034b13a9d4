//! Grids and references that are measured in parts and merged: as if they had been measured at once, bit for bit.
#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeSet,
    fs,
    path::PathBuf,
    process::{Command, Output},
};

use halflight_evaluator::measurement::{Measurement, read_json};
use halflight_native::images::Image;
use serde_json::Value;

const GRID: &str = "scenes = ['cornell']\nsize = ['16x9', '9x16']\nframes = 1\ntruth_samples = 4\n\
                    [[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4 }\ngrid = { levels = [1, 2, 3] }\n\
                    [[sweep]]\ntechnique = 'none'\n";

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("halflight-merged-{test}-{}", std::process::id()));
        drop(fs::remove_dir_all(&path));
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("grid.toml"), GRID).unwrap();
        Self(path)
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_evaluator"));
        command.args(arguments.split_whitespace()).current_dir(&self.0).env("HALFLIGHT_CACHE", self.0.join("cache"));
        command
    }

    fn succeed(&self, arguments: &str) {
        succeeded(&self.command(arguments).output().unwrap());
    }

    fn refused(&self, arguments: &str, parts: &[&str]) {
        let output = self.command(arguments).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        for part in parts {
            assert!(said.contains(part), "{arguments}: {said:?} does not say {part:?}");
        }
    }

    fn rows(&self, report: &str) -> Vec<Measurement> {
        read_json(&self.0.join(report).join("results.json")).unwrap()
    }

    fn image(&self, name: &str) -> Image {
        Image::read(&self.0.join(name)).unwrap()
    }
}

fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The columns of a row that a second measurement on the same adapter gives again.
fn results(row: &Measurement) -> Vec<(String, Value)> {
    let is_time = |name: &str| name.ends_with("_ms") || name.contains("_ms_");
    let kept = row.columns().into_iter().filter(|(name, _)| !is_time(name) && name != "machine");
    kept.collect()
}

fn bits(image: &Image) -> Vec<(String, Vec<u32>)> {
    let of = |values: &Vec<f32>| values.iter().map(|value| value.to_bits()).collect();
    image.channels.iter().map(|(name, values)| (name.clone(), of(values))).collect()
}

#[test]
fn parts_of_a_grid_give_the_report_of_the_whole() {
    let folder = Folder::new("grid");
    folder.succeed("run --grid grid.toml --out whole");
    // Another cache, as on another machine.
    let elsewhere = |arguments: &str| {
        succeeded(&folder.command(arguments).env("HALFLIGHT_CACHE", folder.0.join("elsewhere")).output().unwrap());
    };
    folder.succeed("run --grid grid.toml --out a --shard 0/3");
    elsewhere("run --grid grid.toml --out b --shard 1/3");
    let third = |arguments: &str| {
        let mut command = folder.command(arguments);
        command.env("SLURM_ARRAY_TASK_ID", "2").env("SLURM_ARRAY_TASK_COUNT", "3").env("SLURM_ARRAY_TASK_MIN", "0");
        succeeded(&command.output().unwrap());
    };
    third("run --grid grid.toml --out c --shard auto");
    let shards = ["a", "b", "c"].map(|name| folder.rows(name).len());
    assert_eq!(shards.iter().sum::<usize>(), 8, "each cell in one shard: {shards:?}");
    let largest = ["a", "b", "c"].into_iter().max_by_key(|name| folder.rows(name).len()).unwrap();
    // The largest folder is lost, and measured again by the grid of the missing cells.
    fs::remove_dir_all(folder.0.join(largest)).unwrap();
    let rest: Vec<&str> = ["a", "b", "c"].into_iter().filter(|name| *name != largest).collect();
    let incomplete = folder.command(&format!("merge {} --out merged --complete", rest.join(" "))).output().unwrap();
    assert_eq!(incomplete.status.code(), Some(1), "{}", String::from_utf8_lossy(&incomplete.stderr));
    assert!(folder.rows("merged").len() < 8);
    folder.succeed("run --grid merged/missing.toml --out again");
    folder.succeed(&format!("merge {} again --out merged --complete", rest.join(" ")));
    let (whole, merged) = (folder.rows("whole"), folder.rows("merged"));
    assert_eq!(whole.len(), 8);
    let pairs = whole.iter().map(results).zip(merged.iter().map(results));
    for (number, (whole, merged)) in pairs.enumerate() {
        assert_eq!(whole, merged, "row {number}");
    }
    let pictures: BTreeSet<&str> =
        whole.iter().flat_map(|row| row.images.values()).filter_map(|name| name.as_str()).collect();
    assert_eq!(pictures.len(), 8 * 4 + 2 * 3);
    for name in pictures {
        let paths = ["whole", "merged"].map(|report| folder.0.join(report).join(name));
        // The texts in the header of an EXR file have no order.
        let same = if name.ends_with(".exr") {
            let [a, b] = paths.map(|path| Image::read(&path).unwrap());
            bits(&a) == bits(&b) && a.metadata == b.metadata
        } else {
            let [a, b] = paths.map(|path| fs::read(path).unwrap());
            a == b
        };
        assert!(same, "{name}");
    }
    assert!(!merged[0].machine.is_empty() && !merged[0].processor.is_empty());
    // Another scene in the place of this one.
    folder.succeed("run --grid grid.toml --out other --scene bars --shard 0/3");
    folder.refused("merge whole other --out mixed", &["other cannot be merged with whole: `scenes` is bars"]);
}

#[test]
fn parts_of_a_reference_add_up_to_the_whole_exactly() {
    let folder = Folder::new("reference");
    let common = "truth --scene cornell --size 16x9 --bounces 2 --glossy --ambient-occlusion 1 --samples-per-pixel 200";
    folder.succeed(&format!("{common} --out whole.exr"));
    // 200 samples are three whole parts and one of 8 samples.
    for shard in 0..4 {
        let other_cache = folder.0.join(format!("cache-{shard}"));
        let arguments = format!("{common} --shard {shard}/4 --out {shard}.truth");
        succeeded(&folder.command(&arguments).env("HALFLIGHT_CACHE", other_cache).output().unwrap());
    }
    let merge = |arguments: &str| {
        let arguments = format!("merge {arguments}");
        succeeded(&folder.command(&arguments).env("HALFLIGHT_CACHE", folder.0.join("fresh")).output().unwrap());
    };
    merge("2.truth 0.truth 3.truth 1.truth --out merged.exr");
    let (whole, merged) = (folder.image("whole.exr"), folder.image("merged.exr"));
    assert!(whole.channels.contains_key("variance.R") && whole.channels.contains_key("ambient_occlusion.Y"));
    assert_eq!(bits(&whole), bits(&merged));
    for key in ["samples_per_pixel", "rel_error_8x8", "inputs", "scene_hash"] {
        assert_eq!(whole.metadata[key], merged.metadata[key], "{key}");
    }
    // The cache that the merge wrote gives the same image, and nothing is traced.
    let mut again = folder.command(&format!("{common} --out again.exr"));
    let output = again.env("HALFLIGHT_CACHE", folder.0.join("fresh")).output().unwrap();
    succeeded(&output);
    assert!(String::from_utf8_lossy(&output.stderr).contains("200 samples a pixel from the cache"));
    assert_eq!(bits(&folder.image("again.exr")), bits(&whole));

    let refused = |arguments: &str, parts: &[&str]| folder.refused(&format!("{arguments} --out no.exr"), parts);
    refused("merge 0.truth 2.truth 3.truth", &["2.truth cannot be merged with 0.truth: samples 64 to 127 are missing"]);
    refused("merge 1.truth 2.truth 3.truth", &["samples 0 to 63 are missing"]);
    refused("merge 0.truth 1.truth 2.truth", &["samples 192 to 199 are missing"]);
    refused(
        "merge 0.truth 1.truth 1.truth",
        &["1.truth cannot be merged with 0.truth: samples 64 to 127 are there twice"],
    );
    let other = common.replace("--bounces 2", "--bounces 1 --seed 4");
    folder.succeed(&format!("{other} --shard 1/4 --out seed.truth"));
    refused("merge 0.truth seed.truth", &["seed.truth cannot be merged with 0.truth: `reference settings`", "seed: 4"]);
    folder.succeed(&format!("{} --shard 1/3 --out fewer.truth", common.replace("200", "150")));
    refused("merge 0.truth fewer.truth", &["`samples` is 150 there and 200 here"]);
    let bytes = fs::read(folder.0.join("1.truth")).unwrap();
    fs::write(folder.0.join("1.truth"), &bytes[..bytes.len() - 7]).unwrap();
    refused("merge 0.truth 1.truth", &["cannot read 1.truth: it is cut off or damaged"]);
    refused("merge 0.truth grid.toml", &["grid.toml is no .truth file"]);
    folder.refused(&format!("{common} --shard 0/5 --out 4.truth"), &["use at most 4 shards"]);
    folder.refused(&format!("{common} --shard 0/2 --out 0.exr"), &["0.exr is no .truth file"]);
    folder.refused(&format!("{common} --shard auto --out 0.truth"), &["neither SLURM_ARRAY_TASK_ID nor"]);
}
