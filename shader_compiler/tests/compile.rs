//! The compiler on small folders of shaders.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

use halflight_shader_compiler::{BindingKind, Error, Shader, Sources, Stage};

/// A folder of its own with these files. Two tests may choose one name: each call has another number.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    static FOLDERS: AtomicU32 = AtomicU32::new(0);
    let number = FOLDERS.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{number}_{name}"));
    let _ = fs::remove_dir_all(&folder);
    for (path, text) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

/// Compiles a file that is alone in its folder.
fn alone(name: &str, text: &str) -> Result<Shader, Error> {
    Sources::new(folder(name, &[("shader.wgsl", text)])).compile("shader")
}

const HALF: &str = "@group(0) @binding(1) var texture: texture_2d<f32>;
    fn half(x: f32) -> f32 { return 0.5 * x * f32(textureDimensions(texture).x); }
    fn unused(x: f32) -> f32 { return x; }";

const MAIN: &str = "// variants: twice, wide
    import package::common::half::half;
    struct Params { scale: f32, offset: vec2f, transform: mat4x4f }
    @group(0) @binding(0) var<uniform> params: Params;
    @group(0) @binding(2) var<storage, read_write> result: array<f32>;
    override COUNT: u32 = 7u;
    override ON: bool = true;
    override MUST: f32;
    @if(twice) const FACTOR: f32 = 2.0;
    @if(!twice) const FACTOR: f32 = 1.0;
    @compute @workgroup_size(8, 4)
    fn main() { if ON { result[COUNT] = FACTOR * half(params.scale) * params.offset.x * params.transform[0].x + MUST; } }";

fn sample(name: &str) -> Sources {
    Sources::new(folder(name, &[("a/main.wgsl", MAIN), ("common/half.wgsl", HALF)]))
}

#[test]
fn each_combination_of_features_is_a_shader() {
    let sources = sample("names");
    assert_eq!(
        sources.shader_names().unwrap(),
        ["a/main", "a/main+twice", "a/main+wide", "a/main+twice+wide"],
        "a module without an entry point is none"
    );
    assert_eq!(sources.features("a/main").unwrap(), ["twice", "wide"]);
    assert!(sources.features("common/half").unwrap().is_empty());
    assert_eq!(sources.watched().unwrap().len(), 5, "three folders and two files");
}

#[test]
fn a_shader_describes_itself() {
    let shader = sample("describes").compile("a/main+twice").unwrap();
    let files: Vec<_> = shader.files.iter().map(|file| file.file_name().unwrap().to_owned()).collect();
    assert_eq!(files, ["main.wgsl", "half.wgsl"]);
    assert!(shader.source.contains("FACTOR: f32 = 2") && !shader.source.contains("unused"), "{}", shader.source);
    let overrides: Vec<_> =
        shader.overrides.iter().map(|o| (o.name.as_str(), o.wgsl_type.as_str(), o.default)).collect();
    assert_eq!(overrides, [("COUNT", "u32", Some(7.0)), ("ON", "bool", Some(1.0)), ("MUST", "f32", None)]);
    let [entry] = shader.entry_points.as_slice() else { panic!("one entry point: {:?}", shader.entry_points) };
    assert_eq!((entry.name.as_str(), entry.stage, entry.workgroup_size), ("main", Stage::Compute, [8, 4, 1]));
    let mut bindings: Vec<_> = entry.bindings.iter().map(|b| (b.index, b.name.as_str())).collect();
    bindings.sort();
    assert_eq!(bindings, [(0, "params"), (1, "texture"), (2, "result")], "imported variables have one word");
    let uniform = entry.bindings.iter().find(|b| b.name == "params").unwrap();
    let BindingKind::Uniform { size, members } = &uniform.kind else { panic!("{uniform:?}") };
    let members: Vec<_> = members.iter().map(|m| (m.name.as_str(), m.offset, m.size, m.wgsl_type.as_str())).collect();
    assert_eq!(
        (*size, members.as_slice()),
        (80, [("scale", 0, 4, "f32"), ("offset", 8, 8, "vec2<f32>"), ("transform", 16, 64, "mat4x4<f32>")].as_slice())
    );
    let kind = |name: &str| &entry.bindings.iter().find(|b| b.name == name).unwrap().kind;
    assert_eq!(kind("result"), &BindingKind::Storage { writable: true });
    assert_eq!(kind("texture"), &BindingKind::Texture { arrayed: false });
}

#[test]
fn a_shader_says_which_members_of_a_uniform_block_it_reads() {
    let read = |name: &str, body: &str| {
        let text = format!(
            "struct View {{ eye: vec3f, frame: u32, seed: u32 }}
            @group(0) @binding(0) var<uniform> view: View;
            @group(0) @binding(1) var<storage, read_write> result: array<u32>;
            fn inner() -> u32 {{ return view.seed; }}
            fn outer(on: bool) -> u32 {{ if on {{ for (var i = 0u; i < 2u; i++) {{ result[i] = inner(); }} }} return 1u; }}
            fn whole(all: View) -> u32 {{ return all.frame; }}
            @compute @workgroup_size(1) fn main() {{ result[0] = {body}; }}"
        );
        let shader = alone(name, &text).unwrap();
        let bindings = &shader.entry_points[0].bindings;
        let kind = bindings.iter().find(|binding| binding.name == "view").map(|binding| &binding.kind);
        let Some(BindingKind::Uniform { members, .. }) = kind else { return Vec::new() };
        members.iter().filter(|member| member.read).map(|member| member.name.clone()).collect()
    };
    assert_eq!(read("member", "view.frame"), ["frame"]);
    assert_eq!(read("component", "u32(view.eye.y)"), ["eye"]);
    assert_eq!(read("calls", "outer(true)"), ["seed"]);
    assert_eq!(read("by_value", "whole(view)"), ["eye", "frame", "seed"], "the whole block is read");
    assert_eq!(read("nothing", "1u"), Vec::<String>::new());
}

#[test]
fn the_same_files_give_the_same_text() {
    let modules: Vec<(String, String)> =
        (0..8).map(|i| (format!("m{i}.wgsl"), format!("fn f{i}() -> f32 {{ return {i}.0; }}"))).collect();
    let imports: String = (0..8).map(|i| format!("import package::m{i}::f{i};\n")).collect();
    let calls: Vec<String> = (0..8).map(|i| format!("f{i}()")).collect();
    let calls = calls.join(" + ");
    let main = format!(
        "{imports}@group(0) @binding(0) var<storage, read_write> result: f32;
        @compute @workgroup_size(1) fn main() {{ result = {calls}; }}"
    );
    let files = modules.iter().map(|(name, text)| (name.as_str(), text.as_str())).chain([("main.wgsl", main.as_str())]);
    let sources = Sources::new(folder("order", &files.collect::<Vec<_>>()));
    let first = sources.compile("main").unwrap();
    assert_eq!(first.files.len(), 9);
    for _ in 0..8 {
        assert_eq!(sources.compile("main").unwrap(), first);
    }
}

#[test]
fn a_second_folder_provides_what_the_first_lacks() {
    let first = folder("overlay-first", &[("a/main.wgsl", MAIN)]);
    let second = folder(
        "overlay-second",
        &[("common/half.wgsl", HALF), ("a/main.wgsl", "@compute @workgroup_size(1) fn other() {}")],
    );
    assert!(Sources::new(&first).compile("a/main").is_err(), "the import is missing");
    let both = Sources::new(&first).or_from(&second);
    assert_eq!(both.compile("a/main").unwrap().entry_points[0].name, "main", "the first folder wins");
    assert_eq!(both.shader_names().unwrap().len(), 4, "shaders are those of the first folder");
}

#[test]
fn what_a_browser_refuses_is_an_error() {
    let storage_textures: String = (0..5)
        .map(|i| format!("@group(0) @binding({i}) var t{i}: texture_storage_2d<rgba8unorm, write>;\n"))
        .chain(["@compute @workgroup_size(1) fn main() {".to_owned()])
        .chain((0..5).map(|i| format!("textureStore(t{i}, vec2u(0u), vec4f(0.0));")))
        .chain(["}".to_owned()])
        .collect();
    let cases = [
        ("workgroup", "@compute @workgroup_size(32, 16) fn main() {}".to_owned(), "a browser guarantees 256"),
        ("textures", storage_textures, "main uses 5 storage textures; a browser guarantees 4"),
        (
            "format",
            "@group(0) @binding(0) var image: texture_storage_2d<bgra8unorm, write>;
            @compute @workgroup_size(1) fn main() { textureStore(image, vec2u(0u), vec4f(0.0)); }"
                .to_owned(),
            "which no browser guarantees",
        ),
        (
            "uniform",
            "@group(0) @binding(0) var<uniform> number: f32; @group(0) @binding(1) var<storage, read_write> b: f32;
            @compute @workgroup_size(1) fn main() { b = number; }"
                .to_owned(),
            "number: bind a struct as uniform",
        ),
        ("type", "@compute @workgroup_size(1) fn main() { let x: f32 = 1u; }".to_owned(), "x"),
        ("capability", "@compute @workgroup_size(1) fn main() { let x = 1.0lf; }".to_owned(), ""),
    ];
    for (name, text, expected) in cases {
        let error = alone(name, &text).expect_err(name).to_string();
        assert!(error.starts_with("shader: ") && error.contains(expected), "{name}: {error}");
    }
}

#[test]
fn mistakes_are_named() {
    let error = alone("import", "import package::missing::f; @compute @workgroup_size(1) fn main() { f(); }");
    let error = error.expect_err("the module is missing").to_string();
    assert!(error.contains("missing") && !error.contains('\u{1b}'), "{error:?}");
    let sources = Sources::new(folder("nothing", &[]));
    assert!(matches!(sources.shader_names(), Err(Error::Read { .. })), "the folder does not exist");
    assert!(matches!(sources.features("absent"), Err(Error::Read { .. })));
    assert!(sources.compile("absent").is_err());
}
