//! Scenes that are made, not read: deterministic builders, so that the repository holds no binary files.
//!
//! Every builder is a pure function of nothing. Chance comes from an integer hash, never from a
//! clock, so the same name always gives the same triangles and texels. Lengths are metres, +y up.

mod atrium;
mod bars;
mod build;
mod cornell;
mod furnace;
mod motion;
mod statue;
mod textures;

use crate::{Material, Mesh, Texture};

/// What a generator makes: the surfaces of a scene, without lights and camera (`scenes/NAME.toml` adds these).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Triangle meshes, metres, one for each material in use.
    pub meshes: Vec<Mesh>,
    /// Materials that meshes refer to by index.
    pub materials: Vec<Material>,
    /// Textures that materials refer to by index.
    pub textures: Vec<Texture>,
}

/// Names that [`geometry`] knows; each has a scene file `scenes/NAME.toml`.
pub const NAMES: &[&str] = &["atrium", "bars", "cornell", "furnace", "motion", "statue"];

/// Builds the scene of that name; `None` for a name that is not in [`NAMES`].
pub fn geometry(name: &str) -> Option<Geometry> {
    match name {
        "atrium" => Some(atrium::build()),
        "bars" => Some(bars::build()),
        "cornell" => Some(cornell::build()),
        "furnace" => Some(furnace::build()),
        "motion" => Some(motion::build()),
        "statue" => Some(statue::build()),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
