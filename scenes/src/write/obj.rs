//! OBJ, MTL and PNG files.

use std::collections::HashSet;
use std::fmt::Write;
use std::io::Cursor;

use glam::DVec3;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use crate::{Material, Mesh, SceneError, Texture};

/// Writes surfaces as `NAME.obj`, `NAME.mtl` and `textures/*.png`; returns paths and bytes. `name` is a plain name
/// without folders.
///
/// Numbers are written with the fewest digits that read back as the same float32, so positions, normals and materials
/// read back bit for bit. Texture coordinates read back within 6e-8: v points up in OBJ files, and 1 - v rounds. Names
/// that clash or that OBJ cannot hold are changed. An alpha mask that is opaque everywhere is left out.
///
/// # Errors
/// A texture whose size does not match its number of bytes.
pub fn write_obj(
    meshes: &[Mesh],
    materials: &[Material],
    textures: &[Texture],
    name: &str,
) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    write_obj_at(meshes, materials, textures, name, DVec3::ZERO)
}

/// As [`write_obj`], with all positions moved by `origin`.
pub(super) fn write_obj_at(
    meshes: &[Mesh],
    materials: &[Material],
    textures: &[Texture],
    name: &str,
    origin: DVec3,
) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let mut names = Names::default();
    let images: Vec<_> = textures.iter().map(|t| format!("textures/{}.png", names.take(&stem(&t.name)))).collect();
    let mut names = Names::default();
    let material_names: Vec<_> = materials.iter().map(|m| names.take(&one_line(&m.name))).collect();

    let mut mtl = String::new();
    for (material, name) in materials.iter().zip(&material_names) {
        write_material(&mut mtl, material, name, textures, &images);
    }
    let mut obj = format!("mtllib {name}.mtl\n");
    let mut first = 1;
    for mesh in meshes {
        write_mesh(&mut obj, mesh, material_names.get(mesh.material), first, origin);
        first += mesh.positions.len();
    }
    let mut files = vec![(format!("{name}.obj"), obj.into_bytes()), (format!("{name}.mtl"), mtl.into_bytes())];
    for (texture, path) in textures.iter().zip(images) {
        let mut png = Cursor::new(Vec::new());
        let expected = 4 * texture.width as usize * texture.height as usize;
        if texture.rgba.len() != expected {
            let bytes = texture.rgba.len();
            return Err(SceneError(format!(
                "texture `{}` has {bytes} bytes, but its size needs {expected}; give it 4 bytes per texel",
                texture.name
            )));
        }
        PngEncoder::new(&mut png)
            .write_image(&texture.rgba, texture.width, texture.height, ExtendedColorType::Rgba8)
            .map_err(|error| SceneError(format!("texture `{}` cannot be written as PNG ({error})", texture.name)))?;
        files.push((path, png.into_inner()));
    }
    Ok(files)
}

// Writing to a String cannot fail: the results of `write!` below are dropped for that reason.

fn write_material(mtl: &mut String, material: &Material, name: &str, textures: &[Texture], images: &[String]) {
    let _ = writeln!(mtl, "newmtl {name}");
    let colours = [("Kd", material.albedo), ("Ke", material.emission), ("Ks", material.specular)];
    for (keyword, [r, g, b]) in colours {
        let _ = writeln!(mtl, "{keyword} {r} {g} {b}");
    }
    let _ = writeln!(mtl, "Ns {}", material.phong_exponent);
    for (keyword, value) in [("translucency", material.translucency), ("absorption", material.absorption)] {
        if value != [0.0; 3] {
            let _ = writeln!(mtl, "{keyword} {} {} {}", value[0], value[1], value[2]);
        }
    }
    if let Some(image) = material.albedo_texture.and_then(|i| images.get(i)) {
        let _ = writeln!(mtl, "map_Kd {image}");
    }
    // A reader takes the mask from the alpha channel only if a texel is transparent.
    let cuts =
        |&i: &usize| textures.get(i).is_some_and(|t| t.rgba.as_chunks::<4>().0.iter().any(|texel| texel[3] < 255));
    if let Some(image) = material.alpha_texture.filter(cuts).and_then(|i| images.get(i)) {
        let _ = writeln!(mtl, "map_d {image}");
    }
}

fn write_mesh(obj: &mut String, mesh: &Mesh, material: Option<&String>, first: usize, origin: DVec3) {
    let _ = writeln!(obj, "o {}", one_line(&mesh.name));
    if let Some(material) = material {
        let _ = writeln!(obj, "usemtl {material}");
    }
    for position in &mesh.positions {
        let [x, y, z] = position;
        // The digits of float64 only where they are needed.
        let _ = if origin == DVec3::ZERO {
            writeln!(obj, "v {x} {y} {z}")
        } else {
            let [x, y, z] = (DVec3::from(position.map(f64::from)) + origin).to_array();
            writeln!(obj, "v {x} {y} {z}")
        };
    }
    for [x, y, z] in &mesh.normals {
        let _ = writeln!(obj, "vn {x} {y} {z}");
    }
    for [u, v] in &mesh.uvs {
        let _ = writeln!(obj, "vt {u} {}", 1.0 - v);
    }
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = triangle.map(|i| first + i as usize);
        let _ = writeln!(obj, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
    }
}

/// Names in use.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    /// The name, or the name with the first number that makes it unique.
    fn take(&mut self, name: &str) -> String {
        let numbered = (2..).map(|n| format!("{name}_{n}"));
        let free = std::iter::once(name.to_owned()).chain(numbered).find(|name| !self.0.contains(&name.to_lowercase()));
        let free = free.unwrap_or_default();
        self.0.insert(free.to_lowercase());
        free
    }
}

fn one_line(name: &str) -> String {
    let name: String = name.split_whitespace().collect::<Vec<_>>().join(" ");
    if name.is_empty() { "unnamed".into() } else { name }
}

/// A file name without folders, extension and unusual characters.
fn stem(name: &str) -> String {
    let file = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    one_line(stem).chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}
