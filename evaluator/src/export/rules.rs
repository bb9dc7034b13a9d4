//! Functions of the display's size, found by planning for many sizes. The planner is asked instead of described a second
//! time, so a rule cannot fall behind it: every rule holds for every size of [`SIZES`], or there is none.

use serde::Serialize;

/// Sizes for which plans are compared: common ones, odd ones, and those around the powers of two at which numbers of levels
/// and workgroups change. The largest is beyond every texture, so that no rule ends below it.
pub const SIZES: [[u32; 2]; 20] = [
    [1, 1],
    [2, 3],
    [7, 5],
    [16, 9],
    [33, 65],
    [127, 129],
    [255, 257],
    [320, 180],
    [321, 181],
    [640, 360],
    [1000, 10],
    [13, 2000],
    [1279, 719],
    [1280, 720],
    [1921, 1081],
    [2048, 1024],
    [3840, 2160],
    [4095, 2047],
    [16383, 8193],
    [32768, 30000],
];

/// A side of the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Its width.
    Width,
    /// Its height.
    Height,
}

/// A number of texels or workgroups along one side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Side {
    /// The same for every display.
    Fixed {
        /// The number.
        fixed: u32,
    },
    /// `times * ceil((ceil(of / divide) + plus) / per)`.
    Display {
        /// A side of the display, pixels.
        of: Axis,
        /// Pixels along a texel.
        divide: u32,
        /// Texels more.
        plus: u32,
        /// Texels along a workgroup; 1 for textures.
        per: u32,
        /// Workgroups for each of them.
        times: u32,
    },
}

impl Side {
    /// Its value for a display.
    pub fn at(self, [width, height]: [u32; 2]) -> u32 {
        match self {
            Self::Fixed { fixed } => fixed,
            Self::Display { of, divide, plus, per, times } => {
                let side = if of == Axis::Width { width } else { height };
                times * (side.div_ceil(divide) + plus).div_ceil(per)
            }
        }
    }

    /// The first simple rule that gives these values; `None` if there is none. `per` is the number of texels along a
    /// workgroup.
    pub fn fit(values: &[([u32; 2], u32)], natural: Axis, per: u32) -> Option<Self> {
        let fits = |rule: &Self| values.iter().all(|&(size, value)| rule.at(size) == value);
        let powers = |count: u32| (0..count).map(|exponent| 1u32 << exponent);
        let fixed = Self::Fixed { fixed: values.first()?.1 };
        let other = if natural == Axis::Width { Axis::Height } else { Axis::Width };
        let on_display = [natural, other].into_iter().flat_map(|of| {
            powers(6).flat_map(move |times| {
                [0, 1].into_iter().flat_map(move |plus| {
                    powers(12).map(move |divide| Self::Display { of, divide, plus, per: per.max(1), times })
                })
            })
        });
        // With a single size, every rule would fit.
        [fixed].into_iter().chain(on_display.filter(|_| values.len() > 1)).find(fits)
    }
}

/// `max(times_squares * (ceil(width / divide)^2 + ceil(height / divide)^2), least)`, for areas that grow with the diagonal
/// of the display.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Squares {
    /// Pixels along a texel.
    pub divide: u32,
    /// Factor of the square of the diagonal.
    pub times_squares: f64,
    /// Lower bound.
    pub least: f64,
}

/// Rounding of a number that shaders read: a few operations in float32.
const ROUNDING: f64 = 1e-5;

/// Whether two numbers differ by rounding only.
pub fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

impl Squares {
    fn squares(divide: u32, size: [u32; 2]) -> f64 {
        size.iter().map(|side| f64::from(side.div_ceil(divide)).powi(2)).sum()
    }

    /// Its value for a display.
    pub fn at(self, size: [u32; 2]) -> f64 {
        (self.times_squares * Self::squares(self.divide, size)).max(self.least)
    }

    /// The rule that gives these values; `None` if there is none.
    pub fn fit(values: &[([u32; 2], f64)]) -> Option<Self> {
        let area = |&&(size, _): &&([u32; 2], f64)| Self::squares(1, size);
        let by_area = |a: &&([u32; 2], f64), b: &&([u32; 2], f64)| area(a).total_cmp(&area(b));
        let (smallest, largest) = (values.iter().min_by(by_area)?, values.iter().max_by(by_area)?);
        let rule = |exponent: u32| {
            let divide = 1 << exponent;
            Self { divide, times_squares: largest.1 / Self::squares(divide, largest.0), least: smallest.1 }
        };
        let fits = |rule: &Self| values.iter().all(|&(size, value)| close(rule.at(size), value));
        (0..6).map(rule).find(|rule| smallest.1 >= 0.0 && fits(rule))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(value: impl Fn([u32; 2]) -> u32, per: u32) -> Option<Side> {
        Side::fit(&SIZES.map(|size| (size, value(size))), Axis::Width, per)
    }

    #[test]
    fn sides_are_found() {
        let rule = |of, divide, plus, per, times| Some(Side::Display { of, divide, plus, per, times });
        assert_eq!(side(|[w, _]| w, 1), rule(Axis::Width, 1, 0, 1, 1));
        assert_eq!(side(|[w, _]| w.div_ceil(4), 1), rule(Axis::Width, 4, 0, 1, 1));
        assert_eq!(side(|[w, _]| w.div_ceil(8), 8), rule(Axis::Width, 1, 0, 8, 1));
        assert_eq!(side(|[w, _]| (w.div_ceil(2) + 1).div_ceil(8), 8), rule(Axis::Width, 2, 1, 8, 1));
        // Rows of tiles: see `tiled` in renderer/src/gi/slices.rs.
        assert_eq!(side(|[_, h]| 16 * h.div_ceil(8), 8), rule(Axis::Height, 1, 0, 8, 16));
        assert_eq!(side(|_| 7, 8), Some(Side::Fixed { fixed: 7 }));
        // Three pixels to a texel, and a number of levels, have no rule.
        assert_eq!(side(|[w, _]| w.div_ceil(3), 1), None);
        assert_eq!(side(|[w, _]| w.ilog2(), 1), None);
    }

    #[test]
    fn areas_are_found() {
        let fit = |value: fn(f64, f64) -> f64, divide: u32| {
            Squares::fit(&SIZES.map(|[w, h]| ([w, h], value(w.div_ceil(divide).into(), h.div_ceil(divide).into()))))
        };
        let rule = |divide| Some(Squares { divide, times_squares: 0.25, least: 4.0 });
        assert_eq!(fit(|w, h| (0.25 * (w * w + h * h)).max(4.0), 1), rule(1));
        assert_eq!(fit(|w, h| (0.25 * (w * w + h * h)).max(4.0), 8), rule(8));
        assert_eq!(fit(|w, _| w, 1), None);
        assert_eq!(fit(|w, h| w * w + h * h, 3), None, "three pixels to a texel");
        assert_eq!(fit(|w, h| -w * w - h * h, 1), None, "a lower bound is no upper one");
    }
}
