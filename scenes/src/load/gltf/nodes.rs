//! The nodes of a glTF scene: instances of meshes, cameras and lights.

use std::collections::{BTreeMap, HashMap};

use ::gltf::Node;
use ::gltf::camera::Projection;
use ::gltf::khr_lights_punctual::Kind;
use glam::{DMat3, DMat4, DVec3, Vec3};

use super::super::clean::{Fixes, cleaned};
use super::super::{Model, Reader, camera, clamp, origin};
use super::Source;
use super::animation::Animation;
use super::primitives::{self, Primitive};
use super::tree::{Placed, placed};
use crate::{Light, Mesh, Transform};

/// Reads everything that the scene of the file shows, transformed.
pub(super) fn model(reader: &mut Reader, source: &mut Source, transform: &Transform) -> Result<Model, String> {
    let document = source.document;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    // A file without scenes is a library of nodes; all of them are shown.
    let roots: Vec<Node> = match &scene {
        Some(scene) => scene.nodes().collect(),
        None => {
            let children: Vec<usize> = document.nodes().flat_map(|n| n.children().map(|child| child.index())).collect();
            document.nodes().filter(|node| !children.contains(&node.index())).collect()
        }
    };
    if document.scenes().len() > 1 {
        source.notes.add("only the first scene of the file is drawn");
    }
    let nodes = placed(source, roots, matrix(transform))?;
    let used: BTreeMap<usize, _> =
        nodes.iter().filter_map(|placed| placed.node.mesh()).map(|mesh| (mesh.index(), mesh)).collect();
    let first_material = reader.scene.materials.len();
    let meshes = primitives::read(reader, source, &used)?;
    let offset = offset(&nodes, &meshes);
    let animation = Animation::new(source, &nodes);
    let mut model = Model { offset, ..Model::default() };
    let mut fixes = Fixes::default();
    for (index, placed) in nodes.iter().enumerate() {
        if placed.node.skin().is_some() {
            source.notes.add("skins are not drawn: meshes keep the shape that they are stored in");
        }
        let Some(mesh) = placed.node.mesh() else { continue };
        let name =
            placed.node.name().or(mesh.name()).map_or_else(|| format!("node {}", placed.node.index()), str::to_owned);
        let object = animation.motion(source, index).map(|motion| {
            model.motions.push((motion, placed.to_world.w_axis.truncate()));
            model.motions.len() - 1
        });
        for primitive in meshes.get(&mesh.index()).into_iter().flatten() {
            let to_scene = DMat4::from_translation(-offset) * placed.to_world;
            for part in parts(primitive, to_scene, &name, &mut fixes) {
                model.meshes.push(Mesh { object, ..part });
            }
        }
    }
    if model.meshes.iter().any(|mesh| mesh.positions.as_flattened().iter().any(|x| !x.is_finite())) {
        return Err("has a transform that moves a vertex out of the range of float32; use smaller numbers".into());
    }
    fixes.warn(reader, source.path);
    if model.meshes.is_empty() {
        let what = if fixes.dropped > 0 { "every triangle has zero area" } else { "the file has no triangles" };
        return Err(format!("{what}; export the model with its surfaces"));
    }
    debug_assert!(model.meshes.iter().all(|mesh| mesh.material >= first_material));
    for (index, placed) in nodes.iter().enumerate() {
        if let Some(found) = placed.node.camera() {
            let has_camera = model.camera.is_some();
            add_camera(source, &mut model, &found, placed.to_world);
            if let (false, Some(view)) = (has_camera, &mut model.camera) {
                view.path = animation.path(index);
            }
        }
        if let Some(light) = placed.node.light() {
            let (light, place) = self::light(reader, source, &light, placed.to_world);
            let motion = animation.motion(source, index).map(|mut motion| {
                // A light has no size.
                motion.keyframes.iter_mut().for_each(|key| key.scale = [1.0; 3]);
                motion
            });
            model.lights.push(super::super::PlacedLight { light, place, motion });
        }
    }
    Ok(model)
}

fn matrix(transform: &Transform) -> DMat4 {
    let [scale, translate] = [transform.scale, transform.translate].map(|v| Vec3::from(v).as_dvec3());
    let rotation = crate::moves::rotation(transform.rotate_degrees).as_dquat().normalize();
    DMat4::from_scale_rotation_translation(scale, rotation, translate)
}

/// What positions are relative to.
fn offset(nodes: &[Placed], meshes: &BTreeMap<usize, Vec<Primitive>>) -> DVec3 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for placed in nodes {
        let mesh = placed.node.mesh().and_then(|mesh| meshes.get(&mesh.index()));
        for primitive in mesh.into_iter().flatten() {
            for &corner in primitive.triangles.as_flattened() {
                let position = Vec3::from(primitive.positions[corner as usize]).as_dvec3();
                let position = placed.to_world.transform_point3(position);
                (low, high) = (low.min(position), high.max(position));
            }
        }
    }
    origin::offset(low, high)
}

/// Vertices of a mesh by their vertex in the file, and by their face if that has texture coordinates of its own.
type Known = HashMap<(u32, usize), u32>;

/// The meshes of one instance of a primitive, one per material.
fn parts(primitive: &Primitive, to_scene: DMat4, name: &str, fixes: &mut Fixes) -> Vec<Mesh> {
    let linear = DMat3::from_mat4(to_scene);
    let mirrored = linear.determinant() < 0.0;
    // Cofactors are the inverse transpose without the division by the determinant, which may be tiny.
    let cofactors = DMat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    );
    let sign = if mirrored { -1.0 } else { 1.0 };
    let identity = to_scene == DMat4::IDENTITY;
    let position = |p: [f32; 3]| {
        if identity { p } else { to_scene.transform_point3(Vec3::from(p).as_dvec3()).as_vec3().to_array() }
    };
    let normal = |n: [f32; 3]| {
        if identity {
            n
        } else {
            (sign * cofactors * Vec3::from(n).as_dvec3()).normalize_or_zero().as_vec3().to_array()
        }
    };
    let mut order = Vec::new();
    let mut by_material: HashMap<usize, (Mesh, Known)> = HashMap::new();
    for (face, triangle) in primitive.triangles.iter().enumerate() {
        let material = primitive.materials[face];
        let (mesh, known) = by_material.entry(material).or_insert_with(|| {
            order.push(material);
            (Mesh { name: name.to_owned(), material, ..Mesh::default() }, HashMap::new())
        });
        let [a, b, c] = *triangle;
        for corner in if mirrored { [a, c, b] } else { [a, b, c] } {
            let own = primitive.face_uvs.as_ref().map(|uvs| (face + 1, uvs[face]));
            let key = (corner, own.map_or(0, |(face, _)| face));
            let i = corner as usize;
            let index = *known.entry(key).or_insert_with(|| {
                mesh.positions.push(position(primitive.positions[i]));
                mesh.normals.extend(primitive.normals.get(i).map(|&n| normal(n)));
                mesh.uvs.push(own.map_or(primitive.uvs[i], |(_, uv)| uv));
                mesh.positions.len() as u32 - 1
            });
            mesh.indices.push(index);
        }
    }
    let finish = |material: usize| {
        let (mesh, _) = by_material.remove(&material)?;
        let (name, has_normals) = (mesh.name.clone(), !primitive.normals.is_empty());
        let mesh = cleaned(mesh, has_normals, fixes);
        (!mesh.indices.is_empty()).then_some(Mesh { name, material, ..mesh })
    };
    order.into_iter().filter_map(finish).collect()
}

fn add_camera(source: &mut Source, model: &mut Model, found: &::gltf::Camera, to_world: DMat4) {
    match found.projection() {
        Projection::Perspective(lens) if model.camera.is_none() => {
            let fov = clamp([lens.yfov().to_degrees()], 1.0, 170.0).0[0];
            model.camera = camera::View::of_node(to_world, fov);
        }
        Projection::Perspective(_) => source.notes.add("only the first camera of the file is used"),
        Projection::Orthographic(_) => source.notes.add("orthographic cameras are not used"),
    }
}

/// A light and its position. Candela count as W/sr and lux as W/m2: the numbers stay as they are.
fn light(
    reader: &mut Reader,
    source: &Source,
    light: &::gltf::khr_lights_punctual::Light,
    to_world: DMat4,
) -> (Light, DVec3) {
    let power = light.color().map(|c| c * light.intensity());
    let (power, changed) = clamp(power, 0.0, 1e30);
    if changed {
        reader.warn(format!(
            "{}: the power of light {} is out of range and was clamped",
            source.path.display(),
            light.index()
        ));
    }
    let direction = (-to_world.z_axis.truncate()).try_normalize().unwrap_or(DVec3::NEG_Z).as_vec3().to_array();
    let place = to_world.w_axis.truncate();
    let position = [0.0; 3];
    let light = match light.kind() {
        Kind::Directional => Light::Directional { direction, irradiance: power },
        Kind::Point => Light::Point { position, intensity: power },
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            let half_angle_degrees = clamp([outer_cone_angle.to_degrees()], 0.1, 89.0).0[0];
            let full = clamp([inner_cone_angle.to_degrees()], 0.0, half_angle_degrees).0[0];
            Light::Spot {
                position,
                direction,
                intensity: power,
                half_angle_degrees,
                full_intensity_half_angle_degrees: full,
            }
        }
    };
    (light, place)
}
