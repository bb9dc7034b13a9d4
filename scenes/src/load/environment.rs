//! The environment of a scene file: a constant radiance, or a latitude-longitude map.

use std::io::Cursor;
use std::path::Path;

use exr::image::{AnyChannels, FlatSamples};
use exr::prelude::{ReadChannels, ReadLayers, read as exr_read};

use super::keys::Table;
use super::{Reader, clamp, reason};
use crate::{Environment, SceneError};

/// Radiance is clamped to this value, like that of surfaces.
const LARGEST: f32 = 1e30;

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
                    format_args!("names {}, which {why}; store it as a plain EXR with R, G and B", path.display()),
                )
            })?;
            environment.map = Some(name.to_owned());
            if clamped > 0 {
                reader
                    .warn(format!("{}: {clamped} texels were negative or not finite and were clamped", path.display()));
            }
            Ok(environment)
        }
        (Some(_), Some(_)) => Err(table.error("map", "is given together with `radiance`; remove one of them")),
        (None, None) => {
            Err(table.error("radiance", "is missing; write `radiance = [0.1, 0.1, 0.1]` or `map = \"sky.exr\"`"))
        }
    }
}

/// A map from the bytes of an EXR file, and the number of clamped texels.
fn decode(bytes: &[u8]) -> Result<(Environment, usize), String> {
    let file = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| format!("is not a readable EXR image ({error})"))?;
    let layer = file.layer_data;
    let AnyChannels::<FlatSamples> { list } = layer.channel_data;
    let channel = |name: &str| {
        let found = list.iter().find(|channel| channel.name.to_string() == name);
        found.map(|channel| channel.sample_data.values_as_f32().collect::<Vec<f32>>())
    };
    let (Some(r), Some(g), Some(b)) = (channel("R"), channel("G"), channel("B")) else {
        return Err("has no channels R, G and B".into());
    };
    let count = layer.size.0 * layer.size.1;
    if count == 0 || [&r, &g, &b].iter().any(|samples| samples.len() != count) {
        return Err("has subsampled channels".into());
    }
    let mut clamped = 0;
    let texels = (0..count).map(|i| {
        let (texel, changed) = clamp([r[i], g[i], b[i]], 0.0, LARGEST);
        clamped += usize::from(changed);
        texel
    });
    let texels = texels.collect();
    Ok((Environment { map: None, width: layer.size.0 as u32, height: layer.size.1 as u32, texels }, clamped))
}
