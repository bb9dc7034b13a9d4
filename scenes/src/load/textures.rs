//! Image files to textures.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::files::{clean, tidy};
use super::images::{self, Pyramid};
use super::{Reader, reason};
use crate::Texture;

/// What a material uses an image for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// Colour.
    Colour,
    /// Alpha mask.
    AlphaMask,
    /// Emission.
    Emission,
    /// Metalness and roughness.
    Gloss,
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Self::Colour => "texture",
            Self::AlphaMask => "alpha mask",
            Self::Emission => "image of emission",
            Self::Gloss => "image of metalness and roughness",
        }
    }

    /// What is drawn without the image.
    fn replacement(self) -> &'static str {
        match self {
            Self::Colour => "it is replaced by a magenta checker",
            Self::AlphaMask => "the surface is drawn opaque",
            Self::Emission => "the emission is used without it",
            Self::Gloss => "the factors are used without it",
        }
    }
}

/// Images requested so far.
#[derive(Default)]
pub(super) struct Found {
    /// Textures by path and role; `None` for a missing mask.
    textures: HashMap<(String, Role), Option<usize>>,
    /// Images of emission by path.
    emissions: HashMap<String, Option<Rc<Pyramid>>>,
    /// Paths by folder and text.
    paths: HashMap<(PathBuf, String), String>,
    problems: Vec<Problem>,
    /// Number of images that were found in another folder than their library says.
    by_name: usize,
}

/// Something wrong with an image, and the materials that use it.
struct Problem {
    path: String,
    role: Role,
    sentence: String,
    /// `file:line` of the first material.
    location: String,
    materials: Vec<String>,
}

/// A request for an image.
pub(super) struct Request<'a> {
    /// The readings of its name, the likeliest first.
    pub names: &'a [String],
    /// The folder of the material library, then other folders.
    pub folders: &'a [&'a Path],
    pub role: Role,
    /// The image itself, if it is part of the model's file. Its name is then any text that no other image has.
    pub embedded: Option<&'a [u8]>,
    /// `file:line` of the material.
    pub location: &'a str,
    /// Name of the material.
    pub material: &'a str,
}

impl Request<'_> {
    /// The name in messages: the shortest reading.
    fn name(&self) -> &str {
        self.names.last().map_or("", String::as_str)
    }

    /// The path of the image and, unless it is already known, its contents.
    fn find(&self, reader: &mut Reader) -> (String, io::Result<Option<Vec<u8>>>) {
        if let Some(bytes) = self.embedded {
            return (self.name().to_owned(), Ok(Some(bytes.to_vec())));
        }
        let folder = self.folders.first().copied().unwrap_or(Path::new(""));
        let key = (folder.to_owned(), self.names.first().cloned().unwrap_or_default());
        if let Some(path) = reader.found.paths.get(&key) {
            return (path.clone(), Ok(None));
        }
        let mut refused = None;
        let mut try_path = |path: PathBuf| match reader.files.read(&path) {
            Ok(bytes) => {
                // A backslash that stands for a folder is another spelling of the same file.
                let turned = PathBuf::from(path.to_string_lossy().replace('\\', "/"));
                let same = turned != path && reader.files.read(&turned).is_ok_and(|other| other == bytes);
                Some((clean(if same { &turned } else { &path }), bytes))
            }
            Err(error) => {
                if error.kind() != io::ErrorKind::NotFound {
                    refused.get_or_insert(error);
                }
                None
            }
        };
        let as_given = self.names.iter().find_map(|name| try_path(folder.join(name)));
        // A path of another computer, or an image beside the model.
        let elsewhere = || {
            let beside = self.folders[1..].iter().flat_map(|folder| self.names.iter().map(|name| folder.join(name)));
            let bare = self.names.iter().flat_map(|name| {
                let file = name.rsplit(['/', '\\']).next().unwrap_or_default();
                self.folders.iter().flat_map(move |folder| [folder.join(file), folder.join("textures").join(file)])
            });
            beside.chain(bare).collect::<Vec<_>>()
        };
        let found = match as_given {
            Some(found) => Some(found),
            None => {
                let found = elsewhere().into_iter().find_map(&mut try_path);
                reader.found.by_name += usize::from(found.is_some());
                found
            }
        };
        let (path, bytes) = match found {
            Some((path, bytes)) => (path, Ok(Some(bytes))),
            None => {
                let path = tidy(&folder.join(self.name().replace('\\', "/")));
                (path, Err(refused.unwrap_or_else(|| io::Error::from(io::ErrorKind::NotFound))))
            }
        };
        if bytes.is_ok() {
            reader.found.paths.insert(key, path.clone());
        }
        (path, bytes)
    }

    /// The decoded image and its path.
    fn decode(&self, reader: &mut Reader, path: &str, bytes: Option<Vec<u8>>) -> Option<image::DynamicImage> {
        let bytes = match bytes.map_or_else(|| reader.files.read(Path::new(path)), Ok) {
            Ok(bytes) => bytes,
            Err(error) => {
                self.report(reader, path, &format!("cannot be read ({})", reason(&error)));
                return None;
            }
        };
        match images::decode(&bytes, path) {
            Ok((image, None)) => Some(image),
            Ok((image, Some(note))) => {
                self.report_as(reader, path, &note);
                Some(image)
            }
            Err(why) => {
                self.report(reader, path, &why);
                None
            }
        }
    }

    fn report(&self, reader: &mut Reader, path: &str, why: &str) {
        self.report_as(reader, path, &format!("{why}; {}", self.role.replacement()));
    }

    /// Reports the sentence for this material, once per image.
    fn report_as(&self, reader: &mut Reader, path: &str, sentence: &str) {
        let problems = &mut reader.found.problems;
        let material = self.material.to_owned();
        match problems.iter_mut().find(|p| p.path == path && p.role == self.role) {
            Some(known) if known.materials.contains(&material) => {}
            Some(known) => known.materials.push(material),
            None => problems.push(Problem {
                path: path.to_owned(),
                role: self.role,
                sentence: sentence.to_owned(),
                location: self.location.to_owned(),
                materials: vec![material],
            }),
        }
    }

    /// Repeats what was reported of this image for another material.
    fn repeat(&self, reader: &mut Reader, path: &str) {
        if reader.found.problems.iter().any(|p| p.path == path && p.role == self.role) {
            self.report_as(reader, path, "");
        }
    }
}

/// Index of a texture.
///
/// Each file is decoded once. A missing or broken colour becomes a magenta checker, a missing or broken mask is ignored
/// (`None`); both give a warning.
pub(super) fn texture(reader: &mut Reader, request: &Request) -> Option<usize> {
    let role = request.role;
    let (path, found) = request.find(reader);
    if let Some(&known) = reader.found.textures.get(&(path.clone(), role)) {
        request.repeat(reader, &path);
        return known;
    }
    let decoded = decoded(reader, request, &path, found);
    let name = tidy(Path::new(request.name()));
    let index = match decoded {
        Some(image) => Some(add(reader, &image, &path, name, role)),
        None if role == Role::AlphaMask => None,
        None => {
            reader.scene.textures.push(images::checker(&name));
            Some(reader.scene.textures.len() - 1)
        }
    };
    reader.found.textures.insert((path, role), index);
    index
}

/// The image of a file that was found; `None` if it is missing or broken, which gives a warning.
fn decoded(
    reader: &mut Reader,
    request: &Request,
    path: &str,
    found: io::Result<Option<Vec<u8>>>,
) -> Option<image::DynamicImage> {
    match found {
        Ok(bytes) => request.decode(reader, path, bytes),
        Err(error) => {
            request.report(reader, path, &missing(&error));
            None
        }
    }
}

/// Adds an image as a texture, unless the same image in the other role serves.
pub(super) fn add(reader: &mut Reader, image: &image::DynamicImage, path: &str, name: String, role: Role) -> usize {
    let mut rgba = image.to_rgba8();
    let transparent = image.color().has_alpha() && rgba.pixels().any(|pixel| pixel.0[3] < 255);
    if role == Role::AlphaMask && !transparent {
        rgba.pixels_mut().zip(image.to_luma8().pixels()).for_each(|(pixel, luminance)| pixel.0[3] = luminance.0[0]);
    }
    let other = if role == Role::Colour { Role::AlphaMask } else { Role::Colour };
    match reader.found.textures.get(&(path.to_owned(), other)) {
        // The alpha channel holds the mask, so one texture serves both roles.
        Some(&Some(same)) if transparent => same,
        _ => {
            let (width, height) = rgba.dimensions();
            reader.scene.textures.push(Texture { name, width, height, rgba: rgba.into_raw() });
            reader.scene.textures.len() - 1
        }
    }
}

/// The image of an emission; `None` if it is missing or broken, which gives a warning.
pub(super) fn emission(reader: &mut Reader, request: &Request) -> Option<Rc<Pyramid>> {
    let (path, found) = request.find(reader);
    if let Some(known) = reader.found.emissions.get(&path).cloned() {
        request.repeat(reader, &path);
        return known;
    }
    let decoded = decoded(reader, request, &path, found);
    let pyramid = decoded.map(|image| Rc::new(Pyramid::new(&image)));
    reader.found.emissions.insert(path, pyramid.clone());
    pyramid
}

fn missing(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "is missing".into(),
        _ => format!("cannot be read ({})", reason(error)),
    }
}

/// Warns of every image that is missing or broken, with all materials that use it.
pub(super) fn warn(reader: &mut Reader) {
    for Problem { path, role, sentence, location, materials } in std::mem::take(&mut reader.found.problems) {
        let plural = if materials.len() == 1 { "" } else { "s" };
        let names: Vec<_> = materials.iter().map(|name| format!("`{name}`")).collect();
        let names = names.join(", ");
        let what = role.name();
        reader.warn(format!("{location}: material{plural} {names}: {what} {path} {sentence}"));
    }
    match std::mem::take(&mut reader.found.by_name) {
        0 => {}
        1 => reader.warn(format!("{}: one image was found by its file name in another folder", reader.path.display())),
        n => reader
            .warn(format!("{}: {n} images were found by their file names in other folders", reader.path.display())),
    }
}
