//! Every command that a report, a page or an image file shows repeats what it stands beside: each is run as it is printed,
//! by a shell, and its numbers are compared.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use halflight_evaluator::measurement::{Measurement, read_json};
use halflight_metrics::{
    DisplayPair, Function, LinearPair, METRICS, MetricId, Rgb, Values,
    tone::{auto_exposure, tone_map_all},
};
use halflight_native::images::Image;
use halflight_techniques::invocation::Invocation;

/// A name that a shell would take apart.
const SCENE: &str = "it's a scene/cornell box.toml";

/// A folder of one test, with scenes in it.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("commands").join(test);
        drop(fs::remove_dir_all(&path));
        let folder = Self(path);
        let bundled = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
        folder.write(SCENE, &fs::read_to_string(bundled.join("cornell.toml")).unwrap());
        folder.write("motion.toml", &fs::read_to_string(bundled.join("motion.toml")).unwrap());
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.0.join(name).parent().unwrap()).unwrap();
        fs::write(self.0.join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    /// Runs a command line by a shell, with the evaluator of this build; what it prints.
    fn shell(&self, line: &str) -> String {
        let programs = Path::new(env!("CARGO_BIN_EXE_evaluator")).parent().unwrap();
        let path = std::env::join_paths(
            std::iter::once(programs.to_owned()).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
        );
        let output = Command::new("sh")
            .args(["-c", line])
            .current_dir(&self.0)
            .env("PATH", path.unwrap())
            .env("HALFLIGHT_CACHE", self.0.join("cache"))
            .output()
            .unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs a printed command; the image that it writes.
    fn image(&self, line: &str) -> Image {
        let parsed: Invocation = line.parse().unwrap();
        assert_eq!(parsed.to_string(), line, "what is printed parses back");
        let out = self.0.join(parsed.value("out").unwrap());
        drop(fs::remove_file(&out));
        self.shell(line);
        Image::read(&out).unwrap()
    }

    /// Runs a grid with these lines in it and repeats each of its rows.
    fn rows(&self, grid: &str) -> Vec<Measurement> {
        self.write("grid.toml", &format!("size = [\"24x16\"]\ntruth_samples = 4\ntruth_rel_error = 0.5\n{grid}"));
        self.shell("evaluator run --grid grid.toml --out out");
        let rows = read_json(&self.0.join("out/results.json")).unwrap();
        let tables = self.read("out/tables.md");
        let references: Vec<Image> =
            tables.lines().filter_map(|line| line.strip_prefix("- Reference: ")).map(|line| self.image(line)).collect();
        assert!(!rows.is_empty() && !references.is_empty());
        for row in &rows {
            let found = errors(&self.image(&row.command), &references);
            let measured = METRICS.iter().filter(|metric| !matches!(metric.function, Function::Recorded));
            for metric in measured.filter(|metric| row.errors.get(metric.id).is_some()) {
                // The same seeds on the same adapter: nothing but equality is right.
                assert_eq!(found.get(metric.id), row.errors.get(metric.id), "{}: {}", metric.key, row.command);
            }
            // The file of the cell says the same command.
            let cell = Image::read(&self.0.join("out").join(row.image("exr").unwrap())).unwrap();
            assert_eq!(cell.metadata["command"], row.command);
        }
        rows
    }
}

/// The errors of an image against the references of a report.
fn errors(image: &Image, references: &[Image]) -> Values {
    let mut values = Values::default();
    let product = |image: &Image| -> Option<Vec<Rgb>> {
        let pairs = image.rgb("albedo")?.into_iter().zip(image.rgb("indirect")?);
        Some(pairs.map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect())
    };
    for reference in references {
        let mask = reference.surface_mask().unwrap();
        // A technique without indirect light has no such layer.
        let black = vec![[0.0; 3]; image.pixel_count()];
        if let (own, Some(wanted)) = (product(image).unwrap_or(black), product(reference)) {
            values.measure_indirect(&LinearPair::new(&own, &wanted, Some(&mask)), image.width);
            let linear = [image.rgb("").unwrap(), reference.rgb("").unwrap()];
            let exposure = auto_exposure(&linear[1], Some(&mask));
            let display = [&linear[0], &linear[1]].map(|pixels| tone_map_all(pixels, exposure));
            values.measure_final(&DisplayPair {
                width: image.width,
                linear: [&linear[0], &linear[1]],
                display: [&display[0], &display[1]],
                mask: Some(&mask),
            });
        }
        let open = |image: &Image| -> Option<Vec<Rgb>> {
            Some(image.channels.get("ambient_occlusion.Y")?.iter().map(|&v| [v; 3]).collect())
        };
        if let (Some(own), Some(wanted)) = (open(image), open(reference)) {
            values.measure_occlusion(&LinearPair::new(&own, &wanted, Some(&mask)));
        }
    }
    values
}

fn scenes(path: &str) -> String {
    format!("scenes = [\"{path}\"]\n")
}

#[test]
fn plain_rows() {
    let folder = Folder::new("plain");
    let sweeps = "frames = 2\nseed = 7\n[[sweep]]\ntechnique = 'hierarchical'\ngrid = { samples = [4, 16] }\n\
                  [[sweep]]\ntechnique = 'none'\n";
    let rows = folder.rows(&(scenes(SCENE) + sweeps));
    assert_eq!(rows.len(), 3);
    assert!(rows[0].command.contains("--seed 7") && rows[0].command.contains("scene/cornell box.toml"));
}

#[test]
fn rows_on_path_traced_direct_light() {
    let folder = Folder::new("direct");
    let sweep =
        "direct = 'truth'\nbounces = 2\nframes = 1\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4 }\n";
    let rows = folder.rows(&(scenes(SCENE) + sweep));
    assert!(rows[0].command.contains("--direct truth"));
    // The option matters: without it the numbers are others.
    let reference = folder.image(
        &format!("evaluator truth --scene \"{SCENE}\" --size 24x16 --bounces 2 --samples-per-pixel 4 --out t.exr")
            .parse::<Invocation>()
            .unwrap()
            .to_string(),
    );
    let rendered = folder.image(&rows[0].command.replace(" --direct truth", ""));
    assert_ne!(errors(&rendered, &[reference]).get(MetricId::IndirectRmse), rows[0].errors.get(MetricId::IndirectRmse));
}

#[test]
fn rows_of_a_filter_over_frames() {
    let folder = Folder::new("frames");
    let sweep = "frames = 4\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4, temporal_a = 0.9 }\n";
    let rows = folder.rows(&(scenes(SCENE) + sweep));
    assert!(rows[0].command.contains("--frame 3"), "the last frame is shown: {}", rows[0].command);
}

#[test]
fn rows_of_a_moving_scene() {
    let folder = Folder::new("moving");
    let sweep = "frames = 3\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4 }\n\
                 grid = { temporal_a = [0.0, 0.9] }\n";
    let rows = folder.rows(&(scenes("motion.toml") + sweep));
    assert!(rows.iter().all(|row| row.command.contains("--pose 0")));
    folder.rows(&(scenes("motion.toml") + "direct = 'truth'\n" + sweep));
}

#[test]
fn rows_of_frames_and_motion() {
    let folder = Folder::new("motion");
    let filtered = "\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4, temporal_a = 0.9 }\n";
    let sweeps = format!(
        "frames = 2{filtered}at_frames = [1, 3]\nmoving = ['camera']{filtered}at_frames = [1]\nmoving = ['lights']\n\
         [[sweep]]\ntechnique = 'hierarchical'\nfixed = {{ samples = 4 }}\nmoving = ['camera']\n\
         [[sweep]]\ntechnique = 'radiance-cache'\nat_frames = [3]\n"
    );
    let rows = folder.rows(&(scenes("motion.toml") + &sweeps));
    let of: Vec<_> = rows.iter().map(|row| (row.moving.as_str(), row.at_frame, row.frames)).collect();
    // Frame 1 after the lights turned is timed once: what is before it would be run again for a second time.
    let lights = ("lights", Some(1), 1);
    assert_eq!(of, [("camera", Some(1), 2), ("camera", Some(3), 2), lights, ("camera", None, 2), ("", Some(3), 2)]);
    for (row, words) in rows.iter().zip(["--moving camera", "--frame 2 --moving camera", "--moving lights"]) {
        assert!(row.command.contains(words), "{}", row.command);
    }
    // Each of them is another image.
    let errors: Vec<_> = rows.iter().map(|row| row.errors.get(MetricId::IndirectRmse)).collect();
    assert!(errors.iter().enumerate().all(|(index, error)| !errors[..index].contains(error)), "{errors:?}");
}

#[test]
fn a_scene_does_not_move_twice() {
    let folder = Folder::new("twice");
    let refused = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_evaluator")).args(arguments).current_dir(&folder.0).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let said = refused(&["render", "--scene", "motion.toml", "--moving", "camera", "--out", "a.exr"]);
    assert!(said.contains("--moving camera moves a static scene") && said.contains("--pose FRAME"), "{said}");
    let far = ["render", "--scene", "cornell", "--moving", "camera", "--frame", "4294967295", "--out", "a.exr"];
    let said = refused(&far);
    assert!(said.contains("--frame 4294967295 is too far") && said.contains("give 0 to 255"), "{said}");
    let grid = "scenes = ['motion.toml']\nsize = ['8x8']\ndirect = 'truth'\n[[sweep]]\ntechnique = 'none'\nmoving = ['camera']\n";
    folder.write("grid.toml", grid);
    let said = refused(&["run", "--grid", "grid.toml", "--out", "out"]);
    assert!(said.contains("leave `moving` out"), "{said}");
}

#[test]
fn rows_of_ambient_visibility_alone() {
    let folder = Folder::new("occlusion");
    let sweep = "frames = 1\n[[sweep]]\ntechnique = 'gtao'\nfixed = { radius = 0.5 }\n\
                 [[sweep]]\ntechnique = 'ssao'\nfixed = { radius = 0.5 }\n";
    let rows = folder.rows(&(scenes(SCENE) + sweep));
    assert!(rows.iter().all(|row| row.errors.get(MetricId::OcclusionRmse).is_some()));
}

#[test]
fn a_preset_is_written_out() {
    let folder = Folder::new("preset");
    folder.write("fine.toml", "technique = 'bitmask'\n[settings]\nslices = 2\n");
    let first = folder.image(
        &format!("evaluator render --scene \"{SCENE}\" --preset fine.toml --size 24x16 --out a.exr")
            .parse::<Invocation>()
            .unwrap()
            .to_string(),
    );
    let command = &first.metadata["command"];
    assert!(command.contains("--technique bitmask --set bitmask.slices=2"), "{command}");
    // The preset may be gone or another by then.
    fs::remove_file(folder.0.join("fine.toml")).unwrap();
    assert_eq!(folder.image(command), first);
}

#[test]
fn a_reference_is_traced_again() {
    let folder = Folder::new("truth");
    let line = Invocation::evaluator("truth")
        .option("scene", "motion.toml")
        .size([24, 16])
        .option("bounces", 2)
        .option("samples-per-pixel", 3)
        .option("seed", 5)
        .option("frame", 20)
        .flag("on-screen", true)
        .option("ambient-occlusion", 0.5)
        .option("out", "truth.exr");
    let first = folder.image(&line.to_string());
    assert_eq!(first.metadata["command"], line.to_string());
    fs::remove_dir_all(folder.0.join("cache")).unwrap();
    assert_eq!(folder.image(&first.metadata["command"]), first, "without the cache, too");
}

#[test]
fn an_explanation_is_found_again() {
    let folder = Folder::new("explain");
    let line = Invocation::evaluator("explain")
        .option("scene", SCENE)
        .option("set", "samples=4")
        .size([16, 12])
        .option("frames", 8)
        .option("samples-per-pixel", 2)
        .option("direct", "truth")
        .option("seed", 3)
        .option("out", "page");
    let json = |line: &str| folder.shell(&format!("{line} --json"));
    let first = json(&line.to_string());
    let markdown = folder.read("page/explain.md");
    let command = markdown.lines().find_map(|line| line.strip_prefix("- Command: ")).unwrap();
    assert_eq!(json(command), first, "{command}");
}

#[test]
fn a_run_is_repeated() {
    let folder = Folder::new("run");
    folder.write("a grid.toml", &(scenes(SCENE) + "size = ['64x36']\nframes = 1\ntruth_samples = 2\n[[sweep]]\ntechnique = 'hierarchical'\nfixed = { samples = 4 }\n"));
    let line = Invocation::evaluator("run")
        .option("grid", "a grid.toml")
        .option("out", "out")
        .option("scene", "motion.toml")
        .size([24, 16])
        .option("direct", "truth");
    folder.shell(&line.to_string());
    let rows = || -> Vec<Values> {
        read_json(&folder.0.join("out/results.json")).unwrap().iter().map(|row| row.errors).collect()
    };
    let first = rows();
    let tables = folder.read("out/tables.md");
    let command = tables.lines().find_map(|line| line.strip_prefix("- Command: ")).unwrap();
    assert_eq!(command, line.to_string());
    fs::remove_dir_all(folder.0.join("out")).unwrap();
    folder.shell(command);
    assert_eq!(rows(), first);
}
