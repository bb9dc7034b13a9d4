//! What a row holds of a technique over time.

use serde::{Deserialize, Serialize};

/// Columns of results.csv that only a grid with `temporal = true` has; `None` where there is nothing to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Temporal {
    /// Static camera and scene, after [`WARM_UP`] frames: standard deviation of `albedo * indirect` at a pixel over
    /// [`WINDOW`] frames, root mean square over pixels and channels, radiance.
    #[serde(
        rename = "temporal_still_std",
        with = "halflight_metrics::float::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub still_std: Option<f64>,
    /// Everything animated jumps to its last pose: frames until half of the old light is gone from the surfaces
    /// that stayed in view.
    #[serde(
        rename = "temporal_ghost_half_life_frames",
        with = "halflight_metrics::float::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub ghost_half_life: Option<f64>,
    /// After the same jump, on the surfaces that it uncovered: frames until their error is within a quarter of its
    /// final value.
    #[serde(
        rename = "temporal_recover_frames",
        with = "halflight_metrics::float::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub recover: Option<f64>,
    /// Along the animation of scene and camera: root mean square difference from the average of unfiltered frames of
    /// the same pose, over [`CHECKPOINTS`] frames, radiance.
    #[serde(
        rename = "temporal_path_rmse",
        with = "halflight_metrics::float::optional",
        skip_serializing_if = "Option::is_none"
    )]
    pub path_rmse: Option<f64>,
}

impl Temporal {
    /// Whether nothing was measured.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Frames before a static image is measured, or changed: a filter with a = 0.9 settles in 53.
pub const WARM_UP: u32 = 80;
/// Frames over which a static image is measured.
pub const WINDOW: u32 = 32;
/// Frames that are measured after a jump: the average is an exponential one in all of them.
pub const AFTER: u32 = 48;
/// Frames of a path that are compared with a reference.
pub const CHECKPOINTS: u32 = 4;
