//! MTL material libraries.
//!
//! The lines are parsed here and not by tobj: its MTL reader refuses a whole library at the first unknown line, and it
//! panics on the valid line `Kd 0.5`.

use std::path::{Path, PathBuf};

use super::textures::{Role, texture};
use super::{Reader, clamp};
use crate::Material;

/// One `newmtl` block.
#[derive(Debug, Default)]
pub(super) struct Entry {
    pub name: String,
    /// `file:line` of the block's first line.
    location: String,
    folder: PathBuf,
    kd: Option<[f32; 3]>,
    ke: Option<[f32; 3]>,
    ks: Option<[f32; 3]>,
    ns: Option<f32>,
    translucency: Option<[f32; 3]>,
    absorption: Option<[f32; 3]>,
    dissolve: Option<f32>,
    map_kd: Option<String>,
    map_d: Option<String>,
}

/// Reads a library. Lines that cannot be parsed are skipped with a warning. Keywords are case-insensitive.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8]) -> Vec<Entry> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let text = String::from_utf8_lossy(bytes);
    let mut entries: Vec<Entry> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim_start_matches('\u{feff}').trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let (keyword, rest) = (keyword.to_lowercase(), rest.trim());
        let location = format!("{}:{}", path.display(), index + 1);
        if keyword == "newmtl" {
            entries.push(Entry { name: rest.to_owned(), location, folder: folder.to_owned(), ..Entry::default() });
            continue;
        }
        let Some(entry) = entries.last_mut() else { continue };
        let parsed = match keyword.as_str() {
            "kd" => set(&mut entry.kd, colour(rest)),
            "ke" => set(&mut entry.ke, colour(rest)),
            "ks" => set(&mut entry.ks, colour(rest)),
            "ns" => set(&mut entry.ns, rest.split_whitespace().next().and_then(|word| word.parse().ok())),
            "translucency" => set(&mut entry.translucency, colour(rest)),
            "absorption" => set(&mut entry.absorption, colour(rest)),
            "d" => set(&mut entry.dissolve, rest.split_whitespace().last().and_then(|word| word.parse().ok())),
            "map_kd" => set(&mut entry.map_kd, file_name(rest)),
            "map_d" => set(&mut entry.map_d, file_name(rest)),
            _ => true,
        };
        if !parsed {
            reader.warn(format!("{location}: `{line}` cannot be parsed; the line is skipped"));
        } else if keyword.starts_with("map_") && rest.starts_with('-') && matches!(keyword.as_str(), "map_kd" | "map_d")
        {
            reader.warn(format!("{location}: texture options are not supported; `{line}` uses the image unchanged"));
        }
    }
    entries
}

fn set<T>(target: &mut Option<T>, value: Option<T>) -> bool {
    let parsed = value.is_some();
    *target = value.or(target.take());
    parsed
}

/// `r g b`, or one number for grey.
fn colour(rest: &str) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = rest.split_whitespace().take(3).map(|word| word.parse().ok()).collect();
    match numbers?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

/// A file name may contain spaces; after options it is the last word.
fn file_name(rest: &str) -> Option<String> {
    let name = if rest.starts_with('-') { rest.split_whitespace().last()? } else { rest };
    Some(name.trim_matches('"').to_owned()).filter(|name| !name.is_empty())
}

impl Entry {
    /// The material, with its textures loaded.
    ///
    /// The default of `Kd` is 1 with a `map_Kd` and 0.8 without. `Kd` and `Ks` are clamped to 0..1, `Ke` and `Ns` to
    /// 0..1e6. `translucency` (0..1) and `absorption` (per scene unit) are keys of this program. The standard `Tf` is not
    /// used, because many exporters write `Tf 1 1 1` for opaque materials.
    pub fn resolve(&self, reader: &mut Reader) -> Material {
        let material = format!("{}: material `{}`", self.location, self.name);
        let mut in_range = |keyword: &str, value: [f32; 3], high: f32| {
            let (clamped, changed) = clamp(value, 0.0, high);
            if changed {
                reader.warn(format!(
                    "{material}: {keyword} {} is clamped to 0..{high}",
                    value.map(|x| x.to_string()).join(" ")
                ));
            }
            clamped
        };
        let albedo = in_range("Kd", self.kd.unwrap_or([if self.map_kd.is_some() { 1.0 } else { 0.8 }; 3]), 1.0);
        let specular = in_range("Ks", self.ks.unwrap_or_default(), 1.0);
        // 1e6 is far above any real emitter and far below the largest float.
        let emission = in_range("Ke", self.ke.unwrap_or_default(), 1e6);
        let [phong_exponent, ..] = in_range("Ns", [self.ns.unwrap_or_default(); 3], 1e6);
        let translucency = in_range("translucency", self.translucency.unwrap_or_default(), 1.0);
        let absorption = in_range("absorption", self.absorption.unwrap_or_default(), 1e9);
        if self.map_kd.is_some() && albedo == [0.0; 3] {
            reader.warn(format!("{material}: Kd 0 makes map_Kd black; write Kd 1 1 1 to show the image"));
        }
        if let Some(dissolve) = self.dissolve.filter(|&d| d < 1.0) {
            reader.warn(format!("{material}: d {dissolve} is drawn opaque; use map_d for an alpha mask"));
        }
        let mut load = |name: &Option<String>, role| {
            name.as_deref().and_then(|name| texture(reader, &self.folder, name, role, &material))
        };
        Material {
            name: self.name.clone(),
            albedo,
            albedo_texture: load(&self.map_kd, Role::Colour),
            alpha_texture: load(&self.map_d, Role::AlphaMask),
            emission,
            specular,
            phong_exponent,
            translucency,
            absorption,
            receive_only: false,
        }
    }
}
