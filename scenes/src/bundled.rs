//! The bundled scenes: their files are part of the program, so that a name is enough from any folder.

use std::path::Path;

use crate::{MemoryFiles, Scene, SceneError, load_scene};

/// Scene files by the name of their scene.
macro_rules! scene_files {
    ($($name:literal),* $(,)?) => {
        /// The names of all bundled scenes. Each has a scene file `scenes/NAME.toml`.
        pub const NAMES: &[&str] = &[$($name),*];

        const FILES: &[(&str, &[u8])] =
            &[$((concat!($name, ".toml"), include_bytes!(concat!("../", $name, ".toml")))),*];
    };
}

scene_files![
    "atrium",
    "bars",
    "bars_sky",
    "cameras",
    "cornell",
    "cornell_directions",
    "cornell_sky",
    "furnace",
    "lights",
    "motion",
    "room",
    "room_sun",
    "statue",
    "statue_floor",
    "translucent",
];

/// Maps that the scene files name.
const MAPS: &[(&str, &[u8])] = &[
    ("directions.exr", include_bytes!("../directions.exr")),
    ("room_sky.exr", include_bytes!("../room_sky.exr")),
    ("sky.exr", include_bytes!("../sky.exr")),
];

/// The files of all bundled scenes.
pub fn files() -> MemoryFiles {
    FILES.iter().chain(MAPS).copied().collect()
}

/// The bundled scene of this name.
///
/// # Errors
/// If there is no scene of that name; the sentence suggests the nearest one.
pub fn scene(name: &str) -> Result<Scene, SceneError> {
    if !NAMES.contains(&name) {
        let hint = crate::nearest_name(name, NAMES.iter().copied())
            .map_or(String::new(), |near| format!("did you mean {near}? "));
        return Err(SceneError(format!(
            "no bundled scene is called \"{name}\": {hint}choose one of {}",
            NAMES.join(", ")
        )));
    }
    load_scene(&files(), Path::new(&format!("{name}.toml")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_file_of_the_folder_is_bundled() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found: Vec<String> = std::fs::read_dir(folder)
            .expect("the crate's folder")
            .flatten()
            .filter_map(|entry| entry.file_name().to_str()?.strip_suffix(".toml").map(str::to_owned))
            .filter(|name| !["Cargo", "clippy"].contains(&name.as_str()))
            .collect();
        found.sort();
        assert_eq!(found, NAMES);
    }

    #[test]
    fn every_bundled_scene_loads_without_a_warning() {
        for name in NAMES {
            let scene = scene(name).expect(name);
            assert_eq!(scene.warnings, Vec::<String>::new(), "{name}");
        }
        let sentence = scene("atrum").expect_err("no such scene").to_string();
        assert!(sentence.contains("did you mean atrium?"), "{sentence}");
    }
}
