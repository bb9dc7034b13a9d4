//! The material of each face: from the libraries, with the colours of vertices and the images of emission.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::DVec3;

use super::super::faces::{Faces, derive};
use super::super::image_line::Mapping;
use super::super::images::Pyramid;
use super::super::keys::nearest_name;
use super::super::mtl::{self, Entry, Surface};
use super::super::{Reader, reason, text};
use super::parse::{Face, Parsed};
use crate::Material;

/// The material of each face, an index into the scene. Adds materials and textures to the scene, and texture coordinates
/// to the model where colours of vertices are in a texture.
pub(super) fn assign(reader: &mut Reader, path: &Path, parsed: &mut Parsed) -> Vec<usize> {
    let coloured = colours(reader, path, parsed);
    let Added { mut indices, emissions, mappings } = add_materials(reader, path, parsed, coloured);
    let needs_default = parsed.faces.iter().any(|face| face.material.is_none());
    if needs_default {
        let albedo = if coloured { [1.0; 3] } else { Material::default().albedo };
        reader.scene.materials.push(Material { albedo, ..Material::default() });
        indices.push(reader.scene.materials.len() - 1);
    }
    let index = |face: &Face| face.material.map_or_else(|| indices[indices.len() - 1], |material| indices[material]);
    let mut materials: Vec<usize> = parsed.faces.iter().map(index).collect();
    map_coordinates(parsed, &materials, &mappings);
    if coloured || !emissions.is_empty() {
        vary(reader, path, parsed, &mut materials, &emissions, coloured);
    }
    materials
}

/// Whether colours of vertices are used. Scales them to 0..1.
fn colours(reader: &mut Reader, path: &Path, parsed: &mut Parsed) -> bool {
    let largest = parsed.colours.as_flattened().iter().copied().fold(0.0, f32::max);
    if largest > 1.0 {
        // Some exporters write bytes.
        parsed.colours.as_flattened_mut().iter_mut().for_each(|x| *x = (*x / 255.0).min(1.0));
        let sentence = format!("colours of vertices reach {largest}; they are read as 0..255");
        reader.warn(format!("{}: {sentence}", path.display()));
    }
    parsed.colours.iter().any(|&colour| colour != [1.0; 3])
}

/// Materials that were added to the scene.
struct Added {
    /// One for each name in use.
    indices: Vec<usize>,
    /// Images of emission by material.
    emissions: HashMap<usize, Rc<Pyramid>>,
    /// Mappings of texture coordinates by material, where they change something.
    mappings: HashMap<usize, Mapping>,
}

/// Adds a material to the scene for each name in use.
fn add_materials(reader: &mut Reader, path: &Path, parsed: &Parsed, coloured: bool) -> Added {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut unread = false;
    let mut entries = Vec::new();
    for (line, names) in &parsed.libraries {
        for library in libraries(reader, folder, names) {
            match library {
                Ok((path, bytes)) => entries.extend(mtl::read(reader, &path, &bytes)),
                Err((name, why)) => {
                    unread = true;
                    reader.warn(format!(
                        "{}:{line}: material library `{name}` cannot be read ({why}); its materials are grey",
                        path.display()
                    ));
                }
            }
        }
    }
    let (mut emissions, mut mappings) = (HashMap::new(), HashMap::new());
    // Names with different comments are one material.
    let mut known: HashMap<usize, usize> = HashMap::new();
    let add = |(line, name): &(usize, String)| {
        let found = position(&entries, name);
        if let Some(&index) = found.and_then(|entry| known.get(&entry)) {
            return index;
        }
        let surface = match found {
            Some(entry) => entries[entry].resolve(reader, folder, coloured),
            None => {
                let name = text::names(name).last().unwrap_or_default();
                if !unread {
                    let near = nearest_name(name, entries.iter().map(|entry| entry.name.as_str()));
                    let near = near.map(|near| format!(" (did you mean `{near}`?)")).unwrap_or_default();
                    reader.warn(format!(
                        "{}:{line}: material `{name}` is in no material library{near}; it is drawn in grey",
                        path.display()
                    ));
                }
                let albedo = if coloured { [1.0; 3] } else { Material::default().albedo };
                let material = Material { name: name.to_owned(), albedo, ..Material::default() };
                Surface { material, emission: None, mapping: Mapping::default() }
            }
        };
        reader.scene.materials.push(surface.material);
        let index = reader.scene.materials.len() - 1;
        emissions.extend(surface.emission.map(|image| (index, image)));
        if surface.mapping != Mapping::default() {
            mappings.insert(index, surface.mapping);
        }
        known.extend(found.map(|entry| (entry, index)));
        index
    };
    let indices = parsed.used.iter().map(add).collect();
    Added { indices, emissions, mappings }
}

/// Scales and moves the texture coordinates of faces whose materials ask for it.
fn map_coordinates(parsed: &mut Parsed, materials: &[usize], mappings: &HashMap<usize, Mapping>) {
    let mut known: HashMap<(usize, u32), u32> = HashMap::new();
    for (face, material) in parsed.faces.iter().zip(materials) {
        let Some(Mapping { scale, offset }) = mappings.get(material) else { continue };
        for corner in &mut parsed.corners[face.first..face.first + face.count] {
            if corner[1] > 0 {
                corner[1] = *known.entry((*material, corner[1])).or_insert_with(|| {
                    let uv = parsed.uvs[corner[1] as usize - 1];
                    let mapped: [f32; 2] = std::array::from_fn(|i| offset[i] + scale[i] * uv[i]);
                    parsed.uvs.push(if mapped.iter().all(|x| x.is_finite()) { mapped } else { uv });
                    parsed.uvs.len() as u32
                });
            }
        }
    }
}

/// The entry that a name of `usemtl` stands for: the same text, or the same name with a comment behind one of them.
fn position(entries: &[Entry], name: &str) -> Option<usize> {
    text::names(name).find_map(|wanted| {
        let exact = entries.iter().position(|entry| entry.name == wanted);
        exact.or_else(|| entries.iter().position(|entry| text::names(&entry.name).any(|name| name == wanted)))
    })
}

type Library = Result<(PathBuf, Vec<u8>), (String, String)>;

/// The libraries of one line: a name with blanks, or several names, each of which may have blanks.
fn libraries(reader: &Reader, folder: &Path, rest: &str) -> Vec<Library> {
    let mut last = rest;
    let mut first_error = None;
    for name in text::names(rest) {
        match library(reader, folder, name) {
            Ok(found) => return vec![Ok(found)],
            Err(error) => {
                first_error.get_or_insert(error);
            }
        }
        last = name;
    }
    // The longest run of words that is a file, from each word on.
    let words: Vec<_> = last.split_whitespace().collect();
    let mut found = Vec::new();
    let mut at = 0;
    let mut any = false;
    while at < words.len() {
        let longest = (at + 1..=words.len())
            .rev()
            .find_map(|end| library(reader, folder, &words[at..end].join(" ")).ok().map(|library| (end, library)));
        match longest {
            Some((end, library)) => {
                any = true;
                found.push(Ok(library));
                at = end;
            }
            None => {
                found.push(Err((words[at].to_owned(), "no such file".into())));
                at += 1;
            }
        }
    }
    if any {
        return found;
    }
    let why = first_error.map_or_else(|| "no name is given".into(), |error| reason(&error));
    vec![Err((last.to_owned(), why))]
}

/// A library as its name says, or of this file name beside the model.
fn library(reader: &Reader, folder: &Path, name: &str) -> std::io::Result<(PathBuf, Vec<u8>)> {
    let name = name.trim().trim_matches('"');
    if name.is_empty() {
        return Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    }
    let read = |name: &str| {
        let path = folder.join(name);
        reader.files.read(&path).map(|bytes| (path, bytes))
    };
    read(name).or_else(|error| {
        let bare = name.rsplit(['/', '\\']).next().unwrap_or_default();
        if bare == name || bare.is_empty() { Err(error) } else { read(bare).map_err(|_| error) }
    })
}

/// Gives faces the means of their corners' colours and of their materials' images of emission.
fn vary(
    reader: &mut Reader,
    path: &Path,
    parsed: &mut Parsed,
    materials: &mut [usize],
    emissions: &HashMap<usize, Rc<Pyramid>>,
    coloured: bool,
) {
    let mut by_base: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (face, &base) in materials.iter().enumerate() {
        by_base.entry(base).or_default().push(face);
    }
    let (mut uneven, mut textured, mut averaged, mut error) = (false, false, false, 0.0_f32);
    for (base, members) in by_base {
        let source = &reader.scene.materials[base];
        let (has_texture, glow) = (source.albedo_texture.is_some(), source.emission);
        let image = emissions.get(&base);
        let mut faces = Faces::default();
        for &face in &members {
            let corners = corners(parsed, face);
            faces.areas.push(area(parsed, corners));
            if coloured {
                let colour = |corner: &[u32; 3]| parsed.colours[corner[0] as usize - 1];
                let first = colour(&corners[0]);
                let same = corners.iter().all(|corner| colour(corner) == first);
                uneven |= !same && !has_texture;
                textured |= has_texture && (!same || first != [1.0; 3]);
                if !has_texture {
                    let sum = |i: usize| corners.iter().map(|corner| colour(corner)[i]).sum::<f32>();
                    let mean = |i: usize| sum(i) / corners.len() as f32;
                    // A mean of equal numbers need not be that number in float32.
                    faces.colours.push(if same { first } else { std::array::from_fn(mean) });
                }
            }
            if let Some(image) = image {
                averaged |= !image.is_uniform();
                let mean = mean_emission(parsed, corners, image);
                faces.emissions.push(std::array::from_fn(|i| glow[i] * mean[i]));
            }
        }
        if faces.colours.is_empty() && faces.emissions.is_empty() {
            continue;
        }
        reader.lamps_off |= !faces.emissions.is_empty() && faces.emissions.iter().all(|e| *e == [0.0; 3]);
        let derived = derive(reader, base, &faces);
        error = error.max(derived.error);
        for (i, &face) in members.iter().enumerate() {
            materials[face] = derived.materials[i];
            if let Some(uvs) = &derived.uvs {
                let [u, v] = uvs[i];
                parsed.uvs.push([u, 1.0 - v]);
                let index = parsed.uvs.len() as u32;
                let Face { first, count, .. } = parsed.faces[face];
                parsed.corners[first..first + count].iter_mut().for_each(|corner| corner[1] = index);
            }
        }
    }
    let mut warn = |sentence: String| reader.warn(format!("{}: {sentence}", path.display()));
    if uneven {
        warn("colours of vertices are averaged over each face".into());
    }
    if textured {
        warn("colours of vertices are not used on textured surfaces".into());
    }
    if averaged {
        let within = if error > 0.0 { format!(", within {:.1} %", 100.0 * error) } else { String::new() };
        warn(format!("emission from an image (map_Ke) is averaged over each face{within}"));
    }
}

fn corners(parsed: &Parsed, face: usize) -> &[[u32; 3]] {
    let Face { first, count, .. } = parsed.faces[face];
    &parsed.corners[first..first + count]
}

fn position_of(parsed: &Parsed, corner: &[u32; 3]) -> DVec3 {
    DVec3::from(parsed.positions[corner[0] as usize - 1])
}

/// The area of a flat polygon.
fn area(parsed: &Parsed, corners: &[[u32; 3]]) -> f64 {
    let first = position_of(parsed, &corners[0]);
    let along =
        |pair: &[[u32; 3]]| (position_of(parsed, &pair[0]) - first).cross(position_of(parsed, &pair[1]) - first);
    0.5 * corners.windows(2).map(along).sum::<DVec3>().length()
}

/// The mean of an image over a polygon, by a fan of triangles that are weighted by their areas in space.
fn mean_emission(parsed: &Parsed, corners: &[[u32; 3]], image: &Pyramid) -> [f32; 3] {
    let uv = |corner: &[u32; 3]| {
        let [u, v] = if corner[1] > 0 { parsed.uvs[corner[1] as usize - 1] } else { [0.0, 1.0] };
        [u, 1.0 - v]
    };
    let mut sum = [0.0_f64; 3];
    let mut total = 0.0;
    for i in 2..corners.len() {
        let triangle = [corners[0], corners[i - 1], corners[i]];
        let weight = area(parsed, &triangle);
        let mean = image.mean(triangle.map(|corner| uv(&corner)));
        if corners.len() == 3 || image.is_uniform() {
            return mean;
        }
        total += weight;
        sum.iter_mut().zip(mean).for_each(|(sum, x)| *sum += weight * f64::from(x));
    }
    if total > 0.0 { sum.map(|x| (x / total) as f32) } else { image.mean([uv(&corners[0]); 3]) }
}
