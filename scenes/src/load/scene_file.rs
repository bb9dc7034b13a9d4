//! The scene file (TOML).

use std::path::Path;

use glam::{DVec3, Mat3, Quat, Vec3};

use super::keys::{Source, Table, listed, nearest_name};
use super::{
    Model, Reader, add_lights, add_missing, add_model, environment, is_model, keyframes, origin, read_model, reason,
};
use crate::{Camera, Light, Mesh, ModelSource, SceneError, Transform, generators};

/// Reads a scene file into the reader's scene. See [`super::load_scene`] for its keys.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8]) -> Result<(), SceneError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| SceneError(format!("{}: is not UTF-8 text; save it as UTF-8", path.display())))?;
    let source = Source { path, text };
    let table = source.parse()?;
    let file = Table::file(source, &table, &["name", "model", "camera", "extra_camera", "light", "environment"])?;
    if let Some(table) = file.table("environment", &["radiance", "map"])? {
        reader.scene.environment = Some(environment::read(reader, path, &table)?);
    }
    if let Some(name) = file.text("name")? {
        reader.scene.name = name.to_owned();
    }
    // Cheap things first: a mistake in the camera is reported before a large model is read.
    settings(reader, &file, DVec3::ZERO)?;
    let models = file.tables("model", &["path", "generator", "transform", "moves", "pivot", "receive_only"])?;
    if models.is_empty() {
        return Err(file.error("model", "is missing; write for example `[[model]]` and `path = \"model.obj\"`"));
    }
    let (mut read, mut placements) = (Vec::new(), Vec::new());
    for table in models {
        let (model, placement) = model(reader, path, &table)?;
        read.push(model);
        placements.push(placement);
    }
    origin::place(reader, &placements);
    let origin = DVec3::from(reader.scene.origin);
    if origin != DVec3::ZERO {
        settings(reader, &file, origin)?;
    }
    if !file.has("light") {
        read.iter().for_each(|model| add_lights(reader, model, origin));
    }
    let view = read.iter().find_map(|model| model.camera.as_ref());
    if let Some(view) = view
        && !file.has("camera")
    {
        reader.scene.camera = view.relative_to(origin);
        reader.scene.moves.camera = view.moves(origin);
    }
    let camera = reader.scene.camera;
    add_missing(reader, !file.has("camera") && view.is_none(), !file.has("light") && !file.has("environment"));
    if file.has("camera") || view.is_some() {
        reader.scene.camera = camera;
    }
    Ok(())
}

/// Reads the cameras and lights of a file. Positions become relative to `origin`.
fn settings(reader: &mut Reader, file: &Table, origin: DVec3) -> Result<(), SceneError> {
    let scene = &mut reader.scene;
    if let Some(table) = file.table("camera", &["eye", "target", "up", "vertical_fov_degrees", "moves"])? {
        scene.camera = camera(&table, origin)?;
        scene.moves.camera = keyframes::camera(&table, origin)?;
    }
    scene.extra_cameras.clear();
    for table in file.tables("extra_camera", &["eye", "target", "up", "vertical_fov_degrees"])? {
        scene.extra_cameras.push(camera(&table, origin)?);
    }
    scene.lights.clear();
    scene.moves.lights.clear();
    for (index, table) in file.tables("light", &LIGHT_KEYS)?.into_iter().enumerate() {
        let light = light(table, origin)?;
        scene.moves.lights.extend(keyframes::light(&table, &light)?.map(|motion| (index, motion)));
        scene.lights.push(light);
    }
    Ok(())
}

/// Adds a model to the scene. Its positions are not yet relative to the scene's origin.
fn model(reader: &mut Reader, scene_path: &Path, table: &Table) -> Result<(Model, origin::Placement), SceneError> {
    let receive_only = table.boolean("receive_only")?.unwrap_or(false);
    let first_material = reader.scene.materials.len();
    let transform_table = table.table("transform", &["translate", "rotate_degrees", "scale"])?;
    let transform = transform_table.as_ref().map(self::transform).transpose()?.unwrap_or_default();
    let (source, (mut model, remaining)) = match (table.text("path")?, table.text("generator")?) {
        (Some(name), None) => {
            if !is_model(Path::new(name)) {
                return Err(table.error(
                    "path",
                    format_args!("names {name}; only .obj, .gltf and .glb models are read, export it as one of them"),
                ));
            }
            let path = scene_path.parent().unwrap_or(Path::new("")).join(name);
            let bytes = reader.files.read(&path).map_err(|error| {
                let why = reason(&error);
                table.error(
                    "path",
                    format_args!("names {}, which cannot be read ({why}); it is relative to this file", path.display()),
                )
            })?;
            (ModelSource::File(name.to_owned()), read_model(reader, &path, &bytes, &transform)?)
        }
        (None, Some(name)) => {
            let geometry = generators::geometry(name).ok_or_else(|| {
                let known = generators::NAMES.iter().copied();
                let fix = nearest_name(name, known.clone())
                    .map_or_else(|| format!("use {}", listed(known)), |near| format!("did you mean `{near}`?"));
                table.error("generator", format_args!("names `{name}`, which is not a generator; {fix}"))
            })?;
            let model = Model { meshes: add_geometry(reader, geometry), ..Model::default() };
            (ModelSource::Generator(name.to_owned()), (model, Some(&transform)))
        }
        (Some(_), Some(_)) => return Err(table.error("generator", "is given together with `path`; remove one of them")),
        (None, None) => {
            return Err(table.error("path", "is missing; write `path = \"model.obj\"` or `generator = \"atrium\"`"));
        }
    };
    if let (Some(transform), Some(table)) = (remaining, &transform_table) {
        model.offset = apply(transform, &mut model.meshes, model.offset).ok_or_else(|| {
            table.error("scale", "or `translate` moves a vertex out of the range of float32; use smaller numbers")
        })?;
    }
    if let Some(motion) = keyframes::model(table, transform.translate)? {
        // The motion of the scene file replaces that of the model.
        model.meshes.iter_mut().for_each(|mesh| mesh.object = Some(0));
        model.motions = vec![motion];
    }
    // Every model has its own materials, so this changes no other model.
    reader.scene.materials[first_material..].iter_mut().for_each(|material| material.receive_only = receive_only);
    let placement = add_model(reader, &mut model, source, transform);
    Ok((model, placement))
}

/// Adds materials and textures to the scene and returns the meshes with their indices offset.
fn add_geometry(reader: &mut Reader, geometry: generators::Geometry) -> Vec<Mesh> {
    let scene = &mut reader.scene;
    let (first_material, first_texture) = (scene.materials.len(), scene.textures.len());
    scene.textures.extend(geometry.textures);
    scene.materials.extend(geometry.materials.into_iter().map(|mut material| {
        for texture in [&mut material.albedo_texture, &mut material.alpha_texture].into_iter().flatten() {
            *texture += first_texture;
        }
        material
    }));
    let shift = |mesh: Mesh| Mesh { material: first_material + mesh.material, ..mesh };
    geometry.meshes.into_iter().map(shift).collect()
}

fn transform(table: &Table) -> Result<Transform, SceneError> {
    let any = |key| Ok::<_, SceneError>(table.vector(key, "finite numbers", |_| true)?.unwrap_or_default());
    Ok(Transform {
        translate: any("translate")?,
        rotate_degrees: any("rotate_degrees")?,
        scale: table.scale("scale")?.unwrap_or([1.0; 3]),
    })
}

/// Applies scale and rotation to vertices, and the whole transform to the world position of their origin, which it
/// returns; `None` if a vertex leaves the range of float32. Normals are transformed by the inverse transpose. A
/// mirroring transform flips the winding.
fn apply(transform: &Transform, meshes: &mut [Mesh], offset: DVec3) -> Option<DVec3> {
    let (translate, scale) = (Vec3::from(transform.translate), Vec3::from(transform.scale));
    let [x, y, z] = transform.rotate_degrees.map(f32::to_radians);
    let rotation = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
    let rotate = Mat3::from_quat(rotation);
    let offset = rotate.as_dmat3() * (scale.as_dvec3() * offset) + translate.as_dvec3();
    // Only the ratio of the scales matters to a normal. Dividing by the largest keeps very small and large ones finite.
    let normal_scale = scale.abs().max_element() / scale;
    for mesh in meshes {
        for position in &mut mesh.positions {
            let moved = rotate * (scale * Vec3::from(*position));
            if !moved.is_finite() || !(moved.as_dvec3() + offset).as_vec3().is_finite() {
                return None;
            }
            *position = moved.to_array();
        }
        for normal in &mut mesh.normals {
            *normal = (rotate * (normal_scale * Vec3::from(*normal))).normalize_or(Vec3::Y).to_array();
        }
        if scale.cmplt(Vec3::ZERO).bitmask().count_ones() % 2 == 1 {
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    Some(offset)
}

fn camera(table: &Table, origin: DVec3) -> Result<Camera, SceneError> {
    let [eye, target] = keyframes::eye_and_target(table, "camera.eye", origin)?;
    Ok(Camera {
        eye,
        target,
        up: table.vector("up", "finite numbers, not all 0", |up| up != [0.0; 3])?.unwrap_or([0.0, 1.0, 0.0]),
        vertical_fov_degrees: table.number("vertical_fov_degrees", 1.0..=170.0)?.unwrap_or(60.0),
    })
}

const LIGHT_KEYS: [&str; 8] = [
    "kind",
    "direction",
    "irradiance",
    "position",
    "intensity",
    "half_angle_degrees",
    "full_intensity_half_angle_degrees",
    "moves",
];

fn light(table: Table, origin: DVec3) -> Result<Light, SceneError> {
    let kind = table.required("kind", table.text("kind")?, "kind = \"directional\"")?;
    let keys: &[&str] = match kind {
        "directional" => &["kind", "direction", "irradiance", "moves"],
        "point" => &["kind", "position", "intensity", "moves"],
        "spot" => &LIGHT_KEYS,
        _ => {
            let near =
                nearest_name(kind, ["directional", "spot", "point"]).map(|near| format!("; did you mean `{near}`?"));
            let near = near.unwrap_or_default();
            return Err(
                table.error("kind", format_args!("is \"{kind}\"; it must be `directional`, `spot` or `point`{near}"))
            );
        }
    };
    if kind == "spot" && table.has("irradiance") {
        return Err(table.error("irradiance", "belongs to a directional light; a spot light has `light.intensity`"));
    }
    let table = table.only(keys)?;
    let power = |key| {
        let value = table.vector(key, "finite numbers, none of them negative", |v| v.iter().all(|&x| x >= 0.0))?;
        table.required(key, value, &format!("{key} = [10.0, 9.5, 8.5]"))
    };
    let direction = || {
        let value = table.vector("direction", "finite numbers, not all 0", |d| d != [0.0; 3])?;
        table.required("direction", value, "direction = [0.3, -1.0, 0.1]")
    };
    let position = || {
        let position = table.required("position", table.position("position")?, "position = [0.0, 2.0, 0.0]")?;
        Ok::<_, SceneError>((DVec3::from(position) - origin).as_vec3().to_array())
    };
    Ok(match kind {
        "directional" => Light::Directional { direction: direction()?, irradiance: power("irradiance")? },
        "point" => Light::Point { position: position()?, intensity: power("intensity")? },
        _ => {
            // One perspective shadow map has to cover the cone, so the half angle is under 90 degrees.
            let half_angle = table.number("half_angle_degrees", 0.1..=89.0)?;
            let half_angle_degrees = table.required("half_angle_degrees", half_angle, "half_angle_degrees = 40.0")?;
            let full = table.number("full_intensity_half_angle_degrees", 0.0..=half_angle_degrees)?;
            Light::Spot {
                position: position()?,
                direction: direction()?,
                intensity: power("intensity")?,
                half_angle_degrees,
                full_intensity_half_angle_degrees: full.unwrap_or(half_angle_degrees),
            }
        }
    })
}
