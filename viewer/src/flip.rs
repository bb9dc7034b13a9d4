//! FLIP, the difference that is seen when two pictures are flipped in place: Andersson et al., "FLIP: A Difference Evaluator
//! for Alternating Images", 2020, with separable filters. The C++ library behind `halflight-metrics` does not compile for
//! browsers; a test compares both.
//!
//! The work is done in rows, so that a page stays usable meanwhile.

use halflight_metrics::Rgb;

/// Pixels per degree of the observer: 0.7 m from a 4K display 0.7 m wide, the authors' default.
const PIXELS_PER_DEGREE: f64 = 67.020_643_276_582_25;
/// Exponent and break of the curve from colour distances to errors.
const COLOUR_EXPONENT: f32 = 0.7;
const COLOUR_BREAK: [f32; 2] = [0.4, 0.95];
/// Width of an edge or a point that is detected, degrees, and the exponent of their differences.
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_EXPONENT: f32 = 0.5;
/// Weight and width of the Gaussians of contrast sensitivity: black-white, red-green, and two of blue-yellow.
const SENSITIVITY: [[f64; 2]; 4] = [[1.0, 0.0047], [1.0, 0.0053], [34.1, 0.04], [13.5, 0.025]];
/// Linear sRGB to XYZ, and back.
const TO_XYZ: [[f32; 3]; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_8],
    [0.212_639, 0.715_168_65, 0.072_192_32],
    [0.019_330_82, 0.119_194_78, 0.950_532_16],
];
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_65, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];

fn times(matrix: &[[f32; 3]; 3], v: Rgb) -> Rgb {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ of white.
fn white() -> Rgb {
    times(&TO_XYZ, [1.0; 3])
}

/// Linear sRGB in a linear opponent space: black-white, red-green, blue-yellow.
fn opponent(linear: Rgb) -> Rgb {
    let (xyz, white) = (times(&TO_XYZ, linear), white());
    let [x, y, z] = std::array::from_fn(|c| xyz[c] / white[c]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([y, cx, cz]: Rgb) -> Rgb {
    let (y, white) = ((y + 16.0) / 116.0, white());
    let xyz = [(y + cx / 500.0) * white[0], y * white[1], (y - cz / 200.0) * white[2]];
    times(&FROM_XYZ, xyz)
}

/// Linear sRGB in CIELAB, with less colour where it is dark (Hunt).
fn lab(linear: Rgb) -> Rgb {
    let (xyz, white) = (times(&TO_XYZ, linear), white());
    let curve = |v: f32| {
        let delta: f32 = 6.0 / 29.0;
        if v > delta.powi(3) { v.cbrt() } else { v / (3.0 * delta * delta) + 4.0 / 29.0 }
    };
    let [x, y, z] = std::array::from_fn(|c| curve(xyz[c] / white[c]));
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Distance of two colours, raised to [`COLOUR_EXPONENT`].
fn distance(a: Rgb, b: Rgb) -> f32 {
    ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(COLOUR_EXPONENT)
}

/// Weights of one filter, from -radius to radius.
struct Filter(Vec<f32>);

impl Filter {
    fn new(radius: i32, weight: impl Fn(f64) -> f64) -> Self {
        Self((-radius..=radius).map(|x| weight(f64::from(x)) as f32).collect())
    }

    fn scaled(mut self, factor: impl Fn(f32) -> f32) -> Self {
        self.0.iter_mut().for_each(|weight| *weight *= factor(*weight));
        self
    }

    fn sum(&self) -> f32 {
        self.0.iter().sum()
    }

    /// Weights whose positive and negative ones have the sum 1 and -1.
    fn balanced(self) -> Self {
        let part = |positive: bool| self.0.iter().filter(|w| (**w > 0.0) == positive).map(|w| w.abs()).sum::<f32>();
        let parts = [part(false), part(true)];
        self.scaled(|weight| 1.0 / parts[usize::from(weight > 0.0)])
    }

    /// The weighted sum of a line around a position; what is outside equals the border.
    fn at(&self, line: impl Fn(usize) -> f32, position: usize, length: usize) -> f32 {
        let radius = self.0.len() / 2;
        let index = |offset: usize| (position + offset).saturating_sub(radius).min(length - 1);
        self.0.iter().enumerate().map(|(offset, weight)| weight * line(index(offset))).sum()
    }
}

/// The filters of colour, as [`SENSITIVITY`], and of features: Gaussian, first and second derivative.
struct Filters {
    colour: [Filter; 4],
    features: [Filter; 3],
}

impl Filters {
    fn new() -> Self {
        let pi = std::f64::consts::PI;
        let widest = SENSITIVITY.iter().map(|[_, width]| *width).fold(0.0, f64::max);
        let radius = (3.0 * (widest / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let colour = SENSITIVITY.map(|[weight, width]| {
            // Both directions together have the weight of the Gaussian.
            let height = (weight * (pi / width).sqrt()).sqrt();
            Filter::new(radius, |x| height * (-pi * pi * (x / PIXELS_PER_DEGREE).powi(2) / width).exp())
        });
        let sums: Vec<f32> = colour.iter().map(Filter::sum).collect();
        // Two Gaussians of one channel are normalized together.
        let both = sums[2].hypot(sums[3]);
        let norms = [sums[0], sums[1], both, both];
        let mut index = 0;
        let colour = colour.map(|filter| {
            index += 1;
            filter.scaled(|_| 1.0 / norms[index - 1])
        });
        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let smooth = Filter::new(radius, gaussian);
        let sum = smooth.sum();
        let features = [
            smooth.scaled(|_| 1.0 / sum),
            Filter::new(radius, |x| -x * gaussian(x)).balanced(),
            Filter::new(radius, |x| (x * x / (deviation * deviation) - 1.0) * gaussian(x)).balanced(),
        ];
        Self { colour, features }
    }
}

/// A picture in the opponent space, and after the filters along its rows.
struct Picture {
    opponent: Vec<Rgb>,
    /// As the filters of colour.
    colour: [Vec<f32>; 4],
    /// As those of features.
    features: [Vec<f32>; 3],
}

/// Channels of the opponent space that the filters of colour are for.
const CHANNELS: [usize; 4] = [0, 1, 2, 2];

/// A comparison in progress.
pub struct Flip {
    filters: Filters,
    size: [usize; 2],
    mask: Vec<bool>,
    /// The reference and the picture.
    pictures: [Picture; 2],
    /// Rows that were filtered, and rows that were compared.
    done: [usize; 2],
    sum: f64,
    /// Distance of the colours that differ most.
    most: f32,
}

impl Flip {
    /// Compares a picture with its reference, each as linear values of a display, 0..=1. `mask`: pixels that count.
    pub fn new(reference: &[Rgb], picture: &[Rgb], width: u32, mask: Vec<bool>) -> Self {
        let width = width.max(1) as usize;
        let new = |pixels: &[Rgb]| Picture {
            opponent: pixels.iter().map(|&pixel| opponent(pixel)).collect(),
            colour: Default::default(),
            features: Default::default(),
        };
        Self {
            filters: Filters::new(),
            size: [width, reference.len().min(picture.len()) / width],
            mask,
            pictures: [new(reference), new(picture)],
            done: [0; 2],
            sum: 0.0,
            most: distance(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])),
        }
    }

    /// Continues with rows of about this many pixels. Returns the mean over the mask at the end, 0..=1.
    pub fn step(&mut self, pixels: usize) -> Option<f64> {
        let [width, height] = self.size;
        for _ in 0..pixels.div_ceil(width).max(1) {
            if self.done[0] < height {
                self.filter_row(self.done[0]);
                self.done[0] += 1;
            } else if self.done[1] < height {
                self.compare_row(self.done[1]);
                self.done[1] += 1;
            } else {
                break;
            }
        }
        let count = self.mask.iter().filter(|counts| **counts).count();
        (self.done[1] == height).then(|| self.sum / count.max(1) as f64)
    }

    fn filter_row(&mut self, y: usize) {
        let width = self.size[0];
        for picture in &mut self.pictures {
            let row = &picture.opponent[y * width..(y + 1) * width];
            for ((filter, channel), plane) in self.filters.colour.iter().zip(CHANNELS).zip(&mut picture.colour) {
                plane.extend((0..width).map(|x| filter.at(|x| row[x][channel], x, width)));
            }
            for (filter, plane) in self.filters.features.iter().zip(&mut picture.features) {
                // Black-white as 0..1.
                plane.extend((0..width).map(|x| filter.at(|x| (row[x][0] + 16.0) / 116.0, x, width)));
            }
        }
    }

    fn compare_row(&mut self, y: usize) {
        let [width, height] = self.size;
        for x in (0..width).filter(|x| self.mask[y * width + x]) {
            let down = |filter: &Filter, plane: &[f32]| filter.at(|y| plane[y * width + x], y, height);
            let [colours, edges, points] = {
                let each = self.pictures.each_ref().map(|picture| {
                    let [y, cx, cz, cz2] = std::array::from_fn(|i| down(&self.filters.colour[i], &picture.colour[i]));
                    let seen = from_opponent([y, cx, cz + cz2]).map(|v| v.clamp(0.0, 1.0));
                    let [smooth, first, second] = &self.filters.features;
                    let [smoothed, along, along2] = &picture.features;
                    let edge = down(smooth, along).hypot(down(first, smoothed));
                    let point = down(smooth, along2).hypot(down(second, smoothed));
                    (lab(seen), edge, point)
                });
                let [(a, edge_a, point_a), (b, edge_b, point_b)] = each;
                [distance(a, b), (edge_a - edge_b).abs(), (point_a - point_b).abs()]
            };
            let [break_at, broken] = [COLOUR_BREAK[0] * self.most, COLOUR_BREAK[1]];
            let colour = if colours < break_at {
                colours * broken / break_at
            } else {
                broken + (colours - break_at) / (self.most - break_at) * (1.0 - broken)
            };
            let feature = (std::f32::consts::FRAC_1_SQRT_2 * edges.max(points)).powf(FEATURE_EXPONENT);
            self.sum += f64::from(colour.powf(1.0 - feature));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with edges, thin lines and slopes of several colours, as bytes.
    fn bytes(size: [usize; 2], seed: usize) -> Vec<u8> {
        let pixel = |x: usize, y: usize| {
            let stripe = if (x / 7 + y / 11 + seed).is_multiple_of(3) { 200 } else { 30 };
            let line = if x == 20 + seed { 255 } else { 0 };
            [((x * 3 + seed * 40) % 256) as u8, stripe, line.max((y * 5 % 256) as u8)]
        };
        (0..size[1]).flat_map(|y| (0..size[0]).flat_map(move |x| pixel(x, y))).collect()
    }

    fn linear(bytes: &[u8]) -> Vec<Rgb> {
        let decode = |byte: &u8| halflight_metrics::tone::srgb_decode(f32::from(*byte) / 255.0);
        bytes.as_chunks::<3>().0.iter().map(|pixel| pixel.each_ref().map(decode)).collect()
    }

    fn own(a: &[u8], b: &[u8], width: usize) -> f64 {
        let (a, b) = (linear(a), linear(b));
        let mut flip = Flip::new(&a, &b, width as u32, vec![true; a.len()]);
        let steps = (0..10_000).find_map(|_| flip.step(100));
        steps.expect("an end")
    }

    #[test]
    fn it_agrees_with_the_library_of_its_authors() {
        for size in [[64, 48], [37, 91], [5, 3]] {
            let (a, b) = (bytes(size, 0), bytes(size, 2));
            let image = |bytes: &[u8]| nv_flip::FlipImageRgb8::with_data(size[0] as u32, size[1] as u32, bytes);
            let map = nv_flip::flip(image(&a), image(&b), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
            let wanted = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64;
            let found = own(&a, &b, size[0]);
            assert!((found - wanted).abs() < 1e-4 && wanted > 0.05, "{size:?}: {found}, not {wanted}");
            assert!(own(&a, &a, size[0]) < 1e-6);
        }
    }

    #[test]
    fn pixels_outside_of_the_mask_do_not_count() {
        let a = vec![[0.5; 3]; 40 * 10];
        let mut b = a.clone();
        (0..10).for_each(|y| b[y * 40] = [1.0, 0.0, 0.0]);
        let mean = |mask: Vec<bool>| Flip::new(&a, &b, 40, mask).step(2 * 400);
        // The filters reach less than 20 pixels.
        assert!(mean((0..400).map(|i| i % 40 > 25).collect()).is_some_and(|mean| mean < 1e-6));
        assert!(mean((0..400).map(|i| i % 40 == 0).collect()).is_some_and(|mean| mean > 0.3));
    }
}
