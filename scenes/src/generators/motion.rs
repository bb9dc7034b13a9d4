//! A block that shines, to be moved through another scene: what it lights, and what it uncovers, shows how a
//! technique forgets.

use glam::vec3;

use super::{Geometry, build::Builder};
use crate::Material;

/// Builds a block of half a metre with its foot in the origin. Its sides are matt and coloured, its front shines.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let matt = b.plain("block", [0.75, 0.35, 0.10]);
    let emission = [6.0, 4.2, 1.8];
    let lamp = b.add(Material { name: "lamp".into(), albedo: [0.8; 3], emission, ..Material::default() }, 1.0);
    b.on(matt).block(vec3(-0.25, 0.0, -0.25), vec3(0.25, 0.5, 0.25));
    b.on(lamp).block(vec3(-0.15, 0.12, 0.24), vec3(0.15, 0.38, 0.27));
    b.finish()
}
