//! Damage to glTF models: to their JSON, to their bytes, and to the headers of binary files.

use super::{
    super::edits::{any, below, digits, one_in},
    MODELS, Model, beside, binary, inside,
};
use crate::oracle::Random;

/// Numbers at the limits of their ranges, and constants of glTF.
const NUMBERS: &[&str] = &[
    "0",
    "1",
    "-1",
    "2",
    "3",
    "4",
    "5",
    "7",
    "12",
    "255",
    "256",
    "65535",
    "65536",
    "1000000",
    "16777217",
    "2147483647",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "1e18",
    "1e30",
    "-1e30",
    "1e38",
    "-3e38",
    "3.5e38",
    "1e300",
    "1e400",
    "1e-40",
    "1e-400",
    "-0.0",
    "0.5",
    "1.5707964",
    "-3",
    "5120",
    "5121",
    "5122",
    "5123",
    "5125",
    "5126",
    "34962",
    "10497",
    "33648",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "[0,0,0]",
];

/// Names of glTF.
const NAMES: &[&str] = &[
    "SCALAR",
    "VEC2",
    "VEC3",
    "VEC4",
    "MAT4",
    "POSITION",
    "NORMAL",
    "TEXCOORD_0",
    "TEXCOORD_1",
    "COLOR_0",
    "JOINTS_0",
    "TANGENT",
    "translation",
    "rotation",
    "scale",
    "weights",
    "STEP",
    "LINEAR",
    "CUBICSPLINE",
    "OPAQUE",
    "MASK",
    "BLEND",
    "spot",
    "point",
    "directional",
    "perspective",
    "orthographic",
    "image/png",
    "image/jpeg",
    "image/webp",
    "uri",
    "bufferView",
    "byteOffset",
    "byteStride",
    "children",
    "mesh",
    "camera",
    "matrix",
    "skin",
    "sparse",
    "indices",
    "KHR_draco_mesh_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "m.bin",
    "m.glb",
    "m.gltf",
    "gone.png",
    "data:,x",
    "data:image/png;base64,AAAA",
    "%00",
    "..",
    "\\u0000",
    "\\ud800",
];

/// A damaged binary file.
pub(in crate::fuzz) fn damaged_binary(random: &mut Random) -> Vec<u8> {
    let mut bytes = binary(&damaged(random));
    if one_in(random, 8) {
        // Lengths, versions and kinds of the headers of the file and of its chunks.
        let json =
            usize::try_from(u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]])).unwrap_or_default();
        let field = [0, 4, 8, 12, 16, 20 + json, 24 + json][below(random, 7)];
        digits(&mut bytes, field, random);
    }
    if one_in(random, 12) {
        bytes.truncate(below(random, bytes.len()));
    }
    bytes
}

/// A damaged text file.
pub(in crate::fuzz) fn damaged_text(random: &mut Random) -> Vec<u8> {
    if one_in(random, 3) {
        let mut model = MODELS[0].clone();
        damage_json(&mut model.json, random);
        return beside(&model);
    }
    let mut bytes = inside(&damaged(random));
    match below(random, 20) {
        0 => bytes.truncate(below(random, bytes.len())),
        1 => {
            let at = below(random, bytes.len());
            bytes[at] = below(random, 256) as u8;
        }
        _ => {}
    }
    bytes
}

fn damaged(random: &mut Random) -> Model {
    let mut model = MODELS[usize::from(one_in(random, 4))].clone();
    if !one_in(random, 4) {
        damage_json(&mut model.json, random);
    }
    if one_in(random, 2) {
        for _ in 0..=below(random, 4) {
            damage_bytes(&mut model.bytes, random);
        }
    }
    model
}

fn damage_json(json: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=below(random, 4) {
        match below(random, 14) {
            0..=2 => with_token(json, random, is_number, NUMBERS),
            3 | 4 => {
                // One digit of a number.
                let most = if one_in(random, 4) { 12 } else { 10 };
                let digit = b"0123456789-."[below(random, most)];
                let from = below(random, json.len());
                if let Some(at) = (from..json.len()).find(|&at| json[at].is_ascii_digit()) {
                    if one_in(random, 2) { json[at] = digit } else { json.insert(at, digit) }
                }
            }
            // A small number is often the index of something else.
            5..=8 => {
                let index = below(random, 30).to_string();
                with_token(json, random, is_number, &[&index]);
            }
            9 | 10 => with_token(json, random, is_name, NAMES),
            11 if one_in(random, 2) => {
                let at = below(random, json.len());
                json[at] = b"0 9-{}[]\",:e.x"[below(random, 14)];
            }
            12 if one_in(random, 2) => {
                let at = below(random, json.len());
                json.insert(at, b"19-,\\\x00\xff\""[below(random, 8)]);
            }
            _ => repeat_or_remove(json, random),
        }
    }
}

fn is_number(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'-' | b'.')
}

fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphabetic() || matches!(byte, b'_' | b'/')
}

/// Replaces a number or a name behind a random place.
fn with_token(json: &mut Vec<u8>, random: &mut Random, part: fn(u8) -> bool, new: &[&str]) {
    let from = below(random, json.len());
    let Some(begin) =
        (from..json.len()).find(|&at| part(json[at]) && (at == 0 || !json[at - 1].is_ascii_alphanumeric()))
    else {
        return;
    };
    let end = (begin..json.len()).find(|&at| !part(json[at])).unwrap_or(json.len());
    drop(json.splice(begin..end, any(random, new).bytes()));
}

/// Repeats or removes what stands between two commas.
fn repeat_or_remove(json: &mut Vec<u8>, random: &mut Random) {
    let from = below(random, json.len());
    let Some(begin) = (from..json.len()).find(|&at| json[at] == b',') else { return };
    let Some(end) = (begin + 1..json.len()).find(|&at| json[at] == b',') else { return };
    if one_in(random, 2) {
        drop(json.drain(begin..end));
    } else {
        let times = if one_in(random, 60) { 2000 } else { 1 };
        let part = json[begin..end].repeat(times);
        drop(json.splice(end..end, part));
    }
}

fn damage_bytes(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = below(random, bytes.len().max(1));
    match below(random, 8) {
        0 if at < bytes.len() => bytes[at] = [0, 1, 127, 128, 254, 255][below(random, 6)],
        1 if at < bytes.len() => bytes[at] = below(random, 256) as u8,
        2 if one_in(random, 4) => bytes.truncate(at),
        3 if one_in(random, 4) => bytes.extend((0..at).map(|i| i as u8)),
        // A number in its place, at a limit of its range.
        _ => digits(bytes, at / 4 * 4, random),
    }
}
