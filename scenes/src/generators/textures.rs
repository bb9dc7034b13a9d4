//! Procedural textures. All of them tile. Colours are sRGB-encoded, alpha is the alpha mask.
//!
//! Details are larger than about eight texels, because textures are sampled without mipmaps.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2, vec3};

use super::build::{Chance, hash, unit};
use crate::Texture;

/// Paints an opaque texture from `colour(u, v)`, u and v in 0..1, v pointing down.
pub fn paint(name: &str, [width, height]: [u32; 2], colour: impl Fn(Vec2) -> Vec3) -> Texture {
    let size = vec2(width as f32, height as f32);
    let mut rgba = Vec::with_capacity((width * height * 4) as usize);
    for y in 0..height {
        for x in 0..width {
            rgba.extend(encode(colour(vec2(x as f32 + 0.5, y as f32 + 0.5) / size)));
        }
    }
    Texture { name: format!("{name}.png"), width, height, rgba }
}

fn encode(colour: Vec3) -> [u8; 4] {
    let [r, g, b] = (colour.clamp(Vec3::ZERO, Vec3::ONE) * 255.0 + 0.5).to_array();
    [r as u8, g as u8, b as u8, 255]
}

/// A hashed number in 0..1 for a cell of a grid.
fn cell(x: i32, y: i32, seed: u32) -> f32 {
    unit(hash(
        (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77) ^ seed.wrapping_mul(0xC2B2_AE3D),
    ))
}

/// Value noise in 0..1 that repeats after `period` cells; `p` in cells.
fn noise(p: Vec2, period: i32, seed: u32) -> f32 {
    let (corner, f) = (p.floor(), p - p.floor());
    let f = f * f * (3.0 - 2.0 * f);
    let (x, y) = (corner.x as i32, corner.y as i32);
    let at = |i: i32, j: i32| cell((x + i).rem_euclid(period), (y + j).rem_euclid(period), seed);
    let row = |j| at(0, j) + (at(1, j) - at(0, j)) * f.x;
    row(0) + (row(1) - row(0)) * f.y
}

/// Side of the table of [`Painter`], a power of two.
const CLOUD: usize = 512;

/// Paints the textures. Holds a table of fractal noise for stains and grain.
pub struct Painter {
    cloud: Vec<f32>,
}

/// Smooth step from 0 at `a` to 1 at `b`.
pub fn step(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Masonry in running bond: maps `uv` to the distance to the nearest joint (in course heights) and the block's tone, 0..1.
fn masonry(uv: Vec2, courses: i32, per_course: i32, seed: u32) -> (f32, f32) {
    let y = uv.y * courses as f32;
    let row = y.floor() as i32;
    let x = uv.x * per_course as f32 + if row % 2 == 0 { 0.0 } else { 0.5 };
    let column = (x.floor() as i32).rem_euclid(per_course);
    let ratio = courses as f32 / per_course as f32;
    let (fx, fy) = (x.fract(), y.fract());
    ((fx.min(1.0 - fx) * ratio).min(fy.min(1.0 - fy)), cell(column, row, seed))
}

impl Painter {
    /// Five octaves of value noise, from 4 to 64 cells per repeat, about -0.5..0.5.
    pub fn new() -> Self {
        let texel = |i: usize| {
            let uv = vec2((i % CLOUD) as f32, (i / CLOUD) as f32) / CLOUD as f32;
            (0..5).map(|k| (noise(uv * (4 << k) as f32, 4 << k, k) - 0.5) * 0.5_f32.powi(k as i32)).sum()
        };
        Self { cloud: (0..CLOUD * CLOUD).map(texel).collect() }
    }

    /// Grain at `uv` (not negative) with period 1. Textures use different offsets.
    pub fn grain(&self, uv: Vec2, shift: usize) -> f32 {
        let texel = uv * CLOUD as f32;
        let (x, y) = (texel.x as usize + 131 * shift, texel.y as usize + 197 * shift);
        self.cloud[(y % CLOUD) * CLOUD + x % CLOUD]
    }

    /// Warm limestone blocks with fine joints.
    pub fn ashlar(&self) -> Texture {
        paint("ashlar", [512; 2], |uv| {
            let (edge, tone) = masonry(uv, 6, 3, 11);
            let grain = self.grain(uv, 4);
            let stone = vec3(0.86, 0.80, 0.695) * (0.93 + 0.12 * tone + 0.26 * grain)
                + vec3(0.025, 0.0, -0.03) * (tone * 7.0).fract();
            stone.lerp(vec3(0.66, 0.60, 0.51), 1.0 - step(0.015, 0.06, edge + 0.03 * grain))
        })
    }

    /// Old brick with light mortar.
    pub fn brick(&self) -> Texture {
        paint("brick", [512; 2], |uv| {
            let (edge, tone) = masonry(uv, 16, 6, 21);
            let grain = self.grain(uv, 5);
            let red = vec3(0.66, 0.40, 0.30).lerp(vec3(0.74, 0.53, 0.40), tone);
            let brick = red * (0.92 + 0.3 * grain + 0.10 * ((tone * 13.0).fract() - 0.5));
            brick.lerp(vec3(0.72, 0.64, 0.54) * (1.0 + 0.2 * grain), 1.0 - step(0.05, 0.15, edge + 0.05 * grain))
        })
    }

    /// Lime plaster with soft stains.
    pub fn plaster(&self) -> Texture {
        paint("plaster", [256; 2], |uv| {
            let stain = self.grain(uv, 6);
            vec3(0.89, 0.84, 0.76) * (1.0 + 0.16 * stain) + vec3(0.0, -0.01, -0.03) * self.grain(uv, 1)
        })
    }

    /// Pale marble with faint veins.
    pub fn marble(&self) -> Texture {
        paint("marble", [256; 2], |uv| {
            let warp = self.grain(uv, 7);
            let vein = (1.0 - self.grain(uv + vec2(0.0, 0.2 + 0.2 * warp), 20).abs() * 12.0).max(0.0);
            vec3(0.875, 0.835, 0.76) * (1.0 + 0.10 * warp) - vec3(0.09, 0.09, 0.08) * vein
        })
    }

    /// Court floor: octagonal cream slabs with small terracotta squares between them, four slabs per repeat.
    pub fn court_tiles(&self) -> Texture {
        paint("court_tiles", [512; 2], |uv| {
            let p = uv * 4.0;
            let f = p - p.floor() - 0.5;
            let (x, y) = (p.x as i32, p.y as i32);
            let grain = self.grain(uv, 8);
            let corner = vec2((p.x + 0.5).floor().rem_euclid(4.0), (p.y + 0.5).floor().rem_euclid(4.0));
            let (joint, colour) = {
                let diamond = 1.0 - (f.x.abs() + f.y.abs());
                if diamond < 0.2 {
                    let tone = cell(corner.x as i32, corner.y as i32, 52);
                    (0.2 - diamond, vec3(0.60, 0.40, 0.30).lerp(vec3(0.52, 0.38, 0.31), tone))
                } else {
                    let tone = cell(x, y, 53);
                    let side = 0.5 - f.x.abs().max(f.y.abs());
                    (side.min((diamond - 0.2) * 0.7), vec3(0.70, 0.615, 0.49) * (0.86 + 0.18 * tone))
                }
            };
            (colour * (1.0 + 0.28 * grain)).lerp(vec3(0.56, 0.50, 0.42), 1.0 - step(0.008, 0.03, joint))
        })
    }

    /// Gallery floor: terracotta and cream squares on the diagonal.
    pub fn gallery_tiles(&self) -> Texture {
        paint("gallery_tiles", [512; 2], |uv| {
            let p = vec2(uv.x + uv.y, uv.x - uv.y + 1.0) * 3.0;
            let f = p - p.floor();
            let (x, y) = ((p.x as i32).rem_euclid(6), (p.y as i32).rem_euclid(6));
            let tone = cell((x + y).rem_euclid(6), (x - y).rem_euclid(6), 61);
            let grain = self.grain(uv, 9);
            let colour = if (x + y) % 2 == 0 { vec3(0.66, 0.41, 0.31) } else { vec3(0.80, 0.74, 0.63) };
            let joint = f.min(1.0 - f).min_element();
            (colour * (0.93 + 0.13 * tone + 0.25 * grain)).lerp(vec3(0.5, 0.44, 0.38), 1.0 - step(0.01, 0.05, joint))
        })
    }

    /// Arch stones: one pale and one brick-red voussoir per repeat along u.
    pub fn voussoirs(&self) -> Texture {
        paint("voussoirs", [256; 2], |uv| {
            let grain = self.grain(uv, 10);
            let f = (uv.x * 2.0).fract();
            let colour = if uv.x < 0.5 { vec3(0.86, 0.80, 0.69) } else { vec3(0.68, 0.43, 0.33) };
            let joint = f.min(1.0 - f);
            (colour * (1.0 + 0.3 * grain)).lerp(vec3(0.60, 0.52, 0.44), 1.0 - step(0.01, 0.05, joint))
        })
    }

    /// Terracotta roof tiles: eight by eight tiles per repeat.
    pub fn roof_tiles(&self) -> Texture {
        paint("roof_tiles", [256; 2], |uv| {
            let p = uv * 8.0;
            let tone = cell(p.x as i32, p.y as i32, 81);
            let grain = self.grain(uv * 2.0, 11);
            let colour = vec3(0.62, 0.37, 0.26).lerp(vec3(0.78, 0.55, 0.40), tone) * (1.0 + 0.3 * grain);
            colour * (0.72 + 0.28 * step(0.0, 0.15, p.y.fract()))
        })
    }

    /// Dark oak with grain along u.
    pub fn wood(&self) -> Texture {
        paint("wood", [256; 2], |uv| {
            let grain = self.grain(uv * vec2(1.0, 8.0), 12);
            let tone = self.grain(uv, 13);
            vec3(0.52, 0.37, 0.25) * (1.0 + 0.55 * grain + 0.2 * tone)
        })
    }

    /// Sawn timber of this mean colour with grain along u. `shift` selects its part of the noise.
    pub fn timber(&self, name: &str, colour: Vec3, shift: usize) -> Texture {
        paint(name, [256; 2], |uv| {
            let grain = self.grain(uv * vec2(1.0, 7.0), shift);
            let tone = self.grain(uv, shift + 1);
            let pore = step(0.10, 0.22, self.grain(uv * vec2(1.0, 5.0), shift + 2));
            colour * (1.0 + 0.34 * grain + 0.16 * tone - 0.10 * pore) + vec3(0.015, 0.0, -0.02) * tone
        })
    }
}

/// Gold thread.
pub const GOLD: Vec3 = vec3(0.83, 0.64, 0.30);

/// Size of a cloth's texture, texels.
const CLOTH: [u32; 2] = [256, 512];

/// Distances to the sides of a cloth one wide and two long: (to the nearest side, along that side).
fn hem(p: Vec2) -> (f32, f32) {
    let (x, y) = (p.x.min(1.0 - p.x), p.y.min(2.0 - p.y));
    if x < y { (x, p.y) } else { (y, p.x) }
}

impl Painter {
    /// Hanging cloths of these names, dyes and trims: a scroll border all around, a medallion in the centre.
    pub fn fabrics<const N: usize>(&self, dyes: [(&str, Vec3, Vec3); N]) -> [Texture; N] {
        // The trim's weight is the same for every dye.
        let trimmed: Vec<f32> = (0..CLOTH[0] * CLOTH[1])
            .map(|i| {
                let p = (vec2((i % CLOTH[0]) as f32, (i / CLOTH[0]) as f32) + 0.5) / CLOTH[0] as f32;
                let (side, along) = hem(p);
                let centre = p - vec2(0.5, 1.0);
                let radius = centre.length();
                let bands = [side - 0.035, side - 0.155, radius - 0.285, radius - 0.25, radius - 0.055];
                let fine = bands.iter().fold(f32::MAX, |nearest, band| nearest.min(band.abs()));
                let lozenge = ((centre.x.abs() * 2.0 + centre.y.abs()) - 0.72).abs() * 0.45;
                let scroll = if side < 0.14 { (side - 0.095 - 0.022 * (along * 5.0 * TAU).sin()).abs() } else { 1.0 };
                let petals =
                    if radius < 0.24 { (radius - 0.15 - 0.05 * (centre.to_angle() * 8.0).cos()).abs() } else { 1.0 };
                1.0 - step(0.007, 0.015, fine.min(lozenge)).min(step(0.010, 0.021, scroll.min(petals)))
            })
            .collect();
        dyes.map(|(name, dye, trim)| {
            paint(name, CLOTH, |uv| {
                let texel = (uv * vec2(CLOTH[0] as f32, CLOTH[1] as f32)).as_uvec2();
                let thread = 0.10 * (self.grain(uv * vec2(1.0, 6.0), 14) + self.grain(uv * vec2(4.0, 1.0), 15));
                let shade = 1.0 + thread + 0.22 * self.grain(uv, 2);
                dye.lerp(trim, trimmed[(texel.y * CLOTH[0] + texel.x) as usize]) * shade
            })
        })
    }

    /// A knotted carpet: borders within borders around a field of lozenges.
    pub fn carpet(&self, name: &str, field: Vec3, border: Vec3) -> Texture {
        paint(name, CLOTH, |uv| {
            let p = vec2(uv.x, uv.y * 2.0);
            let (side, along) = hem(p);
            let cream = vec3(0.85, 0.76, 0.58);
            let tooth = ((along * 12.0).fract() - 0.5).abs() * 0.09;
            let q = (p - vec2(0.5, 1.0)) * vec2(1.0, 0.8);
            let lozenge = ((q.x.abs() + q.y.abs()) * 5.0).fract();
            let star = ((q.x * 5.0).rem_euclid(1.0) - 0.5).abs() + ((q.y * 5.0).rem_euclid(1.0) - 0.5).abs();
            let colour = match side {
                s if s < 0.05 + tooth => cream,
                s if s < 0.14 => border,
                s if s < 0.155 => GOLD,
                s if s < 0.20 => border * 0.75,
                s if s < 0.215 => cream,
                _ if star < 0.22 => GOLD,
                _ if lozenge < 0.18 => cream.lerp(border, 0.35),
                _ => field,
            };
            colour * (1.0 + 0.2 * self.grain(uv, 3))
        })
    }
}

/// One leaf of an alpha-masked texture: base, direction and length in texture units, half width over length, tone.
struct Leaf {
    base: Vec2,
    along: Vec2,
    width: f32,
    colour: Vec3,
}

/// Paints leaves on a transparent background. Transparent texels have the background's colour, so that filtering gives
/// no dark fringes.
fn foliage(name: &str, [width, height]: [u32; 2], ground: Vec3, leaves: &[Leaf]) -> Texture {
    let mut texture = paint(name, [width, height], |_| ground);
    texture.rgba.chunks_exact_mut(4).for_each(|texel| texel[3] = 0);
    let size = vec2(width as f32, height as f32);
    for leaf in leaves {
        let reach = leaf.along.length();
        let (low, high) = ((leaf.base - reach).max(Vec2::ZERO), (leaf.base + reach).min(Vec2::ONE));
        for y in (low.y * size.y) as u32..(high.y * size.y) as u32 {
            for x in (low.x * size.x) as u32..(high.x * size.x) as u32 {
                let p = vec2(x as f32 + 0.5, y as f32 + 0.5) / size - leaf.base;
                let s = p.dot(leaf.along) / (reach * reach);
                let t = p.perp_dot(leaf.along) / (reach * reach);
                let half = leaf.width * (PI * s.clamp(0.0, 1.0).powf(0.75)).sin();
                if (0.0..1.0).contains(&s) && t.abs() < half {
                    let rib = 1.0 - step(0.01, 0.035, t.abs());
                    let side = if t > 0.0 { 1.08 } else { 0.94 };
                    let vein = 0.05 * ((s - 1.2 * t.abs()) * 9.0 * TAU).sin();
                    let colour = leaf.colour * (side + vein + 0.3 * rib + 0.12 * s);
                    let at = ((y * width + x) * 4) as usize;
                    texture.rgba[at..at + 4].copy_from_slice(&encode(colour));
                }
            }
        }
    }
    texture
}

/// A sprig: a stem from the bottom centre with leaves on both sides, and blossoms at its end if `blossom` is given.
pub fn sprig(name: &str, green: Vec3, blossom: Option<Vec3>, seed: u32) -> Texture {
    let mut chance = Chance::new(seed);
    let mut leaves = vec![Leaf { base: vec2(0.5, 0.99), along: vec2(0.0, -0.85), width: 0.012, colour: green * 0.8 }];
    for i in 0..13 {
        let s = i as f32 / 12.0;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.15 - 0.85 * s) + chance.between(-0.2, 0.2);
        let length = (0.42 - 0.16 * s) * chance.between(0.85, 1.1);
        leaves.push(Leaf {
            base: vec2(0.5, 0.93 - 0.66 * s),
            along: vec2(angle.sin(), -angle.cos()) * length,
            width: chance.between(0.17, 0.22),
            colour: green * chance.between(0.8, 1.15),
        });
    }
    for i in 0..if blossom.is_some() { 26 } else { 0 } {
        let turn = TAU * (i % 5) as f32 / 5.0 + i as f32;
        let base = vec2(0.5 + 0.26 * ((i / 5) as f32 * 2.4).cos(), 0.34 + 0.24 * ((i / 5) as f32 * 2.4).sin());
        let colour = blossom.unwrap_or(green) * chance.between(0.85, 1.1);
        leaves.push(Leaf { base, along: Vec2::from_angle(turn) * 0.12, width: 0.32, colour });
    }
    foliage(name, [256; 2], green, &leaves)
}

/// A feather palm's frond: leaflets along a rib that runs up the texture.
pub fn frond(name: &str, green: Vec3) -> Texture {
    let mut chance = Chance::new(7);
    let mut leaves = vec![];
    for i in 0..48 {
        let s = (i / 2) as f32 / 24.0;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.05 - 0.6 * s);
        let length = 0.5 * (0.35 + 0.65 * (PI * (0.15 + 0.75 * s)).sin());
        leaves.push(Leaf {
            base: vec2(0.5, 0.98 - 0.86 * s),
            along: vec2(angle.sin() * 1.1, -angle.cos() * 0.5) * length,
            width: 0.085,
            colour: green * chance.between(0.8, 1.15),
        });
    }
    leaves.push(Leaf { base: vec2(0.5, 1.0), along: vec2(0.0, -0.97), width: 0.022, colour: green * 1.15 });
    foliage(name, [256, 512], green, &leaves)
}
