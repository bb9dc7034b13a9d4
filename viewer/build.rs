//! Writes the font of the interface without its hinting, which is three fifths of it and a twentieth of the compressed
//! browser demo. On the screens of today it moves outlines by fractions of a pixel.
//!
//! The library that writes fonts (write-fonts) takes longer to compile than the viewer, so the few tables are changed here.

#![allow(clippy::disallowed_macros, reason = "a build script talks to cargo on standard output")]

use std::{env, error::Error, fs, path::Path};

/// Tables that hold nothing but hinting, and a signature of the whole file.
const HINTING: [&[u8]; 9] = [b"fpgm", b"prep", b"cvt ", b"hdmx", b"VDMX", b"LTSH", b"gasp", b"DSIG", b"FFTM"];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let out = env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?;
    let font = without_hinting(epaint_default_fonts::UBUNTU_LIGHT).ok_or("the font is no complete TrueType file")?;
    fs::write(Path::new(&out).join("text.ttf"), font)?;
    Ok(())
}

fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    Some(u16::from_be_bytes(bytes.get(at..at + 2)?.try_into().ok()?).into())
}

fn u32_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?)).ok()
}

/// The font without hinting; `None` if something is missing. Tables as in the OpenType specification.
fn without_hinting(font: &[u8]) -> Option<Vec<u8>> {
    let mut tables = Vec::new();
    for record in 0..u16_at(font, 4)? {
        let at = 12 + 16 * record;
        let (start, length) = (u32_at(font, at + 8)?, u32_at(font, at + 12)?);
        tables.push((font.get(at..at + 4)?, font.get(start..start + length)?.to_vec()));
    }
    tables.retain(|(name, _)| !HINTING.contains(name));
    let table = |name: &[u8]| tables.iter().position(|(other, _)| *other == name);
    let [glyf, loca, head] = [table(b"glyf")?, table(b"loca")?, table(b"head")?];
    let long = u16_at(&tables[head].1, 50)? == 1;
    let offset = |index| {
        let loca = &tables[loca].1;
        if long { u32_at(loca, 4 * index) } else { Some(2 * u16_at(loca, 2 * index)?) }
    };
    let count = tables[loca].1.len() / if long { 4 } else { 2 };
    let (mut glyphs, mut offsets) = (Vec::new(), Vec::new());
    for index in 0..count {
        offsets.extend(u32::try_from(glyphs.len()).ok()?.to_be_bytes());
        if index + 1 < count {
            glyphs.extend(glyph(tables[glyf].1.get(offset(index)?..offset(index + 1)?)?)?);
            glyphs.resize(glyphs.len().next_multiple_of(4), 0);
        }
    }
    tables[glyf].1 = glyphs;
    tables[loca].1 = offsets;
    // Offsets of glyphs now have 32 bits.
    tables[head].1.get_mut(50..52)?.copy_from_slice(&[0, 1]);
    Some(file(font.get(..4)?, &tables))
}

/// A glyph without its instructions. Those of a composite glyph stay: they are few.
fn glyph(glyph: &[u8]) -> Option<Vec<u8>> {
    let contours = if glyph.is_empty() { return Some(Vec::new()) } else { u16_at(glyph, 0)? };
    if contours >= 0x8000 {
        return Some(glyph.to_vec());
    }
    let at = 10 + 2 * contours;
    let after = at + 2 + u16_at(glyph, at)?;
    Some([glyph.get(..at)?, &[0, 0], glyph.get(after..)?].concat())
}

/// A font file of these tables. Nothing that reads it checks the sums of tables.
fn file(version: &[u8], tables: &[(&[u8], Vec<u8>)]) -> Vec<u8> {
    let count = tables.len() as u16;
    let power = count.ilog2();
    let range = 16 << power;
    let mut file = version.to_vec();
    for number in [count, range, power as u16, 16 * count - range] {
        file.extend(number.to_be_bytes());
    }
    let mut start = 12 + 16 * tables.len();
    for (name, bytes) in tables {
        file.extend_from_slice(name);
        for number in [0, start, bytes.len()] {
            file.extend((number as u32).to_be_bytes());
        }
        start += bytes.len().next_multiple_of(4);
    }
    for (_, bytes) in tables {
        file.extend(bytes);
        file.resize(file.len().next_multiple_of(4), 0);
    }
    file
}
