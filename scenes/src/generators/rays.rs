//! Rays through generated scenes, for tests.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::{Vec3, vec3};

use crate::{Camera, DiskFiles, Light, Mesh, Scene, load_scene};

/// A bundled scene with its lights and cameras.
pub fn bundled(name: &str) -> Scene {
    load_scene(&DiskFiles, &Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("{name}.toml"))).unwrap()
}

/// Nearest triangle of a mesh along a ray: distance and unit normal of its front.
pub fn hit(mesh: &Mesh, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let corners = |t: &[u32]| [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
    let hits = mesh.indices.chunks_exact(3).filter_map(|t| {
        let [a, b, c] = corners(t);
        let (e, f) = (b - a, c - a);
        let p = direction.cross(f);
        let s = (origin - a) / e.dot(p);
        let q = s.cross(e);
        let (u, v, distance) = (s.dot(p), direction.dot(q), f.dot(q));
        // A ray in the plane of the triangle gives infinity or NaN and fails these comparisons.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then(|| (distance, e.cross(f).normalize()))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// What a camera sees in a pixel.
pub struct Seen {
    /// Index of the mesh.
    pub mesh: usize,
    /// World position.
    pub position: Vec3,
    /// Unit normal, towards the camera.
    pub normal: Vec3,
}

/// The surfaces that a camera sees in an image of 64x36 pixels; `None` for the sky.
pub fn view(scene: &Scene, camera: &Camera) -> Vec<Option<Seen>> {
    let [width, height] = [64, 36];
    let half = camera.tan_half_fov(width, height);
    let world = camera.view_matrix().inverse();
    let (eye, count) = (Vec3::from(camera.eye), width * height);
    let pixels = (0..count).map(|i| {
        let centre = |k: u32, size: u32| (k as f32 + 0.5) / size as f32 * 2.0 - 1.0;
        let (x, y) = (centre(i % width, width), -centre(i / width, height));
        let direction = world.transform_vector3(vec3(x * half[0], y * half[1], -1.0)).normalize();
        let hits = scene.meshes.iter().enumerate().filter_map(|(k, mesh)| Some((k, hit(mesh, eye, direction)?)));
        let (mesh, (distance, normal)) = hits.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Seen { mesh, position: eye + direction * distance, normal })
    });
    pixels.collect()
}

/// Direction towards a light, unit length, and the distance to it; `None` outside of its cone.
pub fn towards(light: &Light, position: Vec3) -> Option<(Vec3, f32)> {
    let to = |from: [f32; 3]| {
        let way = Vec3::from(from) - position;
        (way.normalize(), way.length())
    };
    match *light {
        Light::Directional { direction, .. } => Some((-Vec3::from(direction).normalize(), f32::INFINITY)),
        Light::Point { position, .. } => Some(to(position)),
        Light::Spot { position, direction, half_angle_degrees, .. } => {
            let (way, distance) = to(position);
            let angle = (-way).angle_between(Vec3::from(direction)).to_degrees();
            (angle < half_angle_degrees).then_some((way, distance))
        }
    }
}

/// Whether light reaches the side of a surface that the camera sees.
pub fn is_lit(scene: &Scene, light: &Light, seen: &Seen) -> bool {
    let start = seen.position + 1e-4 * seen.normal;
    towards(light, start).is_some_and(|(way, distance)| {
        let free = |mesh| hit(mesh, start, way).is_none_or(|(at, _)| at >= distance);
        way.dot(seen.normal) > 0.0 && scene.meshes.iter().all(free)
    })
}
