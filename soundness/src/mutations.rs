//! Deliberate bugs. Each is a textual edit of linked WGSL, and at least one row must turn red with it: a suite that stays
//! green with a bug does not test for it.

use halflight_evaluator::{
    Error,
    format::number,
    report::document::table::{Cell, Column, Table as Printed, TableRow},
};
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_shared_shaders::{SHADERS, Shader};
use serde::Serialize;

use crate::{
    check::Check,
    suite::{Options, Suite},
};

/// A bug.
#[derive(Clone, Copy, Debug)]
pub struct Mutation {
    /// What is wrong.
    pub name: &'static str,
    /// Text of the linked shaders and its replacement, in every shader that contains it.
    pub edits: &'static [(&'static str, &'static str)],
    /// Rows that run to catch it. Others may turn red as well.
    pub rows: &'static [&'static str],
    /// Why no row can catch the bug on some adapters.
    pub hidden_by: Option<&'static str>,
}

impl Mutation {
    /// The shaders that the bug changes, each with its text.
    ///
    /// # Errors
    /// Where an edit matches no shader.
    fn edited(&self) -> Result<Vec<(&'static Shader, String)>, Error> {
        if let Some((from, _)) = self.edits.iter().find(|(from, _)| !SHADERS.iter().any(|s| s.source.contains(from))) {
            return Err(Error::Failed(format!("\"{}\": no shader contains `{from}`: update the edit", self.name)));
        }
        let edit = |shader: &Shader| {
            self.edits.iter().fold(shader.source.to_owned(), |source, (from, to)| source.replace(from, to))
        };
        let all = SHADERS.iter().map(|shader| (shader, edit(shader)));
        Ok(all.filter(|(shader, source)| source != shader.source).collect())
    }
}

/// Bugs that renderers have had.
pub const MUTATIONS: &[Mutation] = &[
    Mutation {
        name: "r^2 is clamped instead of the disc's form",
        edits: &[
            ("let square = dot(toward, toward);", "let square = max(dot(toward, toward), 1e-3);"),
            ("select(0.0, source, point_to_disc)", "0.0"),
        ],
        rows: &["against float64"],
        hidden_by: None,
    },
    Mutation {
        name: "rings are half a pixel off",
        edits: &[("let centre = vec2f(id) + 0.5;", "let centre = vec2f(id);")],
        rows: &["gather against float64", "mirroring"],
        hidden_by: None,
    },
    Mutation {
        name: "the area of coarse texels lacks its 4^k",
        edits: &[("view.display_size) * params.disc_area;", "view.display_size);")],
        rows: &["gather against float64"],
        hidden_by: None,
    },
    Mutation {
        name: "the emitter's cosine is dropped",
        edits: &[("let source = source_cosine *", "let source = distance * normal_length *")],
        rows: &["against float64", "a plane does not light itself"],
        hidden_by: None,
    },
    Mutation {
        name: "interpolated normals are not of unit length",
        edits: &[("normal = normalize(normal) *", "normal = normal *")],
        rows: &["normals of unit length"],
        hidden_by: None,
    },
    Mutation {
        name: "light of samples outside the screen is distributed to the others",
        edits: &[
            ("var sum = vec3f(0.0);\n    {", "var sum = vec3f(0.0);\n    var inside = 0.0;\n    {"),
            (
                "let words = textureLoad(surfels, vec2i(floor(point)), 0);",
                "let words = textureLoad(surfels, vec2i(floor(point)), 0);\n            \
                 inside += select(0.0, 1.0, all(abs(point - receiver.half_extent) < receiver.half_extent));",
            ),
            ("vec4f(sum * params.discs, 1.0)", "vec4f(sum * params.discs * f32(SAMPLES) / max(inside, 1.0), 1.0)"),
        ],
        rows: &["gather against float64"],
        hidden_by: None,
    },
    Mutation {
        name: "voxels: OR where AND was asked for",
        edits: &[
            ("select(upper & lower, upper | lower, ANY_CHILD)", "select(upper | lower, upper | lower, ANY_CHILD)"),
            (
                "select(both.x & both.y, both.x | both.y, ANY_CHILD)",
                "select(both.x | both.y, both.x | both.y, ANY_CHILD)",
            ),
        ],
        rows: &["rays through the voxels"],
        hidden_by: None,
    },
    Mutation {
        name: "sky is read as a surface at depth 0",
        edits: &[("SKY_DEPTH: f32 = 0.0;", "SKY_DEPTH: f32 = -1.0;")],
        rows: &["all sky", "one triangle", "albedo 1"],
        hidden_by: None,
    },
    Mutation {
        name: "upsampling gives zero where all weights vanish",
        edits: &[("var result = select(sum.closest.rgb,", "var result = select(vec3f(0.0),")],
        rows: &["no surface in view is without light"],
        hidden_by: None,
    },
    Mutation {
        name: "history is not rejected",
        edits: &[(
            "let weight = select(0.0, share.x * share.y, shows(words, tap, surface));",
            "let weight = share.x * share.y;",
        )],
        rows: &["what was hidden in the frame before"],
        hidden_by: None,
    },
    Mutation {
        name: "radiance cache: shares of coarser levels do not sum to one",
        edits: &[("vec4f(light + left * last,", "vec4f(light + last,")],
        rows: &["a lit floor before a wall"],
        hidden_by: None,
    },
    Mutation {
        name: "radiance cache: rays count twice",
        edits: &[("let all = samples + f32(count);", "let all = samples + 2.0 * f32(count);")],
        rows: &["a lit floor before a wall"],
        hidden_by: None,
    },
    Mutation {
        name: "radiance cache: records outlive a cut",
        edits: &[("if previous.valid == 0u || age >", "if age >")],
        rows: &["before a cut"],
        hidden_by: None,
    },
    Mutation {
        name: "history outlives a cut",
        edits: &[("if previous.valid != 0u && position_before.z < 0.0 {", "if position_before.z < 0.0 {")],
        rows: &["before a cut", "frames before a still image"],
        hidden_by: None,
    },
    Mutation {
        name: "a gap between rings",
        edits: &[(
            "let step = (params.outer_square - params.inner_square) / f32(SAMPLES);",
            "let step = 0.9 * (params.outer_square - params.inner_square) / f32(SAMPLES);",
        )],
        rows: &["gather against float64"],
        hidden_by: None,
    },
    Mutation {
        name: "rings overlap",
        edits: &[("var square = params.inner_square + step *", "var square = 0.8 * params.inner_square + step *")],
        rows: &["gather against float64"],
        hidden_by: None,
    },
    Mutation {
        name: "float16 overflows: nothing is clamped on store",
        edits: &[
            ("result = min(result, vec3f(", "result = max(result, 0.0 * vec3f("),
            ("radiance = min(radiance, vec3f(", "radiance = max(radiance, 0.0 * vec3f("),
        ],
        rows: &["radiance 1e30", "radiance 1e6"],
        hidden_by: Some("an adapter that saturates float16 stores 65,504 with and without the clamp"),
    },
    Mutation {
        name: "radiance may be the largest float: sums overflow",
        edits: &[("LARGEST_RADIANCE: f32 = 1e30;", "LARGEST_RADIANCE: f32 = 3.4e38;")],
        rows: &["radiance 1e30", "radiance of the largest float"],
        hidden_by: None,
    },
    Mutation {
        name: "0 / 0 where a point meets itself",
        edits: &[("/ max(denominator, ", "/ max(denominator, 0.0 * ")],
        rows: &["1 pixel", "albedo 1", "coincident"],
        hidden_by: None,
    },
    Mutation {
        name: "albedo is applied twice",
        edits: &[(
            "textureLoad(albedo, pixel, 0).rgb * incident",
            "textureLoad(albedo, pixel, 0).rgb * textureLoad(albedo, pixel, 0).rgb * incident",
        )],
        rows: &["the final image is the sum of its parts"],
        hidden_by: None,
    },
    Mutation {
        name: "a tolerance in scene units",
        edits: &[("tan_half_fov_vertical * coarse_scale * depth)", "tan_half_fov_vertical * coarse_scale * 4.0)")],
        rows: &["world units"],
        hidden_by: None,
    },
    Mutation {
        name: "sectors of the bitmask are rounded down",
        edits: &[("let lowest = rounding - 0.5;", "let lowest = -0.5;")],
        rows: &["sectors of the bitmask"],
        hidden_by: None,
    },
    Mutation {
        name: "all slices of the bitmask weigh the same",
        edits: &[("slice.weight * (slice.cos_angle", "1.0 * (slice.cos_angle")],
        rows: &["sectors of the bitmask"],
        hidden_by: None,
    },
    Mutation {
        name: "chosen virtual point lights lack the weight of those not chosen",
        edits: &[("standing_for(i, stride / importance)", "standing_for(i, 1.0)")],
        rows: &["absolute units"],
        hidden_by: None,
    },
    Mutation {
        name: "a stride over lights without its weight",
        edits: &[("return sum * f32(params.stride);", "return sum;")],
        rows: &["absolute units"],
        hidden_by: None,
    },
    Mutation {
        name: "every pixel draws the same random numbers",
        edits: &[("vec3f(words >> vec3u(8u))", "0.0 * vec3f(words >> vec3u(8u))")],
        rows: &["gather against float64"],
        hidden_by: None,
    },
];

/// Result of one bug.
#[derive(Clone, Debug, Serialize)]
pub struct Caught {
    /// The bug.
    pub name: &'static str,
    /// Number of edited shaders.
    pub shaders: usize,
    /// Number of red checks.
    pub red: usize,
    /// Number of checks.
    pub checks: usize,
    /// The red check that exceeds its bound most: row, technique, metric, value and bound.
    pub by: Option<String>,
    /// Why no row may catch the bug on this adapter.
    pub hidden_by: Option<&'static str>,
}

impl Caught {
    /// Whether no row caught the bug although one should.
    pub fn is_missed(&self) -> bool {
        self.by.is_none() && self.hidden_by.is_none()
    }
}

/// Runs the rows of each wanted bug, each on a new device.
///
/// # Errors
/// Where an edit matches no shader or breaks one, or there is no adapter.
pub fn run(adapter: &AdapterChoice, wanted: impl Fn(&Mutation) -> bool, quick: bool) -> Result<Vec<Caught>, Error> {
    let mut all = Vec::new();
    for mutation in MUTATIONS.iter().filter(|mutation| wanted(mutation)) {
        let native = NativeGpu::open(adapter).map_err(|e| Error::BadInput(e.to_string()))?;
        let edited = mutation.edited()?;
        let shaders = edited.len();
        for (shader, source) in edited {
            native.gpu.replace_source(shader, source);
        }
        let rows = mutation.rows.iter().map(|row| (*row).to_owned()).collect();
        let table = Suite::run(&native, &Options { techniques: Vec::new(), quick, rows })?;
        // A shader that does not compile would be red for the wrong reason.
        let red: Vec<_> = table
            .checks
            .iter()
            .filter(|check| check.is_red() && !["panics", "errors"].contains(&check.metric))
            .collect();
        if let Some(broken) = table.checks.iter().find(|check| check.metric == "panics") {
            return Err(Error::Failed(format!("\"{}\" does not compile: {}", mutation.name, broken.detail)));
        }
        let over = |check: &&&Check| {
            let bound = check.bound.unwrap_or(1.0);
            if check.worst.is_nan() || bound <= 0.0 { f64::INFINITY } else { check.worst / bound }
        };
        let clearest = red.iter().max_by(|a, b| over(a).total_cmp(&over(b)));
        all.push(Caught {
            name: mutation.name,
            shaders,
            red: red.len(),
            checks: table.checks.len(),
            hidden_by: mutation.hidden_by,
            by: clearest.map(|check| {
                let bound = number(check.bound.unwrap_or(f64::NAN), 3);
                format!(
                    "{} ({} {}): {} {} over {bound}",
                    check.row,
                    check.technique,
                    check.settings,
                    check.metric,
                    number(check.worst, 3)
                )
            }),
        });
    }
    Ok(all)
}

/// The table of bugs.
pub fn table(all: &[Caught]) -> Printed {
    let row = |caught: &Caught| TableRow {
        row: None,
        cells: vec![
            Cell::text(caught.name),
            Cell::text(match (&caught.by, caught.hidden_by) {
                (Some(_), _) => "caught",
                (None, Some(_)) => "hidden by this adapter",
                (None, None) => "NOT CAUGHT",
            }),
            Cell::text(format!("{} of {}", caught.red, caught.checks)),
            Cell::text(caught.by.clone().unwrap_or_else(|| caught.hidden_by.unwrap_or_default().into())),
        ],
    };
    Printed {
        title: "deliberate bugs".into(),
        caption: "Each bug is an edit of the shaders' text. The rows run with it on a new device.".into(),
        columns: ["bug", "result", "red checks", "the clearest one"].map(Column::text).into(),
        rows: all.iter().map(row).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::MUTATIONS;

    #[test]
    fn every_bug_finds_the_text_that_it_edits() {
        for mutation in MUTATIONS {
            let edited = mutation.edited().unwrap_or_else(|error| panic!("{error}"));
            assert!(!edited.is_empty(), "{} changes nothing", mutation.name);
        }
    }
}
