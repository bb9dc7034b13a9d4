//! One run of a shader of any type.

use serde::Serialize;

use crate::{BindingKind, Shader};

/// One run of a shader with all its inputs. The types of the shaders convert to it. It can also be built by hand for a
/// shader that this crate does not contain. `R` identifies resources.
#[derive(Clone, Debug, PartialEq)]
pub struct Call<R> {
    /// The shader.
    pub shader: &'static Shader,
    /// Resources by the name of the WGSL variable.
    pub bindings: Vec<(&'static str, R)>,
    /// Fields of the uniform block `params`.
    pub params: Vec<(&'static str, UniformValue)>,
    /// Pipeline-overridable constants.
    pub constants: Vec<(&'static str, f64)>,
}

impl<R> Call<R> {
    /// A run without inputs.
    pub fn new(shader: &'static Shader) -> Self {
        Self { shader, bindings: Vec::new(), params: Vec::new(), constants: Vec::new() }
    }

    /// Binds a resource if there is one and the shader has a variable of this name.
    pub(crate) fn bind(&mut self, name: &'static str, resource: Option<R>) {
        let resource = resource.filter(|_| self.shader.bindings().any(|binding| binding.name == name));
        self.bindings.extend(resource.map(|resource| (name, resource)));
    }

    /// Sets those constants that this variant of the shader has.
    pub(crate) fn constants(&mut self, values: Vec<(&'static str, f64)>) {
        self.constants.extend(values.into_iter().filter(|(name, _)| self.shader.overrides.contains(name)));
    }

    /// Checks that all inputs are given.
    ///
    /// # Panics
    /// If this variant of the shader has a resource or a field of `params` that is not given: a mistake of the calling program, not of its user.
    pub(crate) fn checked(self) -> Self {
        for binding in self.shader.bindings() {
            let given = match &binding.kind {
                BindingKind::Sampler { .. } => true,
                BindingKind::Uniform { .. } if ["view", "previous", "division"].contains(&binding.name) => true,
                BindingKind::Uniform { members, .. } if binding.name == "params" => {
                    for member in members.iter().filter(|member| !member.name.starts_with("unused")) {
                        let given = self.params.iter().any(|(name, _)| *name == member.name);
                        assert!(given, "{} has no value for params.{}", self.shader.name, member.name);
                    }
                    true
                }
                _ => self.bindings.iter().any(|(name, _)| *name == binding.name),
            };
            assert!(given, "{} binds nothing to {}", self.shader.name, binding.name);
        }
        self
    }
}

/// A Rust type of a pipeline-overridable constant.
pub trait Constant {
    /// The value as wgpu expects it.
    fn to_f64(self) -> f64;
}

impl Constant for bool {
    fn to_f64(self) -> f64 {
        f64::from(u8::from(self))
    }
}

impl Constant for u32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Constant for i32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Constant for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

macro_rules! uniform_values {
    ($($(#[$doc:meta])* $variant:ident($type:ty)),* $(,)?) => {
        /// A value of a field of a uniform block.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        pub enum UniformValue { $($(#[$doc])* $variant($type)),* }

        $(impl From<$type> for UniformValue {
            fn from(value: $type) -> Self {
                Self::$variant(value)
            }
        })*

        impl UniformValue {
            /// The bytes as the device reads them.
            pub fn bytes(&self) -> &[u8] {
                match self { $(Self::$variant(value) => bytemuck::bytes_of(value)),* }
            }
        }
    };
}

uniform_values! {
    /// `u32`.
    U32(u32),
    /// `i32`.
    I32(i32),
    /// `f32`.
    F32(f32),
    /// `vec2f`.
    Vec2([f32; 2]),
    /// `vec3f`.
    Vec3([f32; 3]),
    /// `vec4f`.
    Vec4([f32; 4]),
    /// `vec2u`.
    UVec2([u32; 2]),
    /// `vec3u`.
    UVec3([u32; 3]),
    /// `vec4u`.
    UVec4([u32; 4]),
    /// `mat4x4f`, column-major.
    Mat4([[f32; 4]; 4]),
}
