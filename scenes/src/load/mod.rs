//! Readers: bytes in, a [`Scene`] out, or one sentence that says what is wrong and how to fix it.
//!
//! Small defects are fixed and listed in [`Scene::warnings`]; anything else is a [`SceneError`].

mod automatic;
mod environment;
mod faces;
mod files;
mod images;
mod keyframes;
pub mod keys;
mod mtl;
mod obj;
mod origin;
mod scene_file;
mod text;
mod textures;
mod triangulate;

use std::path::{Path, PathBuf};

pub use files::{DiskFiles, FileSource, MemoryFiles};
pub use keys::nearest_name;

use glam::DVec3;

use crate::{Mesh, ModelSource, Scene, SceneError, Transform};

/// Loads a scene: a TOML scene file, or a bare OBJ file, which gets an automatic camera, sun and sky.
///
/// | table | keys |
/// |---|---|
/// | the file | `name` |
/// | `[[model]]` | `path` of an OBJ file relative to the scene file, or `generator`, one of [`crate::generators::NAMES`]; optional: `transform` (`translate`, `rotate_degrees` about the fixed axes x, then y, then z, `scale`), `moves`, `pivot`, `receive_only` |
/// | `[camera]` | `eye`, `target`; optional: `up`, `vertical_fov_degrees`, `moves` |
/// | `[[extra_camera]]` | as `[camera]`, without `moves`: another view that screen-space techniques may gather in |
/// | `[[light]]` | `kind` (`directional`, `spot` or `point`) and what that kind has: `direction`, `irradiance`, `position`, `intensity`, `half_angle_degrees`, `full_intensity_half_angle_degrees`; optional: `moves` |
/// | `[environment]` | a constant `radiance`, or a `map`: a latitude-longitude file, OpenEXR or Radiance (`.hdr`, `.pic`), relative to the scene file |
///
/// Without `[camera]` the camera is chosen automatically. Without `[[light]]` and `[environment]`, a scene without
/// emitters gets an automatic sun and a soft sky. `receive_only = true` makes a model receive indirect light and send none.
///
/// `moves` is a list of keyframes by ascending `frame`; numbers between two keyframes are interpolated linearly. The
/// keyframes of a model have `translate`, `rotate_degrees` and `scale`. They apply after its `transform` and about its
/// `pivot`, a world position; the default is the model's origin after the transform. The keyframes of a light have
/// `translate` for its position and `rotate_degrees` for its direction. The keyframes of the camera have `eye`,
/// `target` and `cut`: the camera stays at the previous keyframe until this frame and jumps here.
///
/// # Errors
/// One sentence with the file, the line (if there is one) and the fix: a file that cannot be read, an unknown key, a
/// value of the wrong type or out of range, an OBJ file without faces, with a vertex that is not finite or with an
/// index out of range.
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
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        reader.scene.models = vec![crate::Model { source: ModelSource::File(file), transform: Transform::default() }];
        let Model { meshes, offset } = obj::read(&mut reader, path, &bytes)?;
        reader.scene.meshes = meshes;
        reader.scene.meshes.iter_mut().for_each(|mesh| mesh.model = Some(0));
        let meshes = 0..reader.scene.meshes.len();
        origin::place(&mut reader, &[origin::Placement { meshes, offset, motion: None }]);
        add_missing(&mut reader, true, true);
    }
    textures::warn(&mut reader);
    Ok(reader.scene)
}

/// A model that was read. Its positions are relative to `offset`.
struct Model {
    meshes: Vec<Mesh>,
    offset: DVec3,
}

/// A scene while it is being read.
struct Reader<'a> {
    files: &'a dyn FileSource,
    /// The file that was asked for.
    path: PathBuf,
    scene: Scene,
    found: textures::Found,
    /// A material has an image of emission that leaves nothing of it.
    lamps_off: bool,
}

impl<'a> Reader<'a> {
    fn new(files: &'a dyn FileSource, path: &Path) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let scene = Scene { name, ..Scene::default() };
        Self { files, path: path.to_owned(), scene, found: textures::Found::default(), lamps_off: false }
    }

    fn warn(&mut self, warning: String) {
        self.scene.warnings.push(warning);
    }
}

/// Adds an automatic camera if asked to, and an automatic light if asked to and nothing emits.
fn add_missing(reader: &mut Reader, camera: bool, light: bool) {
    let scene = &mut reader.scene;
    let emits = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.emission != [0.0; 3]);
    let emits = scene.meshes.iter().any(emits);
    if light && !emits && reader.lamps_off {
        let path = reader.path.display();
        scene.warnings.push(format!("{path}: the images of all emitters are black, so nothing is lit; add a light"));
    }
    let light = light && !emits && !reader.lamps_off;
    if camera || light {
        automatic::add(scene, camera, light);
    }
}

/// Why a file could not be read, in few words.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        _ => error.to_string(),
    }
}

/// The numbers clamped to the range, and whether any of them changed. NaN becomes the low end.
fn clamp<const N: usize>(values: [f32; N], low: f32, high: f32) -> ([f32; N], bool) {
    let clamped = values.map(|x| if x > low { x.min(high) } else { low });
    (clamped, clamped != values)
}
