//! Valid skies in OpenEXR and Radiance files, and damage to them.

use std::{io::Cursor, sync::LazyLock};

use exr::{
    image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, Layers},
    math::Vec2,
    meta::{
        attribute::{Chromaticities, IntegerBounds, LineOrder, Text},
        header::{ImageAttributes, LayerAttributes},
    },
    prelude::{Blocks, Compression, SmallVec, WritableImage, f16},
};

use super::edits::{any, below, digits, one_in, replace_word};
use crate::oracle::Random;

/// Valid OpenEXR files of many kinds.
pub(super) static EXR: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let scan = |compression| Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let tiles = Encoding {
        compression: Compression::ZIP1,
        blocks: Blocks::Tiles(Vec2(4, 3)),
        line_order: LineOrder::Increasing,
    };
    let whole = ([0, 0], [8, 4]);
    let rgb = ["B", "G", "R"];
    let chroma = |mut file: ExrFile| {
        file.attributes.chromaticities = Some(Chromaticities {
            red: Vec2(0.64, 0.33),
            green: Vec2(0.3, 0.6),
            blue: Vec2(0.15, 0.06),
            white: Vec2(0.3127, 0.329),
        });
        file
    };
    vec![
        ExrFile::new(whole).part("sky", [8, 4], [0, 0], &rgb, Kind::Float, scan(Compression::Uncompressed)).bytes(),
        chroma(ExrFile::new(([-1, -2], [12, 6])))
            .part("sky", [8, 4], [3, -1], &rgb, Kind::Half, scan(Compression::ZIP16))
            .bytes(),
        ExrFile::new(whole).part("sky", [8, 4], [0, 0], &rgb, Kind::Half, tiles).bytes(),
        ExrFile::new(([0, 0], [6, 3]))
            .part("mask", [5, 3], [1, 0], &["A"], Kind::Whole, scan(Compression::RLE))
            .part("sky", [8, 4], [-1, -1], &["l.B", "l.G", "l.R"], Kind::Float, scan(Compression::ZIP1))
            .bytes(),
        ExrFile::new(whole).part("grey", [8, 4], [0, 0], &["Y"], Kind::Float, scan(Compression::PXR24)).bytes(),
        ExrFile::new(([0, 0], [16, 40]))
            .part("sky", [16, 40], [0, 0], &rgb, Kind::Half, scan(Compression::PIZ))
            .bytes(),
        ExrFile::new(whole).part("sky", [8, 4], [0, 0], &rgb, Kind::Half, scan(Compression::B44)).bytes(),
        ExrFile::new(whole).part("sky", [8, 4], [0, 0], &rgb, Kind::Whole, scan(Compression::RLE)).bytes(),
    ]
});

/// The type of samples.
#[derive(Clone, Copy)]
enum Kind {
    Half,
    Float,
    Whole,
}

/// An OpenEXR file while it is written.
struct ExrFile {
    attributes: ImageAttributes,
    parts: Vec<Layer<AnyChannels<FlatSamples>>>,
}

impl ExrFile {
    /// `window` is the position and the size of the display window.
    fn new(window: ([i32; 2], [usize; 2])) -> Self {
        let (position, size) = window;
        let window = IntegerBounds::new((position[0], position[1]), (size[0], size[1]));
        Self { attributes: ImageAttributes::new(window), parts: Vec::new() }
    }

    fn part(
        mut self,
        name: &str,
        size: [usize; 2],
        position: [i32; 2],
        channels: &[&str],
        kind: Kind,
        encoding: Encoding,
    ) -> Self {
        let count = size[0] * size[1];
        let value = |i: usize| (i * 37 % 101) as f32 * 0.05;
        let samples = || match kind {
            Kind::Half => FlatSamples::F16((0..count).map(|i| f16::from_f32(value(i))).collect()),
            Kind::Float => FlatSamples::F32((0..count).map(value).collect()),
            Kind::Whole => FlatSamples::U32((0..count as u32).map(|i| i / 9).collect()),
        };
        let list: SmallVec<[_; 4]> = channels.iter().map(|&name| AnyChannel::new(name, samples())).collect();
        let attributes = LayerAttributes {
            layer_name: Some(Text::from(name)),
            layer_position: Vec2(position[0], position[1]),
            ..LayerAttributes::default()
        };
        self.parts.push(Layer::new((size[0], size[1]), attributes, encoding, AnyChannels::sort(list)));
        self
    }

    fn bytes(self) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let image = Image::from_layers(self.attributes, Layers::from(self.parts));
        image.write().to_buffered(&mut bytes).expect("a small image is written to memory");
        bytes.into_inner()
    }
}

/// Valid Radiance files: runs in each component, repeated pixels, plain pixels; rows and columns; XYZ; an exposure.
pub(super) static HDR: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let file = |header: &str, size: &str, pixels: &[u8]| {
        [format!("#?RADIANCE\n# a sky\n{header}\n{size}\n").as_bytes(), pixels].concat()
    };
    let runs = [2, 2, 0, 8, 136, 128, 8, 0, 1, 2, 3, 4, 5, 6, 7, 133, 9, 3, 1, 2, 3, 136, 136];
    let repeated = [5, 6, 7, 128, 1, 1, 1, 2, 9, 9, 9, 120, 1, 1, 1, 2, 8, 8, 8, 1, 3, 1, 1, 4];
    let two_digits = [8, 8, 8, 136, 1, 1, 1, 2, 1, 1, 1, 1, 9, 9, 9, 136];
    let plain: Vec<u8> = (0..32).map(|i| if i % 4 == 3 { 128 + i / 8 } else { 7 * i }).collect();
    vec![
        file("FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n", "-Y 4 +X 8", &runs.repeat(4)),
        file("FORMAT=32-bit_rle_rgbe\nCOLORCORR=1 2 0.5\n", "-Y 2 +X 8", &[&repeated[..], &runs].concat()),
        file("FORMAT=32-bit_rle_xyze\nEXPOSURE=0.5\nEXPOSURE=4\n", "+X 2 -Y 4", &plain),
        file("VIEW=-vta\nGAMMA=1\n", "+Y 1 -X 260", &two_digits),
    ]
});

/// A damaged OpenEXR file.
pub(super) fn damaged_exr(random: &mut Random) -> Vec<u8> {
    let mut bytes = any(random, &EXR).clone();
    for _ in 0..=below(random, 3) {
        let attributes = attributes(&bytes);
        // Where the pixels begin, or some place near it.
        let end = attributes.last().map_or(8, |last| last.end + 1).min(bytes.len());
        match below(random, 14) {
            // A value: windows, compression, channels, tiles.
            0..=4 if !attributes.is_empty() => {
                let value = any(random, &attributes).value();
                let at = value.start + below(random, value.len().max(1));
                if one_in(random, 2) {
                    digits(&mut bytes, value.start + (at - value.start) / 4 * 4, random);
                } else if let Some(byte) = bytes.get_mut(at) {
                    *byte = [0, 1, 2, 3, 4, 5, 9, 127, 128, 255, below(random, 256) as u8][below(random, 11)];
                }
            }
            5 if !attributes.is_empty() => {
                let size = any(random, &attributes).size;
                digits(&mut bytes, size, random);
            }
            6 if !attributes.is_empty() => {
                // A whole attribute again, or not at all.
                let one = any(random, &attributes);
                let copy = if one_in(random, 2) { bytes[one.start..one.end].repeat(2) } else { Vec::new() };
                drop(bytes.splice(one.start..one.end, copy));
            }
            7 if !attributes.is_empty() => {
                // The value of another attribute.
                let (from, to) = (any(random, &attributes).value(), any(random, &attributes).value());
                let value = bytes[from].to_vec();
                drop(bytes.splice(to, value));
            }
            // The offsets of the chunks, and their headers.
            8 | 9 => {
                let at = end + below(random, 96);
                digits(&mut bytes, at, random);
            }
            10 if one_in(random, 4) => bytes.truncate(below(random, bytes.len())),
            _ => {
                let at = below(random, bytes.len().max(1));
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = below(random, 256) as u8;
                }
            }
        }
    }
    bytes
}

/// The places of an attribute: its begin, its size field, its end.
struct Attribute {
    start: usize,
    size: usize,
    end: usize,
}

impl Attribute {
    fn value(&self) -> std::ops::Range<usize> {
        self.size + 4..self.end
    }
}

/// The attributes of all headers, as far as they can be followed.
fn attributes(bytes: &[u8]) -> Vec<Attribute> {
    let text = |at: usize| bytes.get(at..)?.iter().position(|&byte| byte == 0).map(|length| at + length + 1);
    let mut found = Vec::new();
    let mut at = 8;
    loop {
        // A header ends with an empty name; another may follow.
        while bytes.get(at) == Some(&0)
            && at < bytes.len()
            && !found.is_empty()
            && bytes.get(at + 1).is_some_and(u8::is_ascii_alphabetic)
        {
            at += 1;
        }
        if bytes.get(at).is_none_or(|&byte| byte == 0) {
            return found;
        }
        let Some(size) = text(at).and_then(text) else { return found };
        let Some(length) = bytes.get(size..size + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
        else {
            return found;
        };
        let end = size + 4 + length;
        if end > bytes.len() {
            return found;
        }
        found.push(Attribute { start: at, size, end });
        at = end;
    }
}

/// Words of Radiance headers, and numbers at the limits of their ranges.
const WORDS: &[&str] = &[
    "FORMAT",
    "EXPOSURE",
    "COLORCORR",
    "=",
    "32-bit_rle_rgbe",
    "32-bit_rle_xyze",
    "#?RADIANCE",
    "-Y",
    "+Y",
    "-X",
    "+X",
    "Y",
    "0",
    "1",
    "2",
    "7",
    "9",
    "127",
    "128",
    "129",
    "255",
    "32767",
    "32768",
    "65536",
    "1000000",
    "16777216",
    "134217728",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "-1",
    "1e-38",
    "1e-45",
    "1e38",
    "1e39",
    "nan",
    "inf",
    "-inf",
    "0.0",
    "1 1 1",
    "\n",
    "\r\n",
    "\u{0}",
    "é",
];

/// A damaged Radiance file.
pub(super) fn damaged_hdr(random: &mut Random) -> Vec<u8> {
    let mut bytes = any(random, &HDR).clone();
    for _ in 0..=below(random, 4) {
        let lines = (0..bytes.len()).filter(|&i| bytes[i] == b'\n');
        // The line of the size follows an empty one.
        let header = lines.into_iter().find(|&i| i > 0 && bytes[i - 1] == b'\n').map_or(bytes.len(), |i| i + 12);
        let header = header.min(bytes.len());
        match below(random, 8) {
            0..=2 => {
                let pixels = bytes.split_off(header);
                replace_word(&mut bytes, random, WORDS);
                bytes.extend(pixels);
            }
            3 => {
                let at = below(random, header.max(1));
                if let Some(digit) = (at..header).find(|&i| bytes[i].is_ascii_digit()) {
                    let new = b"0123456789.-"[below(random, 12)];
                    if one_in(random, 2) { bytes[digit] = new } else { bytes.insert(digit, new) }
                }
            }
            4 if one_in(random, 4) => bytes.truncate(below(random, bytes.len())),
            _ => {
                let at = header + below(random, (bytes.len() - header).max(1));
                let new = [0, 1, 2, 8, 127, 128, 129, 255, below(random, 256) as u8][below(random, 9)];
                match below(random, 4) {
                    0 => bytes.insert(at.min(bytes.len()), new),
                    1 if at < bytes.len() => drop(bytes.remove(at)),
                    _ if at < bytes.len() => bytes[at] = new,
                    _ => {}
                }
            }
        }
    }
    bytes
}
