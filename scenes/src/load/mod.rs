//! Readers: bytes in, a [`Scene`] out, or one sentence that says what is wrong and how to fix it.
//!
//! Small defects are fixed and listed in [`Scene::warnings`]; anything else is a [`SceneError`].

mod automatic;
mod camera;
mod clean;
mod environment;
mod faces;
mod files;
mod gltf;
mod image_line;
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

use crate::{Light, Mesh, ModelSource, Motion, Scene, SceneError, Transform};

/// Loads a scene: a TOML scene file, or a bare model (OBJ, glTF 2.0 as `.gltf` or `.glb`), which gets an automatic camera,
/// sun and sky where it has none of its own.
///
/// | table | keys |
/// |---|---|
/// | the file | `name` |
/// | `[[model]]` | `path` of an OBJ or glTF file relative to the scene file, or `generator`, one of [`crate::generators::NAMES`]; optional: `transform` (`translate`, `rotate_degrees` about the fixed axes x, then y, then z, `scale`), `moves`, `pivot`, `receive_only` |
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
/// Positions are read as float64. A scene that is so far from the origin that float32 would lose its shape is kept
/// relative to [`Scene::origin`]; cameras and lights of the scene file are in the file's coordinates.
///
/// # Models
/// Of an OBJ file: polygons of any shape, `Kd`, `Ke`, `Ks`, `Ns`, `map_Kd`, `map_d`, `map_Ke`, and colours behind the
/// coordinates of vertices. Of a glTF file: nodes, triangles, materials, textures (PNG, JPEG, WebP), the first perspective
/// camera, `KHR_lights_punctual` (candela count as W/sr, lux as W/m2), and the first animation of nodes, 30 frames a
/// second, as moves of meshes, lights and the camera. Base colour, metalness and roughness become albedo, specular reflectance and Phong exponent: with
/// gloss = 1 - roughness, albedo = base colour x (1 - metalness x gloss), specular = (0.04 (1 - metalness) + base colour x
/// metalness) x gloss, and exponent = 2 / roughness^4 - 2.
///
/// A face has one colour and one emission: colours of vertices and images of emission are averaged over it. The camera
/// and lights of a model count where the scene file has none; `moves` of the scene file replace the model's animation.
/// What is not drawn is told in [`Scene::warnings`].
///
/// # Errors
/// One sentence with the file, the line (if there is one) and the fix: a file that cannot be read, an unknown key, a
/// value of the wrong type or out of range, a model without faces, with a vertex that is not finite, with an index out of
/// range, or with a compression or an extension that it needs and that is not read; a scene whose lengths are outside of
/// [`crate::LENGTHS`].
pub fn load_scene(files: &dyn FileSource, path: &Path) -> Result<Scene, SceneError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if extension != "toml" && !is_model(path) {
        return Err(SceneError(format!(
            "{}: not a scene; give a .toml scene file or an .obj, .gltf or .glb file",
            path.display()
        )));
    }
    let bytes = files.read(path).map_err(|error| {
        SceneError(format!("{}: cannot be read ({}); check the path", path.display(), reason(&error)))
    })?;
    let mut reader = Reader::new(files, path);
    if extension == "toml" {
        scene_file::read(&mut reader, path, &bytes)?;
    } else {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (mut model, _) = read_model(&mut reader, path, &bytes, &Transform::default())?;
        let placement = add_model(&mut reader, &mut model, ModelSource::File(file), Transform::default());
        origin::place(&mut reader, &[placement]);
        let origin = DVec3::from(reader.scene.origin);
        add_lights(&mut reader, &model, origin);
        add_missing(&mut reader, true, true);
        if let Some(view) = &model.camera {
            reader.scene.camera = view.relative_to(origin);
            reader.scene.moves.camera = view.moves(origin);
        }
    }
    textures::warn(&mut reader);
    reader.scene.check_lengths().map_err(|problem| SceneError(format!("{}: {problem}", path.display())))?;
    Ok(reader.scene)
}

/// Whether the name is that of a model.
fn is_model(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    matches!(extension.as_str(), "obj" | "gltf" | "glb")
}

/// Reads a model of any format. `transform` is already applied to it or returned, for a format that leaves it to the caller.
fn read_model<'a>(
    reader: &mut Reader,
    path: &Path,
    bytes: &[u8],
    transform: &'a Transform,
) -> Result<(Model, Option<&'a Transform>), SceneError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        Ok((obj::read(reader, path, bytes)?, Some(transform)))
    } else {
        Ok((gltf::read(reader, path, bytes, transform)?, None))
    }
}

/// Adds the meshes and motions of a model to the scene. Its positions are not yet relative to the scene's origin.
fn add_model(reader: &mut Reader, model: &mut Model, source: ModelSource, transform: Transform) -> origin::Placement {
    let scene = &mut reader.scene;
    let (first, first_object, number) = (scene.meshes.len(), scene.moves.objects.len(), scene.models.len());
    scene.meshes.extend(model.meshes.drain(..).map(|mesh| Mesh {
        model: Some(number),
        object: mesh.object.map(|object| first_object + object),
        ..mesh
    }));
    let mut motions = Vec::new();
    for (motion, pivot) in model.motions.drain(..) {
        motions.push((scene.moves.objects.len(), pivot));
        scene.moves.objects.push(Motion { pivot: pivot.as_vec3().to_array(), ..motion });
    }
    scene.models.push(crate::Model { source, transform });
    origin::Placement { meshes: first..scene.meshes.len(), offset: model.offset, motions }
}

/// Adds the lights of a model to the scene.
fn add_lights(reader: &mut Reader, model: &Model, origin: DVec3) {
    for PlacedLight { light, place, motion } in &model.lights {
        let mut light = *light;
        match &mut light {
            Light::Directional { .. } => {}
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                *position = (*place - origin).as_vec3().to_array();
            }
        }
        let number = reader.scene.lights.len();
        reader.scene.moves.lights.extend(motion.clone().map(|motion| (number, motion)));
        reader.scene.lights.push(light);
    }
}

/// A model that was read. Its positions are relative to `offset`.
#[derive(Default)]
struct Model {
    meshes: Vec<Mesh>,
    offset: DVec3,
    /// Motions of its parts, to which [`Mesh::object`] refers, and the world positions of their pivots.
    motions: Vec<(Motion, DVec3)>,
    /// Its camera.
    camera: Option<camera::View>,
    lights: Vec<PlacedLight>,
}

/// A light of a model. Its position is relative to `place`.
struct PlacedLight {
    light: Light,
    place: DVec3,
    motion: Option<Motion>,
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
    if light && !emits && reader.lamps_off && scene.lights.is_empty() {
        let path = reader.path.display();
        scene.warnings.push(format!("{path}: the images of all emitters are black, so nothing is lit; add a light"));
    }
    let light = light && !emits && !reader.lamps_off && scene.lights.is_empty();
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
