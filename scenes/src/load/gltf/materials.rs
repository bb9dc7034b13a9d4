//! Materials of glTF files.
//!
//! A glTF surface mixes a diffuse part and a reflection by its metalness and roughness. Here it becomes:
//!
//! | | |
//! |---|---|
//! | gloss | 1 - roughness |
//! | albedo | base colour x (1 - metalness x gloss) |
//! | specular | (0.04 (1 - metalness) + base colour x metalness) x gloss |
//! | Phong exponent | 2 / roughness^4 - 2 |
//!
//! So a rough metal is a diffuse surface of its colour: its reflections are too wide to tell from that. Images of
//! metalness and roughness count by their means.

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use ::gltf::material::AlphaMode;
use ::gltf::texture::{Info, Texture, WrappingMode};

use super::super::images::Pyramid;
use super::super::textures::{self, Request, Role};
use super::super::{Reader, clamp};
use super::{Source, names, resource};
use crate::Material;

/// How texture coordinates reach an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mapping {
    /// Number of the set of texture coordinates.
    pub set: u32,
    offset: [f32; 2],
    /// Cosine and sine.
    turn: [f32; 2],
    scale: [f32; 2],
    /// The image does not repeat.
    pub bounded: bool,
}

impl Default for Mapping {
    fn default() -> Self {
        Self { set: 0, offset: [0.0; 2], turn: [1.0, 0.0], scale: [1.0; 2], bounded: false }
    }
}

impl Mapping {
    fn of(info: &Info) -> Self {
        let sampler = info.texture().sampler();
        let bounded = [sampler.wrap_s(), sampler.wrap_t()].iter().any(|&wrap| wrap != WrappingMode::Repeat);
        let set = info.tex_coord();
        match info.texture_transform() {
            None => Self { set, bounded, ..Self::default() },
            Some(transform) => {
                let (sin, cos) = transform.rotation().sin_cos();
                Self {
                    set: transform.tex_coord().unwrap_or(set),
                    offset: transform.offset(),
                    turn: [cos, sin],
                    scale: transform.scale(),
                    bounded,
                }
            }
        }
    }

    /// Scale, then rotation, then offset.
    pub fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let ([cos, sin], [u, v]) = (self.turn, [u * self.scale[0], v * self.scale[1]]);
        [self.offset[0] + cos * u + sin * v, self.offset[1] - sin * u + cos * v]
    }
}

/// A material with what a [`Material`] cannot hold.
pub(super) struct Surface {
    /// Index into the scene's materials.
    pub index: usize,
    pub mapping: Mapping,
    /// The image that the emission is multiplied by, and its mapping.
    pub emission: Option<(Rc<Pyramid>, Mapping)>,
}

/// The materials in use, by index; `None` is that of surfaces without a material.
#[derive(Default)]
pub(super) struct Surfaces(HashMap<Option<usize>, Rc<Surface>>);

impl Surfaces {
    /// The surface of a material, which is added to the scene at its first use. `coloured` surfaces have colours of
    /// vertices.
    pub fn get(
        &mut self,
        reader: &mut Reader,
        source: &mut Source,
        material: &::gltf::Material,
        coloured: bool,
    ) -> Rc<Surface> {
        if let Some(known) = self.0.get(&material.index()) {
            return known.clone();
        }
        let surface = Rc::new(match material.index() {
            Some(_) => add(reader, source, material),
            None => {
                let albedo = if coloured { [1.0; 3] } else { Material::default().albedo };
                reader.scene.materials.push(Material { albedo, ..Material::default() });
                let index = reader.scene.materials.len() - 1;
                Surface { index, mapping: Mapping::default(), emission: None }
            }
        });
        self.0.insert(material.index(), surface.clone());
        surface
    }
}

fn add(reader: &mut Reader, source: &mut Source, material: &::gltf::Material) -> Surface {
    let number = material.index().unwrap_or_default();
    let name = material.name().map_or_else(|| format!("material {number}"), str::to_owned);
    let location = source.path.display().to_string();
    let loader = Loader { location: &location, material: &name };
    let (mut diffuse, image, metalness, roughness, mut reflection) = shading(reader, source, material, &loader);
    let opacity = diffuse[3];
    let mapping = image.as_ref().map(Mapping::of).unwrap_or_default();
    let role = |role| image.as_ref().map(|image| (image.texture(), role));
    let mut load =
        |wanted: Option<(Texture, Role)>| wanted.and_then(|(t, role)| loader.texture(reader, source, &t, role));
    let albedo_texture = load(role(Role::Colour));
    let alpha_texture = match material.alpha_mode() {
        AlphaMode::Opaque => None,
        _ => albedo_texture.filter(|&index| has_holes(reader, index)),
    };
    let alpha_texture = match (material.alpha_mode(), alpha_texture) {
        (AlphaMode::Mask, Some(index)) => Some(cut(reader, index, opacity, material.alpha_cutoff().unwrap_or(0.5))),
        (AlphaMode::Blend, Some(index)) => {
            source.notes.add("alpha blending is drawn as a mask: a surface is absent where its alpha is under 0.5");
            Some(cut(reader, index, opacity, 0.5))
        }
        (AlphaMode::Blend, None) if opacity < 1.0 => {
            source.notes.add("surfaces of constant transparency are drawn opaque");
            None
        }
        (_, alpha) => alpha,
    };
    for (is_there, what) in [
        (material.normal_texture().is_some(), "normal maps are not drawn"),
        (material.unlit(), "materials without lighting (KHR_materials_unlit) are lit like others"),
    ] {
        if is_there {
            source.notes.add(what);
        }
    }
    let gloss = 1.0 - roughness;
    if metalness > 0.0 && gloss > 0.0 && image.is_some() {
        // The reflection of a metal has one colour: the mean of its image.
        let mean = image.as_ref().and_then(|image| loader.pyramid(reader, source, &image.texture(), Role::Colour));
        let mean = mean.map_or([1.0; 3], |image| image.mean_of_all());
        reflection = std::array::from_fn(|i| 0.04 * (1.0 - metalness) + diffuse[i] * mean[i] * metalness);
    }
    diffuse.iter_mut().take(3).for_each(|x| *x *= 1.0 - metalness * gloss);
    let strength = material.emissive_strength().unwrap_or(1.0);
    let glow = material.emissive_factor().map(|x| x * strength);
    let emission = material
        .emissive_texture()
        .and_then(|info| Some((loader.pyramid(reader, source, &info.texture(), Role::Emission)?, Mapping::of(&info))));
    let mut in_range = |what: &str, value: [f32; 3], high: f32| {
        let (clamped, changed) = clamp(value, 0.0, high);
        if changed {
            let value = value.map(|x| x.to_string()).join(" ");
            reader.warn(format!("{location}: material `{name}`: {what} {value} is clamped to 0..{high}"));
        }
        clamped
    };
    let material = Material {
        albedo: in_range("base colour", [diffuse[0], diffuse[1], diffuse[2]], 1.0),
        albedo_texture,
        alpha_texture,
        emission: in_range("emission", glow, 1e6),
        specular: in_range("reflection", reflection.map(|x| x * gloss), 1.0),
        phong_exponent: if gloss > 0.0 { (2.0 / roughness.max(0.03).powi(4) - 2.0).clamp(0.0, 1e6) } else { 0.0 },
        name: name.clone(),
        ..Material::default()
    };
    reader.scene.materials.push(material);
    Surface { index: reader.scene.materials.len() - 1, mapping, emission }
}

type Shading<'a> = ([f32; 4], Option<Info<'a>>, f32, f32, [f32; 3]);

/// Colour with opacity, its image, metalness, roughness, and the colour of the reflection.
fn shading<'a>(
    reader: &mut Reader,
    source: &mut Source,
    material: &::gltf::Material<'a>,
    loader: &Loader,
) -> Shading<'a> {
    if let Some(other) = material.pbr_specular_glossiness() {
        if other.specular_glossiness_texture().is_some() {
            source.notes.add("images of specular colour and glossiness are not drawn; their factors are");
        }
        let roughness = (1.0 - other.glossiness_factor()).clamp(0.0, 1.0);
        return (other.diffuse_factor(), other.diffuse_texture(), 0.0, roughness, other.specular_factor());
    }
    let pbr = material.pbr_metallic_roughness();
    let (mut metalness, mut roughness) = (pbr.metallic_factor(), pbr.roughness_factor());
    if let Some(image) = pbr.metallic_roughness_texture()
        && let Some(image) = loader.pyramid(reader, source, &image.texture(), Role::Gloss)
    {
        // Numbers, not colours: the means are of stored values.
        let [_, green, blue] = image.mean_of_stored();
        (metalness, roughness) = (metalness * blue, roughness * green);
        if !image.is_uniform() {
            source.notes.add("images of metalness and roughness count by their means");
        }
    }
    let [metalness, roughness] = [metalness, roughness].map(|x| clamp([x], 0.0, 1.0).0[0]);
    let base = pbr.base_color_factor();
    let reflection = std::array::from_fn(|i| 0.04 * (1.0 - metalness) + base[i] * metalness);
    (base, pbr.base_color_texture(), metalness, roughness, reflection)
}

fn has_holes(reader: &Reader, index: usize) -> bool {
    reader.scene.textures[index].rgba.as_chunks::<4>().0.iter().any(|texel| texel[3] < 255)
}

/// A texture whose alpha, times `opacity`, is cut at `cutoff`. Masks are cut at one half, so other cutoffs scale it.
fn cut(reader: &mut Reader, index: usize, opacity: f32, cutoff: f32) -> usize {
    let factor = opacity * 0.5 / cutoff.max(1e-6);
    if factor == 1.0 {
        return index;
    }
    let mut texture = reader.scene.textures[index].clone();
    for texel in texture.rgba.as_chunks_mut::<4>().0 {
        texel[3] = (f32::from(texel[3]) * factor).round().clamp(0.0, 255.0) as u8;
    }
    texture.name = format!("mask of {}", texture.name);
    reader.scene.textures.push(texture);
    reader.scene.textures.len() - 1
}

/// Loads images for one material.
struct Loader<'a> {
    location: &'a str,
    material: &'a str,
}

impl Loader<'_> {
    fn texture(&self, reader: &mut Reader, source: &mut Source, texture: &Texture, role: Role) -> Option<usize> {
        self.with(reader, source, texture, role, textures::texture)?
    }

    fn pyramid(&self, reader: &mut Reader, source: &mut Source, texture: &Texture, role: Role) -> Option<Rc<Pyramid>> {
        self.with(reader, source, texture, role, textures::emission)?
    }

    /// Requests the image of a texture; `None` with a note if it has none that can be read.
    fn with<T>(
        &self,
        reader: &mut Reader,
        source: &mut Source,
        texture: &Texture,
        role: Role,
        request: impl Fn(&mut Reader, &Request) -> T,
    ) -> Option<T> {
        let webp = texture.extension_value("EXT_texture_webp").and_then(|webp| webp.get("source")?.as_u64());
        let webp = webp.and_then(|index| source.document.images().nth(usize::try_from(index).ok()?));
        let Some(image) = webp.or_else(|| texture.source()) else {
            source.notes.add("textures in a format that is not read (such as KHR_texture_basisu) are left out");
            return None;
        };
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let label = image.name().map_or_else(|| format!("image {}", image.index()), str::to_owned);
        // The name of a file, or of a part of this file that no other image has.
        let own = format!("{}#{}", source.path.display(), image.index());
        // The crate takes a MIME type for granted, which the contents tell as well.
        let json = &source.document.as_json().images[image.index()];
        let view = json.buffer_view.and_then(|view| source.document.views().nth(view.value()));
        let (names, embedded) = match (&json.uri, view) {
            (Some(uri), _) if !uri.starts_with("data:") => (names(uri), None),
            (Some(uri), _) => (vec![own], Some(resource(reader, source.path, uri))),
            (None, Some(view)) => (vec![own], Some(source.buffers.view(&view).map(<[u8]>::to_vec))),
            (None, None) => (vec![own], Some(Err("it has no data".into()))),
        };
        let embedded = match embedded.transpose() {
            Ok(embedded) => embedded,
            Err(why) => {
                source.notes.add(format!("the image `{label}` cannot be read: {why}"));
                return None;
            }
        };
        let request_of = Request {
            names: &names,
            folders: &[folder],
            role,
            embedded: embedded.as_deref(),
            location: self.location,
            material: self.material,
        };
        Some(request(reader, &request_of))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_scaled_then_turned_then_moved() {
        let mapping = Mapping { offset: [0.5, 0.25], turn: [0.0, 1.0], scale: [2.0, 4.0], ..Mapping::default() };
        // A quarter turn: (u, v) goes to (v, -u).
        assert_eq!(mapping.apply([1.0, 0.0]), [0.5, -1.75]);
        assert_eq!(mapping.apply([0.0, 1.0]), [4.5, 0.25]);
        assert_eq!(Mapping::default().apply([0.3, 0.7]), [0.3, 0.7]);
    }
}
