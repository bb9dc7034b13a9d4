//! MTL material libraries.
//!
//! The lines are parsed here and not by a crate: tobj refuses a whole library at the first unknown line, and no crate
//! reads texture options or tells which lines it passed over.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::image_line::{Image, Mapping};
use super::images::Pyramid;
use super::text::{self, Counts, split_keyword};
use super::textures::{self, Request, Role};
use super::{Reader, clamp};
use crate::Material;

/// One `newmtl` block.
#[derive(Debug, Default)]
pub(super) struct Entry {
    /// The text behind `newmtl`. See [`text::names`] for its readings.
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
    /// The keyword and the number of a line about opacity, and the opacity.
    dissolve: Option<(&'static str, f32, f32)>,
    map_kd: Option<Image>,
    map_d: Option<Image>,
    map_ke: Option<Image>,
}

/// A material with what a [`Material`] cannot hold.
pub(super) struct Surface {
    pub material: Material,
    /// The image that the emission is multiplied by.
    pub emission: Option<Rc<Pyramid>>,
    /// How texture coordinates reach its images.
    pub mapping: Mapping,
}

/// Reads a library. Lines that cannot be parsed are skipped with a warning. Keywords are case-insensitive.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8]) -> Vec<Entry> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let text = text::decode(bytes);
    let mut entries: Vec<Entry> = Vec::new();
    let (mut unused, mut unknown) = (Counts::default(), Counts::default());
    // The first line with texture options that change the picture, and the number of such lines.
    let mut options = (String::new(), 0);
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let (keyword, rest) = split_keyword(line);
        let location = format!("{}:{}", path.display(), index + 1);
        if keyword == "newmtl" {
            entries.push(Entry { name: rest.to_owned(), location, folder: folder.to_owned(), ..Entry::default() });
            continue;
        }
        let Some(entry) = entries.last_mut() else { continue };
        let parsed = match keyword.as_ref() {
            "kd" => set(&mut entry.kd, colour(rest)),
            "ke" => set(&mut entry.ke, colour(rest)),
            "ks" => set(&mut entry.ks, colour(rest)),
            "ns" => set(&mut entry.ns, number(rest)),
            "translucency" => set(&mut entry.translucency, colour(rest)),
            "absorption" => set(&mut entry.absorption, colour(rest)),
            "d" => set(&mut entry.dissolve, number(rest.trim_start_matches("-halo")).map(|d| ("d", d, d))),
            // `d` is the newer keyword and wins.
            "tr" => match entry.dissolve {
                Some(("d", ..)) => true,
                _ => set(&mut entry.dissolve, number(rest).map(|tr| ("Tr", tr, 1.0 - tr))),
            },
            "map_kd" | "map_d" | "map_ke" | "map_emissive" => {
                let image = Image::parse(rest);
                if image.changed {
                    options.1 += 1;
                    if options.0.is_empty() {
                        options.0 = format!("{location}: of the texture options only -s and -o are drawn: `{line}`");
                    }
                }
                let target = match keyword.as_ref() {
                    "map_kd" => &mut entry.map_kd,
                    "map_d" => &mut entry.map_d,
                    _ => &mut entry.map_ke,
                };
                set(target, Some(image).filter(|image| !image.names.is_empty()))
            }
            "tf" => {
                // Many exporters write `Tf 1 1 1` or `Tf 0 0 0` for opaque materials.
                if !matches!(colour(rest), Some([1.0, 1.0, 1.0] | [0.0, 0.0, 0.0])) {
                    unused.add("Tf");
                }
                true
            }
            // 0 to 2 is what is drawn; 3 and above add reflection and refraction, 10 shadows.
            "illum" => {
                if number(rest).is_some_and(|model| (3.0..=9.0).contains(&model)) {
                    unused.add(line.split('#').next().unwrap_or(line).trim());
                }
                true
            }
            "pr" | "pm" | "ps" | "pc" | "pcr" | "aniso" | "anisor" => {
                // Without metal, sheen or coat, 0 changes nothing.
                if keyword == "pr" || number(rest) != Some(0.0) {
                    unused.add(line.split_whitespace().next().unwrap_or_default());
                }
                true
            }
            "map_ks" | "map_ns" | "map_bump" | "bump" | "norm" | "map_norm" | "map_kn" | "disp" | "map_disp"
            | "decal" | "map_decal" | "refl" | "map_refl" | "map_tr" | "map_opacity" | "map_pr" | "map_pm"
            | "map_ps" | "map_rma" | "map_orm" | "map_tf" | "subsurface" | "map_ss" => {
                unused.add(line.split_whitespace().next().unwrap_or_default());
                true
            }
            // The ambient colour of a global term that a path tracer does not have, the index of refraction of opaque
            // matter, and settings of other programs' filters.
            "" | "ka" | "map_ka" | "ni" | "km" | "sharpness" | "map_aat" => true,
            word if word.starts_with('#') => true,
            _ => {
                unknown.add(line.split_whitespace().next().unwrap_or_default());
                true
            }
        };
        if !parsed {
            reader.warn(format!("{location}: `{line}` cannot be parsed; the line is skipped"));
        }
    }
    match options {
        (_, 0) => {}
        (line, 1) => reader.warn(format!("{line} has others")),
        (line, count) => reader.warn(format!("{line} and {} further lines have others", count - 1)),
    }
    if !unused.is_empty() {
        reader.warn(format!("{}: lines that change the light are not used: {unused}", path.display()));
    }
    if !unknown.is_empty() {
        reader.warn(format!("{}: unknown keywords are ignored: {unknown}", path.display()));
    }
    entries
}

fn set<T>(target: &mut Option<T>, value: Option<T>) -> bool {
    let parsed = value.is_some();
    *target = value.or(target.take());
    parsed
}

fn number(rest: &str) -> Option<f32> {
    rest.split_whitespace().next().and_then(|word| word.parse().ok())
}

/// `r g b`, or one number for grey.
fn colour(rest: &str) -> Option<[f32; 3]> {
    let words = rest.split_whitespace().take_while(|word| !word.starts_with('#')).take(3);
    let numbers: Option<Vec<f32>> = words.map(|word| word.parse().ok()).collect();
    match numbers?[..] {
        [grey] => Some([grey; 3]),
        [r, g, b] => Some([r, g, b]),
        _ => None,
    }
}

impl Entry {
    /// The material, with its textures loaded. `model_folder` is the folder of the model.
    ///
    /// The default of `Kd` is 1 with a `map_Kd` or colours of vertices, and 0.8 without. That of `Ke` is 1 with a
    /// `map_Ke`. `Kd` and `Ks` are clamped to 0..1, `Ke` and `Ns` to 0..1e6. `translucency` (0..1) and `absorption` (per
    /// scene unit) are keys of this program. The standard `Tf` is not used, because many exporters write `Tf 1 1 1` for
    /// opaque materials.
    pub fn resolve(&self, reader: &mut Reader, model_folder: &Path, coloured: bool) -> Surface {
        let name = text::names(&self.name).last().unwrap_or_default().to_owned();
        let material = format!("{}: material `{name}`", self.location);
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
        let white = self.map_kd.is_some() || coloured;
        let albedo = in_range("Kd", self.kd.unwrap_or([if white { 1.0 } else { 0.8 }; 3]), 1.0);
        let specular = in_range("Ks", self.ks.unwrap_or_default(), 1.0);
        // 1e6 is far above any real emitter and far below the largest float.
        let emission = in_range("Ke", self.ke.unwrap_or_default(), 1e6);
        let [phong_exponent, ..] = in_range("Ns", [self.ns.unwrap_or_default(); 3], 1e6);
        let translucency = in_range("translucency", self.translucency.unwrap_or_default(), 1.0);
        let absorption = in_range("absorption", self.absorption.unwrap_or_default(), 1e9);
        if self.map_kd.is_some() && albedo == [0.0; 3] {
            reader.warn(format!("{material}: Kd 0 makes map_Kd black; write Kd 1 1 1 to show the image"));
        }
        if let Some((keyword, value, _)) = self.dissolve.filter(|&(.., opacity)| opacity < 1.0) {
            reader.warn(format!("{material}: {keyword} {value} is drawn opaque; use map_d for an alpha mask"));
        }
        let folders = [self.folder.as_path(), model_folder];
        let folders = if folders[0] == folders[1] { &folders[..1] } else { &folders[..] };
        let (location, material) = (self.location.as_str(), name.as_str());
        let images = [("map_Kd", &self.map_kd), ("map_d", &self.map_d), ("map_Ke", &self.map_ke)];
        let mut mappings = images.iter().filter_map(|(keyword, image)| Some((keyword, image.as_ref()?.mapping)));
        let (first, mapping) =
            mappings.next().map_or(("", Mapping::default()), |(&keyword, mapping)| (keyword, mapping));
        for (keyword, other) in mappings {
            if other != mapping {
                let sentence = format!("the options -s and -o of {first} are used for {keyword}, too");
                reader.warn(format!("{location}: material `{material}`: {sentence}"));
            }
        }
        let mut load = |image: &Option<Image>, role| {
            let names = &image.as_ref()?.names[..];
            textures::texture(reader, &Request { names, folders, role, embedded: None, location, material })
        };
        let (albedo_texture, alpha_texture) = (load(&self.map_kd, Role::Colour), load(&self.map_d, Role::AlphaMask));
        let glow = self.map_ke.as_ref().and_then(|image| {
            let names = &image.names[..];
            textures::emission(
                reader,
                &Request { names, folders, role: Role::Emission, embedded: None, location, material },
            )
        });
        let emission = if self.ke.is_none() && glow.is_some() { [1.0; 3] } else { emission };
        let material = Material {
            name,
            albedo,
            albedo_texture,
            alpha_texture,
            emission,
            specular,
            phong_exponent,
            translucency,
            absorption,
            receive_only: false,
        };
        Surface { material, emission: glow, mapping }
    }
}
