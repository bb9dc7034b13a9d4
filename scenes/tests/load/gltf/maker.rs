//! A writer of small glTF files.

use std::io::Cursor;

use halflight_scenes::Scene;
use image::{DynamicImage, ImageFormat};

use crate::load;

/// A file while it is written: accessors, views and their bytes.
#[derive(Default)]
pub struct Maker {
    pub bytes: Vec<u8>,
    pub views: Vec<String>,
    pub accessors: Vec<String>,
}

impl Maker {
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let offset = self.bytes.len();
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{}}}"#, bytes.len()));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    pub fn accessor(&mut self, bytes: &[u8], count: usize, kind: &str, component: u32, more: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"count":{count},"type":"{kind}","componentType":{component}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        // Positions must have bounds; other accessors may.
        let more = if N == 3 { r#","min":[-1e6,-1e6,-1e6],"max":[1e6,1e6,1e6]"# } else { "" };
        self.accessor(&bytes, values.len(), kind, 5126, more)
    }

    pub fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor(&bytes, indices.len(), "SCALAR", 5125, "")
    }

    /// The JSON with these further parts, without the buffer's own line.
    pub fn json(&self, parts: &str, uri: &str) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}{uri}}}],"bufferViews":[{}],"accessors":[{}],{parts}}}"#,
            self.bytes.len(),
            self.views.join(","),
            self.accessors.join(",")
        )
    }

    pub fn glb(&self, parts: &str) -> Vec<u8> {
        binary(&self.json(parts, ""), &self.bytes)
    }
}

/// A binary file of two chunks.
pub fn binary(json: &str, bytes: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], fill: u8| [bytes, &vec![fill; bytes.len().wrapping_neg() % 4]].concat();
    let (json, bytes) = (padded(json.as_bytes(), b' '), padded(bytes, 0));
    let chunk = |kind: &[u8], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &bytes)].concat();
    [b"glTF", &2_u32.to_le_bytes()[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
}

/// A unit right triangle in the plane z = 0 with texture coordinates, as the primitive of mesh 0. `more` follows its
/// attributes.
pub fn triangle(maker: &mut Maker, attributes: &str, more: &str) -> String {
    let positions = maker.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let uvs = maker.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    format!(
        r#""meshes":[{{"name":"t","primitives":[{{"attributes":{{"POSITION":{positions},"TEXCOORD_0":{uvs}{attributes}}}{more}}}]}}]"#
    )
}

pub const ONE_NODE: &str = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}]"#;

pub fn bare(glb: &[u8]) -> Scene {
    load(&[("m.glb", glb)], "m.glb")
}

/// A triangle of one material.
pub fn with_material(material: &str, more: &str) -> Scene {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", r#","material":0"#);
    bare(&maker.glb(&format!(r#"{meshes},{ONE_NODE},"materials":[{{"name":"m",{material}}}]{more}"#)))
}

pub fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).expect("a small image");
    bytes.into_inner()
}

/// A triangle of one material with images in the file.
pub fn with_images(material: &str, images: &[(&[u8], &str)], textures: &str) -> Scene {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", r#","material":0"#);
    let images: Vec<_> = images
        .iter()
        .map(|(bytes, kind)| format!(r#"{{"bufferView":{},"mimeType":"image/{kind}"}}"#, maker.view(bytes)))
        .collect();
    bare(&maker.glb(&format!(
        r#"{meshes},{ONE_NODE},"materials":[{{"name":"m",{material}}}],"images":[{}],"textures":[{textures}]"#,
        images.join(",")
    )))
}

/// Base64 with padding.
pub fn data_encoding(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let four = |three: &[u8]| {
        let bits = three.iter().chain([0, 0].iter()).take(3).fold(0_u32, |bits, &byte| (bits << 8) | u32::from(byte));
        let letter =
            |i: usize| if i > three.len() { '=' } else { char::from(LETTERS[(bits >> (18 - 6 * i)) as usize & 63]) };
        [0, 1, 2, 3].map(letter)
    };
    bytes.chunks(3).flat_map(four).collect()
}
