//! Uniform blocks, packed from named values by the layout that the shader declares.

use glam::Mat4;
use halflight_shared_shaders::Member;
use serde::Serialize;

/// A value of a field of a uniform block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum UniformValue {
    /// `u32`.
    U32(u32),
    /// `f32`.
    F32(f32),
    /// `vec2f`.
    Vec2([f32; 2]),
    /// `mat4x4f`, column-major.
    Mat4([f32; 16]),
}

impl From<u32> for UniformValue {
    fn from(value: u32) -> Self {
        Self::U32(value)
    }
}

impl From<f32> for UniformValue {
    fn from(value: f32) -> Self {
        Self::F32(value)
    }
}

impl From<[f32; 2]> for UniformValue {
    fn from(value: [f32; 2]) -> Self {
        Self::Vec2(value)
    }
}

impl From<Mat4> for UniformValue {
    fn from(value: Mat4) -> Self {
        Self::Mat4(value.to_cols_array())
    }
}

impl UniformValue {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::U32(v) => bytemuck::bytes_of(v),
            Self::F32(v) => bytemuck::bytes_of(v),
            Self::Vec2(v) => bytemuck::bytes_of(v),
            Self::Mat4(v) => bytemuck::bytes_of(v),
        }
    }
}

/// Packs named values into a block of this layout.
///
/// # Panics
/// Where a field has no value or one of another size: a pass of this crate forgot it. Every plan of
/// the test suite is packed, so this cannot reach a user.
pub fn pack(size: u32, members: &[Member], values: &[(&str, UniformValue)], what: &str) -> Vec<u8> {
    let mut block = vec![0; size as usize];
    for member in members {
        let (_, value) = values
            .iter()
            .find(|(name, _)| *name == member.name)
            .unwrap_or_else(|| panic!("{what}: no value for the field {}", member.name));
        let bytes = value.bytes();
        assert_eq!(bytes.len(), member.size as usize, "{what}: size of the field {}", member.name);
        block[member.offset as usize..][..bytes.len()].copy_from_slice(bytes);
    }
    block
}
