//! glTF 2.0 models, as text (`.gltf`) or binary (`.glb`).
//!
//! The crate `gltf` reads the JSON; buffers, images and numbers are read here, through [`FileSource`] and with checks.
//!
//! [`FileSource`]: super::FileSource

mod accessors;
mod animation;
mod materials;
mod nodes;
mod primitives;
mod tree;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use ::gltf::json::Root;
use ::gltf::json::camera::Type;
use ::gltf::json::validation::{Checked, Error, Validate};
use ::gltf::{Document, buffer};

use self::accessors::Buffers;
use super::{Model, Reader};
use crate::{SceneError, Transform};

/// A model while it is being read.
struct Source<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    notes: Notes,
}

/// What is not drawn, for one warning each.
#[derive(Default)]
struct Notes(BTreeSet<String>);

impl Notes {
    fn add(&mut self, note: impl Into<String>) {
        self.0.insert(note.into());
    }
}

/// Extensions that are read, or that change nothing where they are not.
const READ: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    "KHR_materials_ior",
    "KHR_xmp_json_ld",
];

/// Reads a model and transforms it. Adds its materials and textures to the scene. `path` is used for messages and to find
/// files beside the model.
pub(super) fn read(reader: &mut Reader, path: &Path, bytes: &[u8], transform: &Transform) -> Result<Model, SceneError> {
    let fail = |sentence: String| SceneError(format!("{}: {sentence}", path.display()));
    let (json, binary) = split(bytes).map_err(|why| fail(format!("{why}; export the model again")))?;
    let root: Root = ::gltf::json::deserialize::from_slice(json)
        .map_err(|error| fail(format!("not a readable glTF file ({error}); export the model again")))?;
    let mut notes = Notes::default();
    check(&root, &mut notes).map_err(fail)?;
    let document = Document::from_json_without_validation(root);
    let buffers = document.buffers().map(|buffer| contents(reader, path, &buffer, binary));
    let buffers = Buffers(buffers.collect::<Result<_, _>>().map_err(fail)?);
    let mut source = Source { path, document: &document, buffers: &buffers, notes };
    let model = nodes::model(reader, &mut source, transform).map_err(fail)?;
    for note in source.notes.0 {
        reader.warn(format!("{}: {note}", path.display()));
    }
    Ok(model)
}

/// The JSON and the binary part of a file.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let Some(rest) = bytes.strip_prefix(b"glTF") else {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    };
    let number = |at: usize| Some(u32::from_le_bytes(*rest.get(at..)?.first_chunk::<4>()?));
    match number(0) {
        Some(2) => {}
        Some(version) => return Err(format!("has version {version} of binary glTF, and only version 2 is read")),
        None => return Err("is cut off".into()),
    }
    // The length of the whole file is at 4; chunks count on their own.
    let mut at = 8;
    let (mut json, mut binary) = (None, None);
    while let (Some(length), Some(kind)) = (number(at), number(at + 4)) {
        let start = at + 8;
        let end = start.checked_add(length as usize).ok_or("is cut off")?;
        let chunk = rest.get(start..end).ok_or("is cut off")?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = end;
    }
    Ok((json.ok_or("has no part with JSON")?, binary))
}

/// Refuses invalid files and those that need what cannot be read.
fn check(root: &Root, notes: &mut Notes) -> Result<(), String> {
    // The crate, its validation included, takes these for granted.
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|primitive| primitive.attributes.values().chain(&primitive.indices));
    if accessors.any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err("has a mesh that refers to an accessor that is not there; export the model again".into());
    }
    let lens = |camera: &::gltf::json::Camera| match camera.type_ {
        Checked::Valid(Type::Perspective) => camera.perspective.is_some(),
        Checked::Valid(Type::Orthographic) => camera.orthographic.is_some(),
        Checked::Invalid => false,
    };
    if !root.cameras.iter().all(lens) {
        return Err("has a camera without its lens; export the model again".into());
    }
    let complete = |animation: &::gltf::json::Animation| {
        let channel = |channel: &::gltf::json::animation::Channel| {
            channel.sampler.value() < animation.samplers.len() && channel.target.node.value() < root.nodes.len()
        };
        let sampler = |sampler: &::gltf::json::animation::Sampler| {
            sampler.interpolation != Checked::Invalid
                && [sampler.input, sampler.output].iter().all(|accessor| accessor.value() < root.accessors.len())
        };
        animation.channels.iter().all(channel) && animation.samplers.iter().all(sampler)
    };
    if !root.animations.iter().all(complete) {
        return Err("has an animation that refers to something that is not there; export the model again".into());
    }
    let mut error = None;
    root.validate(root, ::gltf::json::Path::new, &mut |path, kind| {
        // Extensions are checked below, and bounds of positions are not used.
        let path = path();
        let bounds = [".min", ".max"].iter().any(|end| path.as_str().ends_with(end));
        if error.is_none() && kind != Error::Unsupported && !bounds {
            error = Some(format!("not valid glTF: `{}` {}; export the model again", path, words(&kind)));
        }
    });
    if let Some(error) = error {
        return Err(error);
    }
    if root.asset.version.split('.').next() != Some("2") {
        return Err(format!("has version {} of glTF, and only version 2 is read", root.asset.version));
    }
    for name in &root.extensions_required {
        match name.as_str() {
            "KHR_draco_mesh_compression" => {
                return Err("has meshes compressed by Draco, which are not read; export it without compression".into());
            }
            "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
                return Err(
                    "has buffers compressed by meshopt, which are not read; export it without compression".into()
                );
            }
            name if READ.contains(&name) || name == "KHR_texture_basisu" || name.starts_with("KHR_materials_") => {}
            name => return Err(format!("needs the extension {name}, which is not read; export it without it")),
        }
    }
    let unread: Vec<_> = root.extensions_used.iter().map(String::as_str).filter(|name| !READ.contains(name)).collect();
    if !unread.is_empty() {
        notes.add(format!("extensions that are not drawn: {}", unread.join(", ")));
    }
    Ok(())
}

fn words(error: &Error) -> &'static str {
    match error {
        Error::IndexOutOfBounds => "refers to something that is not there",
        Error::Missing => "is missing",
        Error::Oversize => "is too large",
        Error::Invalid | Error::Unsupported => "is invalid",
    }
}

/// The bytes of a buffer.
fn contents<'a>(
    reader: &Reader,
    path: &Path,
    buffer: &buffer::Buffer,
    binary: Option<&'a [u8]>,
) -> Result<Cow<'a, [u8]>, String> {
    match buffer.source() {
        buffer::Source::Bin => Ok(Cow::Borrowed(binary.unwrap_or_default())),
        buffer::Source::Uri(uri) => Ok(Cow::Owned(resource(reader, path, uri)?)),
    }
}

/// The bytes behind a URI: data within it, or a file beside the model.
fn resource(reader: &Reader, path: &Path, uri: &str) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        return data_of(data).ok_or_else(|| "has a data URI that is not base64; export the model again".into());
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut missing = None;
    for name in names(uri) {
        match reader.files.read(&folder.join(&name)) {
            Ok(bytes) => return Ok(bytes),
            Err(error) => {
                missing.get_or_insert_with(|| {
                    let why = super::reason(&error);
                    format!("names {name}, which cannot be read ({why}); it is relative to this file")
                });
            }
        }
    }
    Err(missing.unwrap_or_default())
}

/// The bytes of a data URI without its scheme: `type;base64,bytes`.
fn data_of(data: &str) -> Option<Vec<u8>> {
    let (kind, data) = data.split_once(',')?;
    if !kind.ends_with(";base64") {
        return Some(percent_encoding::percent_decode_str(data).collect());
    }
    let data = data.trim_end_matches('=');
    data_encoding::BASE64_NOPAD.decode(data.as_bytes()).ok()
}

/// The readings of a relative URI: decoded, and as it stands, because some exporters do not encode names.
fn names(uri: &str) -> Vec<String> {
    let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy().into_owned();
    if decoded == uri { vec![decoded] } else { vec![decoded, uri.to_owned()] }
}
