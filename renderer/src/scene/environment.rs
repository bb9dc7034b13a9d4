//! The environment map in the layout of `common/environment.wgsl`.

use halflight_scenes::Environment;

/// Largest width of the environment map for techniques. A wider one is averaged over squares.
const LOOK_UP_WIDTH: u32 = 64;

/// Width and height of the small copy, and the number of texels along each side that one of its texels averages.
fn small_size(environment: &Environment) -> ([u32; 2], u32) {
    let factor = environment.width.div_ceil(LOOK_UP_WIDTH).max(1);
    ([environment.width.div_ceil(factor), environment.height.div_ceil(factor)], factor)
}

/// Number of the words that [`environment_words`] gives.
pub(super) fn word_count(environment: &Environment) -> u64 {
    let [width, height] = [environment.width, environment.height].map(u64::from);
    let [small_width, small_height] = small_size(environment).0.map(u64::from);
    10 + width * height + small_width * small_height + height
}

/// Twin of the layout in `common/environment.wgsl`: sizes, nine coefficients of irradiance, the map with the cumulative
/// shares of each row, a small copy, and the cumulative shares of the rows.
pub(super) fn environment_words(environment: &Environment) -> Vec<[f32; 4]> {
    let Environment { width, height, texels, .. } = environment;
    let (w, h) = (*width, *height);
    let (small, factor) = small_size(environment);
    let mut words = vec![[w, h, small[0], small[1]].map(|v| v as f32)];
    words.extend(irradiance_coefficients(environment).map(|[r, g, b]| [r, g, b, 0.0]));
    let shares = LightShares::of(environment);
    words.extend(texels.iter().zip(&shares.in_row).map(|(&[r, g, b], &share)| [r, g, b, share]));
    for y in 0..small[1] {
        for x in 0..small[0] {
            let mut sum = [0.0f64; 3];
            let mut count = 0.0;
            for v in y * factor..((y + 1) * factor).min(h) {
                for u in x * factor..((x + 1) * factor).min(w) {
                    let texel = texels[(v * w + u) as usize];
                    sum.iter_mut().zip(texel).for_each(|(s, t)| *s += f64::from(t));
                    count += 1.0;
                }
            }
            let [r, g, b] = sum.map(|v| (v / f64::max(count, 1.0)) as f32);
            words.push([r, g, b, 0.0]);
        }
    }
    words.extend(shares.of_rows.iter().map(|&share| [share, 0.0, 0.0, 0.0]));
    words
}

/// Cumulative shares of the sky's light, by which the path tracer draws directions.
struct LightShares {
    /// For each texel, the share of its row up to and including it. Texels of a row have equal solid angles.
    in_row: Vec<f32>,
    /// For each row, the share of all light up to and including it.
    of_rows: Vec<f32>,
}

impl LightShares {
    fn of(environment: &Environment) -> Self {
        let &Environment { width, height, ref texels, .. } = environment;
        let mut rows = Vec::with_capacity(height as usize);
        let mut in_row = Vec::with_capacity(texels.len());
        for (y, row) in texels.chunks_exact(width as usize).enumerate() {
            let light = cumulative(row.iter().map(|texel| f64::from(texel.iter().sum::<f32>())));
            let solid_angle = (std::f64::consts::PI * (y as f64 + 0.5) / f64::from(height)).sin();
            rows.push(light.last().copied().unwrap_or(0.0) * solid_angle);
            in_row.extend(shares(&light));
        }
        Self { in_row, of_rows: shares(&cumulative(rows)).collect() }
    }
}

fn cumulative(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let sums = values.into_iter().scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    });
    sums.collect()
}

/// Cumulative sums as shares of the last one. The last share is 1, also where there is no light.
fn shares(sums: &[f64]) -> impl Iterator<Item = f32> {
    let total = sums.last().copied().unwrap_or(0.0);
    let last = sums.len() - 1;
    sums.iter().enumerate().map(
        move |(index, &sum)| {
            if index == last || total <= 0.0 { 1.0 } else { (sum / total) as f32 }
        },
    )
}

/// Irradiance over pi as a polynomial of the normal (Ramamoorthi & Hanrahan 2001, Equation 13): factors of
/// 1, y, z, x, xy, yz, 3z^2 - 1, xz and x^2 - y^2.
fn irradiance_coefficients(environment: &Environment) -> [[f32; 3]; 9] {
    use std::f64::consts::PI;
    let (w, h) = (f64::from(environment.width), f64::from(environment.height));
    // A texel may cover a large angle, so texels of small maps are sampled at many positions.
    let fine = (128.0 / w).ceil().max(1.0) as u32;
    let mut sums = [[0.0f64; 3]; 9];
    for (index, texel) in environment.texels.iter().enumerate() {
        let (x, y) = (index as u32 % environment.width, index as u32 / environment.width);
        for part in 0..fine * fine {
            let position = |v: u32, part: u32| f64::from(v) + (f64::from(part) + 0.5) / f64::from(fine);
            let longitude = (position(x, part % fine) / w - 0.5) * 2.0 * PI;
            let latitude = position(y, part / fine) / h * PI;
            let (sin, cos) = latitude.sin_cos();
            let d = [sin * longitude.sin(), cos, -sin * longitude.cos()];
            let solid_angle = 2.0 * PI / w * PI / h * sin / f64::from(fine * fine);
            for (sum, value) in sums.iter_mut().zip(harmonics(d)) {
                sum.iter_mut().zip(texel).for_each(|(s, &t)| *s += f64::from(t) * value * solid_angle);
            }
        }
    }
    // The cosine's coefficients over pi (1, 2/3, 1/4 by degree), and the norm of each polynomial again.
    let cosine = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];
    std::array::from_fn(|i| sums[i].map(|v| (v * cosine[i] * NORMS[i]) as f32))
}

/// Norms of the real spherical harmonics up to degree 2.
const NORMS: [f64; 9] =
    [0.282_095, 0.488_603, 0.488_603, 0.488_603, 1.092_548, 1.092_548, 0.315_392, 1.092_548, 0.546_274];

fn harmonics([x, y, z]: [f64; 3]) -> [f64; 9] {
    let polynomials = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    std::array::from_fn(|i| NORMS[i] * polynomials[i])
}
