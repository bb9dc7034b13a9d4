//! Materials of single faces. Colours of vertices and images of emission vary over a surface; a material has one colour
//! and one emission. Each face gets its mean of them, by materials derived from that of its surface.

use std::collections::HashMap;

use super::Reader;
use crate::{Material, Texture};

/// Largest number of materials that are derived from one by colour or by emission. More would mean more meshes than a
/// frame can draw quickly.
const LIMIT: usize = 256;

/// The faces of one material.
#[derive(Default)]
pub(super) struct Faces {
    /// Colours that the material's albedo is multiplied by, linear; empty where faces have none.
    pub colours: Vec<[f32; 3]>,
    /// Emitted radiance in place of the material's; empty where it is that of the material.
    pub emissions: Vec<[f32; 3]>,
    /// Areas, in any unit.
    pub areas: Vec<f64>,
}

/// What [`derive()`] found.
pub(super) struct Derived {
    /// The material of each face, an index into the scene.
    pub materials: Vec<usize>,
    /// The texture coordinates of each face, where its colour is in a texture.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// The largest error of an emission, relative to it.
    pub error: f32,
}

/// Derives materials for faces from the material at `base` of the scene, which becomes the first of them.
///
/// Up to 256 colours are exact. More of them become a texture of 8 bits per channel, one texel for each colour. Up to
/// 256 emissions are exact, too; more are merged into classes that keep the emitted power.
pub(super) fn derive(reader: &mut Reader, base: usize, faces: &Faces) -> Derived {
    let count = faces.areas.len();
    let scene = &mut reader.scene;
    let source = scene.materials[base].clone();
    let emissions = Classes::of(&faces.emissions, &faces.areas);
    let albedos: Vec<_> = faces.colours.iter().map(|&colour| product(source.albedo, colour)).collect();
    let exact = distinct(&albedos, LIMIT);
    let mut uvs = None;
    let mut palette = None;
    if !albedos.is_empty() && exact.is_none() {
        let (texture, centres) = palette_of(&albedos, &source.name);
        scene.textures.push(texture);
        (palette, uvs) = (Some(scene.textures.len() - 1), Some(centres));
    }
    let mut known = HashMap::new();
    let mut made = 0;
    let materials = (0..count).map(|face| {
        let colour = exact.as_ref().and_then(|exact| exact.get(face).copied());
        let class = emissions.of.get(face).copied();
        *known.entry((colour, class)).or_insert_with(|| {
            let mut material = source.clone();
            if let Some(albedo) = albedos.get(face) {
                material.albedo = if palette.is_some() { [1.0; 3] } else { *albedo };
                material.albedo_texture = palette;
            }
            if let Some(class) = class {
                material.emission = emissions.values[class];
            }
            made += 1;
            if made == 1 {
                scene.materials[base] = material;
                return base;
            }
            scene.materials.push(Material { name: format!("{} / {made}", source.name), ..material });
            scene.materials.len() - 1
        })
    });
    let materials = materials.collect();
    Derived { materials, uvs, error: emissions.error }
}

fn product(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| (a[i] * b[i]).clamp(0.0, 1.0))
}

/// The number of each value's class, equal values having the same; `None` for more than `limit` classes.
fn distinct(values: &[[f32; 3]], limit: usize) -> Option<Vec<usize>> {
    let mut known = HashMap::new();
    let mut of = Vec::with_capacity(values.len());
    for value in values {
        let next = known.len();
        of.push(*known.entry(value.map(f32::to_bits)).or_insert(next));
        if known.len() > limit {
            return None;
        }
    }
    Some(of)
}

/// Values in a bounded number of classes.
struct Classes {
    of: Vec<usize>,
    /// The mean of each class, weighted by area, so that the sum over all faces stays the same.
    values: Vec<[f32; 3]>,
    error: f32,
}

impl Classes {
    fn of(values: &[[f32; 3]], areas: &[f64]) -> Self {
        if let Some(of) = distinct(values, LIMIT) {
            let count = of.iter().max().map_or(0, |&last| last + 1);
            let mut found = vec![[0.0; 3]; count];
            of.iter().zip(values).for_each(|(&class, &value)| found[class] = value);
            return Self { of, values: found, error: 0.0 };
        }
        // Classes of values whose channels agree within a share of the largest one. The share doubles until they are few.
        let mut share = 0.02;
        loop {
            let key = |value: &[f32; 3]| {
                let largest = value.iter().copied().fold(0.0, f32::max);
                let step = |x: f32| (x / share).round() as i32;
                (largest > 0.0).then(|| (step(largest.ln()), value.map(|x| step(x / largest))))
            };
            let mut known = HashMap::new();
            let mut of = Vec::with_capacity(values.len());
            for value in values {
                let next = known.len();
                of.push(*known.entry(key(value)).or_insert(next));
            }
            if known.len() <= LIMIT {
                return Self::means(values, areas, of, known.len());
            }
            share *= 2.0;
        }
    }

    fn means(values: &[[f32; 3]], areas: &[f64], of: Vec<usize>, count: usize) -> Self {
        let mut sums = vec![([0.0; 3], 0.0, [0.0; 3]); count];
        for ((&class, value), &area) in of.iter().zip(values).zip(areas) {
            let (sum, total, any) = &mut sums[class];
            *any = *value;
            *total += area;
            sum.iter_mut().zip(value).for_each(|(sum, &x)| *sum += area * f64::from(x));
        }
        let mean = |(sum, total, any): ([f64; 3], f64, [f32; 3])| {
            if total > 0.0 { sum.map(|x| (x / total) as f32) } else { any }
        };
        let means: Vec<_> = sums.into_iter().map(mean).collect();
        let error = of.iter().zip(values).map(|(&class, value)| {
            let mean = means[class];
            let largest = value.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
            (0..3).map(|i| (mean[i] - value[i]).abs() / largest).fold(0.0, f32::max)
        });
        let error = error.fold(0.0, f32::max);
        Self { of, values: means, error }
    }
}

/// A texture with one texel for each colour that differs in 8 bits per channel, and the centre of each face's texel.
fn palette_of(colours: &[[f32; 3]], name: &str) -> (Texture, Vec<[f32; 2]>) {
    let mut known = HashMap::new();
    let mut texels = Vec::new();
    let of: Vec<usize> = colours
        .iter()
        .map(|colour| {
            *known.entry(colour.map(encoded)).or_insert_with_key(|&[r, g, b]| {
                texels.push([r, g, b, 255]);
                texels.len() - 1
            })
        })
        .collect();
    let width = (texels.len() as f64).sqrt().ceil() as usize;
    let height = texels.len().div_ceil(width.max(1));
    texels.resize(width * height, [255; 4]);
    let centre = |i: usize| [((i % width) as f32 + 0.5) / width as f32, ((i / width) as f32 + 0.5) / height as f32];
    let texture = Texture {
        name: format!("colours of {name}"),
        width: width as u32,
        height: height as u32,
        rgba: texels.into_flattened(),
    };
    (texture, of.into_iter().map(centre).collect())
}

/// Linear to sRGB, 8 bits.
fn encoded(x: f32) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let curve = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * curve).round() as u8
}

/// sRGB, 8 bits, to linear.
pub(super) fn decoded(x: u8) -> f32 {
    let x = f32::from(x) / 255.0;
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_are_exact_and_many_keep_their_sum() {
        let few: Vec<_> = (0..256).map(|i| [i as f32, 0.0, 1.0]).collect();
        let classes = Classes::of(&few, &[1.0; 256]);
        assert!(classes.error == 0.0 && classes.of.iter().zip(&few).all(|(&c, v)| classes.values[c] == *v));
        let many: Vec<_> = (0..5000).map(|i| [1.0 + i as f32 * 1e-3, 0.5, 0.0]).collect();
        let areas: Vec<_> = (0..5000).map(|i| 1.0 + f64::from(i % 7)).collect();
        let classes = Classes::of(&many, &areas);
        assert!(classes.values.len() <= LIMIT, "{}", classes.values.len());
        // Five values of the largest channel in 256 classes: a class is about 1 % wide.
        assert!(classes.error < 0.02, "{}", classes.error);
        let sum = |value: &dyn Fn(usize) -> f32| {
            areas.iter().enumerate().map(|(i, area)| area * f64::from(value(i))).sum::<f64>()
        };
        let (before, after) = (sum(&|i| many[i][0]), sum(&|i| classes.values[classes.of[i]][0]));
        // Means are rounded to float32.
        assert!((before / after - 1.0).abs() < 1e-6, "{before} {after}");
    }

    #[test]
    fn black_has_a_class_of_its_own() {
        let many: Vec<_> = (0..1000).map(|i| [if i % 2 == 0 { 0.0 } else { i as f32 }; 3]).collect();
        let classes = Classes::of(&many, &[1.0; 1000]);
        assert_eq!(classes.values[classes.of[0]], [0.0; 3]);
        assert!(classes.of.iter().skip(1).step_by(2).all(|&class| class != classes.of[0]));
    }

    #[test]
    fn a_palette_has_each_colour_at_a_texel_centre() {
        let colours: Vec<_> = (0..300).map(|i| [decoded((i % 256) as u8), decoded((i / 256) as u8), 1.0]).collect();
        let (texture, centres) = palette_of(&colours, "x");
        assert_eq!(texture.rgba.len(), 4 * texture.width as usize * texture.height as usize);
        for (i, [u, v]) in centres.into_iter().enumerate() {
            let (x, y) = (u * texture.width as f32, v * texture.height as f32);
            assert!((x.fract() - 0.5).abs() < 1e-3 && (y.fract() - 0.5).abs() < 1e-3, "{x} {y}");
            let texel = 4 * (y as usize * texture.width as usize + x as usize);
            assert_eq!(texture.rgba[texel..texel + 3], [(i % 256) as u8, (i / 256) as u8, 255]);
        }
    }

    #[test]
    fn both_curves_are_inverse() {
        assert!((0..=255).all(|x| encoded(decoded(x)) == x));
    }
}
