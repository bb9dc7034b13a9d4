//! Pictures on the walls.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};

use crate::{
    Texture,
    generators::textures::{Painter, paint, step},
};

/// Size of a picture, texels.
const SIZE: [u32; 2] = [256; 2];

/// Laid over the picture: the light border of its mount.
fn mounted(uv: Vec2, colour: Vec3) -> Vec3 {
    let edge = uv.min(1.0 - uv).min_element();
    vec3(0.90, 0.88, 0.83).lerp(colour, step(0.095, 0.105, edge))
}

/// Hills in layers under a low sun.
pub fn hills(painter: &Painter) -> Texture {
    paint("picture_hills", SIZE, |uv| {
        let sky = vec3(0.96, 0.80, 0.58).lerp(vec3(0.45, 0.60, 0.72), 1.0 - uv.y);
        let sun = 1.0 - step(0.085, 0.095, uv.distance(vec2(0.62, 0.40)));
        let mut colour = sky.lerp(vec3(0.96, 0.42, 0.22), sun);
        for layer in 0..4 {
            let t = layer as f32;
            let ridge = 0.46
                + 0.11 * t
                + 0.05 * (TAU * (0.7 + 0.25 * t) * uv.x + 2.3 * t).sin()
                + 0.05 * painter.grain(vec2(uv.x, 0.13 * t), 21);
            let hill = vec3(0.56, 0.50, 0.52).lerp(vec3(0.13, 0.24, 0.24), t / 3.0);
            colour = colour.lerp(hill, step(ridge, ridge + 0.012, uv.y));
        }
        mounted(uv, colour)
    })
}

/// Overlapping discs and a bar.
pub fn shapes(painter: &Painter) -> Texture {
    paint("picture_shapes", SIZE, |uv| {
        let mut colour = vec3(0.87, 0.80, 0.68) * (1.0 + 0.15 * painter.grain(uv, 22));
        let discs = [
            (vec2(0.42, 0.42), 0.22, vec3(0.80, 0.27, 0.16)),
            (vec2(0.62, 0.56), 0.17, vec3(0.88, 0.64, 0.22)),
            (vec2(0.36, 0.66), 0.13, vec3(0.12, 0.26, 0.36)),
        ];
        for (centre, radius, ink) in discs {
            colour = colour.lerp(ink, 0.92 * (1.0 - step(radius - 0.006, radius + 0.006, uv.distance(centre))));
        }
        let bar = (uv.y - 0.80).abs().max((uv.x - 0.5).abs() - 0.28);
        mounted(uv, colour.lerp(vec3(0.16, 0.15, 0.15), 1.0 - step(0.008, 0.016, bar)))
    })
}

/// A sea under clouds.
pub fn sea(painter: &Painter) -> Texture {
    paint("picture_sea", SIZE, |uv| {
        let cloud = painter.grain(uv * vec2(0.8, 1.6), 23);
        let sky = vec3(0.50, 0.66, 0.78).lerp(vec3(0.93, 0.86, 0.74), step(-0.05, 0.25, cloud + 0.2 * uv.y));
        let swell = painter.grain(uv * vec2(0.7, 3.5), 24);
        let water = vec3(0.10, 0.32, 0.40) * (1.1 + 0.9 * swell) + vec3(0.12, 0.10, 0.06) * (1.0 - uv.y);
        mounted(uv, sky.lerp(water, step(0.54, 0.546, uv.y)))
    })
}
