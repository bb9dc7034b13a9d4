//! A scene, ready for path tracing on a device.

use halflight_scenes::{Light, Scene};

use super::{Request, Stop, Trace, TruthError};
use crate::scene::{SceneBuffers, contrast::is_uneven};
use halflight_frame_graph::Gpu;

/// The BVH of a scene on a device, with the scene's buffers. It serves any number of traces.
pub struct Tracer {
    pub(super) nodes: wgpu::TextureView,
    pub(super) triangles: wgpu::TextureView,
    pub(super) attributes: wgpu::TextureView,
    pub(super) materials: wgpu::Buffer,
    pub(super) texels: wgpu::TextureView,
    pub(super) lights: wgpu::Buffer,
    /// A black texel if the scene has no environment.
    pub(super) environment: wgpu::Buffer,
    pub(super) has_environment: bool,
    /// Whether directions are drawn from the sky.
    pub(super) draws_sky: bool,
    /// Whether the scene has any light.
    pub(super) lit: bool,
    /// Table of emitting triangles; one unused entry if there are none.
    pub(super) emitters: wgpu::TextureView,
    pub(super) emitter_count: u32,
    /// Density over area at which points on an emission of 1 are drawn.
    pub(super) emitter_density: f32,
    /// Whether some material is translucent.
    pub(super) has_translucency: bool,
    pub(super) light_count: u32,
    /// Whether any triangle is alpha-masked.
    pub(super) has_holes: bool,
    /// Half the diagonal of the bounding box, scene units.
    pub(super) scene_radius: f32,
    /// Power of two that scales the brightest source to about 1.
    pub(super) radiance_scale: f32,
}

impl Tracer {
    /// Builds the BVH and uploads it.
    ///
    /// # Errors
    /// If the BVH is too deep or too large for the device.
    pub fn new(gpu: &Gpu, scene: &Scene, buffers: &SceneBuffers) -> Result<Self, TruthError> {
        let bvh = buffers.bvh(gpu, scene)?;
        let scene_radius = scene.bounds().map_or(0.0, |(low, high)| (high - low).length() / 2.0);
        let radiance_scale = radiance_scale(scene);
        Ok(Self {
            lit: is_lit(scene),
            draws_sky: scene.environment.as_ref().is_some_and(is_uneven),
            emitters: bvh.emitters.create_view(&Default::default()),
            emitter_count: bvh.emitter_count,
            emitter_density: bvh.emitter_density,
            has_holes: bvh.has_holes,
            nodes: bvh.nodes.create_view(&Default::default()),
            triangles: bvh.triangles.create_view(&Default::default()),
            attributes: bvh.attributes.create_view(&Default::default()),
            materials: buffers.materials.clone(),
            texels: buffers.texels.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            lights: buffers.lights.clone(),
            environment: buffers.environment.clone().unwrap_or_else(|| {
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("truth.environment"),
                    size: 16,
                    usage: wgpu::BufferUsages::STORAGE,
                    mapped_at_creation: false,
                })
            }),
            has_environment: buffers.environment.is_some(),
            has_translucency: scene.materials.iter().any(|material| material.translucency != [0.0; 3]),
            light_count: buffers.light_count,
            scene_radius,
            radiance_scale,
        })
    }

    /// Starts a trace.
    ///
    /// # Errors
    /// If a value of the request is out of range or its sums do not fit the device.
    pub fn start(&self, gpu: &Gpu, request: &Request, stop: Stop) -> Result<Trace, TruthError> {
        Trace::new(gpu, self, request, stop)
    }
}

/// Whether the scene has any light. Without, every image is black and exact.
pub fn is_lit(scene: &Scene) -> bool {
    brightest(scene) > 0.0
}

fn radiance_scale(scene: &Scene) -> f32 {
    let brightest = brightest(scene);
    // Beyond 2^±100 the power itself would leave float32's range.
    if brightest > 0.0 { (-brightest.log2().floor().clamp(-100.0, 100.0)).exp2() } else { 1.0 }
}

/// The largest finite intensity, irradiance or radiance of any source.
fn brightest(scene: &Scene) -> f32 {
    let lights = scene.lights.iter().flat_map(|light| match *light {
        Light::Directional { irradiance, .. } => irradiance,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
    });
    let emitters = scene.materials.iter().flat_map(|material| material.emission);
    let sky = scene.environment.iter().flat_map(|environment| environment.texels.iter().copied().flatten());
    lights.chain(emitters).chain(sky).filter(|v| v.is_finite()).fold(0.0, f32::max)
}
