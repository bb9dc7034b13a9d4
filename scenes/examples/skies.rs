//! Writes the environment maps of the bundled scenes, 64x32 texels each.
//!
//!     cargo run -p halflight-scenes --example skies
//!
//! `sky.exr` is warm on the right and blue on the left, above a dark ground. `directions.exr` stores directions as
//! colours: `2 light / visibility - 1` is then the mean direction of incidence on a surface, with the ambient visibility.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::{f32::consts::PI, path::Path, process::ExitCode};

use exr::prelude::write_rgb_file;
use glam::{Vec3, vec3};

/// Number of texels in longitude and latitude.
const SIZE: [usize; 2] = [64, 32];

fn main() -> ExitCode {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let maps = [("sky.exr", sky as fn(Vec3) -> Vec3), ("directions.exr", directions)];
    for (name, radiance) in maps {
        let texel = |x, y| radiance(direction(x, y)).into();
        if let Err(error) = write_rgb_file(folder.join(name), SIZE[0], SIZE[1], texel) {
            eprintln!("error: {name} cannot be written to {} ({error})", folder.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Direction through the centre of a texel: the inverse of `latlong` in `common/environment.wgsl`.
fn direction(x: usize, y: usize) -> Vec3 {
    let longitude = ((x as f32 + 0.5) / SIZE[0] as f32 - 0.5) * 2.0 * PI;
    let latitude = (y as f32 + 0.5) / SIZE[1] as f32 * PI;
    vec3(latitude.sin() * longitude.sin(), latitude.cos(), -latitude.sin() * longitude.cos())
}

/// A white zenith between a warm and a blue horizon. The radiance of the ground is a hundredth of the sky's.
fn sky(direction: Vec3) -> Vec3 {
    let right = direction.x.max(0.0).powi(2);
    let left = direction.x.min(0.0).powi(2);
    let above = 0.3 * direction.y.abs() + vec3(1.6, 0.75, 0.25) * right + vec3(0.16, 0.5, 1.3) * left;
    if direction.y > 0.0 { above } else { 0.01 * above }
}

/// The direction with each axis mapped from -1..1 to 0..1, because radiance cannot be negative.
fn directions(direction: Vec3) -> Vec3 {
    0.5 * direction + 0.5
}
