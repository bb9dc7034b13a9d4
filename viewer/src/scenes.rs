//! Bundled scenes, and scenes from files that were dropped onto the viewer.

use std::{io::Cursor, path::Path};

use halflight_scenes::{MemoryFiles, Scene, SceneError, load_scene};

/// Largest unpacked size of a zip, bytes. More does not fit into a browser's memory together with the loaded scene.
const LARGEST_ZIP: u64 = 1 << 30;

/// A scene from files that were dropped together: one model or scene `.toml`, with its materials and textures, or a
/// `.zip` of them.
///
/// # Errors
/// One sentence: which file is missing, or what is wrong in a file, with its line.
pub fn dropped(files: Vec<(String, Vec<u8>)>) -> Result<Scene, SceneError> {
    let mut all = Vec::new();
    for (name, bytes) in files {
        if extension(&name) == "zip" {
            all.extend(unzip(&name, &bytes)?);
        } else {
            all.push((name, bytes));
        }
    }
    let of = |wanted: &[&str]| {
        all.iter().map(|(name, _)| name.as_str()).filter(|name| wanted.contains(&extension(name).as_str())).collect()
    };
    let (scene_files, models): (Vec<&str>, Vec<&str>) = (of(&["toml"]), of(&["obj", "gltf", "glb"]));
    let path = match (scene_files.as_slice(), models.as_slice()) {
        ([one], _) | ([], [one]) => (*one).to_owned(),
        ([], []) => {
            let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).take(5).collect();
            return Err(SceneError(format!(
                "the dropped files ({}) contain no model (.obj, .gltf, .glb) and no .toml scene file: drop the model \
                 together with its materials and textures, or a .zip of them",
                names.join(", ")
            )));
        }
        ([], many) | (many, _) => {
            return Err(SceneError(format!("{} are several scenes: drop one of them", many.join(" and "))));
        }
    };
    // Dropped files have no folders, but materials refer to textures with folders, so files are also found by name alone.
    let flat: Vec<_> = all.iter().map(|(name, bytes)| (bare(name).to_owned(), bytes.clone())).collect();
    load_scene(&Dropped { flat: flat.into_iter().collect(), exact: all.into_iter().collect() }, Path::new(&path))
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

fn unzip(name: &str, bytes: &[u8]) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let broken =
        |error: &dyn std::fmt::Display| SceneError(format!("{name}: not a readable zip ({error}); create it again"));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
    let mut files = Vec::new();
    let mut left = LARGEST_ZIP;
    for index in 0..archive.len() {
        let file = archive.by_index(index).map_err(|e| broken(&e))?;
        if file.is_dir() {
            continue;
        }
        let path = file.name().map_err(|e| broken(&e))?.into_owned();
        let mut contents = Vec::new();
        // The size in the header may be wrong, so the bytes are counted while reading.
        std::io::Read::read_to_end(&mut std::io::Read::take(file, left + 1), &mut contents).map_err(|e| broken(&e))?;
        left = left.checked_sub(contents.len() as u64).ok_or_else(|| {
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

    fn zip(list: &[(&str, &str)]) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in list {
            writer.start_file(*name, zip::write::SimpleFileOptions::default()).expect("a new file");
            writer.write_all(text.as_bytes()).expect("memory takes it");
        }
        writer.finish().expect("a complete zip").into_inner()
    }

    #[test]
    fn a_model_is_loaded_with_its_materials() {
        for dropped_files in [
            files(&[("model.obj", OBJ), ("m.mtl", MTL)]),
            vec![("a.zip".to_owned(), zip(&[("folder/model.obj", OBJ), ("folder/m.mtl", MTL)]))],
            vec![("a.zip".to_owned(), zip(&[("folder/model.obj", OBJ), ("elsewhere/M.MTL", MTL)]))],
        ] {
            let scene = dropped(dropped_files).expect("a valid scene");
            assert_eq!(scene.materials[scene.meshes[0].material].albedo, [0.5, 0.1, 0.1]);
            assert_eq!(scene.warnings, Vec::<String>::new());
        }
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
