//! An error as a chain of differences between states, from what a technique shows to the reference.
//!
//! Some states are known exactly; others are estimated, in several groups that share no random number. The product of
//! a difference in one group and a difference in another has the product of the true differences as its mean, so
//! squares carry no noise of the estimates (a U-statistic, Hoeffding 1948). Leaving out one group at a time tells how
//! far each number is to be trusted (the jackknife, Tukey 1958).

use halflight_native::images::Rgb;

/// An image on the way from the technique's image to the reference.
#[derive(Clone, Debug)]
pub enum State {
    /// Known exactly, or given: the image that is to be explained.
    Exact(Vec<Rgb>),
    /// One independent estimate for each group.
    Groups(Vec<Vec<Rgb>>),
}

impl State {
    fn value(&self, group: usize, pixel: usize, channel: usize) -> f64 {
        f64::from(match self {
            Self::Exact(image) => image[pixel][channel],
            Self::Groups(images) => images[group][pixel][channel],
        })
    }
}

/// One link: a sum of states times factors, which adds up to a difference of two images.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name in tables.
    pub name: &'static str,
    /// States by number, with their factors.
    pub terms: Vec<(usize, f64)>,
}

impl Link {
    /// `from` less `to`.
    pub fn between(name: &'static str, from: usize, to: usize) -> Self {
        Self { name, terms: vec![(from, 1.0), (to, -1.0)] }
    }

    fn value(&self, states: &[State], group: usize, pixel: usize, channel: usize) -> f64 {
        self.terms.iter().map(|&(state, factor)| factor * states[state].value(group, pixel, channel)).sum()
    }
}

/// A number and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Uncertain {
    /// The number.
    pub value: f64,
    /// Standard deviation of it over repetitions with other random numbers.
    pub standard_error: f64,
}

/// What the links of a chain amount to, over the pixels that count and their channels.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Mean of each link.
    pub means: Vec<Uncertain>,
    /// Mean of the product of two links, by row and column: squares on the diagonal.
    pub products: Vec<Vec<Uncertain>>,
    /// For each link twice its products with all others.
    pub crosses: Vec<Uncertain>,
    /// For each link its square and its products with all others: a cross term is counted half with either link, so
    /// these add up to `square`.
    pub parts: Vec<Uncertain>,
    /// `parts` as shares of `square`.
    pub shares: Vec<Uncertain>,
    /// Mean square of the sum of all links.
    pub square: Uncertain,
    /// Mean of the sum of all links.
    pub mean: Uncertain,
}

/// Means and mean products of links. `weights`, one a pixel and channel, multiply products; pixels with a false mask
/// are left out.
///
/// # Panics
/// With fewer than three groups: leaving out one must leave a pair.
pub fn moments(
    states: &[State],
    links: &[Link],
    groups: usize,
    mask: &[bool],
    weights: &dyn Fn(usize, usize) -> f64,
) -> Moments {
    assert!(groups >= 3, "a jackknife over pairs takes three groups");
    let count = links.len();
    // Index 0 holds all groups, index 1 + g leaves out group g.
    let mut means = vec![vec![0.0; count]; groups + 1];
    let mut products = vec![vec![0.0; count * count]; groups + 1];
    let mut values = vec![0.0; count * groups];
    let mut sums = vec![0.0; count];
    let mut pixels = 0.0f64;
    for pixel in (0..mask.len()).filter(|&pixel| mask[pixel]) {
        pixels += 1.0;
        for channel in 0..3 {
            for (l, link) in links.iter().enumerate() {
                let own = &mut values[l * groups..][..groups];
                own.iter_mut().enumerate().for_each(|(g, v)| *v = link.value(states, g, pixel, channel));
                sums[l] = own.iter().sum();
            }
            let weight = weights(pixel, channel);
            for l in 0..count {
                means[0][l] += sums[l] / groups as f64;
                for g in 0..groups {
                    means[1 + g][l] += (sums[l] - values[l * groups + g]) / (groups - 1) as f64;
                }
                for m in 0..=l {
                    let (a, b) = (&values[l * groups..][..groups], &values[m * groups..][..groups]);
                    let same: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    let pairs = |n: usize| (n * (n - 1)) as f64;
                    let mut add = |place: usize, product: f64| {
                        products[place][l * count + m] += weight * product;
                        if l != m {
                            products[place][m * count + l] += weight * product;
                        }
                    };
                    add(0, (sums[l] * sums[m] - same) / pairs(groups));
                    for g in 0..groups {
                        let rest = (sums[l] - a[g]) * (sums[m] - b[g]) - (same - a[g] * b[g]);
                        add(1 + g, rest / pairs(groups - 1));
                    }
                }
            }
        }
    }
    let samples = (3.0 * pixels).max(1.0);
    let estimate = |of: &dyn Fn(usize) -> f64| {
        let left_out: Vec<f64> = (1..=groups).map(of).collect();
        let mean = left_out.iter().sum::<f64>() / groups as f64;
        let spread: f64 = left_out.iter().map(|v| (v - mean).powi(2)).sum();
        let error = (spread * (groups - 1) as f64 / groups as f64).sqrt();
        // What the order of additions leaves of a number without random samples is no uncertainty.
        let rounding = 1e-12 * mean.abs();
        Uncertain { value: of(0), standard_error: if error > rounding { error } else { 0.0 } }
    };
    let row = |place: usize, l: usize| products[place][l * count..][..count].iter().sum::<f64>() / samples;
    let own = |place: usize, l: usize| products[place][l * count + l] / samples;
    let square = |place: usize| products[place].iter().sum::<f64>() / samples;
    Moments {
        means: (0..count).map(|l| estimate(&|place| means[place][l] / samples)).collect(),
        products: (0..count)
            .map(|l| (0..count).map(|m| estimate(&|place| products[place][l * count + m] / samples)).collect())
            .collect(),
        crosses: (0..count).map(|l| estimate(&|place| 2.0 * (row(place, l) - own(place, l)))).collect(),
        parts: (0..count).map(|l| estimate(&|place| row(place, l))).collect(),
        shares: (0..count).map(|l| estimate(&|place| row(place, l) / square(place))).collect(),
        square: estimate(&square),
        mean: estimate(&|place| means[place].iter().sum::<f64>() / samples),
    }
}

/// A link as an image: its mean over groups.
pub fn picture(states: &[State], link: &Link, groups: usize, pixels: usize) -> Vec<Rgb> {
    let value =
        |pixel, channel| (0..groups).map(|g| link.value(states, g, pixel, channel)).sum::<f64>() as f32 / groups as f32;
    (0..pixels).map(|pixel| std::array::from_fn(|channel| value(pixel, channel))).collect()
}

#[cfg(test)]
#[allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
mod tests {
    use super::*;

    /// Random numbers that are the same in every run.
    fn noise(pixel: usize, group: usize, stream: usize) -> f32 {
        let mut v = (pixel as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (group as u64).wrapping_mul(0xD1B5_4A32_D192_ED03)
            ^ (stream as u64) << 17;
        for _ in 0..3 {
            v ^= v >> 31;
            v = v.wrapping_mul(0xBF58_476D_1CE4_E5B9);
        }
        (v >> 40) as f32 / (1u64 << 24) as f32 - 0.5
    }

    const PIXELS: usize = 4000;
    const GROUPS: usize = 8;

    fn chain() -> (Vec<State>, Vec<Link>) {
        let flat = |value: f32| vec![[value; 3]; PIXELS];
        let noisy = |value: f32, stream: usize| {
            let image = |g| (0..PIXELS).map(|p| [value + noise(p, g, stream); 3]).collect();
            State::Groups((0..GROUPS).map(image).collect())
        };
        // The image differs from its mean, 2, by +-0.4 from pixel to pixel.
        let image = (0..PIXELS).map(|p| [if p % 2 == 0 { 2.4 } else { 1.6 }; 3]).collect();
        let states = vec![State::Exact(image), noisy(2.0, 1), State::Exact(flat(1.7)), noisy(1.2, 2)];
        let links = vec![Link::between("noise", 0, 1), Link::between("bias", 1, 2), Link::between("missing", 2, 3)];
        (states, links)
    }

    #[test]
    fn noise_of_the_estimates_is_not_counted_as_error() {
        let (states, links) = chain();
        let found = moments(&states, &links, GROUPS, &[true; PIXELS], &|_, _| 1.0);
        // True values; estimates carry noise of deviation 0.29, whose square, 0.083, must not show.
        let expected = [[0.16, 0.0, 0.0], [0.0, 0.09, 0.15], [0.0, 0.15, 0.25]];
        for (l, row) in expected.iter().enumerate() {
            for (m, &value) in row.iter().enumerate() {
                let got = found.products[l][m];
                assert!((got.value - value).abs() < 5.0 * got.standard_error + 1e-4, "{l} {m}: {got:?} for {value}");
                assert!(got.standard_error < 0.02, "{l} {m}: {got:?}");
            }
        }
        for (got, value) in found.means.iter().zip([0.0, 0.3, 0.5]) {
            assert!((got.value - value).abs() < 5.0 * got.standard_error && got.standard_error < 0.01, "{got:?}");
        }
    }

    #[test]
    fn links_add_up() {
        let (states, links) = chain();
        let found = moments(&states, &links, GROUPS, &[true; PIXELS], &|_, _| 1.0);
        let sum = |values: &[Uncertain]| values.iter().map(|v| v.value).sum::<f64>();
        // The same numbers in another order: rounding alone is left.
        assert!((sum(&found.means) - found.mean.value).abs() < 1e-12);
        assert!((sum(&found.parts) - found.square.value).abs() < 1e-12);
        assert!((sum(&found.shares) - 1.0).abs() < 1e-12);
        let whole = moments(&states, &[Link::between("all", 0, 3)], GROUPS, &[true; PIXELS], &|_, _| 1.0);
        assert!((whole.square.value - found.square.value).abs() < 1e-9, "{:?} {:?}", whole.square, found.square);
        assert!((whole.mean.value - found.mean.value).abs() < 1e-9);
    }

    #[test]
    fn standard_errors_are_those_of_repetitions() {
        // The same chain many times over with other noise: the spread of a number is what it claims.
        let repeat = |run: usize| {
            let image = |g: usize| (0..500).map(|p| [1.0 + noise(p, g + 100 * run, 9); 3]).collect();
            let states = [State::Exact(vec![[1.5; 3]; 500]), State::Groups((0..GROUPS).map(image).collect())];
            moments(&states, &[Link::between("all", 0, 1)], GROUPS, &[true; 500], &|_, _| 1.0).square
        };
        let runs: Vec<Uncertain> = (0..60).map(repeat).collect();
        let mean = runs.iter().map(|r| r.value).sum::<f64>() / 60.0;
        let spread = (runs.iter().map(|r| (r.value - mean).powi(2)).sum::<f64>() / 59.0).sqrt();
        let claimed = (runs.iter().map(|r| r.standard_error.powi(2)).sum::<f64>() / 60.0).sqrt();
        println!("spread {spread:.2e}, claimed {claimed:.2e}, mean {mean:.5}");
        // Sixty runs know their spread to 9 %; three times that.
        assert!((claimed / spread - 1.0).abs() < 0.27, "{claimed} {spread}");
        assert!((mean - 0.25).abs() < 4.0 * spread / 60f64.sqrt());
    }

    #[test]
    fn masked_pixels_do_not_count_and_weights_do() {
        let states = [State::Exact(vec![[3.0; 3], [9.0; 3]]), State::Groups(vec![vec![[1.0; 3]; 2]; 3])];
        let links = [Link::between("all", 0, 1)];
        let found = moments(&states, &links, 3, &[true, false], &|_, _| 0.5);
        assert_eq!(found.mean.value, 2.0);
        assert_eq!(found.square, Uncertain { value: 2.0, standard_error: 0.0 });
        assert_eq!(picture(&states, &links[0], 3, 2), [[2.0; 3], [8.0; 3]]);
    }
}
