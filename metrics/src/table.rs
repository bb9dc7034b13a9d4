//! The one table of metrics.

use crate::{
    DisplayPair, LinearPair, blocks, linear,
    similarity::{psnr_db, ssim},
};

/// A metric: where it is shown, and how it is computed.
#[derive(Debug)]
pub struct Metric {
    /// Which one it is.
    pub id: MetricId,
    /// Column of results.csv: the image that is measured, `_`, and the metric.
    pub key: &'static str,
    /// Head of its column in tables.
    pub title: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// One sentence for a reader who sees it first.
    pub meaning: &'static str,
    /// Significant digits worth printing.
    pub digits: usize,
    /// Which value is best.
    pub best: Best,
    /// How plots show it; `None` for not at all.
    pub plot: Option<Plotted>,
    /// Position in tables and choices, from 1: what a viewer sees comes first.
    pub rank: u32,
    /// Whether it stands for the error where there is room for few numbers: under error maps and in tables.md.
    pub headline: bool,
    /// Whether every frontier table has its column, whatever metric the frontier is by.
    pub in_frontiers: bool,
    /// Whether results.csv has its column only where it was measured.
    pub optional: bool,
    /// How it is computed.
    pub function: Function,
}

/// What a metric is computed from.
#[derive(Clone, Copy, Debug)]
pub enum Function {
    /// Indirect light, `albedo * indirect`, linear radiance.
    Indirect(fn(&LinearPair) -> f64),
    /// The same over blocks of pixels; the number is that of pixels per row.
    IndirectBlocks(fn(&LinearPair, u32) -> f64),
    /// Ambient visibility, 0..1.
    Occlusion(fn(&LinearPair) -> f64),
    /// The final image.
    Final(fn(&DisplayPair) -> f64),
    /// Not one image: the run records it.
    Recorded,
}

/// How a metric appears in plots, where lower must be better.
#[derive(Debug)]
pub struct Plotted {
    /// Name of the choice.
    pub name: &'static str,
    /// Part of the file name.
    pub file: &'static str,
    /// Axis label.
    pub label: &'static str,
    /// Value as plotted; lower is better.
    pub value: fn(f64) -> f64,
}

/// Which value is best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Best {
    /// The smallest.
    Lowest,
    /// The largest.
    Highest,
    /// The one nearest to this.
    Nearest(f64),
}

impl Best {
    /// A key that is smallest for the best value.
    pub fn key(self, value: f64) -> f64 {
        match self {
            Self::Lowest => value,
            Self::Highest => -value,
            Self::Nearest(best) => (value - best).abs(),
        }
    }
}

impl MetricId {
    /// Its entry in the table.
    pub fn metric(self) -> &'static Metric {
        &METRICS[self as usize]
    }
}

impl Metric {
    /// All metrics by [`rank`](Self::rank): the order of tables and choices.
    pub fn ranked() -> Vec<&'static Self> {
        let mut all: Vec<&Self> = METRICS.iter().collect();
        all.sort_by_key(|metric| metric.rank);
        all
    }
}

#[cfg(feature = "flip")]
const FLIP: Function = Function::Final(crate::flip::flip);
#[cfg(feature = "flip")]
const HDR_FLIP: Function = Function::Final(crate::flip::hdr_flip);
/// Without their library these metrics can be shown but not computed.
#[cfg(not(feature = "flip"))]
const FLIP: Function = Function::Recorded;
#[cfg(not(feature = "flip"))]
const HDR_FLIP: Function = Function::Recorded;

/// Declares [`MetricId`] and [`METRICS`] from one list.
macro_rules! metrics {
    ($($id:ident { $($field:ident: $value:expr,)* })*) => {
        /// Names a metric in code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "each entry of the table has its meaning")]
        pub enum MetricId {
            $($id,)*
        }

        /// All metrics, in the order of their columns in results.csv.
        pub static METRICS: &[Metric] = &[$(Metric { id: MetricId::$id, $($field: $value,)* },)*];

        /// Their number.
        pub(crate) const COUNT: usize = [$(MetricId::$id,)*].len();
    };
}

metrics! {
    IndirectRelMse {
        key: "indirect_rel_mse",
        title: "relMSE",
        unit: "",
        meaning: "mean of (x − t)² / (t² + 0.01 m²) of linear albedo · indirect against the reference t with mean m; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "relMSE",
            file: "relmse",
            label: "relMSE of albedo · indirect",
            value: |value| value,
        }),
        rank: 2,
        headline: true,
        in_frontiers: true,
        optional: false,
        function: Function::Indirect(linear::rel_mse),
    }
    IndirectBlockRelMse {
        key: "indirect_block_rel_mse",
        title: "block relMSE",
        unit: "",
        meaning: "relMSE of linear albedo · indirect over means of 4x4 pixels, with the floor of relMSE: noise that the eye averages counts a sixteenth, leaks and missing light count in full; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "block relMSE",
            file: "block-relmse",
            label: "relMSE of albedo · indirect over 4x4 pixels",
            value: |value| value,
        }),
        rank: 3,
        headline: true,
        in_frontiers: true,
        optional: false,
        function: Function::IndirectBlocks(blocks::block_rel_mse),
    }
    IndirectRmse {
        key: "indirect_rmse",
        title: "RMSE",
        unit: "radiance",
        meaning: "root mean square error of linear albedo · indirect; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "RMSE",
            file: "rmse",
            label: "RMSE of albedo · indirect, radiance",
            value: |value| value,
        }),
        rank: 4,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Indirect(linear::rmse),
    }
    IndirectBias {
        key: "indirect_bias",
        title: "bias",
        unit: "radiance",
        meaning: "signed mean error of linear albedo · indirect; positive is too bright, 0 is best",
        digits: 3,
        best: Best::Nearest(0.0),
        plot: Some(Plotted {
            name: "|bias|",
            file: "bias",
            label: "|bias| of albedo · indirect, radiance",
            value: f64::abs,
        }),
        rank: 7,
        headline: false,
        in_frontiers: true,
        optional: false,
        function: Function::Indirect(linear::bias),
    }
    IndirectP95Abs {
        key: "indirect_p95_abs",
        title: "P95 error",
        unit: "radiance",
        meaning: "95th percentile of the absolute error of linear albedo · indirect; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        rank: 8,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Indirect(linear::p95_abs),
    }
    IndirectP999Abs {
        key: "indirect_p999_abs",
        title: "P99.9 error",
        unit: "radiance",
        meaning: "99.9th percentile of the absolute error of linear albedo · indirect; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        rank: 9,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Indirect(linear::p999_abs),
    }
    IndirectBestFactor {
        key: "indirect_best_factor",
        title: "factor",
        unit: "1",
        meaning: "factor on albedo · indirect that minimizes relMSE; 1 where a method is right in absolute units, or black",
        digits: 3,
        best: Best::Nearest(1.0),
        plot: None,
        rank: 11,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Indirect(linear::best_factor),
    }
    IndirectScaledRelMse {
        key: "indirect_scaled_rel_mse",
        title: "relMSE, exposed",
        unit: "",
        meaning: "relMSE after the one factor on albedo · indirect that minimizes it: what a method without units can reach",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        rank: 10,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Indirect(linear::scaled_rel_mse),
    }
    OcclusionRmse {
        key: "occlusion_rmse",
        title: "AO RMSE",
        unit: "1",
        meaning: "root mean square error of ambient visibility against the traced one of the same radius; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "AO RMSE",
            file: "ao-rmse",
            label: "RMSE of ambient visibility",
            value: |value| value,
        }),
        rank: 12,
        headline: false,
        in_frontiers: false,
        optional: true,
        function: Function::Occlusion(linear::rmse),
    }
    OcclusionBias {
        key: "occlusion_bias",
        title: "AO bias",
        unit: "1",
        meaning: "signed mean error of ambient visibility; positive is too open, 0 is best",
        digits: 3,
        best: Best::Nearest(0.0),
        plot: None,
        rank: 13,
        headline: false,
        in_frontiers: false,
        optional: true,
        function: Function::Occlusion(linear::bias),
    }
    OcclusionP95Abs {
        key: "occlusion_p95_abs",
        title: "AO P95 error",
        unit: "1",
        meaning: "95th percentile of the absolute error of ambient visibility; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        rank: 14,
        headline: false,
        in_frontiers: false,
        optional: true,
        function: Function::Occlusion(linear::p95_abs),
    }
    FinalPsnrDb {
        key: "final_psnr_db",
        title: "PSNR",
        unit: "dB",
        meaning: "peak signal-to-noise ratio of the final tone-mapped image; higher is better",
        digits: 3,
        best: Best::Highest,
        plot: None,
        rank: 15,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Final(|pair| psnr_db(pair.display[0], pair.display[1], pair.mask)),
    }
    FinalSsim {
        key: "final_ssim",
        title: "SSIM",
        unit: "",
        meaning: "structural similarity of the final tone-mapped image; 1 is equal",
        digits: 3,
        best: Best::Highest,
        plot: Some(Plotted {
            name: "1 − SSIM",
            file: "ssim",
            label: "1 − SSIM of the final image",
            value: |value| 1.0 - value,
        }),
        rank: 5,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Final(|pair| ssim(pair.display[0], pair.display[1], pair.width, pair.mask)),
    }
    FinalFlip {
        key: "final_flip",
        title: "FLIP",
        unit: "",
        meaning: "perceived difference of the final tone-mapped image when flipping between it and the reference; 0 is equal",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "FLIP",
            file: "flip",
            label: "FLIP of the final image",
            value: |value| value,
        }),
        rank: 1,
        headline: true,
        in_frontiers: true,
        optional: false,
        function: FLIP,
    }
    FinalHdrFlip {
        key: "final_hdr_flip",
        title: "HDR-FLIP",
        unit: "",
        meaning: "the largest FLIP over all exposures of the final linear image; 0 is equal",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "HDR-FLIP",
            file: "hdr-flip",
            label: "HDR-FLIP of the final image",
            value: |value| value,
        }),
        rank: 6,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: HDR_FLIP,
    }
    NoiseStd {
        key: "noise_std",
        title: "noise",
        unit: "radiance",
        meaning: "standard deviation per pixel over seeds under a static camera; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        rank: 16,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Recorded,
    }
    TruthRelError {
        key: "truth_rel_error",
        title: "truth error",
        unit: "",
        meaning: "relative standard error that the path-traced reference reached",
        digits: 2,
        best: Best::Lowest,
        plot: None,
        rank: 17,
        headline: false,
        in_frontiers: false,
        optional: false,
        function: Function::Recorded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_files_and_ranks_are_unique() {
        for (index, metric) in METRICS.iter().enumerate() {
            assert_eq!(metric.id as usize, index);
            for other in &METRICS[..index] {
                assert!(metric.key != other.key && metric.title != other.title && metric.rank != other.rank);
                let file = |metric: &Metric| metric.plot.as_ref().map(|plot| plot.file);
                assert!(file(metric).is_none() || file(metric) != file(other), "{}", metric.key);
            }
        }
    }

    #[test]
    fn a_plot_is_lower_where_the_metric_is_better() {
        for metric in METRICS {
            let Some(plot) = &metric.plot else { continue };
            let (better, worse) = match metric.best {
                Best::Lowest => (0.1, 0.2),
                Best::Highest => (0.2, 0.1),
                Best::Nearest(best) => (best - 0.1, best - 0.2),
            };
            assert!((plot.value)(better) < (plot.value)(worse), "{}", metric.key);
            assert!(metric.best.key(better) < metric.best.key(worse), "{}", metric.key);
        }
    }
}
