//! OBJ models.
//!
//! tobj triangulates faces and unifies indices. Before that, [`check`] reads every line once. It gives errors their line
//! numbers and lets faces refer to later vertices. It also separates faces of different forms: tobj misaligns its arrays
//! if only some faces of a group have texture coordinates or normals.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::{Reader, keys::nearest_name, mtl, reason};
use crate::{Material, Mesh, SceneError};

/// Reads a model. Adds its materials and textures to the scene and returns its meshes: one per object and material, in
/// the order of first use. `path` is used for messages and to find files beside the model.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8]) -> Result<Vec<Mesh>, SceneError> {
    let text = String::from_utf8_lossy(bytes);
    let checked = check(path, &text)?;
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let names: HashMap<_, _> = (0..checked.used.len()).map(|i| (i.to_string(), i)).collect();
    let (models, _) = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, |_| {
        let names = names.iter().map(|(name, &i)| (name.clone(), i)).collect();
        Ok((vec![tobj::Material::default(); checked.used.len()], names))
    })
    .map_err(|error| SceneError(format!("{}: {error}; export the model again", path.display())))?;

    let first_material = reader.scene.materials.len();
    let materials = materials(reader, path, &checked);
    reader.scene.materials.extend(materials);
    let mut default_material = None;
    let mut fixes = Fixes { coordinates: checked.bad_coordinates, ..Fixes::default() };
    fixes.dropped += checked.lines_as_faces;
    let (mut meshes, mut known) = (Vec::<Mesh>::new(), HashMap::new());
    for tobj::Model { mesh, name } in models {
        let part = cleaned(&mesh, &mut fixes);
        if part.indices.is_empty() {
            continue;
        }
        let material = mesh.material_id.map_or_else(
            || {
                *default_material.get_or_insert_with(|| {
                    reader.scene.materials.push(Material::default());
                    reader.scene.materials.len() - 1
                })
            },
            |id| first_material + id,
        );
        match known.get(&(name.clone(), material)) {
            Some(&index) => append(&mut meshes[index], &part),
            None => {
                known.insert((name.clone(), material), meshes.len());
                meshes.push(Mesh { name, material, ..part });
            }
        }
    }
    fixes.warn(reader, path);
    if meshes.is_empty() {
        let what = if fixes.dropped > 0 { "every face has zero area" } else { "the file has no faces" };
        return Err(SceneError(format!("{}: {what}; export the model with its surfaces", path.display())));
    }
    Ok(meshes)
}

/// A checked file in the form that tobj reads.
#[derive(Default)]
struct Checked {
    /// Vertices first, then faces; `usemtl` followed by an index into `used`.
    text: String,
    /// Material libraries and their lines.
    libraries: Vec<(usize, String)>,
    /// Names of materials in the order of first use, and their lines.
    used: Vec<(usize, String)>,
    /// Texture coordinates that were not finite.
    bad_coordinates: usize,
    /// Faces with fewer than three corners.
    lines_as_faces: usize,
}

/// Which of texture coordinate and normal a face refers to.
type Form = [bool; 2];

const ELEMENTS: [(&str, &str); 3] = [("vertex", "v"), ("texture coordinate", "vt"), ("normal", "vn")];

fn check(path: &Path, text: &str) -> Result<Checked, SceneError> {
    let fail = |line: usize, sentence: String| Err(SceneError(format!("{}:{line}: {sentence}", path.display())));
    let mut out = Checked::default();
    let mut vertices = String::with_capacity(text.len() / 2);
    let mut faces = String::with_capacity(text.len() / 2);
    let mut counts = [0_usize; 3];
    // For each element, the highest index used by a face, and its line.
    let mut highest = [(0_usize, 0_usize); 3];
    let mut used = HashMap::new();
    let mut group = "";
    let mut form: Form = [false; 2];
    let mut corners = Vec::new();
    for (number, line) in logical_lines(text) {
        let (keyword, rest) = split_keyword(&line);
        match keyword {
            "v" => {
                let Some(words) = words::<3>(rest).filter(|words| words.iter().all(|word| finite(word).is_some()))
                else {
                    let sentence = format!(
                        "vertex `{}` is not three finite numbers; export the model again or fix this line",
                        line.trim()
                    );
                    return fail(number, sentence);
                };
                push_line(&mut vertices, "v", &words);
                counts[0] += 1;
            }
            "vt" => {
                // A single number is valid: v is then 0.
                let both = words::<2>(rest).or_else(|| words::<1>(rest).map(|[u]| [u, "0"]));
                let good = both.filter(|words| words.iter().all(|word| finite(word).is_some()));
                out.bad_coordinates += usize::from(good.is_none());
                push_line(&mut vertices, "vt", &good.unwrap_or(["0", "0"]));
                counts[1] += 1;
            }
            "vn" => {
                // A zero normal is replaced by the geometric normal later.
                let good = words::<3>(rest).filter(|words| words.iter().all(|word| finite(word).is_some()));
                push_line(&mut vertices, "vn", &good.unwrap_or(["0", "0", "0"]));
                counts[2] += 1;
            }
            "f" => {
                corners.clear();
                for word in all_words(rest) {
                    match corner(word, counts) {
                        Ok(corner) => corners.push(corner),
                        Err(what) => {
                            return fail(
                                number,
                                format!("face corner `{word}` {what}; export the model again or fix this line"),
                            );
                        }
                    }
                }
                let form_here = corners.first().map_or(form, |c| [c[1] > 0, c[2] > 0]);
                if corners.iter().any(|c| [c[1] > 0, c[2] > 0] != form_here) {
                    let sentence = "the corners of this face have different forms (v, v/vt, v//vn or v/vt/vn); export the model again or fix this line";
                    return fail(number, sentence.into());
                }
                if corners.len() < 3 {
                    out.lines_as_faces += 1;
                    continue;
                }
                for (highest, element) in highest.iter_mut().zip(0..3) {
                    let here = corners.iter().map(|c| c[element]).max().unwrap_or_default();
                    *highest = (*highest).max((here, if here > highest.0 { number } else { 0 }));
                }
                if form_here != form {
                    form = form_here;
                    // tobj starts new arrays at a new group.
                    push_line(&mut faces, "g", &[group]);
                }
                faces.push('f');
                for &[v, vt, vn] in &corners {
                    // Writing to a String cannot fail.
                    let _ = match form {
                        [false, false] => write!(faces, " {v}"),
                        [true, false] => write!(faces, " {v}/{vt}"),
                        [false, true] => write!(faces, " {v}//{vn}"),
                        [true, true] => write!(faces, " {v}/{vt}/{vn}"),
                    };
                }
                faces.push('\n');
            }
            _ => {}
        }
        // A name borrows from the text unless its line was joined from several lines.
        match (keyword, &line) {
            ("o" | "g", Cow::Borrowed(line)) => {
                group = split_keyword(line).1;
                push_line(&mut faces, "g", &[group]);
            }
            ("usemtl", _) => {
                let next = used.len();
                let index = *used.entry(rest.to_owned()).or_insert_with(|| {
                    out.used.push((number, rest.to_owned()));
                    next
                });
                push_line(&mut faces, "usemtl", &[&index.to_string()]);
            }
            ("mtllib", _) => out.libraries.push((number, rest.to_owned())),
            _ => {}
        }
    }
    for ((index, line), (count, (name, keyword))) in highest.into_iter().zip(counts.into_iter().zip(ELEMENTS)) {
        if index > count {
            let sentence = format!(
                "face refers to {name} {index}, but the file has {count} `{keyword}` lines; export the model again or fix this line"
            );
            return fail(line, sentence);
        }
    }
    out.text = format!("mtllib used\n{vertices}{faces}");
    Ok(out)
}

/// Lines with their numbers, starting at 1. A line that ends in `\` continues on the next one.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.trim_start_matches('\u{feff}').lines().zip(1..);
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        let Some(start) = line.strip_suffix('\\') else { return Some((number, Cow::Borrowed(line))) };
        let mut joined = start.to_owned();
        for (line, _) in lines.by_ref() {
            joined.push(' ');
            joined.push_str(line.strip_suffix('\\').unwrap_or(line));
            if !line.ends_with('\\') {
                break;
            }
        }
        Some((number, Cow::Owned(joined)))
    })
}

fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword, rest.trim())
}

/// Words up to a comment. A comment is a word that begins with `#`; `1.#IND` is an invalid number, not a comment.
fn all_words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// The first `N` words. Further words (weights, colours, a third texture coordinate) are ignored.
fn words<const N: usize>(rest: &str) -> Option<[&str; N]> {
    let mut words = all_words(rest);
    let mut found = [""; N];
    for slot in &mut found {
        *slot = words.next()?;
    }
    Some(found)
}

fn finite(word: &str) -> Option<f32> {
    word.parse().ok().filter(|x: &f32| x.is_finite())
}

fn push_line(text: &mut String, keyword: &str, words: &[&str]) {
    text.push_str(keyword);
    for word in words {
        text.push(' ');
        text.push_str(word);
    }
    text.push('\n');
}

/// The one-based indices of vertex, texture coordinate and normal (0 for none) of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
/// Negative numbers count back from the last element read.
fn corner(word: &str, counts: [usize; 3]) -> Result<[usize; 3], String> {
    let mut indices = [0; 3];
    for (element, part) in word.split('/').enumerate() {
        let slot = indices.get_mut(element).ok_or("has more than three indices")?;
        if part.is_empty() && element > 0 {
            continue;
        }
        let index: isize = part.parse().map_err(|_| "does not consist of whole numbers in range")?;
        let from_one = if index < 0 { counts[element] as isize + 1 + index } else { index };
        if from_one < 1 {
            let (name, keyword) = ELEMENTS[element];
            let count = counts[element];
            return Err(format!("refers to {name} {index}, out of range after {count} `{keyword}` lines"));
        }
        *slot = from_one as usize;
    }
    Ok(indices)
}

/// Materials in the order of `checked.used`.
fn materials(reader: &mut Reader, path: &Path, checked: &Checked) -> Vec<Material> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut entries = Vec::new();
    let mut unread = false;
    for (line, name) in &checked.libraries {
        // The line is one name with spaces, or several names.
        let whole = [name.as_str()];
        let several: Vec<_> = name.split_whitespace().collect();
        let found = |name: &&str| library(reader, folder, name).is_ok();
        let names = if whole.iter().all(found) || !several.iter().all(found) { &whole[..] } else { &several[..] };
        for name in names {
            match library(reader, folder, name) {
                Ok((path, bytes)) => entries.extend(mtl::read(reader, &path, &bytes)),
                Err(error) => {
                    unread = true;
                    let why = reason(&error);
                    reader.warn(format!(
                        "{}:{line}: material library `{name}` cannot be read ({why}); its materials are grey",
                        path.display()
                    ));
                }
            }
        }
    }
    let mut resolve = |(line, name): &(usize, String)| match entries.iter().find(|entry| entry.name == *name) {
        Some(entry) => entry.resolve(reader),
        None => {
            if !unread {
                let near = nearest_name(name, entries.iter().map(|entry| entry.name.as_str()));
                let near = near.map(|near| format!(" (did you mean `{near}`?)")).unwrap_or_default();
                reader.warn(format!(
                    "{}:{line}: material `{name}` is in no material library{near}; it is drawn in grey",
                    path.display()
                ));
            }
            Material { name: name.clone(), ..Material::default() }
        }
    };
    checked.used.iter().map(&mut resolve).collect()
}

fn library(reader: &Reader, folder: &Path, name: &str) -> std::io::Result<(PathBuf, Vec<u8>)> {
    let path = folder.join(name.trim_matches('"').replace('\\', "/"));
    reader.files.read(&path).map(|bytes| (path, bytes))
}

/// Number of fixes, for the warnings.
#[derive(Default)]
struct Fixes {
    dropped: usize,
    normals: usize,
    coordinates: usize,
}

impl Fixes {
    fn warn(&self, reader: &mut Reader, path: &Path) {
        let mut say = |count: usize, one: &str, many: &str, what: &str| {
            if count > 0 {
                let (things, verb) = if count == 1 { (one, "was") } else { (many, "were") };
                reader.warn(format!("{}: {count} {things} {verb} {what}", path.display()));
            }
        };
        say(self.dropped, "face of zero area", "faces of zero area", "dropped");
        say(self.normals, "zero or non-finite normal", "zero or non-finite normals", "replaced by geometric normals");
        say(self.coordinates, "non-finite texture coordinate", "non-finite texture coordinates", "replaced by 0");
    }
}

/// The mesh without triangles of zero area, with a unit normal and a texture coordinate per vertex. If the file has no
/// normals, vertices are split and faces are shaded flat.
fn cleaned(mesh: &tobj::Mesh, fixes: &mut Fixes) -> Mesh {
    let triples = |values: &[f32]| values.as_chunks::<3>().0.to_vec();
    let mut out = Mesh {
        positions: triples(&mesh.positions),
        normals: triples(&mesh.normals),
        // v points up in OBJ files.
        uvs: mesh.texcoords.as_chunks::<2>().0.iter().map(|&[u, v]| [u, 1.0 - v]).collect(),
        indices: Vec::with_capacity(mesh.indices.len()),
        ..Mesh::default()
    };
    out.uvs.resize(out.positions.len(), [0.0; 2]);
    for triangle in mesh.indices.as_chunks::<3>().0 {
        match area_vector(&out.positions, triangle) {
            Some(_) => out.indices.extend(triangle),
            None => fixes.dropped += 1,
        }
    }
    if out.normals.is_empty() {
        return flat(&out);
    }
    fix_normals(&mut out, fixes);
    out
}

/// Geometric normal times twice the area. `None` for a triangle whose height is under 1e-7 of its longest edge: at the
/// precision of float32 positions it is a line.
fn area_vector(positions: &[[f32; 3]], triangle: &[u32; 3]) -> Option<DVec3> {
    let [a, b, c] = triangle.map(|i| Vec3::from(positions[i as usize]).as_dvec3());
    let cross = (b - a).cross(c - a);
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (cross.length() > 1e-7 * longest).then_some(cross)
}

fn flat(mesh: &Mesh) -> Mesh {
    let corners = || mesh.indices.iter().map(|&i| i as usize);
    let normal = |triangle: &[u32; 3]| {
        let normal = area_vector(&mesh.positions, triangle).unwrap_or(DVec3::Y).normalize();
        [normal.as_vec3().to_array(); 3]
    };
    Mesh {
        positions: corners().map(|i| mesh.positions[i]).collect(),
        normals: mesh.indices.as_chunks::<3>().0.iter().flat_map(normal).collect(),
        uvs: corners().map(|i| mesh.uvs[i]).collect(),
        indices: (0..mesh.indices.len() as u32).collect(),
        ..Mesh::default()
    }
}

/// Normalizes normals. A normal without a direction is replaced by the area-weighted mean of the geometric normals
/// around its vertex.
fn fix_normals(mesh: &mut Mesh, fixes: &mut Fixes) {
    let mut bad = HashMap::new();
    for (i, normal) in mesh.normals.iter_mut().enumerate() {
        let exact = Vec3::from(*normal).as_dvec3();
        match exact.try_normalize() {
            // A normal of unit length within float precision is kept bit for bit.
            Some(_) if (exact.length_squared() - 1.0).abs() < 1e-6 => {}
            Some(unit) => *normal = unit.as_vec3().to_array(),
            None => {
                bad.insert(i as u32, [DVec3::ZERO; 2]);
            }
        }
    }
    if bad.is_empty() {
        return;
    }
    for triangle in mesh.indices.as_chunks::<3>().0 {
        for corner in triangle {
            if let (Some([sum, last]), Some(area)) = (bad.get_mut(corner), area_vector(&mesh.positions, triangle)) {
                *sum += area;
                *last = area;
            }
        }
    }
    // Vertices that only dropped triangles use are not counted.
    fixes.normals += bad.values().filter(|[_, last]| *last != DVec3::ZERO).count();
    for (i, [sum, last]) in bad {
        let unit = sum.try_normalize().or(last.try_normalize()).unwrap_or(DVec3::Y);
        mesh.normals[i as usize] = unit.as_vec3().to_array();
    }
}

fn append(mesh: &mut Mesh, part: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend_from_slice(&part.positions);
    mesh.normals.extend_from_slice(&part.normals);
    mesh.uvs.extend_from_slice(&part.uvs);
    mesh.indices.extend(part.indices.iter().map(|i| first + i));
}
