//! The error measures that a report knows: one declaration for tables, plots and choices.

use crate::measurement::Measurement;

/// An error measure.
pub struct Measure {
    /// Head of its column.
    pub name: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// One sentence for a reader who meets it first.
    pub meaning: &'static str,
    /// Significant digits worth printing.
    pub digits: usize,
    /// Which value is best: the smallest, the largest, or the one nearest to 0.
    pub best: Best,
    /// For plots, where lower must be better: file name, axis label and value.
    pub plot: Option<Plotted>,
    /// Its value in a row.
    pub value: fn(&Measurement) -> Option<f64>,
}

/// How a measure appears in plots.
pub struct Plotted {
    /// Name of the choice.
    pub name: &'static str,
    /// Part of the file name.
    pub file: &'static str,
    /// Axis label.
    pub label: &'static str,
    /// Value as plotted, lower = better.
    pub value: fn(f64) -> f64,
}

impl Plotted {
    /// The plotted value of a row; NaN where it was not measured.
    pub fn error(&self, measure: &Measure, row: &Measurement) -> f64 {
        (measure.value)(row).map_or(f64::NAN, self.value)
    }
}

/// Which value is best.
#[derive(Clone, Copy, PartialEq)]
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

/// All measures, in the order of every table and choice: what a viewer sees first.
pub static MEASURES: [Measure; 16] = [
    Measure {
        name: "FLIP",
        unit: "",
        meaning: "perceived difference of the final tone-mapped image when flipping between it and truth; 0 is equal",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted { name: "FLIP", file: "flip", label: "FLIP of the final image", value: |value| value }),
        value: |row| row.errors.final_flip,
    },
    Measure {
        name: "relMSE",
        unit: "",
        meaning: "mean of (x − t)² / (t² + 0.01 m²) of linear albedo · indirect against truth t with mean m; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted {
            name: "relMSE",
            file: "relmse",
            label: "relMSE of albedo · indirect",
            value: |value| value,
        }),
        value: |row| row.errors.indirect_rel_mse,
    },
    Measure {
        name: "RMSE",
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
        value: |row| row.errors.indirect_rmse,
    },
    Measure {
        name: "SSIM",
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
        value: |row| row.errors.final_ssim,
    },
    Measure {
        name: "HDR-FLIP",
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
        value: |row| row.errors.final_hdr_flip,
    },
    Measure {
        name: "bias",
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
        value: |row| row.errors.indirect_bias,
    },
    Measure {
        name: "P95 error",
        unit: "radiance",
        meaning: "95th percentile of the absolute error of linear albedo · indirect; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.indirect_p95_abs,
    },
    Measure {
        name: "P99.9 error",
        unit: "radiance",
        meaning: "99.9th percentile of the absolute error of linear albedo · indirect; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.indirect_p999_abs,
    },
    Measure {
        name: "relMSE, exposed",
        unit: "",
        meaning: "relMSE after the one factor on albedo · indirect that makes it smallest: what a method without units can reach",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.indirect_scaled_rel_mse,
    },
    Measure {
        name: "factor",
        unit: "1",
        meaning: "that factor; 1 where a method is right in absolute units, or black",
        digits: 3,
        best: Best::Nearest(1.0),
        plot: None,
        value: |row| row.errors.indirect_best_factor,
    },
    Measure {
        name: "AO RMSE",
        unit: "1",
        meaning: "root mean square error of openness against traced openness of the same radius; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: Some(Plotted { name: "AO RMSE", file: "ao-rmse", label: "RMSE of openness", value: |value| value }),
        value: |row| row.errors.occlusion_rmse,
    },
    Measure {
        name: "AO bias",
        unit: "1",
        meaning: "signed mean error of openness; positive is too open, 0 is best",
        digits: 3,
        best: Best::Nearest(0.0),
        plot: None,
        value: |row| row.errors.occlusion_bias,
    },
    Measure {
        name: "AO P95 error",
        unit: "1",
        meaning: "95th percentile of the absolute error of openness; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.occlusion_p95_abs,
    },
    Measure {
        name: "PSNR",
        unit: "dB",
        meaning: "peak signal-to-noise ratio of the final tone-mapped image; higher is better",
        digits: 3,
        best: Best::Highest,
        plot: None,
        value: |row| row.errors.final_psnr_db,
    },
    Measure {
        name: "noise",
        unit: "radiance",
        meaning: "standard deviation per pixel over seeds under a still camera; lower is better",
        digits: 3,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.noise_std,
    },
    Measure {
        name: "truth error",
        unit: "",
        meaning: "relative standard error that the path-traced truth reached",
        digits: 2,
        best: Best::Lowest,
        plot: None,
        value: |row| row.errors.truth_rel_error,
    },
];
