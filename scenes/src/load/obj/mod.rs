//! OBJ models.
//!
//! The lines are read by [`parse`], faces are given their materials by [`surfaces`], and [`build`] makes meshes of them.
//! No crate is used for this: those known read positions as float32, divide polygons into fans, and drop colours of
//! vertices.

mod build;
mod parse;
mod surfaces;

use std::path::Path;

use glam::DVec3;

use super::clean::Fixes;
use super::{Model, Reader, origin, text};
use crate::SceneError;

/// Reads a model. Adds its materials and textures to the scene and returns its meshes: one per object and material, in
/// the order of first use. `path` is used for messages and to find files beside the model.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8]) -> Result<Model, SceneError> {
    let text = text::decode(bytes);
    let mut parsed = parse::parse(path, &text)?;
    let materials = surfaces::assign(reader, path, &mut parsed);
    let (low, high) = bounds(&parsed);
    let offset = origin::offset(low, high);
    let mut fixes = Fixes { coordinates: parsed.bad_coordinates, ..Fixes::default() };
    fixes.dropped += parsed.lines_as_faces;
    let meshes = build::meshes(&parsed, &materials, offset, &mut fixes);
    fixes.warn(reader, path);
    let mut warn = |sentence: String| reader.warn(format!("{}: {sentence}", path.display()));
    if parsed.thin > 0 {
        let (things, verb) = if parsed.thin == 1 { ("line or point", "is") } else { ("lines and points", "are") };
        warn(format!("{} {things} (`l`, `p`) {verb} not drawn", parsed.thin));
    }
    if !parsed.free_form.is_empty() {
        warn(format!("curves and free-form surfaces are not drawn ({}); export polygons", parsed.free_form));
    }
    if !parsed.unknown.is_empty() {
        warn(format!("unknown keywords are ignored: {}", parsed.unknown));
    }
    if meshes.is_empty() {
        let what = if fixes.dropped > 0 { "every face has zero area" } else { "the file has no faces" };
        return Err(SceneError(format!("{}: {what}; export the model with its surfaces", path.display())));
    }
    Ok(Model { meshes, offset, ..Model::default() })
}

/// Bounds of what faces use.
fn bounds(parsed: &parse::Parsed) -> (DVec3, DVec3) {
    let corners = parsed.corners.iter().map(|corner| DVec3::from(parsed.positions[corner[0] as usize - 1]));
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}
