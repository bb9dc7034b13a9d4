//! Generated scenes, so that the repository needs no model files.
//!
//! Every generator is deterministic: random numbers come from an integer hash with fixed seeds, so a name always gives
//! the same triangles and texels. Lengths are in metres, +y is up.

mod atrium;
mod bars;
mod build;
mod cameras;
mod cornell;
mod furnace;
mod lights;
mod motion;
mod parts;
mod room;
mod solids;
mod statue;
mod textures;
mod translucent;

use crate::{Material, Mesh, Texture};

/// The output of a generator: surfaces without lights and camera, which `scenes/NAME.toml` adds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Geometry {
    /// Triangle meshes in metres, one per material.
    pub meshes: Vec<Mesh>,
    /// Materials that meshes refer to by index.
    pub materials: Vec<Material>,
    /// Textures that materials refer to by index.
    pub textures: Vec<Texture>,
}

/// The names of all generators; each has a scene file `scenes/NAME.toml`.
pub const NAMES: &[&str] =
    &["atrium", "bars", "cameras", "cornell", "furnace", "lights", "motion", "room", "statue", "translucent"];

/// Builds the scene of this name; `None` for a name that is not in [`NAMES`].
pub fn geometry(name: &str) -> Option<Geometry> {
    match name {
        "atrium" => Some(atrium::build()),
        "bars" => Some(bars::build()),
        "cameras" => Some(cameras::build()),
        "cornell" => Some(cornell::build()),
        "furnace" => Some(furnace::build()),
        "lights" => Some(lights::build()),
        "motion" => Some(motion::build()),
        "room" => Some(room::build()),
        "statue" => Some(statue::build()),
        "translucent" => Some(translucent::build()),
        _ => None,
    }
}

#[cfg(test)]
mod lit;
#[cfg(test)]
mod rays;
#[cfg(test)]
mod tests;
