//! Scenes, environment maps and presets from files that were dropped onto the viewer.

use std::{io::Cursor, path::Path};

use halflight_scenes::{Environment, MemoryFiles, Scene, SceneError, load_scene};
use halflight_techniques::preset::Preset;

/// Largest unpacked size of all zips together, bytes. More does not fit into a browser's memory together with the loaded
/// scene.
const LARGEST_ZIP: u64 = 1 << 30;
/// Zips inside of zips are unpacked up to this depth.
const DEEPEST_ZIP: u32 = 3;

/// Extensions of environment maps.
const MAPS: [&str; 3] = ["hdr", "exr", "pic"];

/// A file by its name, with folders where it is known in which it was.
type File = (String, Vec<u8>);

/// What files that were dropped together contain.
#[derive(Debug, Default)]
pub struct Opened {
    /// The scene, with the environment map if there is one.
    pub scene: Option<Scene>,
    /// An environment map without a scene.
    pub environment: Option<Environment>,
    /// Presets by their names.
    pub presets: Vec<(String, Preset)>,
    /// What was not used, a sentence each.
    pub warnings: Vec<String>,
    /// Whether an environment map without a scene lights the scene of another source.
    pub is_lit: bool,
}

/// The contents of files that were dropped together: a model or a scene file with its materials and textures, an environment
/// map, presets, or zips of them.
///
/// # Errors
/// One sentence: which file is missing, or what is wrong in a file, with its line.
pub fn dropped(files: Vec<File>) -> Result<Opened, SceneError> {
    let (mut all, mut left) = (Vec::new(), LARGEST_ZIP);
    for (name, bytes) in files {
        unpack(name, bytes, 0, &mut left, &mut all)?;
    }
    let mut presets = Vec::new();
    let mut rest = Vec::new();
    for (name, bytes) in all {
        if extension(&name) == "toml" && is_preset(&bytes) {
            let text = String::from_utf8_lossy(&bytes);
            let preset = Preset::read(name.as_ref(), &text).map_err(|error| SceneError(error.to_string()))?;
            presets.push((bare(&name).to_owned(), preset));
        } else {
            rest.push((name, bytes));
        }
    }
    let of = |wanted: &[&str]| -> Vec<String> {
        let names = rest.iter().map(|(name, _)| name.as_str());
        names.filter(|name| wanted.contains(&extension(name).as_str())).map(str::to_owned).collect()
    };
    let (scene_files, models, maps) = (of(&["toml"]), of(&["obj", "gltf", "glb"]), of(&MAPS));
    let mut warnings = Vec::new();
    let path = match (scene_files.as_slice(), models.as_slice()) {
        ([one], _) | ([], [one]) => Some(one.clone()),
        ([], []) => None,
        ([], many) | (many, _) => {
            return Err(SceneError(format!("{} are several scenes: drop one of them", many.join(" and "))));
        }
    };
    // A scene file names its own map.
    let environment = match maps.as_slice() {
        _ if !scene_files.is_empty() => None,
        [one] => Some(map(one, &rest, &mut warnings)?),
        [] => None,
        many => {
            return Err(SceneError(format!("{} are several environment maps: drop one of them", many.join(" and "))));
        }
    };
    let Some(path) = path else {
        if environment.is_none() && presets.is_empty() {
            let names: Vec<&str> = rest.iter().map(|(name, _)| name.as_str()).take(5).collect();
            return Err(SceneError(format!(
                "the dropped files ({}) contain no model (.obj, .gltf, .glb) and no .toml scene file: drop the model \
                 together with its materials and textures, or a .zip of them",
                names.join(", ")
            )));
        }
        return Ok(Opened { environment, presets, warnings, ..Opened::default() });
    };
    // Dropped files have no folders, but materials refer to textures with folders, so files are also found by name alone.
    let flat: Vec<_> = rest.iter().map(|(name, bytes)| (bare(name).to_owned(), bytes.clone())).collect();
    let files = Dropped { flat: flat.into_iter().collect(), exact: rest.into_iter().collect() };
    let mut scene = load_scene(&files, Path::new(&path))?;
    if environment.is_some() {
        scene.environment = environment;
    }
    warnings.append(&mut scene.warnings);
    Ok(Opened { scene: Some(scene), presets, warnings, ..Opened::default() })
}

/// Whether a file may be an environment map, or a zip with one.
pub fn may_be_map(name: &str) -> bool {
    let extension = extension(name);
    extension == "zip" || MAPS.contains(&extension.as_str())
}

/// Whether a TOML file is a preset: it has a key `technique`.
pub fn is_preset(bytes: &[u8]) -> bool {
    String::from_utf8_lossy(bytes).lines().any(|line| line.trim_start().starts_with("technique"))
}

/// Reads an environment map, with the reader of scene files.
fn map(name: &str, files: &[File], warnings: &mut Vec<String>) -> Result<Environment, SceneError> {
    let bytes = files.iter().find(|(other, _)| other == name).map(|(_, bytes)| bytes.clone()).unwrap_or_default();
    let name = bare(name);
    // Debug writes the quotes and escapes of a basic string of TOML.
    let scene = format!("[[model]]\ngenerator = \"cornell\"\n[environment]\nmap = {name:?}\n");
    let files = MemoryFiles::from_iter([("map.toml".to_owned(), scene.into_bytes()), (name.to_owned(), bytes)]);
    let scene = load_scene(&files, Path::new("map.toml"))
        .map_err(|error| SceneError(format!("{name} cannot be used as an environment: {error}")))?;
    warnings.extend(scene.warnings);
    scene.environment.ok_or_else(|| SceneError(format!("{name} is no environment map: drop an .hdr or .exr file")))
}

/// Whether a file only describes others to the system that packed it.
fn is_clutter(name: &str) -> bool {
    let mut parts = name.split(['/', '\\']);
    let file = bare(name);
    parts.any(|part| part == "__MACOSX")
        || file.starts_with("._")
        || [".DS_Store", "Thumbs.db", "desktop.ini"].contains(&file)
}

/// Adds a file, or what is in it if it is a zip. `left`: bytes that may still be unpacked.
fn unpack(name: String, bytes: Vec<u8>, depth: u32, left: &mut u64, all: &mut Vec<File>) -> Result<(), SceneError> {
    if is_clutter(&name) {
        return Ok(());
    }
    if extension(&name) != "zip" {
        all.push((name, bytes));
        return Ok(());
    }
    if depth == DEEPEST_ZIP {
        return Err(SceneError(format!("{name}: more than {DEEPEST_ZIP} zips inside of each other; unpack it first")));
    }
    for (inner, bytes) in unzip(&name, &bytes, left)? {
        unpack(inner, bytes, depth + 1, left, all)?;
    }
    Ok(())
}

/// Finds a file by its path or else by its name without folders.
struct Dropped {
    exact: MemoryFiles,
    flat: MemoryFiles,
}

impl halflight_scenes::FileSource for Dropped {
    fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        self.exact.read(path).or_else(|_| self.flat.read(Path::new(bare(&path.to_string_lossy()))))
    }
}

fn bare(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn extension(name: &str) -> String {
    name.rsplit_once('.').map(|(_, extension)| extension.to_lowercase()).unwrap_or_default()
}

fn unzip(name: &str, bytes: &[u8], left: &mut u64) -> Result<Vec<File>, SceneError> {
    let broken =
        |error: &dyn std::fmt::Display| SceneError(format!("{name}: not a readable zip ({error}); create it again"));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
    let mut files = Vec::new();
    for index in 0..archive.len() {
        let file = archive.by_index(index).map_err(|e| broken(&e))?;
        if file.is_dir() {
            continue;
        }
        let path = file.name().map_err(|e| broken(&e))?.into_owned();
        let mut contents = Vec::new();
        // The size in the header may be wrong, so the bytes are counted while reading.
        std::io::Read::read_to_end(&mut std::io::Read::take(file, *left + 1), &mut contents).map_err(|e| broken(&e))?;
        *left = left.checked_sub(contents.len() as u64).ok_or_else(|| {
            SceneError(format!("{name}: unpacks to more than {} MiB; remove large textures", LARGEST_ZIP >> 20))
        })?;
        files.push((path, contents));
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const OBJ: &str = "mtllib m.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const MTL: &str = "newmtl red\nKd 0.5 0.1 0.1\n";

    fn files(list: &[(&str, &str)]) -> Vec<(String, Vec<u8>)> {
        list.iter().map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec())).collect()
    }

    fn zip(list: &[(&str, &[u8])]) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in list {
            writer.start_file(*name, zip::write::SimpleFileOptions::default()).expect("a new file");
            writer.write_all(bytes).expect("memory takes it");
        }
        writer.finish().expect("a complete zip").into_inner()
    }

    #[test]
    fn a_model_is_loaded_with_its_materials() {
        for dropped_files in [
            files(&[("model.obj", OBJ), ("m.mtl", MTL)]),
            vec![("a.zip".to_owned(), zip(&[("folder/model.obj", OBJ.as_bytes()), ("folder/m.mtl", MTL.as_bytes())]))],
            vec![(
                "a.zip".to_owned(),
                zip(&[("folder/model.obj", OBJ.as_bytes()), ("elsewhere/M.MTL", MTL.as_bytes())]),
            )],
        ] {
            let opened = dropped(dropped_files).expect("a valid scene");
            let scene = opened.scene.expect("a scene");
            assert_eq!(scene.materials[scene.meshes[0].material].albedo, [0.5, 0.1, 0.1]);
            assert_eq!(opened.warnings, Vec::<String>::new());
        }
    }

    #[test]
    fn clutter_in_zips_is_ignored_and_zips_inside_are_unpacked() {
        let inner = zip(&[("room/model.obj", OBJ.as_bytes()), ("room/m.mtl", MTL.as_bytes())]);
        let outer = zip(&[
            ("__MACOSX/room/._model.obj", b"\0\x05\x16\x07"),
            ("__MACOSX/._other.toml", b"technique"),
            (".DS_Store", b"Bud1"),
            ("more/room.zip", &inner),
        ]);
        let opened = dropped(vec![("a.zip".to_owned(), outer)]).expect("a valid scene");
        assert_eq!(opened.scene.expect("a scene").materials.len(), 1);
        let mut deep = zip(&[("model.obj", OBJ.as_bytes())]);
        for _ in 0..DEEPEST_ZIP {
            deep = zip(&[("inner.zip", &deep)]);
        }
        let error = dropped(vec![("deep.zip".to_owned(), deep)]).expect_err("too deep").to_string();
        assert!(error.contains("inner.zip") && error.contains("unpack it first"), "{error}");
    }

    #[test]
    fn presets_are_found_beside_a_scene_and_alone() {
        let preset = "technique = \"bitmask\"\n[settings]\nsteps = 20\n";
        let both = zip(&[("model.obj", OBJ.as_bytes()), ("m.mtl", MTL.as_bytes()), ("p.toml", preset.as_bytes())]);
        let opened = dropped(vec![("a.zip".to_owned(), both)]).expect("a scene and a preset");
        assert!(opened.scene.is_some());
        assert_eq!(opened.presets[0].0, "p.toml");
        assert_eq!(opened.presets[0].1.technique.name, "bitmask");
        let alone = dropped(files(&[("p.toml", preset)])).expect("a preset");
        assert!(alone.scene.is_none() && alone.presets.len() == 1);
        let wrong = dropped(files(&[("p.toml", "technique = \"bitmsk\"\n")])).expect_err("a wrong preset").to_string();
        assert!(wrong.contains("did you mean bitmask"), "{wrong}");
    }

    /// A binary glTF file of one triangle.
    fn glb() -> Vec<u8> {
        let mut json = br#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],
            "bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,
            "type":"VEC3","min":[0,0,0],"max":[1,1,0]}]}"#
            .to_vec();
        json.resize(json.len().next_multiple_of(4), b' ');
        let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
        let mut chunks = Vec::new();
        for (kind, bytes) in [(b"JSON", json), (b"BIN\0", corners)] {
            chunks.extend((bytes.len() as u32).to_le_bytes());
            chunks.extend(kind);
            chunks.extend(bytes);
        }
        let length = (12 + chunks.len() as u32).to_le_bytes();
        [b"glTF".to_vec(), 2u32.to_le_bytes().to_vec(), length.to_vec(), chunks].concat()
    }

    #[test]
    fn a_glb_is_a_scene_by_itself_and_in_a_zip() {
        for dropped_files in
            [vec![("a.glb".to_owned(), glb())], vec![("a.zip".to_owned(), zip(&[("folder/a.GLB", &glb())]))]]
        {
            let scene = dropped(dropped_files).expect("a valid scene").scene.expect("a scene");
            assert_eq!(scene.meshes.len(), 1);
        }
    }

    /// A Radiance image of 2 x 1 texels without run lengths: (1, 0.5, 0.25) and twice that.
    fn radiance() -> Vec<u8> {
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
        bytes.extend([128, 64, 32, 129, 128, 64, 32, 130]);
        bytes
    }

    #[test]
    fn an_environment_map_is_read_alone_and_beside_a_model() {
        let close =
            |found: [f32; 3]| found.iter().zip([1.0, 0.5, 0.25]).all(|(a, b): (&f32, f32)| (a - b).abs() < 0.02);
        let opened = dropped(vec![("my \"sky\".hdr".to_owned(), radiance())]).expect("a map");
        let environment = opened.environment.expect("a map");
        assert!(opened.scene.is_none() && environment.width == 2 && close(environment.texels[0]), "{environment:?}");
        let mut both = files(&[("model.obj", OBJ), ("m.mtl", MTL)]);
        both.push(("sky.hdr".to_owned(), radiance()));
        let scene = dropped(both).expect("a scene under a sky").scene.expect("a scene");
        assert!(scene.environment.is_some_and(|environment| close(environment.texels[0])));
        let error = dropped(files(&[("sky.exr", "no image")])).expect_err("no map").to_string();
        assert!(error.contains("sky.exr cannot be used as an environment") && error.contains("Radiance"), "{error}");
    }

    #[test]
    fn invalid_drops_are_reported_with_the_fix() {
        for (files, wanted) in [
            (
                files(&[("picture.png", "")]),
                "the dropped files (picture.png) contain no model (.obj, .gltf, .glb) and no .toml",
            ),
            (files(&[("a.obj", OBJ), ("b.obj", OBJ)]), "a.obj and b.obj are several scenes: drop one"),
            (files(&[("broken.obj", "v 0 0 0\nf 1 2 9\n")]), "broken.obj:2"),
            (files(&[("a.zip", "no zip")]), "a.zip: not a readable zip"),
        ] {
            let sentence = dropped(files).expect_err("an invalid drop").to_string();
            assert!(sentence.contains(wanted), "{sentence:?} does not contain {wanted:?}");
        }
    }
}
