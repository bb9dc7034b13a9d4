//! Readers: bytes in, [`Scene`] out, or one sentence that says what is wrong and how to mend it.
//!
//! What can be mended is mended and listed in [`Scene::warnings`]; what cannot is a [`SceneError`].

mod automatic;
mod environment;
mod files;
pub mod keys;
mod moves;
mod mtl;
mod obj;
mod scene_file;
mod textures;
mod write;
mod write_scene;

use std::path::Path;

pub use files::{DiskFiles, FileSource, MemoryFiles};
pub use keys::nearest_name;
pub use write::write_obj;
pub use write_scene::write_scene;

use crate::{Mesh, Scene, SceneError};

/// Loads a scene: a TOML scene file, or a bare OBJ file, which gets an automatic camera and sun.
///
/// Scene file: `name`, `[[model]]` (`path` of an OBJ file relative to the scene file, or
/// `generator`, one of [`crate::generators::NAMES`]; optionally `transform` with `translate`,
/// `rotate_degrees` about the fixed axes x, then y, then z, and `scale`), `[camera]` and
/// `[[light]]`; optionally `[[extra_camera]]`, with the keys of a camera that stands still: another view that
/// techniques on the screen may gather in. Without `[camera]` the camera is automatic; without `[[light]]`, in a scene
/// where nothing emits, there is an automatic sun. `[environment]` has a `radiance` that comes from every direction
/// or a `map`, a latitude-longitude EXR file; it replaces the automatic sun.
///
/// `moves` is a list of keyframes by ascending `frame`; numbers between two of them are interpolated
/// linearly. A model's have `translate`, `rotate_degrees` and `scale`, on top of its `transform` and about its
/// `pivot` (a world position; where `transform` put its origin unless told). A light's have `translate`,
/// which moves its position, and `rotate_degrees`, which turns its direction. A camera's have `eye`, `target` and
/// `cut`: the camera rests at the keyframe before and is here at once. `receive_only = true` makes a
/// model receive indirect light and send none.
///
/// # Errors
/// One sentence with file, line (where there is one) and the mend: a file that cannot be read, an
/// unknown key, a value of the wrong type or out of range, an OBJ file without faces, with a vertex
/// that is not finite or with an index out of range.
pub fn load_scene(files: &dyn FileSource, path: &Path) -> Result<Scene, SceneError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !matches!(extension.as_str(), "obj" | "toml") {
        return Err(SceneError(format!("{}: not a scene; give a .toml scene file or an .obj file", path.display())));
    }
    let bytes = files.read(path).map_err(|error| {
        SceneError(format!("{}: cannot be read ({}); check the path", path.display(), reason(&error)))
    })?;
    let mut reader = Reader::new(files, path);
    if extension == "toml" {
        scene_file::read(&mut reader, path, &bytes)?;
    } else {
        reader.scene.meshes = obj::read(&mut reader, path, &bytes)?;
        add_missing(&mut reader.scene, true, true);
    }
    Ok(reader.scene)
}

/// A scene while it is read.
struct Reader<'a> {
    files: &'a dyn FileSource,
    scene: Scene,
    textures: textures::Found,
}

impl<'a> Reader<'a> {
    fn new(files: &'a dyn FileSource, path: &Path) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self { files, scene: Scene { name, ..Scene::default() }, textures: textures::Found::default() }
    }

    fn warn(&mut self, warning: String) {
        self.scene.warnings.push(warning);
    }
}

/// Adds an automatic camera, and an automatic light unless something emits.
fn add_missing(scene: &mut Scene, camera: bool, light: bool) {
    let emits = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.emission != [0.0; 3]);
    let light = light && !scene.meshes.iter().any(emits);
    if camera || light {
        let shape = automatic::Shape::of(scene);
        if camera {
            scene.camera = shape.camera(scene);
        }
        if light {
            shape.add_light(scene);
        }
    }
}

/// What the operating system says, in its shortest form.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        _ => error.to_string(),
    }
}

/// Numbers, each clamped to the range; whether any of them had to be (a NaN becomes the low end).
fn clamp<const N: usize>(values: [f32; N], low: f32, high: f32) -> ([f32; N], bool) {
    let clamped = values.map(|x| if x > low { x.min(high) } else { low });
    (clamped, clamped != values)
}
