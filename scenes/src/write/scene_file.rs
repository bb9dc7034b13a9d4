//! The scene file (TOML), with OBJ files for meshes that were made in memory.

use std::fmt::Write;

use glam::DVec3;

use super::obj::write_obj_at;
use crate::{Camera, Keyframe, Light, Material, Mesh, Model, ModelSource, Motion, Scene, SceneError, Transform};

/// Writes a scene as files; returns their paths and bytes, the scene file `NAME.toml` first. `name` is a plain name
/// without folders.
///
/// The scene file holds everything that [`crate::load_scene`] reads. It refers to models, as the scene was loaded with
/// them: to a generator by name, to a file by its path, to the map of an environment by its path. Paths are relative to
/// the scene file, so it belongs into the folder of the file that the scene was loaded from. Meshes that were made in
/// memory ([`Mesh::model`] is `None`) are written as OBJ files with their materials and textures: one file for all
/// static meshes, one for each animated object, and one for those that only receive light.
///
/// Positions are written in the coordinates of the scene's files: relative to their origin and not to [`Scene::origin`].
///
/// A scene that refers to all its models reads back equal. Numbers of an OBJ file read back bit for bit, except texture
/// coordinates (see [`crate::write_obj`]). Meshes are grouped by model, so their order changes if models alternate.
///
/// # Errors
/// Those of [`crate::write_obj`], and an environment map that was made in memory: it has no file to refer to.
pub fn write_scene(scene: &Scene, name: &str) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let origin = DVec3::from(scene.origin);
    let mut toml = format!("name = {}\n", quoted(&scene.name));
    let mut files = Vec::new();
    let receives_only = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.receive_only);
    // The parts of a glTF model may move on their own; their motions are those of the file.
    let moves_itself = |mesh: &Mesh| {
        let is_gltf = match mesh.model.and_then(|model| scene.models.get(model)).map(|model| &model.source) {
            Some(ModelSource::File(path)) => !path.to_lowercase().ends_with(".obj"),
            _ => false,
        };
        is_gltf && scene.meshes.iter().any(|other| other.model == mesh.model && other.object != mesh.object)
    };
    // What a mesh shares with the other meshes of its model; in order of appearance.
    let key = |mesh: &Mesh| (mesh.model, mesh.object.filter(|_| !moves_itself(mesh)), receives_only(mesh));
    let mut models: Vec<(Option<usize>, Option<usize>, bool)> = Vec::new();
    for mesh in &scene.meshes {
        if !models.contains(&key(mesh)) {
            models.push(key(mesh));
        }
    }
    for model in models {
        let (source, object, receive_only) = model;
        // Writing to a String cannot fail: results are dropped here and below.
        toml += "\n[[model]]\n";
        if let Some(source) = source.and_then(|model| scene.models.get(model)) {
            write_model(&mut toml, source);
        } else {
            let file = if files.is_empty() { name.to_owned() } else { format!("{name}_{}", files.len()) };
            let (meshes, materials) = part(scene, |mesh| key(mesh) == model);
            files.push(write_obj_at(&meshes, &materials, &scene.textures, &file, scene.origin.into())?);
            let _ = writeln!(toml, "path = {}", quoted(&format!("{file}.obj")));
        }
        if receive_only {
            toml += "receive_only = true\n";
        }
        if let Some(motion) = object.and_then(|object| scene.moves.objects.get(object)) {
            let _ = writeln!(toml, "pivot = {}", absolute(motion.pivot, origin));
            write_keyframes(&mut toml, motion, &["translate", "rotate_degrees", "scale"]);
        }
    }
    write_environment(&mut toml, scene)?;
    toml += "\n[camera]\n";
    write_camera(&mut toml, &scene.camera, origin);
    if !scene.moves.camera.is_empty() {
        toml += "moves = [\n";
        for key in &scene.moves.camera {
            let cut = if key.cut { ", cut = true" } else { "" };
            let [eye, target] = [key.eye, key.target].map(|position| absolute(position, origin));
            let _ = writeln!(toml, "    {{ frame = {}, eye = {eye}, target = {target}{cut} }},", key.frame);
        }
        toml += "]\n";
    }
    for camera in &scene.extra_cameras {
        toml += "\n[[extra_camera]]\n";
        write_camera(&mut toml, camera, origin);
    }
    if scene.lights.is_empty() {
        // Without this line a reader would add a sun.
        toml = format!("light = []\n{toml}");
    }
    for (index, light) in scene.lights.iter().enumerate() {
        write_light(&mut toml, light, origin);
        if let Some((_, motion)) = scene.moves.lights.iter().find(|(animated, _)| *animated == index) {
            let keys: &[&str] = match light {
                Light::Directional { .. } => &["rotate_degrees"],
                Light::Point { .. } => &["translate"],
                Light::Spot { .. } => &["translate", "rotate_degrees"],
            };
            write_keyframes(&mut toml, motion, keys);
        }
    }
    let mut written = vec![(format!("{name}.toml"), toml.into_bytes())];
    for (path, bytes) in files.into_iter().flatten() {
        // Models share their textures.
        if !written.iter().any(|(known, _)| *known == path) {
            written.push((path, bytes));
        }
    }
    Ok(written)
}

/// The text as a TOML string.
fn quoted(text: &str) -> toml::Value {
    toml::Value::from(text)
}

fn write_model(toml: &mut String, model: &Model) {
    let _ = match &model.source {
        ModelSource::Generator(name) => writeln!(toml, "generator = {}", quoted(name)),
        ModelSource::File(path) => writeln!(toml, "path = {}", quoted(path)),
    };
    let (Transform { translate, rotate_degrees, scale }, rest) = (model.transform, Transform::default());
    let changed = [
        ("translate", translate, rest.translate),
        ("rotate_degrees", rotate_degrees, rest.rotate_degrees),
        ("scale", scale, rest.scale),
    ];
    let changed = changed.into_iter().filter(|(_, value, rest)| value != rest);
    let changed: Vec<_> = changed.map(|(key, value, _)| format!("{key} = {value:?}")).collect();
    if !changed.is_empty() {
        let _ = writeln!(toml, "transform = {{ {} }}", changed.join(", "));
    }
}

fn write_environment(toml: &mut String, scene: &Scene) -> Result<(), SceneError> {
    let Some(environment) = &scene.environment else { return Ok(()) };
    toml.push_str("\n[environment]\n");
    let _ = match (&environment.map, environment.texels.as_slice()) {
        (Some(path), _) => writeln!(toml, "map = {}", quoted(path)),
        (None, [radiance]) => writeln!(toml, "radiance = {radiance:?}"),
        (None, _) => {
            return Err(SceneError(
                "an environment map that was made in memory cannot be written; save it as an EXR file and name that file \
                 in `Environment::map`"
                    .into(),
            ));
        }
    };
    Ok(())
}

/// The selected meshes and the materials that they use.
fn part(scene: &Scene, selected: impl Fn(&Mesh) -> bool) -> (Vec<Mesh>, Vec<Material>) {
    let mut used: Vec<usize> = Vec::new();
    let mut meshes = Vec::new();
    for mesh in scene.meshes.iter().filter(|mesh| selected(mesh)) {
        let material = used.iter().position(|&m| m == mesh.material).unwrap_or_else(|| {
            used.push(mesh.material);
            used.len() - 1
        });
        meshes.push(Mesh { material, ..mesh.clone() });
    }
    (meshes, used.iter().filter_map(|&m| scene.materials.get(m).cloned()).collect())
}

fn write_keyframes(toml: &mut String, motion: &Motion, keys: &[&str]) {
    *toml += "moves = [\n";
    for Keyframe { frame, translate, rotate_degrees, scale } in &motion.keyframes {
        let _ = write!(toml, "    {{ frame = {frame}");
        for (key, value) in [("translate", translate), ("rotate_degrees", rotate_degrees), ("scale", scale)] {
            if keys.contains(&key) {
                let _ = write!(toml, ", {key} = {value:?}");
            }
        }
        *toml += " },\n";
    }
    *toml += "]\n";
}

fn write_camera(toml: &mut String, camera: &Camera, origin: DVec3) {
    let [eye, target] = [camera.eye, camera.target].map(|position| absolute(position, origin));
    let _ = writeln!(toml, "eye = {eye}\ntarget = {target}\nup = {:?}", camera.up);
    let _ = writeln!(toml, "vertical_fov_degrees = {:?}", camera.vertical_fov_degrees);
}

/// A position in the coordinates of the scene's files.
fn absolute(position: [f32; 3], origin: DVec3) -> String {
    if origin == DVec3::ZERO {
        return format!("{position:?}");
    }
    format!("{:?}", (DVec3::from(position.map(f64::from)) + origin).to_array())
}

fn write_light(toml: &mut String, light: &Light, origin: DVec3) {
    let _ = match *light {
        Light::Directional { direction, irradiance } => writeln!(
            toml,
            "\n[[light]]\nkind = \"directional\"\ndirection = {direction:?}\nirradiance = {irradiance:?}"
        ),
        Light::Point { position, intensity } => {
            writeln!(
                toml,
                "\n[[light]]\nkind = \"point\"\nposition = {}\nintensity = {intensity:?}",
                absolute(position, origin)
            )
        }
        Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
            writeln!(
                toml,
                "\n[[light]]\nkind = \"spot\"\nposition = {}\ndirection = {direction:?}\nintensity = {intensity:?}\n\
                 half_angle_degrees = {half_angle_degrees:?}\n\
                 full_intensity_half_angle_degrees = {full_intensity_half_angle_degrees:?}",
                absolute(position, origin)
            )
        }
    };
}
