//! relMSE of `albedo * indirect` over means of blocks of pixels, which noise of single pixels does not reach.
//!
//!     cargo run --release -p halflight-evaluator --example blocks -- IMAGE.exr TRUTH.exr --block 4
//!
//! IMAGE is a picture of a report folder or of `evaluator render`, TRUTH that of the same folder or of `evaluator truth`.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::{error::Error, path::PathBuf};

use clap::Parser;
use halflight_native::images::Image;

#[derive(Parser)]
struct Args {
    /// The image.
    image: PathBuf,
    /// What it should look like.
    truth: PathBuf,
    /// Width of a block, pixels.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=256))]
    block: u32,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let (image, truth) = (Image::read(&args.image)?, Image::read(&args.truth)?);
    let layer = |image: &Image, name: &str| image.rgb(name).ok_or_else(|| format!("there is no layer {name}"));
    let (light, wanted, albedo) = (layer(&image, "indirect")?, layer(&truth, "indirect")?, layer(&truth, "albedo")?);
    let shown = truth.surface_mask().ok_or("the truth has no depth")?;
    if light.len() != wanted.len() {
        return Err("the two images differ in size".into());
    }
    let (block, width) = (args.block as usize, truth.width as usize);
    let columns = width / block;
    // Sums of image and truth over each block, and the number of its pixels that show a surface.
    let mut blocks = vec![([[0.0f64; 3]; 2], 0u32); columns * (truth.height as usize / block)];
    for pixel in (0..light.len()).filter(|&pixel| shown[pixel]) {
        let (x, y) = (pixel % width / block, pixel / width / block);
        let Some((sums, count)) = blocks.get_mut(y * columns + x).filter(|_| x < columns) else { continue };
        *count += 1;
        for c in 0..3 {
            sums[0][c] += f64::from(light[pixel][c] * albedo[pixel][c]);
            sums[1][c] += f64::from(wanted[pixel][c] * albedo[pixel][c]);
        }
    }
    let means: Vec<[f64; 2]> = blocks
        .iter()
        .filter(|(_, count)| *count > 0)
        .flat_map(|(sums, count)| (0..3).map(move |c| [sums[0][c], sums[1][c]].map(|sum| sum / f64::from(*count))))
        .collect();
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| means.iter().map(of).sum::<f64>() / means.len().max(1) as f64;
    let (own, true_mean) = (mean(&|m| m[0]), mean(&|m| m[1]));
    // The floor is that of every relMSE here: a tenth of the mean, squared.
    let floor = 0.01 * true_mean * true_mean;
    let rel_mse = mean(&|[x, t]| (x - t).powi(2) / (t * t + floor));
    let none = mean(&|[_, t]| t * t / (t * t + floor));
    println!(
        "relMSE over {block}x{block}: {rel_mse:.4} (no light: {none:.4}), mean {:.4} of the truth's",
        own / true_mean
    );
    Ok(())
}
