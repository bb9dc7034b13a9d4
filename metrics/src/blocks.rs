//! Comparing images that both carry noise: over blocks, where it averages out.

use crate::{LinearPair, Rgb, linear::relative_floor, mean, relative_square, rmse};

/// Width and height of the blocks of [`block_rel_mse`], pixels.
pub const BLOCK: u32 = 4;

/// Means over blocks of `n x n` pixels (smaller at the right and lower border), rows of blocks from the top. Within a
/// block only the pixels that count are averaged; a block without one is left out.
///
/// # Panics
/// If `n` or `width` is 0.
pub fn block_mean(image: &[Rgb], width: u32, n: u32, mask: Option<&[bool]>) -> Vec<Rgb> {
    block_sums(image, width, n, mask)
        .filter(|&(_, count)| count > 0)
        .map(|(sum, count)| sum.map(|sum| (sum / f64::from(count)) as f32))
        .collect()
}

/// relMSE over means of blocks of [`BLOCK`] x [`BLOCK`] pixels: the mean of `(x - t)^2 / (t^2 + 0.01 m^2)`, where x and t
/// are means over the pixels of a block that count, and m is the mean of the reference. NaN when no pixel counts.
///
/// A block counts as often as it has pixels that count. So the blocks that are cut by the border or by the sky weigh less
/// than whole ones, and a block of sky weighs nothing. The floor is that of [`crate::rel_mse`].
///
/// # Panics
/// If `width` is 0 or the sizes differ.
pub fn block_rel_mse(pair: &LinearPair, width: u32) -> f64 {
    block_rel_mse_with_floor(pair, width, relative_floor(mean(pair.reference, pair.mask)))
}

/// [`block_rel_mse`] with a floor that is already known.
///
/// # Panics
/// As [`block_rel_mse`].
pub fn block_rel_mse_with_floor(pair: &LinearPair, width: u32, floor: f64) -> f64 {
    assert_eq!(pair.image.len(), pair.reference.len(), "an image and its reference have the same size");
    let sums = |image| block_sums(image, width, BLOCK, pair.mask);
    let (error, samples) =
        sums(pair.image).zip(sums(pair.reference)).fold((0.0, 0.0), |(error, samples), ((own, count), (wanted, _))| {
            let count = f64::from(count);
            let terms = own.iter().zip(wanted).map(|(x, t)| relative_square(x / count, t / count, floor));
            // A block without a pixel that counts has no mean.
            if count > 0.0 { (error + count * terms.sum::<f64>(), samples + 3.0 * count) } else { (error, samples) }
        });
    error / samples
}

/// Sum and number of the pixels that count in each block, rows of blocks from the top.
fn block_sums(image: &[Rgb], width: u32, n: u32, mask: Option<&[bool]>) -> impl Iterator<Item = ([f64; 3], u32)> {
    assert!(n > 0 && width > 0, "blocks and images have a size");
    let (width, n) = (width as usize, n as usize);
    let height = image.len() / width;
    let (columns, rows) = (width.div_ceil(n), height.div_ceil(n));
    let mut sums = vec![([0.0f64; 3], 0u32); columns * rows];
    for (index, pixel) in image.iter().enumerate().filter(|&(index, _)| mask.is_none_or(|mask| mask[index])) {
        let (sum, count) = &mut sums[index / width / n * columns + index % width / n];
        sum.iter_mut().zip(pixel).for_each(|(sum, &value)| *sum += f64::from(value));
        *count += 1;
    }
    sums.into_iter()
}

/// `sqrt(mean((a - b)^2)) / mean(b)` over pixels (or blocks) and channels; 0 for equal images, also if both are black.
///
/// # Panics
/// If the sizes differ.
pub fn relative_rmse(a: &[Rgb], b: &[Rgb]) -> f64 {
    let error = rmse(&LinearPair::new(a, b, None));
    if error == 0.0 { 0.0 } else { error / mean(b, None) }
}
