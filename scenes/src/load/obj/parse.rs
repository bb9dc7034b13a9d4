//! The lines of an OBJ file.
//!
//! Every line is read once. Errors have line numbers, and faces may refer to later vertices.

use std::collections::HashMap;
use std::path::Path;

use super::super::text::{Counts, logical_lines, split_keyword};
use crate::SceneError;

/// A face.
pub(super) struct Face {
    /// The first of its corners, and their number.
    pub first: usize,
    pub count: usize,
    /// Faces of one run share vertices: a group, its material and its form stay the same.
    pub run: usize,
    /// Index into [`Parsed::groups`].
    pub group: usize,
    /// Index into [`Parsed::used`].
    pub material: Option<usize>,
}

/// The contents of a file.
#[derive(Default)]
pub(super) struct Parsed {
    pub positions: Vec<[f64; 3]>,
    /// One for each position if any position has one; white where it has none.
    pub colours: Vec<[f32; 3]>,
    /// As in the file, v pointing up.
    pub uvs: Vec<[f32; 2]>,
    /// As in the file; 0 where it is not finite.
    pub normals: Vec<[f32; 3]>,
    /// One-based indices of position, texture coordinate and normal; 0 for none.
    pub corners: Vec<[u32; 3]>,
    pub faces: Vec<Face>,
    /// Names of objects and groups.
    pub groups: Vec<String>,
    /// Material libraries and their lines.
    pub libraries: Vec<(usize, String)>,
    /// Names of materials in the order of first use, and their lines.
    pub used: Vec<(usize, String)>,
    /// Texture coordinates that were not finite.
    pub bad_coordinates: usize,
    /// Faces with fewer than three corners.
    pub lines_as_faces: usize,
    /// Lines and points, which have no surface.
    pub thin: usize,
    /// Keywords of free-form geometry.
    pub free_form: Counts,
    /// Keywords that OBJ does not have.
    pub unknown: Counts,
}

/// The name of what belongs to no object or group.
const UNNAMED: &str = "unnamed_object";

const ELEMENTS: [(&str, &str); 3] = [("vertex", "v"), ("texture coordinate", "vt"), ("normal", "vn")];

pub(super) fn parse(path: &Path, text: &str) -> Result<Parsed, SceneError> {
    let fail = |line: usize, sentence: String| Err(SceneError(format!("{}:{line}: {sentence}", path.display())));
    let mut out = Parsed { groups: vec![UNNAMED.into()], ..Parsed::default() };
    // For each element, the highest index used by a face, and its line.
    let mut highest = [(0_usize, 0_usize); 3];
    let mut used = HashMap::new();
    let mut material = None;
    let mut form = [false; 2];
    let mut run = 0;
    for (number, line) in logical_lines(text) {
        let (keyword, rest) = split_keyword(&line);
        match keyword.as_ref() {
            "v" => {
                let Some(position) = position(rest) else {
                    let sentence = format!(
                        "vertex `{}` is not three finite numbers; export the model again or fix this line",
                        line.trim()
                    );
                    return fail(number, sentence);
                };
                let colour = colour(rest);
                if colour.is_some() && out.colours.is_empty() {
                    out.colours.resize(out.positions.len(), [1.0; 3]);
                }
                if colour.is_some() || !out.colours.is_empty() {
                    out.colours.push(colour.unwrap_or([1.0; 3]));
                }
                out.positions.push(position);
            }
            "vt" => {
                // A single number is valid: v is then 0.
                let good = numbers::<2>(rest).or_else(|| numbers::<1>(rest).map(|[u]| [u, 0.0]));
                out.bad_coordinates += usize::from(good.is_none());
                out.uvs.push(good.unwrap_or_default());
            }
            // A zero normal is replaced by the geometric normal later.
            "vn" => out.normals.push(numbers(rest).unwrap_or_default()),
            "f" | "fo" => {
                let first = out.corners.len();
                let counts = [out.positions.len(), out.uvs.len(), out.normals.len()];
                for word in words(rest) {
                    match corner(word, counts) {
                        Ok(corner) => {
                            for ((highest, line), index) in highest.iter_mut().zip(corner) {
                                if index > *highest {
                                    (*highest, *line) = (index, number);
                                }
                            }
                            // An index out of range is refused below.
                            out.corners.push(corner.map(|index| u32::try_from(index).unwrap_or(u32::MAX)));
                        }
                        Err(what) => {
                            return fail(
                                number,
                                format!("face corner `{word}` {what}; export the model again or fix this line"),
                            );
                        }
                    }
                }
                let corners = &out.corners[first..];
                let form_here = corners.first().map_or(form, |c| [c[1] > 0, c[2] > 0]);
                if corners.iter().any(|c| [c[1] > 0, c[2] > 0] != form_here) {
                    let sentence = "the corners of this face have different forms (v, v/vt, v//vn or v/vt/vn); export the model again or fix this line";
                    return fail(number, sentence.into());
                }
                if corners.len() < 3 {
                    out.lines_as_faces += 1;
                    out.corners.truncate(first);
                    continue;
                }
                run += usize::from(form_here != form);
                form = form_here;
                let (count, group) = (corners.len(), out.groups.len() - 1);
                out.faces.push(Face { first, count, run, group, material });
            }
            "o" | "g" => {
                out.groups.push(if rest.is_empty() { UNNAMED.into() } else { rest.to_owned() });
                run += 1;
            }
            "usemtl" if !rest.is_empty() => {
                let next = used.len();
                let index = *used.entry(rest.to_owned()).or_insert_with(|| {
                    out.used.push((number, rest.to_owned()));
                    next
                });
                run += usize::from(material != Some(index));
                material = Some(index);
            }
            "mtllib" => out.libraries.push((number, rest.to_owned())),
            "l" | "p" => out.thin += 1,
            // Smoothing groups, display settings, and parameters of free-form geometry change no surface.
            "" | "s" | "mg" | "vp" | "usemtl" | "usemap" | "maplib" | "bevel" | "c_interp" | "d_interp" | "lod"
            | "shadow_obj" | "trace_obj" | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole" | "scrv"
            | "sp" | "end" | "con" | "ctech" | "stech" => {}
            "curv" | "curv2" | "surf" | "bsp" | "bzp" | "cdc" | "cdp" | "res" => out.free_form.add(&keyword),
            word if word.starts_with('#') => {}
            word => out.unknown.add(word),
        }
    }
    let counts = [out.positions.len(), out.uvs.len(), out.normals.len()];
    for ((index, line), (count, (name, keyword))) in highest.into_iter().zip(counts.into_iter().zip(ELEMENTS)) {
        if index > count {
            let sentence = format!(
                "face refers to {name} {index}, but the file has {count} `{keyword}` lines; export the model again or fix this line"
            );
            return fail(line, sentence);
        }
    }
    Ok(out)
}

/// Words up to a comment. A comment is a word that begins with `#`; `1.#IND` is an invalid number, not a comment.
fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// The first three numbers, finite in float32.
fn position(rest: &str) -> Option<[f64; 3]> {
    let mut words = words(rest);
    let mut found = [0.0; 3];
    for slot in &mut found {
        *slot = words.next()?.parse().ok().filter(|x: &f64| (*x as f32).is_finite())?;
    }
    Some(found)
}

/// The colour behind the coordinates of a vertex. A fourth number alone is a weight.
fn colour(rest: &str) -> Option<[f32; 3]> {
    let mut words = words(rest).skip(3);
    let mut found = [0.0; 3];
    for slot in &mut found {
        *slot = words.next()?.parse().ok().filter(|x: &f32| x.is_finite() && *x >= 0.0)?;
    }
    Some(found)
}

/// The first `N` numbers. Further numbers (a third texture coordinate) are ignored.
fn numbers<const N: usize>(rest: &str) -> Option<[f32; N]> {
    let mut words = words(rest);
    let mut found = [0.0; N];
    for slot in &mut found {
        *slot = words.next()?.parse().ok().filter(|x: &f32| x.is_finite())?;
    }
    Some(found)
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
