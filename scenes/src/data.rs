//! The scene as data. Every position and direction is in world space.

use glam::{Mat4, Vec3};

use crate::Moves;

/// A complete scene: everything that a frame or a path tracer reads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name used in tables and file names.
    pub name: String,
    /// Triangle meshes, world space, one material each.
    pub meshes: Vec<Mesh>,
    /// Materials that meshes refer to by index.
    pub materials: Vec<Material>,
    /// Textures that materials refer to by index.
    pub textures: Vec<Texture>,
    /// Delta lights.
    pub lights: Vec<Light>,
    /// The camera that a render uses unless it is told otherwise.
    pub camera: Camera,
    /// Cameras that stand still and see light which the display's camera does not: techniques on the screen may gather
    /// in their images, too (Soler et al. 2009, Figure 9).
    pub extra_cameras: Vec<Camera>,
    /// Light from outside the scene, where the scene has any.
    pub environment: Option<Environment>,
    /// What moves; empty for a still scene. Everything else is the scene at rest.
    pub moves: Moves,
    /// What the loader mended or replaced, one sentence each.
    pub warnings: Vec<String>,
}

/// Indexed triangles of one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name of the object in its file, for messages.
    pub name: String,
    /// Positions, scene units.
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, one for each position.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one for each position, `v` running downwards (row 0 is the top of the image).
    pub uvs: Vec<[f32; 2]>,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// The motion that moves the mesh, index into [`Moves::objects`]; `None` for one that stands still.
    pub object: Option<usize>,
}

/// A surface. Surfaces are two-sided; the diffuse BRDF is `albedo / pi`.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in its file.
    pub name: String,
    /// Diffuse reflectance (`Kd`), linear, each channel 0..1; multiplied by the texture where there is one.
    pub albedo: [f32; 3],
    /// Diffuse texture (`map_Kd`), sRGB-encoded, index into [`Scene::textures`].
    pub albedo_texture: Option<usize>,
    /// Cut-out texture (`map_d`), index into [`Scene::textures`]; a surface is absent where its
    /// alpha (or, in an image without transparency, its luminance) is under 0.5.
    pub alpha_texture: Option<usize>,
    /// Emitted radiance (`Ke`), linear, W sr^-1 m^-2.
    pub emission: [f32; 3],
    /// Specular reflectance (`Ks`), linear, 0..1.
    pub specular: [f32; 3],
    /// Phong exponent (`Ns`), 0..1e6.
    pub phong_exponent: f32,
    /// Share of the light on the far side that passes (`translucency`), linear, 0..1; 0 is opaque. What passes leaves as from
    /// a diffuse surface.
    pub translucency: [f32; 3],
    /// Absorption inside a translucent body (`absorption`), linear, for each scene unit, 0..1e9: after a way d there
    /// exp(-absorption d) of the light is left.
    pub absorption: [f32; 3],
    /// The surface receives indirect light and sends none: techniques take its radiance as a source for 0.
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

/// An image as it was stored: 8 bits a channel, colour sRGB-encoded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    /// File name relative to the scene, for messages and export.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height * 4` bytes, RGBA, rows from top to bottom. In a cut-out texture the alpha
    /// channel is already the mask value (255 opaque), whichever channel the file kept it in.
    pub rgba: Vec<u8>,
}

/// A delta light. Directions are those in which the light travels; they need not be unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light.
    Directional {
        /// Direction of travel.
        direction: [f32; 3],
        /// Irradiance at normal incidence, W m^-2.
        irradiance: [f32; 3],
    },
    /// A point that shines in every direction.
    Point {
        /// World position.
        position: [f32; 3],
        /// Radiant intensity, W sr^-1.
        intensity: [f32; 3],
    },
    /// A point that shines into a cone; intensity falls linearly in angle from
    /// `full_intensity_half_angle_degrees` to `half_angle_degrees`.
    Spot {
        /// World position.
        position: [f32; 3],
        /// Axis, direction of travel.
        direction: [f32; 3],
        /// Radiant intensity on the axis, W sr^-1.
        intensity: [f32; 3],
        /// Edge of the cone, degrees, 0..90.
        half_angle_degrees: f32,
        /// Full intensity inside this angle, degrees, at most `half_angle_degrees`.
        full_intensity_half_angle_degrees: f32,
    },
}

/// A pinhole camera. View space is right-handed, +y up, looking along -z.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// World to view space. Falls back to another up vector where `up` is parallel to the view
    /// axis, and to looking along -z where `eye` equals `target`, so the result is always finite.
    pub fn view_matrix(&self) -> Mat4 {
        let eye = Vec3::from(self.eye);
        let forward = (Vec3::from(self.target) - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        let up = Vec3::from(self.up).try_normalize().unwrap_or(Vec3::Y);
        let up = if forward.cross(up).length_squared() < 1e-8 { forward.any_orthonormal_vector() } else { up };
        glam::camera::rh::view::look_to_mat4(eye, forward, up)
    }

    /// Tangents of the half field of view, (horizontal, vertical), for an image of this size.
    pub fn tan_half_fov(&self, width: u32, height: u32) -> [f32; 2] {
        let vertical = (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        [vertical * width as f32 / height as f32, vertical]
    }
}

/// Light that arrives from outside all geometry: a map of directions.
///
/// Longitude runs along rows, latitude along columns: the direction d of the middle of a texel (x, y) has
/// x = (0.5 + atan2(d.x, -d.z) / 2 pi) width, y = acos(d.y) / pi height. All of a texel has one radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// File name relative to the scene; `None` for a radiance that was written down.
    pub map: Option<String>,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, W sr^-1 m^-2, rows from the top.
    pub texels: Vec<[f32; 3]>,
}

impl Environment {
    /// The same radiance from every direction.
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self { map: None, width: 1, height: 1, texels: vec![radiance] }
    }
}

impl Scene {
    /// Corners of the smallest axis-aligned box around all vertices; `None` for an empty scene.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.meshes.iter().flat_map(|mesh| &mesh.positions).map(|&p| Vec3::from(p)).fold(None, |bounds, p| {
            let (low, high) = bounds.unwrap_or((p, p));
            Some((low.min(p), high.max(p)))
        })
    }

    /// Whether a mesh of this scene is the skin of solid matter: watertight, and without cut-outs.
    pub fn is_solid(&self, mesh: &Mesh) -> bool {
        let cut_out = self.materials.get(mesh.material).is_some_and(|material| material.alpha_texture.is_some());
        !cut_out && mesh.is_watertight()
    }

    /// Number of triangles over all meshes.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum()
    }
}
