//! The scene on the device. Layouts are those of `common/scene.wgsl`.

use std::{ops::Range, sync::OnceLock};

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, vec2};
use halflight_frame_graph::{Gpu, Provider, Triangles};
use halflight_scenes::{Environment, Light, Mesh, Scene, Texture};

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
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
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
    /// `array<u32>`: for each texture its width, its height and its texels.
    pub texels: wgpu::Buffer,
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
}

/// The triangles with their numbers, for browsers without `primitive_index`: the first corner of each triangle, from
/// which a flat varying is taken, begins no other triangle.
pub(crate) struct NumberedTriangles {
    /// Index buffer into `corners`, in the order of the scene's indices.
    pub(crate) indices: wgpu::Buffer,
    /// `array<vec2u>`: a vertex, and the number of the triangle that begins with it, counted from 1.
    corners: wgpu::Buffer,
}

impl SceneBuffers {
    /// Uploads a scene.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let (vertices, indices) = geometry(scene);
        let (starts, texels) = texel_pool(&scene.textures);
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
        let lights = lights(&scene.pose(0).lights);
        let alpha_masked = |mesh: &Mesh| scene.materials.get(mesh.material).is_some_and(|m| m.alpha_texture.is_some());
        let storage = |label, bytes: &[u8], size: usize, usage| {
            let empty = vec![0u8; size];
            let contents = if bytes.is_empty() { &empty } else { bytes };
            gpu.filled_buffer(label, contents, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | usage)
        };
        use bytemuck::cast_slice;
        let none = wgpu::BufferUsages::empty();
        let copied_to = wgpu::BufferUsages::COPY_DST;
        let still = Object { to_world: Mat4::IDENTITY, view_to_previous: Mat4::IDENTITY };
        let objects = scene.meshes.iter().any(|mesh| mesh.object.is_some()).then(|| {
            let poses = scene.pose(0).objects;
            let objects = poses.into_iter().map(|to_world| Object { to_world, ..still });
            let objects: Vec<Object> = [still].into_iter().chain(objects).collect();
            storage("scene.objects", cast_slice(&objects), size_of::<Object>(), copied_to)
        });
        Self {
            vertices: storage("scene.vertices", cast_slice(&vertices), size_of::<Vertex>(), none),
            indices: storage("scene.indices", cast_slice(&indices), 4, wgpu::BufferUsages::INDEX),
            materials: storage("scene.materials", cast_slice(&materials), size_of::<Material>(), none),
            texels: storage("scene.texels", cast_slice(&texels), 4, none),
            lights: storage("scene.lights", cast_slice(&lights), size_of::<GpuLight>(), copied_to),
            objects,
            environment: scene
                .environment
                .as_ref()
                .map(|environment| storage("scene.environment", cast_slice(&environment_words(environment)), 16, none)),
            index_count: indices.len() as u32,
            solid: ranges(scene, |mesh| scene.is_solid(mesh)),
            open: ranges(scene, |mesh| !scene.is_solid(mesh) && !alpha_masked(mesh)),
            alpha_masked: ranges(scene, alpha_masked),
            without_alpha_masked: ranges(scene, |mesh| !alpha_masked(mesh)),
            light_count: lights.len() as u32,
            vertex_count: vertices.len() as u32,
            corners: indices,
            numbered: OnceLock::new(),
        }
    }

    /// The triangles with their numbers, created when the first plan needs them.
    pub(crate) fn numbered(&self, gpu: &Gpu) -> &NumberedTriangles {
        self.numbered.get_or_init(|| {
            let (mut indices, mut corners) = numbered(self.vertex_count, &self.corners);
            if indices.is_empty() {
                (indices, corners) = (vec![0; 3], vec![[0; 2]]);
            }
            let buffer = |label, bytes: &[u8], usage| gpu.filled_buffer(label, bytes, usage);
            NumberedTriangles {
                indices: buffer("numbered triangles", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
                corners: buffer("scene.corners", bytemuck::cast_slice(&corners), wgpu::BufferUsages::STORAGE),
            }
        })
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
        let all = [&self.vertices, &self.indices, &self.materials, &self.texels, &self.lights];
        let numbered = self.numbered.get().into_iter().flat_map(|numbered| [&numbered.indices, &numbered.corners]);
        all.into_iter().chain(&self.objects).chain(&self.environment).chain(numbered).map(wgpu::Buffer::size).sum()
    }
}

impl Provider for SceneBuffers {
    fn buffer(&self, gpu: &Gpu, name: &str) -> Option<wgpu::Buffer> {
        match name.strip_prefix("scene.")? {
            "vertices" => Some(self.vertices.clone()),
            "indices" => Some(self.indices.clone()),
            "materials" => Some(self.materials.clone()),
            "texels" => Some(self.texels.clone()),
            "lights" => Some(self.lights.clone()),
            "corners" => Some(self.numbered(gpu).corners.clone()),
            "objects" => self.objects.clone(),
            "environment" => self.environment.clone(),
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

/// Indices with each triangle rotated so that it begins with a corner of its own, and those corners: a vertex and the
/// number of the triangle that begins with it, counted from 1, or 0. A vertex is duplicated if all corners of a
/// triangle are taken.
fn numbered(vertices: u32, indices: &[u32]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut corners: Vec<[u32; 2]> = (0..vertices).map(|vertex| [vertex, 0]).collect();
    let mut turned = Vec::with_capacity(indices.len());
    for (triangle, of) in indices.chunks_exact(3).enumerate() {
        let free = (0..3).find(|&i| corners[of[i] as usize][1] == 0);
        let (turn, first) = free.map_or((0, corners.len() as u32), |i| (i, of[i]));
        if free.is_none() {
            corners.push([of[0], 0]);
        }
        corners[first as usize][1] = triangle as u32 + 1;
        turned.extend([first, of[(turn + 1) % 3], of[(turn + 2) % 3]]);
    }
    (turned, corners)
}

/// Index ranges of the wanted meshes. Adjacent ranges are joined.
fn ranges(scene: &Scene, wanted: impl Fn(&Mesh) -> bool) -> Vec<Range<u32>> {
    let mut ranges = Vec::<Range<u32>>::new();
    let mut first = 0;
    for mesh in &scene.meshes {
        let end = first + mesh.indices.len() as u32;
        if wanted(mesh) {
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

/// Largest width of the environment map for techniques. A wider one is averaged over squares.
const LOOK_UP_WIDTH: u32 = 64;

/// Twin of the layout in `common/environment.wgsl`: sizes, nine coefficients of irradiance, the map, and a small copy.
fn environment_words(environment: &Environment) -> Vec<[f32; 4]> {
    let Environment { width, height, texels, .. } = environment;
    let (w, h) = (*width, *height);
    let factor = w.div_ceil(LOOK_UP_WIDTH).max(1);
    let small = [w.div_ceil(factor), h.div_ceil(factor)];
    let mut words = vec![[w, h, small[0], small[1]].map(|v| v as f32)];
    words.extend(irradiance_coefficients(environment).map(|[r, g, b]| [r, g, b, 0.0]));
    words.extend(texels.iter().map(|&[r, g, b]| [r, g, b, 0.0]));
    for y in 0..small[1] {
        for x in 0..small[0] {
            let mut sum = [0.0f64; 3];
            let mut count = 0.0;
            for v in y * factor..((y + 1) * factor).min(h) {
                for u in x * factor..((x + 1) * factor).min(w) {
                    let texel = texels[(v * w + u) as usize];
                    sum.iter_mut().zip(texel).for_each(|(s, t)| *s += f64::from(t));
                    count += 1.0;
                }
            }
            let [r, g, b] = sum.map(|v| (v / f64::max(count, 1.0)) as f32);
            words.push([r, g, b, 0.0]);
        }
    }
    words
}

/// Irradiance over pi as a polynomial of the normal (Ramamoorthi & Hanrahan 2001, Equation 13): factors of
/// 1, y, z, x, xy, yz, 3z^2 - 1, xz and x^2 - y^2.
fn irradiance_coefficients(environment: &Environment) -> [[f32; 3]; 9] {
    use std::f64::consts::PI;
    let (w, h) = (f64::from(environment.width), f64::from(environment.height));
    // A texel may cover a large angle, so texels of small maps are sampled at many positions.
    let fine = (128.0 / w).ceil().max(1.0) as u32;
    let mut sums = [[0.0f64; 3]; 9];
    for (index, texel) in environment.texels.iter().enumerate() {
        let (x, y) = (index as u32 % environment.width, index as u32 / environment.width);
        for part in 0..fine * fine {
            let place = |v: u32, part: u32| f64::from(v) + (f64::from(part) + 0.5) / f64::from(fine);
            let longitude = (place(x, part % fine) / w - 0.5) * 2.0 * PI;
            let latitude = place(y, part / fine) / h * PI;
            let (sin, cos) = latitude.sin_cos();
            let d = [sin * longitude.sin(), cos, -sin * longitude.cos()];
            let solid_angle = 2.0 * PI / w * PI / h * sin / f64::from(fine * fine);
            for (sum, value) in sums.iter_mut().zip(harmonics(d)) {
                sum.iter_mut().zip(texel).for_each(|(s, &t)| *s += f64::from(t) * value * solid_angle);
            }
        }
    }
    // The cosine's coefficients over pi (1, 2/3, 1/4 by degree), and the norm of each polynomial again.
    let cosine = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];
    std::array::from_fn(|i| sums[i].map(|v| (v * cosine[i] * NORMS[i]) as f32))
}

/// Norms of the real spherical harmonics up to degree 2.
const NORMS: [f64; 9] =
    [0.282_095, 0.488_603, 0.488_603, 0.488_603, 1.092_548, 1.092_548, 0.315_392, 1.092_548, 0.546_274];

fn harmonics([x, y, z]: [f64; 3]) -> [f64; 9] {
    let polynomials = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    std::array::from_fn(|i| NORMS[i] * polynomials[i])
}

/// All textures in one array of words. Returns the start of each texture.
fn texel_pool(textures: &[Texture]) -> (Vec<u32>, Vec<u32>) {
    // Square root of the linear value, in 10 bits, for each sRGB code.
    let root: [u32; 256] = std::array::from_fn(|code| {
        let v = code as f32 / 255.0;
        let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        (linear.sqrt() * 1023.0).round() as u32
    });
    let mut words = Vec::new();
    let starts = textures
        .iter()
        .map(|texture| {
            let start = words.len() as u32;
            words.extend([texture.width, texture.height]);
            words.extend(texture.rgba.as_chunks::<4>().0.iter().map(|&[r, g, b, a]| {
                let alpha = if a >= 128 { 3 } else { 0 };
                root[r as usize] | root[g as usize] << 10 | root[b as usize] << 20 | alpha << 30
            }));
            start
        })
        .collect();
    (starts, words)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_triangle_begins_with_a_corner_of_its_own() {
        // A closed fan around vertex 0, and a triangle without a free vertex.
        let fan = [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1, 0, 1, 2, 1, 2, 3];
        let (turned, corners) = numbered(5, &fan);
        let vertex = |corner: &u32| corners[*corner as usize][0];
        for (triangle, (own, of)) in turned.chunks_exact(3).zip(fan.chunks_exact(3)).enumerate() {
            assert_eq!(corners[own[0] as usize][1], triangle as u32 + 1);
            let own: Vec<u32> = own.iter().map(vertex).collect();
            assert!((0..3).any(|turn| own == [of[turn], of[(turn + 1) % 3], of[(turn + 2) % 3]]), "{own:?} {of:?}");
        }
        // Five vertices serve five triangles. The sixth triangle duplicates one.
        assert_eq!(corners.len(), 6);
    }
}
