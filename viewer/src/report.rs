//! The state of the running application as JSON, for hosts and tests.

use std::collections::BTreeMap;

use halflight_frame_graph::non_finite::ValueCounts;
use serde::Serialize;

/// A pass.
#[derive(Serialize)]
pub struct PassReport {
    /// Its name.
    pub name: String,
    /// Part of the frame.
    pub part: String,
    /// Median time, milliseconds; `None` before the first measurement.
    pub ms: Option<f64>,
}

/// A side.
#[derive(Serialize)]
pub struct SideReport {
    /// Its passes.
    pub passes: Vec<PassReport>,
    /// Sum over the technique's passes, milliseconds.
    pub technique_ms: Option<f64>,
    /// Milliseconds that its plan, and its textures and pipelines took when it was made.
    pub made_in: [f64; 2],
    /// Samples in its picture: one, or several that are parts of a pixel apart.
    pub samples: u32,
    /// Smallest number of measurements of any pass.
    pub rounds: usize,
    /// How they were measured.
    pub method: String,
    /// Errors of `albedo * indirect` against the reference that are known, by the name of the metric.
    pub errors: BTreeMap<String, f64>,
    /// Whether its last frame is on the screen.
    pub drawn: bool,
    /// Results of the NaN/Inf check; `None` unless the check is open.
    pub check: Option<Vec<CheckReport>>,
}

/// The NaN/Inf check of one texture or buffer.
#[derive(Serialize)]
pub struct CheckReport {
    /// Its name.
    pub name: String,
    /// Number of values.
    pub values: u64,
    /// Number of values that are not finite.
    pub not_finite: u64,
    /// Number of values that are clamped: equal to the largest number of their format.
    pub clamped: u32,
    /// Largest magnitude of the finite values.
    pub largest: f32,
}

impl CheckReport {
    /// The report of one result.
    pub fn of(found: &ValueCounts) -> Self {
        Self {
            name: found.name.clone(),
            values: found.values,
            not_finite: found.not_finite(),
            clamped: found.clamped,
            largest: found.largest,
        }
    }
}

/// The search for the best settings within a time.
#[derive(Serialize)]
pub struct BestReport {
    /// Whether it runs.
    pub running: bool,
    /// Configurations that it has measured.
    pub cells: usize,
    /// Whether it has found something better than no indirect light.
    pub so_far: bool,
    /// What the last one found, as it is shown.
    pub sentence: Option<String>,
    /// Whether that is an answer, not a reason why there is none.
    pub answered: bool,
}

/// The application.
#[derive(Serialize)]
pub struct Report {
    /// The state as text, as in links.
    pub address: String,
    /// Name of the scene that is shown.
    pub scene: String,
    /// Messages to the user, oldest first.
    pub messages: Vec<String>,
    /// Number of errors that the device reported, such as invalid commands.
    pub device_errors: usize,
    /// The sides that are shown.
    pub sides: Vec<SideReport>,
    /// Samples per pixel of the reference.
    pub reference_samples: u32,
    /// Whether it shows the benchmark page.
    pub benchmark: bool,
    /// Whether the picture of the current state is complete. Times may still be measured and the reference traced.
    pub settled: bool,
    /// Name of the adapter, from the browser or the driver.
    pub adapter: String,
    /// Exposure in use, a factor of radiance.
    pub exposure: Option<f32>,
    /// Frame number of the animation.
    pub frame: u32,
    /// Left, top, width and height of controls by name, points.
    pub marks: BTreeMap<String, [f32; 4]>,
    /// Width and height of the page, points.
    pub screen: [f32; 2],
    /// Number of configurations measured on the current picture.
    pub tried: usize,
    /// The search for the best settings.
    pub best: BestReport,
    /// Milliseconds from the start of loading the scene until it was read, until it could be drawn, and until it had its BVH;
    /// 0 for what is not yet.
    pub scene_ms: [f64; 3],
    /// Milliseconds from the start of the application to the first picture.
    pub first_picture_ms: Option<f64>,
}
