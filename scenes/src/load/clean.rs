//! Meshes without faces that have no area and normals that have no direction.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::Reader;
use crate::Mesh;

/// Number of fixes, for the warnings.
#[derive(Default)]
pub(super) struct Fixes {
    pub dropped: usize,
    pub normals: usize,
    pub coordinates: usize,
}

impl Fixes {
    pub fn warn(&self, reader: &mut Reader, path: &Path) {
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

/// The mesh without triangles of zero area, with a unit normal per vertex. Without normals, vertices are split and faces
/// are shaded flat.
pub(super) fn cleaned(mut mesh: Mesh, has_normals: bool, fixes: &mut Fixes) -> Mesh {
    let mut kept = Vec::with_capacity(mesh.indices.len());
    for triangle in mesh.indices.as_chunks::<3>().0 {
        match area_vector(&mesh.positions, triangle) {
            Some(_) => kept.extend(triangle),
            None => fixes.dropped += 1,
        }
    }
    mesh.indices = kept;
    if !has_normals {
        return flat(&mesh);
    }
    fix_normals(&mut mesh, fixes);
    mesh
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

/// Adds the triangles of `part`.
pub(super) fn append(mesh: &mut Mesh, part: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend_from_slice(&part.positions);
    mesh.normals.extend_from_slice(&part.normals);
    mesh.uvs.extend_from_slice(&part.uvs);
    mesh.indices.extend(part.indices.iter().map(|i| first + i));
}
