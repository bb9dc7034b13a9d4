//! A scene that is saved and opened again is the same scene.

use std::{io, path::Path};

use halflight_scenes::{
    DiskFiles, Environment, FileSource, MemoryFiles, Mesh, Model, ModelSource, Moves, Scene, Transform, load_scene,
    write_scene,
};

use crate::{assert_says, corners, keyframes::animated, load};

/// Saved files on top of a folder on disk.
struct SavedInto<'a>(MemoryFiles, &'a Path);

impl FileSource for SavedInto<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.0.read(path).or_else(|_| DiskFiles.read(&self.1.join(path)))
    }
}

/// The scene after saving it into the folder that it was loaded from, and the text of its scene file.
#[track_caller]
fn saved(scene: &Scene, folder: &Path) -> (Scene, String) {
    let files = write_scene(scene, "saved").expect("a scene that can be saved");
    let paths: Vec<_> = files.iter().map(|(path, _)| path.as_str()).collect();
    assert_eq!(paths, ["saved.toml"], "every model is referred to");
    let text = String::from_utf8(files[0].1.clone()).expect("TOML is UTF-8");
    let files = SavedInto(files.into_iter().collect(), folder);
    (load_scene(&files, Path::new("saved.toml")).expect("a saved scene can be loaded"), text)
}

/// Every scene file of this crate is bundled with the program.
fn bundled() -> Vec<(String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let entries = folder.read_dir().expect("the crate's folder").flatten().map(|entry| entry.path());
    let is_scene = |path: &std::path::PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.ends_with(".toml") && !["Cargo.toml", "clippy.toml"].contains(&name.as_str())
    };
    let load = |path: std::path::PathBuf| {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        (name, load_scene(&DiskFiles, &path).expect("a bundled scene"))
    };
    entries.filter(is_scene).map(load).collect()
}

#[test]
fn bundled_scenes_are_equal_after_saving() {
    let scenes = bundled();
    let names: Vec<_> = scenes.iter().map(|(name, _)| name.as_str()).collect();
    for name in ["atrium", "bars", "bars_sky", "cornell", "cornell_sky", "furnace", "motion", "statue"] {
        assert!(names.contains(&name), "{name} is missing in {names:?}");
    }
    for (name, scene) in &scenes {
        let (read, text) = saved(scene, Path::new(env!("CARGO_MANIFEST_DIR")));
        assert!(read == *scene, "{name} is not equal after saving it as\n{text}");
    }
    let (_, motion) = scenes.iter().find(|(name, _)| name == "motion").expect("it was found above");
    let (_, text) = saved(motion, Path::new(""));
    assert_says(&text, &["generator = \"motion\"", "generator = \"cornell\"", "translate = [-0.6, 0.75, 0.45]"]);
}

#[test]
fn models_in_files_are_referred_to_by_path() {
    let obj = crate::TRIANGLE.as_bytes();
    let sky = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("sky.exr")).expect("a bundled map");
    let toml = "name = 'two'\n[[model]]\npath = 'deep er/\"a\".obj'\n[[model]]\npath = 'm.obj'\n\
                transform = { rotate_degrees = [0.1, 20, 30], scale = -2 }\nmoves = [{ frame = 4, scale = [1, 2, 3] }]\n\
                receive_only = true\n[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n[environment]\nmap = 'sky.exr'\n";
    let files: [(&str, &[u8]); 4] =
        [("s.toml", toml.as_bytes()), ("m.obj", obj), ("deep er/\"a\".obj", obj), ("sky.exr", &sky)];
    let scene = load(&files, "s.toml");
    assert_eq!(scene.models[0].source, ModelSource::File("deep er/\"a\".obj".into()));
    let written = write_scene(&scene, "saved").expect("a scene that can be saved");
    assert_eq!(written.len(), 1, "every model is referred to");
    let all = files.iter().map(|(path, bytes)| ((*path).to_owned(), bytes.to_vec())).chain(written);
    let read = load_scene(&MemoryFiles::from_iter(all), Path::new("saved.toml")).expect("it can be loaded");
    assert!(read == scene);

    // A bare OBJ file: its automatic camera and sun are written down.
    let scene = load(&[("m.obj", obj)], "m.obj");
    let unscaled = Model { source: ModelSource::File("m.obj".into()), transform: Transform::default() };
    assert_eq!(scene.models, [unscaled]);
    let written = write_scene(&scene, "saved").expect("a scene that can be saved");
    let all: MemoryFiles = written.into_iter().chain([("m.obj".to_owned(), obj.to_vec())]).collect();
    assert!(load_scene(&all, Path::new("saved.toml")).expect("it can be loaded") == scene);
}

#[test]
fn edited_scenes_keep_everything_that_a_scene_file_holds() {
    let scene = animated();
    let files = write_scene(&scene, "saved").expect("a scene that can be saved");
    let all: MemoryFiles = files.into_iter().chain([("m.obj".to_owned(), crate::TRIANGLE.into())]).collect();
    assert!(load_scene(&all, Path::new("saved.toml")).expect("it can be loaded") == scene);
    // A scene without any light stays dark.
    let moves = Moves { lights: vec![], ..scene.moves.clone() };
    let dark = Scene { lights: vec![], moves, ..scene };
    let files = write_scene(&dark, "saved").expect("a scene that can be saved");
    let all: MemoryFiles = files.into_iter().chain([("m.obj".to_owned(), crate::TRIANGLE.into())]).collect();
    assert!(load_scene(&all, Path::new("saved.toml")).expect("it can be loaded") == dark);
}

#[test]
fn meshes_made_in_memory_become_obj_files() {
    let mut scene = animated();
    scene.meshes.iter_mut().for_each(|mesh| mesh.model = None);
    scene.name = "a \"b\" é".into();
    let files = write_scene(&scene, "out").expect("a scene that can be saved");
    let paths: Vec<_> = files.iter().map(|(path, _)| path.as_str()).collect();
    assert_eq!(paths[..3], ["out.toml", "out.obj", "out.mtl"]);
    let read =
        load_scene(&files.into_iter().collect::<MemoryFiles>(), Path::new("out.toml")).expect("it can be loaded");
    let positions = |scene: &Scene| corners(scene).into_iter().map(|(_, corner)| corner.0).collect::<Vec<_>>();
    assert_eq!(positions(&read), positions(&scene));
    let of = |scene: &Scene| {
        let mesh = |mesh: &Mesh| (mesh.object, scene.materials[mesh.material].clone());
        scene.meshes.iter().map(mesh).collect::<Vec<_>>()
    };
    assert_eq!(of(&read), of(&scene));
    // Everything else is equal.
    let rest = |scene: Scene| Scene { meshes: vec![], materials: vec![], models: vec![], ..scene };
    assert_eq!(rest(read), rest(scene));
}

#[test]
fn a_posed_scene_no_longer_refers_to_its_animated_models() {
    let posed = animated().posed(30);
    assert_eq!(posed.meshes.iter().map(|mesh| mesh.model).collect::<Vec<_>>(), [Some(0), None, None]);
}

#[test]
fn an_environment_map_made_in_memory_is_refused() {
    let map = Environment { map: None, width: 2, height: 1, texels: vec![[1.0; 3]; 2] };
    let scene = Scene { environment: Some(map), ..animated() };
    let error = write_scene(&scene, "out").expect_err("a map without a file");
    assert_says(&error.to_string(), &["environment map", "`Environment::map`"]);
}
