//! A whole scene as files: a scene file (TOML) and an OBJ for each of its models.

use std::fmt::Write;

use super::write_obj;
use crate::{Camera, Keyframe, Light, Material, Mesh, Motion, Scene, SceneError};

/// Writes a scene as `NAME.toml` and one OBJ file, with its materials and textures, for the still meshes,
/// for every moving object and for what receives light only; returns paths and bytes. `name` is a plain name
/// without folders.
///
/// Numbers read back bit for bit, but for texture coordinates (see [`write_obj`]). Meshes come out in another order
/// where still and moving ones alternate.
///
/// # Errors
/// As [`write_obj`]; a scene whose environment is a map: its file is not kept.
pub fn write_scene(scene: &Scene, name: &str) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let environment = match &scene.environment {
        Some(environment) if environment.map.is_some() => {
            return Err(SceneError(
                "a map of the environment cannot be written; copy its file beside the scene".into(),
            ));
        }
        other => other.as_ref().and_then(|environment| environment.texels.first()),
    };
    let mut toml = format!("name = {}\n", toml::Value::from(scene.name.as_str()));
    let mut files = Vec::new();
    let receives_only = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.receive_only);
    // What of a mesh a model decides; in order of appearance.
    let mut models: Vec<(Option<usize>, bool)> = Vec::new();
    for mesh in &scene.meshes {
        let model = (mesh.object, receives_only(mesh));
        if !models.contains(&model) {
            models.push(model);
        }
    }
    for (index, &(object, receive_only)) in models.iter().enumerate() {
        let (meshes, materials) = part(scene, |mesh| (mesh.object, receives_only(mesh)) == (object, receive_only));
        let file = if index == 0 { name.to_owned() } else { format!("{name}_{index}") };
        for (path, bytes) in write_obj(&meshes, &materials, &scene.textures, &file)? {
            if !files.iter().any(|(known, _)| *known == path) {
                files.push((path, bytes));
            }
        }
        // Writing to a String cannot fail: results are dropped.
        let _ = writeln!(toml, "\n[[model]]\npath = \"{file}.obj\"");
        if receive_only {
            toml += "receive_only = true\n";
        }
        if let Some(motion) = object.and_then(|object| scene.moves.objects.get(object)) {
            let _ = writeln!(toml, "pivot = {:?}", motion.pivot);
            write_moves(&mut toml, motion, true, true, true);
        }
    }
    if let Some(radiance) = environment {
        let _ = writeln!(toml, "\n[environment]\nradiance = {radiance:?}");
    }
    toml += "\n[camera]\n";
    write_camera(&mut toml, &scene.camera);
    if !scene.moves.camera.is_empty() {
        toml += "moves = [\n";
        for key in &scene.moves.camera {
            let cut = if key.cut { ", cut = true" } else { "" };
            let _ =
                writeln!(toml, "    {{ frame = {}, eye = {:?}, target = {:?}{cut} }},", key.frame, key.eye, key.target);
        }
        toml += "]\n";
    }
    for camera in &scene.extra_cameras {
        toml += "\n[[extra_camera]]\n";
        write_camera(&mut toml, camera);
    }
    if scene.lights.is_empty() {
        // Without this line a reader would add a sun.
        toml = format!("light = []\n{toml}");
    }
    for (index, light) in scene.lights.iter().enumerate() {
        write_light(&mut toml, light);
        if let Some((_, motion)) = scene.moves.lights.iter().find(|(moving, _)| *moving == index) {
            let (places, turns) = (!matches!(light, Light::Directional { .. }), !matches!(light, Light::Point { .. }));
            write_moves(&mut toml, motion, places, turns, false);
        }
    }
    files.insert(0, (format!("{name}.toml"), toml.into_bytes()));
    Ok(files)
}

/// The wanted meshes and the materials that they use.
fn part(scene: &Scene, wanted: impl Fn(&Mesh) -> bool) -> (Vec<Mesh>, Vec<Material>) {
    let mut used: Vec<usize> = Vec::new();
    let mut meshes = Vec::new();
    for mesh in scene.meshes.iter().filter(|mesh| wanted(mesh)) {
        let material = used.iter().position(|&m| m == mesh.material).unwrap_or_else(|| {
            used.push(mesh.material);
            used.len() - 1
        });
        meshes.push(Mesh { material, ..mesh.clone() });
    }
    (meshes, used.iter().filter_map(|&m| scene.materials.get(m).cloned()).collect())
}

fn write_moves(toml: &mut String, motion: &Motion, places: bool, turns: bool, scales: bool) {
    *toml += "moves = [\n";
    for Keyframe { frame, translate, rotate_degrees, scale } in &motion.keyframes {
        let _ = write!(toml, "    {{ frame = {frame}");
        for (wanted, key, value) in
            [(places, "translate", translate), (turns, "rotate_degrees", rotate_degrees), (scales, "scale", scale)]
        {
            if wanted {
                let _ = write!(toml, ", {key} = {value:?}");
            }
        }
        *toml += " },\n";
    }
    *toml += "]\n";
}

fn write_camera(toml: &mut String, camera: &Camera) {
    let _ = writeln!(toml, "eye = {:?}\ntarget = {:?}\nup = {:?}", camera.eye, camera.target, camera.up);
    let _ = writeln!(toml, "vertical_fov_degrees = {:?}", camera.vertical_fov_degrees);
}

fn write_light(toml: &mut String, light: &Light) {
    let _ = match *light {
        Light::Directional { direction, irradiance } => writeln!(
            toml,
            "\n[[light]]\nkind = \"directional\"\ndirection = {direction:?}\nirradiance = {irradiance:?}"
        ),
        Light::Point { position, intensity } => {
            writeln!(toml, "\n[[light]]\nkind = \"point\"\nposition = {position:?}\nintensity = {intensity:?}")
        }
        Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
            writeln!(
                toml,
                "\n[[light]]\nkind = \"spot\"\nposition = {position:?}\ndirection = {direction:?}\nintensity = {intensity:?}\n\
                 half_angle_degrees = {half_angle_degrees:?}\n\
                 full_intensity_half_angle_degrees = {full_intensity_half_angle_degrees:?}"
            )
        }
    };
}
