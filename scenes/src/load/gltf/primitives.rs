//! Triangles of glTF meshes, with the materials of their faces.

use std::collections::BTreeMap;
use std::rc::Rc;

use ::gltf::Semantic;
use ::gltf::mesh::Mode;
use glam::Vec3;

use super::super::Reader;
use super::super::faces::{Faces, derive};
use super::Source;
use super::materials::{Mapping, Surface, Surfaces};

/// The triangles of one primitive, in the coordinates of its mesh.
pub(super) struct Primitive {
    pub positions: Vec<[f32; 3]>,
    /// Empty if the file has none.
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// The material of each triangle, an index into the scene.
    pub materials: Vec<usize>,
    /// Texture coordinates of single faces, in place of `uvs`.
    pub face_uvs: Option<Vec<[f32; 2]>>,
}

/// A primitive whose faces have no materials yet.
struct Draft {
    primitive: Primitive,
    surface: Rc<Surface>,
    colours: Vec<[f32; 3]>,
    /// Texture coordinates of the image of emission.
    glow_uvs: Vec<[f32; 2]>,
}

/// Meshes by their index: those in `used`.
pub(super) fn read(
    reader: &mut Reader,
    source: &mut Source,
    used: &BTreeMap<usize, ::gltf::Mesh>,
) -> Result<BTreeMap<usize, Vec<Primitive>>, String> {
    let mut surfaces = Surfaces::default();
    let mut drafts = Vec::new();
    for (&index, mesh) in used {
        for primitive in mesh.primitives() {
            drafts.extend(draft(reader, source, &mut surfaces, &primitive)?.map(|draft| (index, draft)));
        }
    }
    vary(reader, source, &mut drafts);
    let mut meshes: BTreeMap<usize, Vec<Primitive>> = BTreeMap::new();
    for (index, draft) in drafts {
        meshes.entry(index).or_default().push(draft.primitive);
    }
    Ok(meshes)
}

/// `None` for lines, points and primitives without positions.
fn draft(
    reader: &mut Reader,
    source: &mut Source,
    surfaces: &mut Surfaces,
    primitive: &::gltf::Primitive,
) -> Result<Option<Draft>, String> {
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        source.notes.add("lines and points are not drawn");
        return Ok(None);
    }
    if primitive.morph_targets().next().is_some() {
        source.notes.add("morph targets are not drawn");
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    if positions.view().is_none() && primitive.extension_value("KHR_draco_mesh_compression").is_some() {
        return Err("has meshes compressed by Draco, which are not read; export it without compression".into());
    }
    let buffers = source.buffers;
    let positions = buffers.vectors::<3>(&positions)?;
    let count = positions.len();
    if positions.as_flattened().iter().any(|x| !x.is_finite()) {
        return Err("has a vertex that is not finite; export the model again".into());
    }
    let same_length = |length: usize| {
        let sentence = || format!("has {count} positions with {length} other attributes; export the model again");
        if length == count { Ok(()) } else { Err(sentence()) }
    };
    let normals = match primitive.get(&Semantic::Normals) {
        Some(normals) => buffers.vectors::<3>(&normals)?,
        None => Vec::new(),
    };
    if !normals.is_empty() {
        same_length(normals.len())?;
    }
    let colours = match primitive.get(&Semantic::Colors(0)) {
        Some(colours) => buffers.vectors::<3>(&colours)?,
        None => Vec::new(),
    };
    // White changes nothing.
    let colours = if colours.iter().all(|&colour| colour == [1.0; 3]) { Vec::new() } else { colours };
    if !colours.is_empty() {
        same_length(colours.len())?;
    }
    let surface = surfaces.get(reader, source, &primitive.material(), !colours.is_empty());
    let mut coordinates = |mapping: &Mapping| -> Result<Vec<[f32; 2]>, String> {
        let Some(accessor) = primitive.get(&Semantic::TexCoords(mapping.set)) else { return Ok(vec![[0.0; 2]; count]) };
        let mut uvs = buffers.vectors::<2>(&accessor)?;
        same_length(uvs.len())?;
        for uv in &mut uvs {
            let mapped = mapping.apply(*uv);
            *uv = if mapped.iter().all(|x| x.is_finite()) { mapped } else { [0.0; 2] };
        }
        // Within a texel or so of the border, wrapping shows nothing.
        if mapping.bounded && uvs.as_flattened().iter().any(|x| !(-0.01..=1.01).contains(x)) {
            source.notes.add("textures that are clamped or mirrored at their border are repeated");
        }
        Ok(uvs)
    };
    let uvs = coordinates(&surface.mapping)?;
    let glow_uvs = match &surface.emission {
        Some((_, mapping)) => coordinates(mapping)?,
        None => Vec::new(),
    };
    let corners = match primitive.indices() {
        Some(indices) => buffers.indices(&indices)?,
        None => (0..u32::try_from(count).map_err(|_| "has too many vertices")?).collect(),
    };
    if corners.iter().any(|&i| i as usize >= count) {
        return Err(format!("has an index out of range: there are {count} vertices; export the model again"));
    }
    let triangles: Vec<[u32; 3]> = match primitive.mode() {
        Mode::TriangleStrip => {
            let triple = |(i, c): (usize, &[u32])| if i % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] };
            corners.windows(3).enumerate().map(triple).collect()
        }
        Mode::TriangleFan => corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]).collect(),
        _ => corners.as_chunks::<3>().0.to_vec(),
    };
    let materials = vec![surface.index; triangles.len()];
    let primitive = Primitive { positions, normals, uvs, triangles, materials, face_uvs: None };
    Ok(Some(Draft { primitive, surface, colours, glow_uvs }))
}

/// Gives faces the means of their corners' colours and of their materials' images of emission.
fn vary(reader: &mut Reader, source: &mut Source, drafts: &mut [(usize, Draft)]) {
    let mut bases: Vec<usize> = drafts.iter().map(|(_, draft)| draft.surface.index).collect();
    bases.sort_unstable();
    bases.dedup();
    for base in bases {
        let has_texture = reader.scene.materials[base].albedo_texture.is_some();
        let glow = reader.scene.materials[base].emission;
        let members = || drafts.iter().map(|(_, draft)| draft).filter(|draft| draft.surface.index == base);
        let coloured = members().any(|draft| !draft.colours.is_empty());
        let image = members().find_map(|draft| draft.surface.emission.clone()).map(|(image, _)| image);
        if coloured && has_texture {
            source.notes.add("colours of vertices are not used on textured surfaces");
        }
        let coloured = coloured && !has_texture;
        if !coloured && image.is_none() {
            continue;
        }
        let mut faces = Faces::default();
        for draft in members() {
            for triangle in &draft.primitive.triangles {
                let corner = |i: usize| triangle[i] as usize;
                let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(draft.primitive.positions[corner(i)]).as_dvec3());
                faces.areas.push((b - a).cross(c - a).length());
                if coloured {
                    let colours = [0, 1, 2].map(|i| draft.colours.get(corner(i)).copied().unwrap_or([1.0; 3]));
                    let same = colours[1] == colours[0] && colours[2] == colours[0];
                    if !same {
                        source.notes.add("colours of vertices are averaged over each face");
                    }
                    let mean = |k: usize| colours.iter().map(|colour| colour[k]).sum::<f32>() / 3.0;
                    let mean = if same { colours[0] } else { std::array::from_fn(mean) };
                    faces.colours.push(super::super::clamp(mean, 0.0, 1.0).0);
                }
                if let Some(image) = &image {
                    if !image.is_uniform() {
                        source.notes.add("emission from an image is averaged over each face");
                    }
                    let mean = image.mean([0, 1, 2].map(|i| draft.glow_uvs[corner(i)]));
                    faces.emissions.push(std::array::from_fn(|k| glow[k] * mean[k]));
                }
            }
        }
        reader.lamps_off |= !faces.emissions.is_empty()
            && glow != [0.0; 3]
            && faces.emissions.iter().all(|emission| *emission == [0.0; 3]);
        let derived = derive(reader, base, &faces);
        let mut at = 0;
        for (_, draft) in drafts.iter_mut().filter(|(_, draft)| draft.surface.index == base) {
            let range = at..at + draft.primitive.triangles.len();
            at = range.end;
            draft.primitive.materials.copy_from_slice(&derived.materials[range.clone()]);
            draft.primitive.face_uvs = derived.uvs.as_ref().map(|uvs| uvs[range].to_vec());
        }
    }
}
