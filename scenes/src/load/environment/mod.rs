//! The environment of a scene file: a constant radiance, or a latitude-longitude map.

mod openexr;
mod radiance;

use std::path::Path;

use super::keys::Table;
use super::{Reader, clamp, reason};
use crate::{Environment, SceneError};

/// Radiance is clamped to this value, like that of surfaces.
const LARGEST: f32 = 1e30;

/// Largest number of texels of a map: 16,384 x 8,192. A map of more needs gigabytes.
const MOST_TEXELS: usize = 1 << 27;

/// Reads the table `environment`.
pub(super) fn read(reader: &mut Reader, scene_path: &Path, table: &Table) -> Result<Environment, SceneError> {
    let radiance =
        table.vector("radiance", "finite numbers, none of them negative", |v| v.iter().all(|&x| x >= 0.0))?;
    match (radiance, table.text("map")?) {
        (Some(radiance), None) => Ok(Environment::constant(radiance)),
        (None, Some(name)) => {
            let path = scene_path.parent().unwrap_or(Path::new("")).join(name);
            let bytes = reader.files.read(&path).map_err(|error| {
                let why = reason(&error);
                let sentence =
                    format_args!("names {}, which cannot be read ({why}); it is relative to this file", path.display());
                table.error("map", sentence)
            })?;
            let (mut environment, clamped) = decode(&bytes).map_err(|why| {
                table.error(
                    "map",
                    format_args!(
                        "names {}, which {why}; store it as a plain EXR with R, G and B, or as Radiance .hdr",
                        path.display()
                    ),
                )
            })?;
            environment.map = Some(name.to_owned());
            if clamped > 0 {
                reader
                    .warn(format!("{}: {clamped} texels were negative or not finite and were clamped", path.display()));
            }
            let (width, height) = (environment.width, environment.height);
            // A map of a few texels may be rounded.
            if width.abs_diff(2 * height) > 2 + height / 50 {
                reader.warn(format!(
                    "{}: the map has {width} x {height} texels, but a latitude-longitude map is twice as wide as high; it is \
                     stretched over the whole sphere",
                    path.display()
                ));
            }
            Ok(environment)
        }
        (Some(_), Some(_)) => Err(table.error("map", "is given together with `radiance`; remove one of them")),
        (None, None) => {
            Err(table.error("radiance", "is missing; write `radiance = [0.1, 0.1, 0.1]` or `map = \"sky.exr\"`"))
        }
    }
}

/// A map from the bytes of a file, and the number of clamped texels. The contents tell the format.
fn decode(bytes: &[u8]) -> Result<(Environment, usize), String> {
    let (size, mut texels) = match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => openexr::decode(bytes)?,
        [b'#', b'?', ..] => radiance::decode(bytes)?,
        _ => return Err("is not a readable EXR image or Radiance image".into()),
    };
    let mut clamped = 0;
    for texel in &mut texels {
        let (value, changed) = clamp(*texel, 0.0, LARGEST);
        clamped += usize::from(changed);
        *texel = value;
    }
    Ok((Environment { map: None, width: size[0] as u32, height: size[1] as u32, texels }, clamped))
}

/// The number of texels of a map of this size, or why it is refused.
fn area([width, height]: [usize; 2]) -> Result<usize, String> {
    match width.checked_mul(height) {
        Some(0) => Err("has no texels".into()),
        Some(area) if area <= MOST_TEXELS => Ok(area),
        _ => Err(format!("has {width} x {height} texels, more than {MOST_TEXELS} of them")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_maps_never_panic() {
        use exr::prelude::WritableImage;
        let image = exr::image::Image::from_channels(
            (8, 4),
            exr::prelude::SpecificChannels::rgb(|p: exr::math::Vec2<usize>| (p.0 as f32, p.1 as f32, 1.0)),
        );
        let written = |image: &dyn Fn(&mut std::io::Cursor<Vec<u8>>) -> exr::error::UnitResult| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            image(&mut bytes).expect("a small image");
            bytes.into_inner()
        };
        let exr = written(&|bytes| image.write().to_buffered(bytes));
        // The differences of its numbers wrap where they are damaged.
        let halves = exr::image::Image::from_encoded_channels(
            (8, 4),
            exr::prelude::Encoding {
                compression: exr::prelude::Compression::B44,
                blocks: exr::prelude::Blocks::ScanLines,
                line_order: exr::prelude::LineOrder::Increasing,
            },
            exr::prelude::SpecificChannels::rgb(|p: exr::math::Vec2<usize>| {
                [p.0 as f32, p.1 as f32, 1.0].map(exr::prelude::f16::from_f32).into()
            }),
        );
        let b44 = written(&|bytes| halves.write().to_buffered(bytes));
        let new_runs = [2, 2, 0, 8].into_iter().chain([136, 7, 136, 8, 3, 1, 2, 3, 133, 9, 136, 128]);
        let old_runs = [5, 6, 7, 128, 1, 1, 1, 7, 9, 9, 9, 120, 1, 1, 1, 2, 8, 8, 8, 1, 1, 1, 1, 4];
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 3 +X 8\n".to_vec();
        let hdr: Vec<u8> = header.into_iter().chain(new_runs.clone()).chain(new_runs).chain(old_runs).collect();
        let (mut read, mut refused) = (0, 0);
        for good in [exr, b44, hdr] {
            assert!(decode(&good).is_ok(), "{:?}", decode(&good).err());
            let mut random = 1_u32;
            let mut next = |below: usize| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random >> 8) as usize % below.max(1)
            };
            for round in 0..4000 {
                let mut bytes = good.clone();
                for _ in 0..1 + round % 3 {
                    let at = next(bytes.len());
                    match next(4) {
                        0 => bytes.truncate(at),
                        1 => drop(bytes.remove(at.min(bytes.len().saturating_sub(1)))),
                        2 => bytes.insert(at, next(256) as u8),
                        _ => bytes[at] = [0, 1, 2, 255, b' ', b'9', next(256) as u8][next(7)],
                    }
                    if bytes.is_empty() {
                        break;
                    }
                }
                match decode(&bytes) {
                    Ok((map, _)) => {
                        read += 1;
                        assert_eq!(map.texels.len(), map.width as usize * map.height as usize);
                        assert!(map.texels.as_flattened().iter().all(|x| (0.0..=LARGEST).contains(x)));
                    }
                    Err(why) => {
                        refused += 1;
                        assert!(!why.is_empty());
                    }
                }
            }
        }
        // Both outcomes occur.
        assert!(read > 500 && refused > 2000, "{read} read, {refused} refused");
    }
}
