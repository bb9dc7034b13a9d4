//! Uniform blocks, packed from named values by the layout that the shader declares.

use halflight_shared_shaders::{Member, UniformValue};

/// Packs named values into a block of this layout.
///
/// # Panics
/// If a field has no value or one of another size. Every plan of the test suite is packed, so this cannot reach a user.
pub fn pack(size: u32, members: &[Member], values: &[(&str, UniformValue)], what: &str) -> Vec<u8> {
    let mut block = vec![0; size as usize];
    for member in members.iter().filter(|member| !member.name.starts_with("unused")) {
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
