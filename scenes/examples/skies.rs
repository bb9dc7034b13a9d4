//! Writes the environment maps of the bundled scenes.
//!
//!     cargo run -p halflight-scenes --example skies
//!
//! `sky.exr` is warm on the right and blue on the left, above a dark ground. `directions.exr` stores directions as
//! colours: `2 light / visibility - 1` is then the mean direction of incidence on a surface, with the ambient visibility.
//! `room_sky.exr` is a clear evening sky with a low sun.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::{f32::consts::PI, path::Path, process::ExitCode};

use exr::prelude::{Encoding, Image, SpecificChannels, WritableImage, f16, write_rgb_file};
use glam::{Vec3, vec3};

/// Number of texels of the simple maps in longitude and latitude.
const SIZE: [usize; 2] = [64, 32];
/// As [`SIZE`], for the evening sky, whose sun is a few texels wide.
const EVENING_SIZE: [usize; 2] = [256, 128];

fn main() -> ExitCode {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let maps = [("sky.exr", sky as fn(Vec3) -> Vec3), ("directions.exr", directions)];
    for (name, radiance) in maps {
        let texel = |x, y| radiance(direction(x, y, SIZE)).into();
        if let Err(error) = write_rgb_file(folder.join(name), SIZE[0], SIZE[1], texel) {
            eprintln!("error: {name} cannot be written to {} ({error})", folder.display());
            return ExitCode::FAILURE;
        }
    }
    let texel = |at: exr::math::Vec2<usize>| -> (f16, f16, f16) {
        let [r, g, b] = evening(direction(at.x(), at.y(), EVENING_SIZE)).to_array().map(f16::from_f32);
        (r, g, b)
    };
    let size = (EVENING_SIZE[0], EVENING_SIZE[1]);
    let image = Image::from_encoded_channels(size, Encoding::SMALL_LOSSLESS, SpecificChannels::rgb(texel));
    if let Err(error) = image.write().to_file(folder.join("room_sky.exr")) {
        eprintln!("error: room_sky.exr cannot be written to {} ({error})", folder.display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Direction through the centre of a texel: the inverse of `latlong` in `common/environment.wgsl`.
fn direction(x: usize, y: usize, size: [usize; 2]) -> Vec3 {
    let longitude = ((x as f32 + 0.5) / size[0] as f32 - 0.5) * 2.0 * PI;
    let latitude = (y as f32 + 0.5) / size[1] as f32 * PI;
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

/// A clear evening: blue above, warm near the horizon towards the sun, which is 21 degrees high. Its disc is blurred to
/// a width of about four degrees, so that the largest radiance stays moderate at the same irradiance.
fn evening(direction: Vec3) -> Vec3 {
    let sun = vec3(-0.90, 0.36, 0.29).normalize();
    let angle = direction.angle_between(sun).to_degrees();
    let towards = 0.5 + 0.5 * direction.with_y(0.0).normalize_or(Vec3::X).dot(sun.with_y(0.0).normalize());
    let low = (-5.0 * direction.y.abs()).exp();
    let warm = low * (0.25 + 0.75 * towards * towards);
    let air = vec3(0.20, 0.42, 0.92).lerp(vec3(0.62, 0.78, 1.0), low);
    let sky = 1.4 * air.lerp(vec3(1.9, 1.15, 0.6), warm) + vec3(2.0, 1.3, 0.6) * (-(angle / 16.0).powi(2)).exp();
    if direction.y > 0.0 {
        sky + vec3(1500.0, 1000.0, 520.0) * (-0.5 * (angle / 1.8).powi(2)).exp()
    } else {
        // Fields, which fade into the haze at the horizon.
        vec3(0.24, 0.23, 0.11).lerp(air.lerp(vec3(1.6, 1.0, 0.5), warm), (20.0 * direction.y).exp() * 0.8)
    }
}
