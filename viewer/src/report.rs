//! What a host or a test can ask of the running application, as JSON.

use std::collections::BTreeMap;

use halflight_frame_graph::scan::Scanned;
use serde::Serialize;

/// A measured pass.
#[derive(Serialize)]
pub struct PassReport {
    /// Its name.
    pub name: String,
    /// Part of the frame.
    pub part: String,
    /// Median, milliseconds; none before it was measured.
    pub ms: Option<f64>,
}

/// A side.
#[derive(Serialize)]
pub struct SideReport {
    /// Its passes.
    pub passes: Vec<PassReport>,
    /// Sum over the technique's passes, milliseconds.
    pub technique_ms: Option<f64>,
    /// Fewest measurements of any pass.
    pub rounds: usize,
    /// How they were measured.
    pub method: String,
    /// relMSE against the truth.
    pub rel_mse: Option<f64>,
    /// Whether its last frame is on the screen.
    pub drawn: bool,
    /// What the scan of its last frame found; none where it was not asked for.
    pub scanned: Option<Vec<ScannedReport>>,
}

/// What a texture or buffer held.
#[derive(Serialize)]
pub struct ScannedReport {
    /// Its name.
    pub name: String,
    /// Values that were looked at.
    pub values: u64,
    /// Values that are not finite.
    pub not_finite: u64,
    /// Values at the largest number of their format.
    pub clamped: u32,
    /// Largest magnitude of the finite ones.
    pub largest: f32,
}

impl ScannedReport {
    /// Of a line of the scan.
    pub fn of(found: &Scanned) -> Self {
        Self {
            name: found.name.clone(),
            values: found.values,
            not_finite: found.not_finite(),
            clamped: found.clamped,
            largest: found.largest,
        }
    }
}

/// The application as it stands.
#[derive(Serialize)]
pub struct Report {
    /// The state as a link has it.
    pub address: String,
    /// Name of the scene that is shown.
    pub scene: String,
    /// What the page says to its user, oldest first.
    pub messages: Vec<String>,
    /// The sides that are shown.
    pub sides: Vec<SideReport>,
    /// Samples a pixel of the truth.
    pub truth_samples: u32,
    /// The truth's own noise, as relMSE.
    pub truth_noise: Option<f64>,
    /// Whether everything is drawn as the state has it; times may still be measured and the truth traced.
    pub settled: bool,
    /// Adapter, as the browser or driver names it.
    pub adapter: String,
    /// Exposure that is in use.
    pub exposure: Option<f32>,
    /// Number of the frame: where what moves in the scene stands.
    pub frame: u32,
    /// Places of controls by name: left, top, width, height in points.
    pub marks: BTreeMap<String, [f32; 4]>,
    /// Width and height of the page, points.
    pub screen: [f32; 2],
    /// Points that were tried on the current picture.
    pub tried: usize,
    /// Milliseconds from the start of the application to the first picture.
    pub first_picture_ms: Option<f64>,
}
