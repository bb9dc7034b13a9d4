//! The scene as plain data. Positions and directions are in world space, relative to [`Scene::origin`].

use glam::{Mat4, Vec3};
use serde::{Deserialize, Serialize};

use crate::{bulk, moves::Moves};

/// A complete scene: everything that a renderer or a path tracer reads.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name for tables and file names.
    pub name: String,
    /// Models that meshes were loaded from. [`Mesh::model`] refers to them by index.
    pub models: Vec<Model>,
    /// Triangle meshes in world space, one material each.
    pub meshes: Vec<Mesh>,
    /// Materials that meshes refer to by index.
    pub materials: Vec<Material>,
    /// Textures that materials refer to by index.
    pub textures: Vec<Texture>,
    /// Punctual lights (directional, point, spot).
    pub lights: Vec<Light>,
    /// The camera that a render uses by default.
    pub camera: Camera,
    /// Static cameras beside the main one. A screen-space technique may gather light from their images, too
    /// (Soler et al. 2009, Figure 9).
    pub extra_cameras: Vec<Camera>,
    /// Light from outside the geometry, if any.
    pub environment: Option<Environment>,
    /// What every position is relative to, in the coordinates of the scene's files, scene units. It is 0 unless the scene
    /// is so far from the origin that float32 numbers could not hold its shape. A writer adds it to what it writes.
    pub origin: [f64; 3],
    /// Animation; empty for a static scene. Every other field is the scene in its rest pose.
    pub moves: Moves,
    /// What the loader fixed or replaced, one sentence each.
    pub warnings: Vec<String>,
}

/// Where the surfaces of a model come from, and how they were transformed: one `[[model]]` of a scene file.
///
/// A saved scene refers to its models by this, so that it needs no copy of their triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// The origin of the surfaces.
    pub source: ModelSource,
    /// Applied to the vertices when the model was loaded.
    pub transform: Transform,
}

/// The origin of a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelSource {
    /// A generator, by name: one of [`crate::generators::NAMES`].
    Generator(String),
    /// An OBJ or glTF file, by its path relative to the scene file.
    File(String),
}

/// Scale, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Translation, scene units.
    pub translate: [f32; 3],
    /// Rotations about the fixed axes x, then y, then z, degrees.
    pub rotate_degrees: [f32; 3],
    /// Factors along the axes, none of them 0.
    pub scale: [f32; 3],
}

impl Default for Transform {
    fn default() -> Self {
        Self { translate: [0.0; 3], rotate_degrees: [0.0; 3], scale: [1.0; 3] }
    }
}

/// Indexed triangles of one material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Name of the object in its file, for messages.
    pub name: String,
    /// Positions, scene units.
    #[serde(with = "bulk")]
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, one for each position.
    #[serde(with = "bulk")]
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one for each position, `v` running downwards (row 0 is the top of the image).
    #[serde(with = "bulk")]
    pub uvs: Vec<[f32; 2]>,
    /// Three indices per triangle.
    #[serde(with = "bulk")]
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// The motion of the mesh, index into [`Moves::objects`]; `None` for a static mesh.
    pub object: Option<usize>,
    /// The model that the mesh was loaded from, index into [`Scene::models`]; `None` for a mesh made in memory. Set it
    /// to `None` when the mesh is edited: a saved scene refers to the model and does not store its triangles.
    pub model: Option<usize>,
}

/// A surface. Surfaces are two-sided; the diffuse BRDF is `albedo / pi`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in its file.
    pub name: String,
    /// Diffuse reflectance (`Kd`), linear, each channel 0..1; multiplied by the texture if there is one.
    pub albedo: [f32; 3],
    /// Diffuse texture (`map_Kd`), sRGB-encoded, index into [`Scene::textures`].
    pub albedo_texture: Option<usize>,
    /// Alpha mask (`map_d`), index into [`Scene::textures`]. The surface is absent where the mask is under 0.5. The mask
    /// is the image's alpha, or its luminance if the image has no transparency.
    pub alpha_texture: Option<usize>,
    /// Emitted radiance (`Ke`), linear, W sr^-1 m^-2.
    pub emission: [f32; 3],
    /// Specular reflectance (`Ks`), linear, 0..1.
    pub specular: [f32; 3],
    /// Phong exponent (`Ns`), 0..1e6.
    pub phong_exponent: f32,
    /// Fraction of the light on the far side that is transmitted (`translucency`), linear, 0..1; 0 is opaque. Transmitted
    /// light leaves the surface diffusely.
    pub translucency: [f32; 3],
    /// Absorption coefficient inside a translucent body (`absorption`), linear, per scene unit, 0..1e9. Over a distance
    /// d the transmittance is exp(-absorption d).
    pub absorption: [f32; 3],
    /// The surface receives indirect light and sends none: techniques use a radiance of 0 for it as a source.
    pub receive_only: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            albedo: [0.8; 3],
            albedo_texture: None,
            alpha_texture: None,
            emission: [0.0; 3],
            specular: [0.0; 3],
            phong_exponent: 0.0,
            translucency: [0.0; 3],
            absorption: [0.0; 3],
            receive_only: false,
        }
    }
}

/// An image as stored in its file: 8 bits per channel, colour sRGB-encoded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// File name relative to its material library, for messages and export.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes, RGBA, rows from top to bottom. In an alpha mask the alpha channel holds the mask
    /// (255 is opaque), whichever channel of the file it came from.
    #[serde(with = "bulk")]
    pub rgba: Vec<u8>,
}

/// A punctual light. Directions are those in which the light travels; they need not be unit length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Parallel light.
    Directional {
        /// Direction of travel.
        direction: [f32; 3],
        /// Irradiance at normal incidence, W m^-2.
        irradiance: [f32; 3],
    },
    /// A point that emits in every direction.
    Point {
        /// World position.
        position: [f32; 3],
        /// Radiant intensity, W sr^-1.
        intensity: [f32; 3],
    },
    /// A point that emits into a cone. The intensity falls linearly with the angle from
    /// `full_intensity_half_angle_degrees` to `half_angle_degrees`.
    Spot {
        /// World position.
        position: [f32; 3],
        /// Axis, direction of travel.
        direction: [f32; 3],
        /// Radiant intensity on the axis, W sr^-1.
        intensity: [f32; 3],
        /// Half angle of the cone, degrees, 0..90.
        half_angle_degrees: f32,
        /// Half angle of full intensity, degrees, at most `half_angle_degrees`.
        full_intensity_half_angle_degrees: f32,
    },
}

/// A pinhole camera. View space is right-handed, +y up, looking along -z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// World position of the eye.
    pub eye: [f32; 3],
    /// World position that the camera looks at.
    pub target: [f32; 3],
    /// World direction that points up in the image.
    pub up: [f32; 3],
    /// Vertical field of view, degrees, 1..170.
    pub vertical_fov_degrees: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self { eye: [0.0, 0.0, 1.0], target: [0.0; 3], up: [0.0, 1.0, 0.0], vertical_fov_degrees: 60.0 }
    }
}

impl Camera {
    /// World to view space. Always finite: another up vector is used if `up` is parallel to the view axis, and the
    /// camera looks along -z if `eye` equals `target`.
    pub fn view_matrix(&self) -> Mat4 {
        let eye = Vec3::from(self.eye);
        let forward = (Vec3::from(self.target) - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        let up = Vec3::from(self.up).try_normalize().unwrap_or(Vec3::Y);
        let up = if forward.cross(up).length_squared() < 1e-8 { forward.any_orthonormal_vector() } else { up };
        glam::camera::rh::view::look_to_mat4(eye, forward, up)
    }

    /// Tangents of half the field of view, [horizontal, vertical], for an image of this size.
    pub fn tan_half_fov(&self, width: u32, height: u32) -> [f32; 2] {
        let vertical = (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        [vertical * width as f32 / height as f32, vertical]
    }
}

/// Light that arrives from outside the geometry: a latitude-longitude map.
///
/// The direction d through the centre of the texel (x, y) satisfies
/// x = (0.5 + atan2(d.x, -d.z) / 2 pi) width and y = acos(d.y) / pi height. Radiance is constant over a texel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// File name relative to the scene file; `None` if the scene file gives a constant radiance.
    pub map: Option<String>,
    /// Texels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, W sr^-1 m^-2, rows from top to bottom.
    #[serde(with = "bulk")]
    pub texels: Vec<[f32; 3]>,
}

impl Environment {
    /// The same radiance from every direction.
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self { map: None, width: 1, height: 1, texels: vec![radiance] }
    }
}

impl Scene {
    /// Axis-aligned bounding box of all vertices as (low, high); `None` for an empty scene.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.meshes.iter().flat_map(|mesh| &mesh.positions).map(|&p| Vec3::from(p)).fold(None, |bounds, p| {
            let (low, high) = bounds.unwrap_or((p, p));
            Some((low.min(p), high.max(p)))
        })
    }

    /// Number of triangles in all meshes.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum()
    }
}
