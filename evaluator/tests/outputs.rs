//! What the command does with files of the user and with outputs that cannot be written.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output, Stdio},
};

use halflight_metrics::MetricId;

const ROOM: &str = "mtllib room.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -1 -1 2\nv 1 -1 2\nvt 0 0\nusemtl wall\n\
                    f 1/1 2/1 3/1 4/1\nf 5/1 6/1 2/1 1/1\n";
const SCENE: &str = "name = \"room\"\n[[model]]\npath = \"room.obj\"\n[camera]\neye = [0.0, 0.0, 3.0]\n\
                     target = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nvertical_fov_degrees = 60.0\n\
                     [[light]]\nkind = \"point\"\nposition = [0.0, 0.5, 1.5]\nintensity = [1.0, 1.0, 1.0]\n\
                     [environment]\nmap = \"sky.exr\"\n";
const GRID: &str = "scenes = [\"room.toml\"]\nsize = [\"24x16\"]\nframes = 1\ntruth_samples = 4\ntruth_rel_error = 1.0\n\
                    [[sweep]]\ntechnique = \"hierarchical\"\ngrid = { samples = [4, 16] }\n";

/// A folder of one test with a scene and a grid.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("outputs").join(test);
        drop(fs::remove_dir_all(&path));
        fs::create_dir_all(&path).unwrap();
        let folder = Self(path);
        folder.write("room.mtl", "newmtl wall\nKd 0.7 0.7 0.7\nmap_Kd wall.png\n");
        folder.write("room.obj", ROOM);
        folder.write("room.toml", SCENE);
        folder.write("grid.toml", GRID);
        folder.texture([200, 180, 160]);
        folder.sky(0.1);
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.0.join(name).parent().unwrap()).unwrap();
        fs::write(self.0.join(name), text).unwrap();
    }

    fn texture(&self, colour: [u8; 3]) {
        halflight_native::images::write_png_srgb8(&self.0.join("wall.png"), 2, &[colour; 4]).unwrap();
    }

    fn sky(&self, radiance: f32) {
        let mut image = halflight_native::images::Image::new(2, 1);
        image.set_rgb("", &[[radiance; 3]; 2]);
        image.write_exr(&self.0.join("sky.exr"), halflight_native::images::Precision::Full).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_evaluator"));
        command.args(arguments.split_whitespace()).current_dir(&self.0).env("HALFLIGHT_CACHE", self.0.join("cache"));
        command
    }

    fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn succeed(&self, arguments: &str) {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// The sentence that a refused command ends with.
    fn refused(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        sentence(&output)
    }

    /// Root mean square error of each row of a report.
    fn errors(&self, report: &str) -> Vec<f64> {
        let rows = halflight_evaluator::measurement::read_json(&self.0.join(report).join("results.json")).unwrap();
        rows.iter().map(|row| row.errors.get(MetricId::IndirectRmse).unwrap()).collect()
    }
}

/// The one line that begins with `error: `; a driver may write such lines of its own.
fn sentence(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    let errors: Vec<_> =
        text.lines().filter(|line| line.starts_with("error: ") && !line.contains("XDG_RUNTIME_DIR")).collect();
    assert_eq!(errors.len(), 1, "{text}");
    errors[0].to_owned()
}

#[test]
fn files_of_the_user_in_a_report_folder_are_kept() {
    let folder = Folder::new("kept");
    folder.write("out/notes.txt", "mine");
    folder.write("out/images/photo.png", "mine");
    folder.write("out/plots/sketch.svg", "mine");
    for _ in 0..2 {
        folder.succeed("run --grid grid.toml --out out");
        for name in ["out/notes.txt", "out/images/photo.png", "out/plots/sketch.svg"] {
            assert_eq!(folder.read(name), "mine", "{name}");
        }
    }
}

#[test]
fn files_of_the_user_under_names_of_a_report_are_refused_before_anything_is_measured() {
    for name in ["index.html", "results.csv", "results.json", "tables.md", "run.json", "cells.jsonl"] {
        let folder = Folder::new("refused");
        folder.write(&format!("out/{name}"), "mine");
        let said = folder.refused("run --grid grid.toml --out out");
        assert!(said.contains(name) && said.contains("choose another folder"), "{said}");
        assert_eq!(folder.read(&format!("out/{name}")), "mine");
        assert!(!folder.0.join("cache").exists(), "nothing was traced");
    }
    let folder = Folder::new("refused_explain");
    folder.write("out/index.html", "mine");
    let said = folder.refused("explain --scene room.toml --size 8x8 --frames 1 --samples-per-pixel 1 --out out");
    assert!(said.contains("index.html"), "{said}");
    assert_eq!(folder.read("out/index.html"), "mine");
}

#[test]
fn a_shorter_grid_leaves_no_cell_of_a_longer_one() {
    let folder = Folder::new("shorter");
    folder.succeed("run --grid grid.toml --out out");
    let cells = || folder.read("out/cells.jsonl").lines().count();
    assert_eq!(cells(), 2);
    folder.write("grid.toml", &GRID.replace("[4, 16]", "[4]"));
    folder.succeed("run --grid grid.toml --out out");
    assert_eq!(cells(), 1);
    assert_eq!(folder.errors("out").len(), 1);
}

#[test]
fn files_of_the_scene_are_not_overwritten() {
    let folder = Folder::new("inputs");
    let (texture, sky) = (fs::read(folder.0.join("wall.png")).unwrap(), fs::read(folder.0.join("sky.exr")).unwrap());
    for arguments in [
        "render --scene room.toml --size 16x9 --out wall.png",
        "render --scene room.toml --size 16x9 --out ./sky.exr",
        "truth --scene room.toml --size 16x9 --samples-per-pixel 1 --out wall.png",
    ] {
        assert!(folder.refused(arguments).contains("is a file of the scene"), "{arguments}");
    }
    assert_eq!(fs::read(folder.0.join("wall.png")).unwrap(), texture);
    assert_eq!(fs::read(folder.0.join("sky.exr")).unwrap(), sky);
}

#[test]
fn resume_measures_a_changed_scene_again() {
    let folder = Folder::new("changed");
    folder.succeed("run --grid grid.toml --out out");
    let mut last = folder.errors("out");
    let changes: [(&str, &dyn Fn()); 5] = [
        ("room.mtl", &|| folder.write("room.mtl", "newmtl wall\nKd 0.2 0.3 0.4\nmap_Kd wall.png\n")),
        ("room.obj", &|| folder.write("room.obj", &ROOM.replace("v 1 1 0", "v 1 0.5 0"))),
        ("room.toml", &|| folder.write("room.toml", &SCENE.replace("[1.0, 1.0, 1.0]", "[2.0, 1.0, 1.0]"))),
        ("wall.png", &|| folder.texture([90, 200, 30])),
        ("sky.exr", &|| folder.sky(0.5)),
    ];
    for (file, change) in changes {
        change();
        folder.succeed("run --grid grid.toml --out out --resume");
        let resumed = folder.errors("out");
        folder.succeed("run --grid grid.toml --out fresh");
        assert_eq!(resumed, folder.errors("fresh"), "{file}");
        assert_ne!(resumed, last, "{file} changes no number: the test tests nothing");
        last = resumed;
    }
}

/// Commands that print to standard output.
const PRINTING: [&str; 8] = [
    "--help",
    "list parameters",
    "list techniques --json",
    "plan --scene room.toml --size 64x36",
    "plan --scene room.toml --size 64x36 --json",
    "compare wall.png wall.png",
    "compare wall.png wall.png --json",
    "render --scene room.toml --size 16x9 --out frame.png",
];

#[test]
fn a_closed_output_is_a_quiet_end() {
    let folder = Folder::new("closed");
    for arguments in PRINTING {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = folder.command(arguments).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{arguments}: {said}");
        assert!(!said.contains("panicked") && !said.contains("standard output"), "{arguments}: {said}");
    }
    assert!(folder.0.join("frame.png").exists(), "the image is written all the same");
}

#[test]
fn a_closed_error_output_does_not_stop_the_work() {
    let folder = Folder::new("closed_errors");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = folder.command("run --grid grid.toml --out out").stderr(writer).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(folder.errors("out").len(), 2);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_the_output_is_one_sentence() {
    let folder = Folder::new("full");
    for arguments in PRINTING {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = folder.command(arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert!(sentence(&output).contains("cannot write to standard output"), "{arguments}");
    }
}
