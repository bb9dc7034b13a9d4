//! Faces to meshes: triangles, shared vertices, normals.

use std::collections::HashMap;

use glam::DVec3;

use super::super::clean::{Fixes, append, cleaned};
use super::super::triangulate::Triangulator;
use super::parse::Parsed;
use crate::Mesh;

/// A mesh while it is being built: the faces of one run and one material.
#[derive(Default)]
struct Part {
    /// Vertices by their one-based indices in the file.
    known: HashMap<[u32; 3], u32>,
    group: usize,
    material: usize,
    has_normals: bool,
    mesh: Mesh,
}

impl Part {
    fn vertex(&mut self, parsed: &Parsed, offset: DVec3, corner: [u32; 3]) -> u32 {
        let mesh = &mut self.mesh;
        *self.known.entry(corner).or_insert_with(|| {
            let [position, uv, normal] = corner.map(|index| index as usize);
            mesh.positions.push((DVec3::from(parsed.positions[position - 1]) - offset).as_vec3().to_array());
            if normal > 0 {
                mesh.normals.push(parsed.normals[normal - 1]);
            }
            // v points up in OBJ files.
            mesh.uvs.push(if uv > 0 { parsed.uvs[uv - 1] } else { [0.0, 1.0] });
            if let Some([_, v]) = mesh.uvs.last_mut() {
                *v = 1.0 - *v;
            }
            mesh.positions.len() as u32 - 1
        })
    }
}

/// One mesh per group name and material, in the order of first use. `materials` holds the material of each face, an
/// index into the scene. Positions are relative to `offset`.
pub(super) fn meshes(parsed: &Parsed, materials: &[usize], offset: DVec3, fixes: &mut Fixes) -> Vec<Mesh> {
    let mut triangulator = Triangulator::new();
    let mut outline = Vec::new();
    let (mut parts, mut places) = (Vec::<Part>::new(), HashMap::new());
    for (face, &material) in parsed.faces.iter().zip(materials) {
        let place = *places.entry((face.run, material)).or_insert_with(|| {
            let has_normals = parsed.corners[face.first][2] > 0;
            parts.push(Part { group: face.group, material, has_normals, ..Part::default() });
            parts.len() - 1
        });
        let part = &mut parts[place];
        let corners = &parsed.corners[face.first..face.first + face.count];
        outline.clear();
        outline.extend(corners.iter().map(|corner| DVec3::from(parsed.positions[corner[0] as usize - 1])));
        triangulator.triangles(&outline, |triangle| {
            let triangle = triangle.map(|i| part.vertex(parsed, offset, corners[i]));
            part.mesh.indices.extend(triangle);
        });
    }
    let (mut meshes, mut known) = (Vec::<Mesh>::new(), HashMap::new());
    for part in parts {
        let mesh = cleaned(part.mesh, part.has_normals, fixes);
        if mesh.indices.is_empty() {
            continue;
        }
        let name = &parsed.groups[part.group];
        match known.get(&(name.as_str(), part.material)) {
            Some(&index) => append(&mut meshes[index], &mesh),
            None => {
                known.insert((name.as_str(), part.material), meshes.len());
                meshes.push(Mesh { name: name.clone(), material: part.material, ..mesh });
            }
        }
    }
    meshes
}
