//! Sizes of a scene's buffers, known before anything is uploaded.

use halflight_frame_graph::{BeyondLimits, DeviceLimits, ExternalSize, check_external};
use halflight_scenes::Scene;

use super::{
    buffers::{GpuLight, Material, Object, Vertex},
    environment, numbered_triangles, texel_pool,
};

/// Sizes of a scene's buffers on a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneSize {
    /// Names without `scene.`, with their sizes.
    buffers: Vec<(&'static str, ExternalSize)>,
}

impl SceneSize {
    /// The sizes of the buffers of this scene.
    pub fn of(scene: &Scene) -> Self {
        let vertices: u64 = scene.meshes.iter().map(|mesh| mesh.positions.len() as u64).sum();
        let indices: u64 = scene.meshes.iter().map(|mesh| mesh.indices.len() as u64).sum();
        let mut buffers = Vec::new();
        let mut add = |name, count: u64, element: usize, elements| {
            // Every buffer has at least one element.
            let bytes = count.max(1) * element as u64;
            buffers.push((name, ExternalSize { bytes, element: element as u64, elements, texture: None }));
        };
        add("vertices", vertices, size_of::<Vertex>(), "vertices");
        add("indices", indices, 4, "corners of triangles");
        add("materials", scene.materials.len() as u64, size_of::<Material>(), "materials");
        add("lights", scene.lights.len() as u64, size_of::<GpuLight>(), "lights");
        add("corners", numbered_triangles::corner_count(scene), 8, "corners that begin a triangle");
        if scene.meshes.iter().any(|mesh| mesh.object.is_some()) {
            add("objects", scene.moves.objects.len() as u64 + 1, size_of::<Object>(), "moving objects");
        }
        if let Some(sky) = &scene.environment {
            add("environment", environment::word_count(sky), 16, "texels in the environment map");
        }
        buffers.push(("texels", texel_pool::size(&scene.textures)));
        Self { buffers }
    }

    /// The size of a buffer by the name that plans use, for example `scene.vertices`; `None` if there is none.
    pub fn buffer(&self, name: &str) -> Option<ExternalSize> {
        let name = name.strip_prefix("scene.")?;
        self.buffers.iter().find(|(own, _)| *own == name).map(|&(_, size)| size)
    }

    /// Number of elements of a buffer by the name that plans use; 0 if there is no such buffer.
    pub fn count(&self, name: &str) -> u64 {
        self.buffer(name).map_or(0, |size| size.bytes / size.element.max(1))
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|(_, size)| size.bytes).sum()
    }

    /// Whether a device can hold and bind each buffer and texture that every upload makes. Some plans need more:
    /// [`halflight_frame_graph::FramePlan::check`] tells.
    ///
    /// # Errors
    /// The first buffer that is too large.
    pub fn check(&self, device: &DeviceLimits) -> Result<(), BeyondLimits> {
        // Only some plans read triangles with their numbers.
        let made = self.buffers.iter().filter(|(name, _)| *name != "corners");
        made.into_iter().try_for_each(|&(name, size)| check_external(device, &format!("scene.{name}"), size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_scenes::{Environment, Light, Mesh, Motion, Texture};

    #[test]
    fn sizes_are_those_of_the_buffers() {
        let mesh = Mesh {
            positions: vec![[0.0; 3]; 5],
            indices: vec![0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1, 0, 1, 2, 1, 2, 3],
            object: Some(0),
            ..Mesh::default()
        };
        let mut scene = Scene {
            meshes: vec![mesh],
            lights: vec![Light::Point { position: [0.0; 3], intensity: [1.0; 3] }; 3],
            textures: vec![Texture { width: 5, height: 7, rgba: vec![0; 140], ..Texture::default() }; 2],
            environment: Some(Environment { map: None, width: 130, height: 65, texels: vec![[1.0; 3]; 130 * 65] }),
            ..Scene::default()
        };
        scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes: Vec::new() });
        let size = SceneSize::of(&scene);
        let bytes = |name: &str| size.buffer(name).expect("the buffer exists").bytes;
        assert_eq!(bytes("scene.vertices"), 5 * 32);
        assert_eq!(bytes("scene.indices"), 18 * 4);
        // 74 words in a row of 4096.
        assert_eq!(texel_pool::words(&scene.textures), texel_pool::texel_pool(&scene.textures).1.len() as u64);
        assert_eq!(bytes("scene.texels"), 4 * 4096);
        // The layout itself.
        let words = environment::environment_words(scene.environment.as_ref().expect("it has one"));
        assert_eq!(bytes("scene.environment"), 16 * words.len() as u64);
        // Five vertices serve five triangles, the sixth duplicates one.
        assert_eq!(bytes("scene.corners"), 6 * 8);
        assert_eq!(bytes("scene.objects"), 2 * 128);
        assert_eq!((size.count("scene.vertices"), size.count("scene.objects"), size.count("x")), (5, 2, 0));
        assert_eq!(size.buffer("vertices"), None);
        assert_eq!(SceneSize::of(&Scene::default()).buffer("scene.environment"), None);
    }

    #[test]
    fn a_scene_that_no_browser_can_hold_is_told_by_its_vertices() {
        let vertices = |count| {
            let mesh = Mesh { positions: vec![[0.0; 3]; count], ..Mesh::default() };
            SceneSize::of(&Scene { meshes: vec![mesh], ..Scene::default() })
        };
        let browser = DeviceLimits::browser();
        // 2^27 bytes, 32 for each.
        assert_eq!(vertices(1 << 22).check(&browser), Ok(()));
        let error = vertices(4_400_000).check(&browser).expect_err("too many").to_string();
        assert_eq!(
            error,
            "the buffer scene.vertices needs 140.80 MB in one storage binding and this device allows 134.22 MB: use at \
             most 4.19 million vertices"
        );
    }
}
