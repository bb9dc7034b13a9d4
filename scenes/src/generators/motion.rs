//! An emissive block to animate in another scene. The surfaces that it lights and disoccludes show the temporal lag of a
//! technique.

use glam::vec3;

use super::{Geometry, build::Builder};
use crate::Material;

/// Builds a block of half a metre that stands on the origin. Its sides are diffuse and coloured, its front emits.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let diffuse = b.plain("block", [0.75, 0.35, 0.10]);
    let emission = [6.0, 4.2, 1.8];
    let lamp = b.add(Material { name: "lamp".into(), albedo: [0.8; 3], emission, ..Material::default() }, 1.0);
    b.on(diffuse).block(vec3(-0.25, 0.0, -0.25), vec3(0.25, 0.5, 0.25));
    b.on(lamp).block(vec3(-0.15, 0.12, 0.24), vec3(0.15, 0.38, 0.27));
    b.finish()
}
