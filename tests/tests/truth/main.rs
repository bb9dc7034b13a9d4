//! The path tracer against closed forms, against its own promises and against an unrelated renderer.
#![allow(clippy::unwrap_used)]

mod closed_forms;
mod independent;
mod promises;
mod rare_light;
mod textures;

use halflight_native::{AdapterChoice, NativeGpu, truth::TruthSource};
use halflight_renderer::truth::{Estimate, Request, Stop, Truth};
use halflight_scenes::{Camera, Material, Mesh, Scene};

/// Traces without a cache.
fn trace(scene: &Scene, request: &Request, samples: u32) -> Truth {
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap();
    TruthSource::new(&gpu.gpu, scene, None).trace(request, Stop::at_samples(samples), &mut |_| ()).unwrap().truth
}

/// A material that reflects and emits grey.
fn grey(albedo: f32, emission: f32) -> Material {
    Material { albedo: [albedo; 3], emission: [emission; 3], ..Material::default() }
}

/// Adds a parallelogram with flat normals.
fn add_quad(scene: &mut Scene, corner: [f32; 3], u: [f32; 3], v: [f32; 3], material: Material) {
    use glam::Vec3;
    let [corner, u, v] = [corner, u, v].map(Vec3::from);
    let normal = u.cross(v).normalize_or_zero().to_array();
    scene.meshes.push(Mesh {
        positions: [corner, corner + u, corner + u + v, corner + v].map(|p| p.to_array()).to_vec(),
        normals: vec![normal; 4],
        uvs: vec![[0.0; 2]; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        material: scene.materials.len(),
        ..Mesh::default()
    });
    scene.materials.push(material);
}

/// Looks straight down at the origin, so closely that every pixel of a small image sees the same point.
fn down_at_origin() -> Camera {
    Camera { eye: [0.0, 0.5, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0], vertical_fov_degrees: 1.0 }
}

/// Mean over all pixels and channels, and its standard error.
fn mean(estimate: &Estimate<[f32; 3]>) -> (f64, f64) {
    let values = |image: &[[f32; 3]]| image.iter().map(|p| f64::from(p[0] + p[1] + p[2]) / 3.0).collect::<Vec<_>>();
    let count = estimate.mean.len() as f64;
    let variance: f64 = values(&estimate.standard_error).iter().map(|e| e * e).sum();
    (values(&estimate.mean).iter().sum::<f64>() / count, variance.sqrt() / count)
}

fn mean_grey(estimate: &Estimate<f32>) -> (f64, f64) {
    let three = |image: &[f32]| image.iter().map(|&v| [v; 3]).collect();
    mean(&Estimate { mean: three(&estimate.mean), standard_error: three(&estimate.standard_error) })
}

/// Within four standard errors (one trace in 16,000 would miss by chance; the seeds are fixed), plus `bias`.
fn assert_near((mean, error): (f64, f64), expected: f64, bias: f64, what: &str) {
    let bound = 4.0 * error + bias;
    assert!((mean - expected).abs() <= bound, "{what}: {mean} instead of {expected}, allowed {bound}");
}
