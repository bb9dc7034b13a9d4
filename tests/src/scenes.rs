//! Scenes made of a few quads, with closed forms behind them.

use glam::Vec3;
use halflight_scenes::{Camera, Light, Material, Mesh, Scene};

/// A flat quad: corner and two edges; its normal is the cross product of the edges.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3, material: usize) -> Mesh {
    let normal = u.cross(v).normalize().to_array();
    Mesh {
        positions: [corner, corner + u, corner + u + v, corner + v].map(|p| p.to_array()).to_vec(),
        normals: vec![normal; 4],
        uvs: vec![[0.0; 2]; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    }
}

/// A grey surface of this albedo.
pub fn grey(albedo: f32) -> Material {
    Material { albedo: [albedo; 3], ..Material::default() }
}

/// A black surface that emits this radiance.
pub fn emitter(radiance: f32) -> Material {
    Material { albedo: [0.0; 3], emission: [radiance; 3], ..Material::default() }
}

/// A camera looking along -z from `distance`, half a field of view wide.
pub fn camera(eye: [f32; 3], target: [f32; 3], vertical_fov_degrees: f32) -> Camera {
    Camera { eye, target, vertical_fov_degrees, ..Camera::default() }
}

/// A sun travelling downwards and a little away from the camera.
pub fn sun() -> Light {
    Light::Directional { direction: [0.2, -1.0, -0.3], irradiance: [3.0, 2.5, 2.0] }
}

/// The court with a glossy floor, which shows the wall and the block: Ks 0.5 and this Phong exponent.
pub fn polished(exponent: f32) -> Scene {
    let mut scene = court();
    scene.materials[0].specular = [0.5; 3];
    scene.materials[0].phong_exponent = exponent;
    scene
}

/// Floor and back wall of a grey court, 4 x 4 x 3 units, and a box-like block on the floor.
pub fn court() -> Scene {
    let block = Vec3::new(-0.6, 0.0, -1.4);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    Scene {
        name: "court".into(),
        meshes: vec![
            quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * x, -4.0 * z, 0),
            quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * x, 3.0 * y, 1),
            quad(block + 0.5 * z, 0.8 * x, 0.7 * y, 0),
            quad(block + 0.7 * y + 0.5 * z, 0.8 * x, -0.5 * z, 1),
        ],
        materials: vec![grey(0.7), Material { albedo: [0.8, 0.3, 0.2], ..Material::default() }],
        lights: vec![sun()],
        camera: camera([0.0, 1.4, 4.0], [0.0, 0.8, 0.0], 45.0),
        ..Scene::default()
    }
}
