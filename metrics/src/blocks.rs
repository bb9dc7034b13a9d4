//! Comparing images that both carry noise: over blocks, where it averages out.

use crate::{LinearPair, Rgb, mean, rmse};

/// Means over blocks of `n x n` pixels (smaller at the right and lower border), rows of blocks from the top. Within a
/// block only the pixels that count are averaged; a block without one is left out.
///
/// # Panics
/// If `n` or `width` is 0.
pub fn block_mean(image: &[Rgb], width: u32, n: u32, mask: Option<&[bool]>) -> Vec<Rgb> {
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
        .filter(|&(_, count)| count > 0)
        .map(|(sum, count)| sum.map(|sum| (sum / f64::from(count)) as f32))
        .collect()
}

/// `sqrt(mean((a - b)^2)) / mean(b)` over pixels (or blocks) and channels; 0 for equal images, also if both are black.
///
/// # Panics
/// If the sizes differ.
pub fn relative_rmse(a: &[Rgb], b: &[Rgb]) -> f64 {
    let error = rmse(&LinearPair::new(a, b, None));
    if error == 0.0 { 0.0 } else { error / mean(b, None) }
}
