//! The scene on the device. Layouts are those of `common/scene.wgsl`.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, vec2};
use halflight_frame_graph::{FramePlan, Gpu, Provider, Triangles};
use halflight_scenes::{Light, Mesh, Scene, bulk};
use serde::{Deserialize, Serialize};

use super::{
    BvhError, Piece, Pieces, SceneBvh,
    bvh::MovingBvh,
    contents::{BufferPart, Part, TexturePart},
    environment::environment_words,
    numbered_triangles::NumberedTriangles,
    texel_pool,
};

/// Twin of `Vertex` in `common/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Vertex {
    position: [f32; 3],
    material: u32,
    uv: [f32; 2],
    normal: u32,
    object: u32,
}

/// Twin of `Object` in `common/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Object {
    pub(crate) to_world: Mat4,
    pub(crate) view_to_previous: Mat4,
}

/// Twin of `Material` in `common/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Material {
    albedo: [f32; 3],
    albedo_texture: u32,
    emission: [f32; 3],
    alpha_texture: u32,
    specular: [f32; 3],
    phong_exponent: f32,
    translucency: [f32; 3],
    unused_0: f32,
    absorption: [f32; 3],
    unused_1: f32,
}

/// Twin of `Light` in `common/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLight {
    pub(crate) vector: [f32; 3],
    pub(crate) kind: u32,
    pub(crate) intensity: [f32; 3],
    pub(crate) shadow_layer: u32,
    pub(crate) axis: [f32; 3],
    pub(crate) half_angle: f32,
    pub(crate) full_intensity_half_angle: f32,
    pub(crate) shadow_faces: u32,
    pub(crate) unused: [f32; 2],
}

const NO_TEXTURE: u32 = u32::MAX;

/// Buffers of a scene: geometry, materials, textures and lights. Every buffer has at least one element, so that an
/// empty scene binds like any other.
pub struct SceneBuffers {
    /// `array<Vertex>`, world space.
    pub vertices: wgpu::Buffer,
    /// `array<u32>`, three per triangle; also bound as index buffer.
    pub indices: wgpu::Buffer,
    /// `array<Material>`.
    pub materials: wgpu::Buffer,
    /// The texel pool: for each texture its width, its height and its texels.
    pub texels: wgpu::Texture,
    /// `array<Light>`.
    pub lights: wgpu::Buffer,
    /// `array<Object>`, the first one for static geometry; `None` if nothing is animated.
    pub objects: Option<wgpu::Buffer>,
    /// `array<vec4f>` in the layout of `common/environment.wgsl`; `None` without an environment.
    pub environment: Option<wgpu::Buffer>,
    /// Number of indices; 0 for an empty scene.
    pub index_count: u32,
    /// Indices of solid meshes.
    pub solid: Vec<Range<u32>>,
    /// Indices of meshes that are neither solid nor alpha-masked.
    pub open: Vec<Range<u32>>,
    /// Indices of alpha-masked meshes.
    pub alpha_masked: Vec<Range<u32>>,
    /// Indices of all other meshes.
    pub without_alpha_masked: Vec<Range<u32>>,
    /// Number of lights; 0 for an unlit scene.
    pub light_count: u32,
    /// Source of [`NumberedTriangles`], for plans that need them.
    vertex_count: u32,
    corners: Vec<u32>,
    numbered: OnceLock<NumberedTriangles>,
    bvh: OnceLock<SceneBvh>,
}

/// What the buffers of a scene hold apart from their contents.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneContents {
    /// Bytes of the buffers that every scene has.
    vertices: u64,
    indices: u64,
    materials: u64,
    texels: u64,
    lights: u64,
    /// Bytes of those that only some have.
    objects: Option<u64>,
    environment: Option<u64>,
    solid: Vec<Range<u32>>,
    open: Vec<Range<u32>>,
    alpha_masked: Vec<Range<u32>>,
    without_alpha_masked: Vec<Range<u32>>,
    light_count: u32,
    vertex_count: u32,
    #[serde(with = "bulk")]
    corners: Vec<u32>,
}

impl SceneContents {
    /// Computes the contents of all buffers. Takes long for a large scene and uses no device.
    pub fn of(scene: &Scene) -> (Self, Pieces) {
        let (vertices, indices) = geometry(scene);
        let (starts, texels) = texel_pool::texel_pool(&scene.textures);
        let texture = |index: Option<usize>| index.map_or(NO_TEXTURE, |index| starts[index]);
        let materials: Vec<Material> = scene
            .materials
            .iter()
            .map(|m| Material {
                albedo: m.albedo,
                albedo_texture: texture(m.albedo_texture),
                emission: m.emission,
                alpha_texture: texture(m.alpha_texture),
                specular: m.specular,
                phong_exponent: m.phong_exponent,
                translucency: m.translucency,
                absorption: m.absorption,
                ..Material::zeroed()
            })
            .collect();
        let pose = scene.pose(0);
        let lights = lights(&pose.lights);
        let still = Object { to_world: Mat4::IDENTITY, view_to_previous: Mat4::IDENTITY };
        let objects = scene.meshes.iter().any(|mesh| mesh.object.is_some()).then(|| {
            let objects = pose.objects.iter().map(|&to_world| Object { to_world, ..still });
            [still].into_iter().chain(objects).collect()
        });
        let solid: Vec<bool> = scene.meshes.iter().map(|mesh| scene.is_solid(mesh)).collect();
        let masked = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.alpha_texture.is_some());
        let mut pieces = Pieces::default();
        let contents = Self {
            light_count: lights.len() as u32,
            vertex_count: vertices.len() as u32,
            corners: indices.clone(),
            vertices: pieces.add(Part::Buffer(BufferPart::Vertices), vertices),
            indices: pieces.add(Part::Buffer(BufferPart::Indices), indices),
            materials: pieces.add(Part::Buffer(BufferPart::Materials), materials),
            texels: pieces.add(Part::Texture(TexturePart::Texels), texels),
            lights: pieces.add(Part::Buffer(BufferPart::Lights), lights),
            objects: objects.map(|objects: Vec<Object>| pieces.add(Part::Buffer(BufferPart::Objects), objects)),
            environment: scene
                .environment
                .as_ref()
                .map(|environment| pieces.add(Part::Buffer(BufferPart::Environment), environment_words(environment))),
            solid: ranges(scene, |index, _| solid[index]),
            open: ranges(scene, |index, mesh| !solid[index] && !masked(mesh)),
            alpha_masked: ranges(scene, |_, mesh| masked(mesh)),
            without_alpha_masked: ranges(scene, |_, mesh| !masked(mesh)),
        };
        (contents, pieces)
    }
}

impl SceneBuffers {
    /// Uploads a scene that the device can hold: see [`SceneSize::check`](super::SceneSize::check).
    pub fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let (contents, pieces) = SceneContents::of(scene);
        let buffers = Self::reserve(gpu, contents);
        pieces.iter().for_each(|piece| buffers.write(gpu, &piece));
        buffers
    }

    /// Creates the buffers for these contents, of which nothing is written yet: see [`Self::write`].
    pub fn reserve(gpu: &Gpu, contents: SceneContents) -> Self {
        let SceneContents { solid, open, alpha_masked, without_alpha_masked, corners, .. } = contents;
        Self {
            vertices: BufferPart::Vertices.reserve(gpu, contents.vertices),
            indices: BufferPart::Indices.reserve(gpu, contents.indices),
            materials: BufferPart::Materials.reserve(gpu, contents.materials),
            texels: TexturePart::Texels.reserve(gpu, contents.texels),
            lights: BufferPart::Lights.reserve(gpu, contents.lights),
            objects: contents.objects.map(|bytes| BufferPart::Objects.reserve(gpu, bytes)),
            environment: contents.environment.map(|bytes| BufferPart::Environment.reserve(gpu, bytes)),
            index_count: corners.len() as u32,
            solid,
            open,
            alpha_masked,
            without_alpha_masked,
            light_count: contents.light_count,
            vertex_count: contents.vertex_count,
            corners,
            numbered: OnceLock::new(),
            bvh: OnceLock::new(),
        }
    }

    /// Writes a piece of the contents. Nothing may be drawn before all of them are written.
    pub fn write(&self, gpu: &Gpu, piece: &Piece) {
        let buffer = match piece.part {
            Part::Buffer(BufferPart::Vertices) => Some(&self.vertices),
            Part::Buffer(BufferPart::Indices) => Some(&self.indices),
            Part::Buffer(BufferPart::Materials) => Some(&self.materials),
            Part::Buffer(BufferPart::Lights) => Some(&self.lights),
            Part::Buffer(BufferPart::Objects) => self.objects.as_ref(),
            Part::Buffer(BufferPart::Environment) => self.environment.as_ref(),
            Part::Texture(part) => {
                if part == TexturePart::Texels {
                    piece.write_to_texture(gpu, part, &self.texels);
                }
                None
            }
        };
        if let Some(buffer) = buffer {
            piece.write_to_buffer(gpu, buffer);
        }
    }

    /// Uses a BVH of the scene that was built elsewhere: see [`SceneBvh::reserve`].
    pub fn set_bvh(&self, bvh: SceneBvh) {
        // A scene has one BVH: where there is one already, they are equal.
        let _ = self.bvh.set(bvh);
    }

    /// Whether the BVH was built.
    pub fn has_bvh(&self) -> bool {
        self.bvh.get().is_some()
    }

    /// The triangles with their numbers, created when the first plan needs them.
    pub(crate) fn numbered(&self, gpu: &Gpu) -> &NumberedTriangles {
        self.numbered.get_or_init(|| NumberedTriangles::new(gpu, self.vertex_count, &self.corners))
    }

    /// The BVH of `scene`, whose buffers these are, created at the first call. Plans that trace rays need it before they
    /// are compiled: see [`Self::prepare`]. Animated objects are where they are in the first frame, until [`SceneMotion`]
    /// moves them.
    ///
    /// [`SceneMotion`]: super::SceneMotion
    ///
    /// # Errors
    /// If it is too deep or too large for the device.
    pub fn bvh(&self, gpu: &Gpu, scene: &Scene) -> Result<&SceneBvh, BvhError> {
        if let Some(bvh) = self.bvh.get() {
            return Ok(bvh);
        }
        let bvh = SceneBvh::new(gpu, scene)?;
        Ok(self.bvh.get_or_init(|| bvh))
    }

    /// The animated part of the BVH; `None` without one.
    pub(super) fn moving_bvh(&self) -> Option<Arc<MovingBvh>> {
        self.bvh.get()?.moving.clone()
    }

    /// Creates what a plan needs beyond the buffers of every scene. Call it before the plan is compiled.
    ///
    /// # Errors
    /// If the plan traces rays and the scene's BVH is too deep or too large for the device.
    pub fn prepare(&self, gpu: &Gpu, scene: &Scene, plan: &FramePlan) -> Result<(), BvhError> {
        if traces_rays(plan) { self.bvh(gpu, scene).map(|_| ()) } else { Ok(()) }
    }

    /// Updates lights that moved or changed their brightness. Returns false and changes nothing if their number
    /// differs. The shadows follow with the plan: see [`halflight_frame_graph::CompiledGraph::update`].
    pub fn relight(&self, gpu: &Gpu, moved: &[Light]) -> bool {
        let same = moved.len() == self.light_count as usize;
        if same && !moved.is_empty() {
            gpu.queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&lights(moved)));
        }
        same
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let all = [&self.vertices, &self.indices, &self.materials, &self.lights];
        let texels =
            4 * u64::from(self.texels.width() * self.texels.height()) * u64::from(self.texels.depth_or_array_layers());
        let numbered = self.numbered.get().into_iter().flat_map(|numbered| [&numbered.indices, &numbered.corners]);
        all.into_iter()
            .chain(&self.objects)
            .chain(&self.environment)
            .chain(numbered)
            .map(wgpu::Buffer::size)
            .sum::<u64>()
            + texels
            + self.bvh.get().map_or(0, SceneBvh::bytes)
    }
}

impl Provider for SceneBuffers {
    fn buffer(&self, gpu: &Gpu, name: &str) -> Option<wgpu::Buffer> {
        match name.strip_prefix("scene.")? {
            "vertices" => Some(self.vertices.clone()),
            "indices" => Some(self.indices.clone()),
            "materials" => Some(self.materials.clone()),
            "lights" => Some(self.lights.clone()),
            "corners" => Some(self.numbered(gpu).corners.clone()),
            "objects" => self.objects.clone(),
            "environment" => self.environment.clone(),
            _ => None,
        }
    }

    fn texture(&self, name: &str) -> Option<wgpu::Texture> {
        match name {
            "scene.texels" => Some(self.texels.clone()),
            BVH_NODES => Some(self.bvh.get()?.nodes.clone()),
            BVH_TRIANGLES => Some(self.bvh.get()?.triangles.clone()),
            BVH_EMITTERS => Some(self.bvh.get()?.emitters.clone()),
            BVH_ATTRIBUTES => Some(self.bvh.get()?.attributes.clone()),
            _ => None,
        }
    }

    fn triangles(&self, gpu: &Gpu, name: &str) -> Option<Triangles> {
        let numbered = name.starts_with(triangles::NUMBERED);
        let indices = if numbered { self.numbered(gpu).indices.clone() } else { self.indices.clone() };
        let ranges = match name {
            triangles::ALL | triangles::NUMBERED => std::iter::once(0..self.index_count).collect(),
            triangles::SOLID => self.solid.clone(),
            triangles::OPEN => self.open.clone(),
            triangles::ALPHA_TESTED | triangles::NUMBERED_ALPHA_TESTED => self.alpha_masked.clone(),
            triangles::OPAQUE | triangles::NUMBERED_OPAQUE => self.without_alpha_masked.clone(),
            _ => return None,
        };
        Some(Triangles { indices, ranges })
    }
}

/// Names of the textures of [`SceneBvh`] in plans.
pub(crate) const BVH_NODES: &str = "scene.bvh_nodes";
pub(crate) const BVH_TRIANGLES: &str = "scene.bvh_triangles";
pub(crate) const BVH_ATTRIBUTES: &str = "scene.bvh_attributes";
pub(crate) const BVH_EMITTERS: &str = "scene.bvh_emitters";

/// Whether a plan traces rays through the scene's triangles.
pub fn traces_rays(plan: &FramePlan) -> bool {
    plan.resources.iter().any(|resource| resource.name == BVH_NODES)
}

/// Names of the scene's triangles in plans.
pub mod triangles {
    use halflight_shared_shaders::Shader;

    /// All triangles.
    pub const ALL: &str = "all";
    /// Triangles of solid meshes.
    pub const SOLID: &str = "solid";
    /// Triangles of meshes that are neither solid nor alpha-masked.
    pub const OPEN: &str = "open";
    /// Triangles of alpha-masked meshes.
    pub const ALPHA_TESTED: &str = "alpha_tested";
    /// Triangles of all other meshes.
    pub const OPAQUE: &str = "opaque";
    /// All triangles in the scene's order, with the corners of `scene.corners`: each begins with a corner of its own.
    pub const NUMBERED: &str = "numbered";
    /// As [`NUMBERED`], of alpha-masked meshes.
    pub const NUMBERED_ALPHA_TESTED: &str = "numbered_alpha_tested";
    /// As [`NUMBERED`], of all others.
    pub const NUMBERED_OPAQUE: &str = "numbered_opaque";

    /// All triangles. Those that are not alpha-masked use a shader without the alpha test, because a fragment that may
    /// be discarded costs several times as much as depth alone. `None` is the pass's own shader.
    pub fn by_alpha(alpha_tested: bool, opaque: &'static Shader) -> Vec<(&'static str, Option<&'static Shader>)> {
        if alpha_tested { vec![(OPAQUE, Some(opaque)), (ALPHA_TESTED, None)] } else { vec![(ALL, None)] }
    }

    /// As [`by_alpha`], for numbered triangles.
    pub fn numbered_by_alpha(
        alpha_tested: bool,
        opaque: &'static Shader,
    ) -> Vec<(&'static str, Option<&'static Shader>)> {
        if alpha_tested {
            vec![(NUMBERED_OPAQUE, Some(opaque)), (NUMBERED_ALPHA_TESTED, None)]
        } else {
            vec![(NUMBERED, None)]
        }
    }
}

fn geometry(scene: &Scene) -> (Vec<Vertex>, Vec<u32>) {
    let mut vertices = Vec::new();
    let mut indices = Vec::new();
    for mesh in &scene.meshes {
        let first = vertices.len() as u32;
        // The first object is the static world.
        let object = mesh.object.map_or(0, |object| object as u32 + 1);
        vertices.extend(mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs).map(|((&position, &normal), &uv)| {
            Vertex { position, material: mesh.material as u32, uv, normal: pack_normal(normal), object }
        }));
        indices.extend(mesh.indices.iter().map(|index| first + index));
    }
    (vertices, indices)
}

/// Index ranges of the wanted meshes. Adjacent ranges are joined.
fn ranges(scene: &Scene, wanted: impl Fn(usize, &Mesh) -> bool) -> Vec<Range<u32>> {
    let mut ranges = Vec::<Range<u32>>::new();
    let mut first = 0;
    for (index, mesh) in scene.meshes.iter().enumerate() {
        let end = first + mesh.indices.len() as u32;
        if wanted(index, mesh) {
            match ranges.last_mut() {
                Some(last) if last.end == first => last.end = end,
                _ if end > first => ranges.push(first..end),
                _ => {}
            }
        }
        first = end;
    }
    ranges
}

/// Octahedral map to two signed 16-bit numbers, as `octahedral_encode` and `pack2x16snorm` do.
fn pack_normal(normal: [f32; 3]) -> u32 {
    let n = Vec3::from(normal);
    let n = n / n.abs().element_sum().max(f32::MIN_POSITIVE);
    let mut p = vec2(n.x, n.y);
    if n.z < 0.0 {
        let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
        p = vec2((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y));
    }
    let snorm = |v: f32| ((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16) as u32;
    snorm(p.x) | snorm(p.y) << 16
}

/// A spot light wider than this (half angle, degrees) has six faces, because a single projection would waste its texels
/// at the rim.
const WIDE_SPOT_DEGREES: f32 = 60.0;

/// Number of shadow map layers of a light.
pub(crate) fn shadow_faces(light: &Light) -> u32 {
    match light {
        Light::Point { .. } => 6,
        Light::Spot { half_angle_degrees, .. } if *half_angle_degrees > WIDE_SPOT_DEGREES => 6,
        Light::Spot { .. } | Light::Directional { .. } => 1,
    }
}

pub(crate) fn lights(lights: &[Light]) -> Vec<GpuLight> {
    let unit = |v: [f32; 3]| Vec3::from(v).normalize_or(Vec3::NEG_Y).to_array();
    let mut layer = 0;
    lights
        .iter()
        .map(|light| {
            let shadow_faces = shadow_faces(light);
            let mut twin = GpuLight { shadow_layer: layer, shadow_faces, ..GpuLight::zeroed() };
            layer += shadow_faces;
            match *light {
                Light::Directional { direction, irradiance } => {
                    (twin.vector, twin.kind, twin.intensity) = (unit(direction), 0, irradiance);
                }
                Light::Point { position, intensity } => {
                    (twin.vector, twin.kind, twin.intensity) = (position, 1, intensity);
                }
                Light::Spot {
                    position,
                    direction,
                    intensity,
                    half_angle_degrees,
                    full_intensity_half_angle_degrees,
                } => {
                    (twin.vector, twin.kind, twin.intensity) = (position, 2, intensity);
                    twin.axis = unit(direction);
                    twin.half_angle = half_angle_degrees.to_radians();
                    twin.full_intensity_half_angle = full_intensity_half_angle_degrees.to_radians();
                }
            }
            twin
        })
        .collect()
}
