//! Bad input ends with one sentence that names the file, line or key and the fix, and with exit code 2.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output},
};

use halflight_techniques::TECHNIQUES;

const TRIANGLE: &str = "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n";
const SCENE: &str = "name = \"triangle\"\n[[model]]\npath = \"triangle.obj\"\n[camera]\neye = [0.0, 0.0, 3.0]\n\
                     target = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nvertical_fov_degrees = 60.0\n";
const GRID: &str = "scenes = [\"good.toml\"]\nsize = [\"16x9\"]\nframes = 1\n[[sweep]]\ntechnique = \"none\"\n";

/// A folder of this test with a triangle, a scene and a grid that are all right.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("bad_input").join(test);
        drop(fs::remove_dir_all(&path));
        fs::create_dir_all(&path).unwrap();
        let folder = Self(path);
        folder.write("t.mtl", "newmtl m\nKd 1 1 1\n");
        folder.write("triangle.obj", TRIANGLE);
        folder.write("good.toml", SCENE);
        folder.write("grid.toml", GRID);
        folder
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_evaluator")).args(arguments).current_dir(&self.0).output().unwrap()
    }

    /// The sentence that the command ends with.
    fn error(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        // A driver may write lines of its own to the same stream.
        let errors: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("error: ")).collect();
        let own: Vec<&str> = errors.into_iter().filter(|line| !line.contains("XDG_RUNTIME_DIR")).collect();
        assert_eq!(own.len(), 1, "{arguments:?}: not one sentence: {text}");
        assert!(!text.contains("panicked"), "{text}");
        own[0].to_owned()
    }

    fn render_error(&self, arguments: &[&str]) -> String {
        self.error(&[&["render", "--size", "16x9", "--out", "o.png"], arguments].concat())
    }

    /// The error of a grid file that differs from a good one in this.
    fn grid_error(&self, from: &str, to: &str) -> String {
        assert!(GRID.contains(from));
        self.write("bad.toml", &GRID.replace(from, to));
        self.error(&["run", "--grid", "bad.toml", "--out", "report"])
    }
}

#[track_caller]
fn says(error: &str, parts: &[&str]) {
    for part in parts {
        assert!(error.contains(part), "\"{error}\" does not say \"{part}\"");
    }
}

#[test]
fn presets() {
    let folder = Folder::new("presets");
    folder.write("p.toml", "technique = 'hierarchical'\n[settings]\nsamples = 16\n");
    let output = folder.run(&["plan", "--scene", "good.toml", "--size", "16x9", "--preset", "p.toml", "--json"]);
    let plan = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && plan.contains("\"SAMPLES\",\n          16.0"), "{plan}");
    let scene = ["--scene", "good.toml"];
    let error = |rest: &[&str]| folder.render_error(&[&scene, rest].concat());
    assert!(error(&["--preset", "none.toml"]).contains("cannot read none.toml"));
    let clash = error(&["--preset", "p.toml", "--technique", "none"]);
    assert!(clash.contains("--technique none does not go with --preset, which is for hierarchical"), "{clash}");
    folder.write("p.toml", "technique = 'hierarchical'\n[settings]\nsampels = 16\n");
    assert!(error(&["--preset", "p.toml"]).starts_with("p.toml:3: unknown key `sampels`"));
}

#[test]
fn what_is_right_renders() {
    let folder = Folder::new("right");
    let output = folder.run(&["render", "--scene", "good.toml", "--size", "16x9", "--out", "o.png"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(folder.0.join("o.png").exists());
}

#[test]
fn a_filter_that_does_nothing_is_noted() {
    let folder = Folder::new("unfiltered");
    let plan = |settings: &[&str]| {
        let common = ["plan", "--scene", "good.toml", "--size", "16x9", "--technique", "bitmask"];
        let output = folder.run(&[&common, settings].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let note = "ambient visibility is not filtered over frames";
    says(&plan(&["--set", "finds=occlusion", "--set", "temporal_a=0.9"]), &[note, "raise slices or denoise"]);
    for settings in [["--set", "finds=occlusion"], ["--set", "temporal_a=0.9"]] {
        assert!(!plan(&settings).contains(note));
    }
}

#[test]
fn limits_of_browsers() {
    let folder = Folder::new("limits");
    let plan = |more: &[&str]| {
        let common = ["plan", "--scene", "good.toml", "--technique", "none", "--limits", "browser"];
        let output = folder.run(&[&common, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    says(&plan(&["--size", "16x9"]), &["The plan fits every browser", "4096 of 8192", "scene.vertices"]);
    let fix = "use at most 8192x8192 pixels";
    says(&plan(&["--size", "9000x9000"]), &["The plan does not fit every browser", fix]);
    says(&plan(&["--size", "9000x9000", "--json"]), &["\"too_large\": \"an image", fix, "\"texture_side\""]);
    says(&plan(&["--size", "16x9", "--json"]), &["\"too_large\": null"]);
    let silent = folder.run(&["plan", "--scene", "good.toml", "--size", "9000x9000"]);
    assert!(silent.status.success() && !String::from_utf8(silent.stdout).unwrap().contains("browser"));
}

#[test]
fn a_frame_far_ahead_comes_at_once() {
    let folder = Folder::new("far_ahead");
    let key = |frame, x| format!("{{ frame = {frame}, eye = [{x}.0, 0.0, 3.0], target = [0.0, 0.0, 0.0] }}");
    let keys = format!("[camera]\nmoves = [{}, {}]\n", key(0, 2), key(20, 0));
    let scene = SCENE.replace("[camera]\n", &keys);
    folder.write("moving.toml", &scene);
    let render = |frame: &str, technique: &str, settings: &[&str]| {
        let common = ["render", "--scene", "moving.toml", "--size", "16x9", "--out", "o.png", "--layer", "albedo"];
        let own = ["--exposure", "1", "--technique", technique, "--frame", frame];
        let output = folder.run(&[&common[..], &own, settings].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{text}");
        (fs::read(folder.0.join("o.png")).unwrap(), text)
    };
    // The camera stays where its path ends.
    let end = render("20", "none", &[]).0;
    assert_ne!(render("0", "none", &[]).0, end);
    assert_eq!(render("4294967295", "none", &[]).0, end);
    let (filtered, said) = render("4294967295", "hierarchical", &["--set", "temporal_a=0.9"]);
    assert_eq!(filtered, end);
    says(&said, &["the temporal filter has seen the 256 frames before frame 4294967295"]);
}

#[test]
fn missing_files() {
    let folder = Folder::new("missing");
    says(&folder.render_error(&["--scene", "gone.obj"]), &["gone.obj", "no such file", "check"]);
    says(&folder.render_error(&["--scene", "gone.toml"]), &["gone.toml", "no such file", "check"]);
    folder.write("lost.toml", &SCENE.replace("triangle.obj", "gone.obj"));
    says(&folder.render_error(&["--scene", "lost.toml"]), &["lost.toml:3", "model.path", "gone.obj"]);
    says(&folder.error(&["run", "--grid", "gone.toml", "--out", "report"]), &["gone.toml", "--grid"]);
    says(&folder.grid_error("good.toml", "gone.toml"), &["gone.toml"]);
    says(&folder.error(&["compare", "gone.png", "gone.exr"]), &["gone.png"]);
}

#[test]
fn a_missing_texture_gets_a_stand_in() {
    let folder = Folder::new("texture");
    folder.write("t.mtl", "newmtl m\nKd 1 1 1\nmap_Kd gone.png\n");
    let output = folder.run(&["render", "--scene", "good.toml", "--size", "16x9", "--out", "o.png"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    let warnings: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("warning: ")).collect();
    assert_eq!(warnings.len(), 1, "{text}");
    says(warnings[0], &["t.mtl", "`m`", "gone.png", "magenta checker"]);
}

#[test]
fn damaged_models() {
    let folder = Folder::new("models");
    folder.write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
    says(&folder.render_error(&["--scene", "nan.obj"]), &["nan.obj:3", "v 0 nan 0", "finite"]);
    folder.write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    says(&folder.render_error(&["--scene", "index.obj"]), &["index.obj:4"]);
}

#[test]
fn damaged_scene_files() {
    let folder = Folder::new("scenes");
    let error = |from, to| {
        folder.write("bad.toml", &SCENE.replace(from, to));
        folder.render_error(&["--scene", "bad.toml"])
    };
    says(&error("vertical_fov_degrees", "vertical_fov_degree"), &["bad.toml:8", "did you mean `vertical_fov_degrees`"]);
    says(&error("= 60.0", "= 260.0"), &["bad.toml:8", "vertical_fov_degrees", "260", "1 to 170"]);
    says(&error("name = \"triangle\"", "name ="), &["bad.toml:1", "TOML"]);
}

#[test]
fn techniques_and_settings() {
    let folder = Folder::new("settings");
    let error = |arguments: &[&str]| folder.render_error(&[&["--scene", "good.toml"], arguments].concat());
    says(&error(&["--technique", "hierarchcal"]), &["hierarchcal", "did you mean hierarchical"]);
    let all: Vec<&str> = TECHNIQUES.iter().map(|technique| technique.name).collect();
    says(&error(&["--technique", "zzz"]), &[&["zzz"], &all[..]].concat());
    says(&error(&["--set", "sampels=3"]), &["sampels", "did you mean hierarchical.samples"]);
    says(&error(&["--set", "samples=0"]), &["hierarchical.samples = 0", "1 to 1024"]);
    says(&error(&["--set", "samples=many"]), &["hierarchical.samples = many", "1 to 1024"]);
    says(&error(&["--set", "disc_area=txel"]), &["txel", "sample | texel"]);
    says(&error(&["--set", "samples"]), &["--set samples=VALUE"]);
    says(&error(&["--set", "levels=2", "--set", "only_level=3"]), &["only_level", "2 levels"]);
    says(&error(&["--adapter", "nosuch"]), &["nosuch", "choose one of"]);
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = Folder::new("outputs");
    // A file where a folder would have to be: no user, not even root, can write there.
    for out in ["good.toml/o.png", "good.toml/o.exr"] {
        let error = folder.error(&["render", "--scene", "good.toml", "--size", "16x9", "--out", out]);
        says(&error, &["good.toml", "write"]);
    }
    let error = folder.error(&["render", "--scene", "good.toml", "--size", "16x9", "--out", "o.jpg"]);
    says(&error, &["o.jpg", ".exr", ".png"]);
    says(&folder.error(&["run", "--grid", "grid.toml", "--out", "good.toml"]), &["good.toml", "write"]);
}

#[test]
fn damaged_grid_files() {
    let folder = Folder::new("grids");
    says(&folder.grid_error("frames", "framez"), &["bad.toml:3", "framez", "did you mean `frames`"]);
    says(&folder.grid_error("frames = 1", "frames = 0"), &["bad.toml:3", "frames", "1 to"]);
    says(&folder.grid_error("16x9", "16x"), &["bad.toml:2", "16x", "WIDTHxHEIGHT"]);
    says(&folder.grid_error("\"none\"", "\"non\""), &["bad.toml:5", "did you mean none"]);
    let sweep = "technique = \"hierarchical\"\n";
    let grid = |text: &str| folder.grid_error("technique = \"none\"\n", &format!("{sweep}{text}"));
    says(&grid("[sweep.grid]\nlevles = [1]\n"), &["bad.toml:7", "levles", "did you mean `levels`"]);
    says(&grid("[sweep.grid]\nlevels = [1, 9]\n"), &["bad.toml:7", "levels = 9", "1 to 8"]);
    says(&grid("[sweep.fixed]\nlevels = \"four\"\n"), &["bad.toml:7", "levels = four", "1 to 8"]);
    says(&folder.grid_error("[[sweep]]\ntechnique = \"none\"\n", ""), &["bad.toml", "sweep", "missing"]);
    says(&folder.grid_error("scenes = [\"good.toml\"]\n", ""), &["bad.toml", "scenes"]);
    says(
        &folder.error(&["run", "--grid", "grid.toml", "--out", "r", "--adapter", "nosuch"]),
        &["nosuch", "choose one of"],
    );
}
