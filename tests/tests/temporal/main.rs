//! Frames that build on frames: the temporal filter, and what moves under it.
#![allow(clippy::unwrap_used)]

mod filter;
mod moving;

use glam::Vec3;
use halflight_evaluator::experiment::session::Frames;
use halflight_native::images::Rgb;
use halflight_scenes::{Keyframe, Motion, Scene};
use halflight_soundness::scenes;

/// A small, noisy gather whose light is stored without loss.
const NOISY: [(&str, &str); 5] =
    [("start_resolution", "half"), ("levels", "3"), ("samples", "4"), ("disc_area", "texel"), ("storage", "float32")];

fn filtered(a: &'static str) -> Vec<(&'static str, &'static str)> {
    NOISY.into_iter().chain([("temporal_a", a)]).collect()
}

fn light(frames: &Frames) -> Vec<Rgb> {
    frames.read_rgb("indirect").unwrap().unwrap()
}

/// Runs frames from `0` to `last`; the light of each from `from` on.
fn lights(frames: &mut Frames, from: u32, last: u32) -> Vec<Vec<Rgb>> {
    let mut all = Vec::new();
    for frame in 0..=last {
        frames.run(frame).unwrap();
        if frame >= from {
            all.push(light(frames));
        }
    }
    all
}

fn mean(images: &[Vec<Rgb>]) -> Vec<Rgb> {
    (0..images[0].len())
        .map(|i| {
            std::array::from_fn(|c| {
                images.iter().map(|image| f64::from(image[i][c])).sum::<f64>() as f32 / images.len() as f32
            })
        })
        .collect()
}

/// Root mean square over pixels and channels.
fn rms(a: &[Rgb], b: &[Rgb]) -> f64 {
    let square = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    (square / (3 * a.len()) as f64).sqrt()
}

/// Standard deviation over images at each pixel and channel, root mean square.
fn deviation(images: &[Vec<Rgb>]) -> f64 {
    let middle = mean(images);
    let variance: f64 = images.iter().map(|image| rms(image, &middle).powi(2)).sum();
    (variance / (images.len() - 1) as f64).sqrt()
}

/// The court with a lamp beside the wall that moves away at once, at a frame.
fn lamp(leaves: u32) -> Scene {
    let mut scene = scenes::court();
    let mut mesh = scenes::quad(Vec3::new(0.4, 0.8, -1.6), 0.6 * Vec3::X, 0.6 * Vec3::Y, 2);
    mesh.object = Some(0);
    scene.meshes.push(mesh);
    scene.materials.push(scenes::emitter(20.0));
    let key = |frame, x| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
    let keyframes = vec![key(0, 0.0), key(leaves - 1, 0.0), key(leaves, -1.8)];
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes });
    scene
}
