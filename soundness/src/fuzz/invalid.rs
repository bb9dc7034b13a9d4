//! What may be invalid in a loaded scene.

use glam::Vec3;
use halflight_scenes::{Camera, Environment, Keyframe, Light, Material, Mesh, Moves, Scene, Texture};

/// What is invalid in a loaded scene, if anything.
pub(super) fn invalid(scene: &Scene) -> Option<String> {
    let mesh = || scene.meshes.iter().find_map(|mesh| in_mesh(scene, mesh));
    let material = || scene.materials.iter().find_map(|material| in_material(scene, material));
    let texture = || scene.textures.iter().find_map(in_texture);
    let camera = || [&scene.camera].into_iter().chain(&scene.extra_cameras).find_map(in_camera);
    let light = || scene.lights.iter().find_map(in_light);
    let origin = || (!scene.origin.iter().all(|v| v.is_finite())).then(|| "the origin is not finite".into());
    let environment = || scene.environment.as_ref().and_then(in_environment);
    mesh()
        .or_else(material)
        .or_else(texture)
        .or_else(camera)
        .or_else(light)
        .or_else(origin)
        .or_else(environment)
        .or_else(|| in_moves(&scene.moves, scene.lights.len()))
}

fn finite(v: &[f32]) -> bool {
    v.iter().all(|v| v.is_finite())
}

fn in_mesh(scene: &Scene, mesh: &Mesh) -> Option<String> {
    let count = mesh.positions.len();
    if mesh.normals.len() != count || mesh.uvs.len() != count || !mesh.indices.len().is_multiple_of(3) {
        return Some(format!("mesh {:?} has lists of different lengths", mesh.name));
    }
    if mesh.indices.iter().any(|&i| i as usize >= count) || mesh.material >= scene.materials.len() {
        return Some(format!("mesh {:?} has an index out of range", mesh.name));
    }
    if mesh.object.is_some_and(|object| object >= scene.moves.objects.len()) {
        return Some(format!("mesh {:?} moves with nothing", mesh.name));
    }
    if !finite(mesh.positions.as_flattened()) || !finite(mesh.uvs.as_flattened()) {
        return Some(format!("mesh {:?} has a number that is not finite", mesh.name));
    }
    if mesh.normals.iter().any(|&n| (Vec3::from(n).length() - 1.0).abs() > 1e-3 || !finite(&n)) {
        return Some(format!("mesh {:?} has a normal that is not of unit length", mesh.name));
    }
    None
}

fn in_material(scene: &Scene, material: &Material) -> Option<String> {
    let unit = |v: &[f32]| v.iter().all(|v| (0.0..=1.0).contains(v));
    let glow = material.emission.iter().all(|v| v.is_finite() && *v >= 0.0);
    if !unit(&material.albedo)
        || !unit(&material.specular)
        || !unit(&material.translucency)
        || !material.absorption.iter().all(|v| (0.0..=1e9).contains(v))
        || !glow
        || !(0.0..=1e6).contains(&material.phong_exponent)
    {
        return Some(format!("material {:?} is out of range", material.name));
    }
    let textures = [material.albedo_texture, material.alpha_texture];
    if textures.into_iter().flatten().any(|texture| texture >= scene.textures.len()) {
        return Some(format!("material {:?} has a texture that is not there", material.name));
    }
    None
}

fn in_texture(texture: &Texture) -> Option<String> {
    let texels = texture.width as usize * texture.height as usize;
    (texels == 0 || texture.rgba.len() != 4 * texels).then(|| format!("texture {:?} has a wrong size", texture.name))
}

fn in_camera(camera: &Camera) -> Option<String> {
    let view = camera.view_matrix().to_cols_array();
    let valid = finite(&view) && finite(&camera.target) && (1.0..=170.0).contains(&camera.vertical_fov_degrees);
    (!valid).then(|| "the camera is not finite".into())
}

fn in_light(light: &Light) -> Option<String> {
    let power = |v: &[f32]| v.iter().all(|v| v.is_finite() && *v >= 0.0);
    let valid = match light {
        Light::Directional { direction, irradiance } => finite(direction) && power(irradiance),
        Light::Point { position, intensity } => finite(position) && power(intensity),
        Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
            finite(position)
                && finite(direction)
                && power(intensity)
                && (0.0..=90.0).contains(half_angle_degrees)
                && (0.0..=*half_angle_degrees).contains(full_intensity_half_angle_degrees)
        }
    };
    (!valid).then(|| "a light is not finite or out of range".into())
}

fn in_environment(environment: &Environment) -> Option<String> {
    let texels = environment.width as usize * environment.height as usize;
    if texels == 0 || environment.texels.len() != texels {
        return Some("the environment has a wrong size".into());
    }
    let valid = environment.texels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0);
    (!valid).then(|| "the environment has a texel that is negative or not finite".into())
}

/// `lights` is the number of lights of the scene.
fn in_moves(moves: &Moves, lights: usize) -> Option<String> {
    let number = |v: &[f32; 3]| finite(v);
    let motions = moves.objects.iter().chain(moves.lights.iter().map(|(_, motion)| motion));
    for motion in motions {
        let ascending = motion.keyframes.is_sorted_by(|a, b| a.frame < b.frame);
        if motion.keyframes.is_empty() || !ascending {
            return Some("a motion has no keyframes, or not in ascending order".into());
        }
        let valid = |key: &Keyframe| {
            number(&key.translate)
                && number(&key.rotate_degrees)
                && number(&key.scale)
                && key.scale.iter().all(|&s| s > 0.0)
        };
        if !number(&motion.pivot) || !motion.keyframes.iter().all(valid) {
            return Some("a motion is not finite".into());
        }
    }
    if moves.lights.iter().any(|&(light, _)| light >= lights) {
        return Some("a light that is not there moves".into());
    }
    if !moves.camera.is_sorted_by(|a, b| a.frame < b.frame) {
        return Some("the camera's path has keyframes that are not in ascending order".into());
    }
    let path = moves.camera.iter().all(|key| number(&key.eye) && number(&key.target));
    (!path).then(|| "the camera's path is not finite".into())
}
