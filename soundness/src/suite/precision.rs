//! Shaders against float64 implementations on the CPU with the same inputs, and the error of each storage format.

use glam::DVec3;
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session},
};
use halflight_frame_graph::Part;
use halflight_metrics::percentile;
use halflight_native::images::luminance;
use halflight_renderer::parameters::{Kind, Settings, Value};
use halflight_scenes::Scene;
use halflight_shared_shaders::UniformValue;
use halflight_techniques::technique;

use super::{Suite, closed_forms::SHORT_NORMAL, float16_textures, packed_textures};
use crate::{
    check::Check,
    oracle::{
        GBuffer, GatherTwin,
        pairs::{Level, answered, surfels_of},
        sectors::Gather,
        voxels::Grid,
    },
    scenes::{self, bundled},
    settings::{parameter, with_small_shadows},
};

const GROUP: &str = "precision";

pub(super) fn run(suite: &mut Suite) {
    exhaustive(suite);
    gather(suite);
    surfels(suite);
    march(suite);
    sectors(suite);
    storage(suite);
}

fn asked(suite: &Suite, technique: &str, row: &str) -> bool {
    suite.wants(GROUP, row) && suite.switches.iter().any(|s| s.technique.name == technique)
}

fn settings(name: &str, values: &[(&str, &str)]) -> Settings {
    values.iter().map(|(key, value)| (format!("{name}.{key}"), Value::parse(value))).collect()
}

fn frame<'a>(session: &Session<'a>, name: &str, settings: &Settings, size: [u32; 2]) -> Result<Frames<'a>, Error> {
    let technique = technique(name).map_err(|e| Error::BadInput(e.to_string()))?;
    let settings = with_small_shadows(settings);
    let mut frames = session.frames(&Request { technique, settings, size, seed: 0, direct: None })?;
    frames.run(0)?;
    Ok(frames)
}

/// Errors of each pixel relative to its value, or to the mean where the pixel is darker. Between nearly coplanar surfaces
/// the cosine is a small difference, whose absolute error float32 bounds but not its relative error.
fn relative_errors(exact: &[DVec3], got: &[[f32; 3]]) -> Vec<f64> {
    let mean = exact.iter().map(|v| v.element_sum() / 3.0).sum::<f64>() / exact.len().max(1) as f64;
    let error = |(exact, got): (&DVec3, &[f32; 3])| {
        let channel = |i: usize| (f64::from(got[i]) - exact[i]).abs() / exact[i].max(mean);
        channel(0).max(channel(1)).max(channel(2))
    };
    exact.iter().zip(got).map(error).collect()
}

/// The scenes of a quick run, or of a full one.
fn scenes_of(suite: &Suite) -> Vec<Scene> {
    let quick = suite.options.quick;
    let mut all = vec![scenes::lamp_court()];
    if !quick {
        all.extend(["cornell", "bars", "atrium"].map(bundled));
    }
    all
}

fn exhaustive(suite: &mut Suite) {
    let row = "exhaustive sum against float64";
    if !asked(suite, "exhaustive", row) {
        return;
    }
    for scene in scenes_of(suite) {
        let session = Session::new(suite.native, &scene).keep_all();
        for form_factor in ["eq4", "eq3"] {
            let settings = settings("exhaustive", &[("form_factor", form_factor)]);
            let check = Check::new(GROUP, row, "exhaustive", &settings).detail(scene.name.clone());
            suite.guarded(check, |check| {
                let frames = frame(&session, "exhaustive", &settings, [48, 32])?;
                let exact = GBuffer::read(&frames).exhaustive(form_factor == "eq4");
                let got = frames.read_rgb("indirect")?.unwrap_or_default();
                let worst = relative_errors(&exact, &got).into_iter().fold(0.0, f64::max);
                let reason = "float32 gives the direction between neighbours of 48 per row to 3 x 2^-24 x 48 = 9e-6; ten such errors may add up";
                Ok(vec![check.clone().bounded("largest relative error", worst, 1e-4, reason)])
            });
        }
    }
}

/// The gather of every level against the same samples in float64.
fn gather(suite: &mut Suite) {
    let row = "gather against float64";
    if !asked(suite, "hierarchical", row) {
        return;
    }
    for scene in scenes_of(suite) {
        let session = Session::new(suite.native, &scene).keep_all();
        for form_factor in ["eq4", "eq3"] {
            for disc_area in ["sample", "texel"] {
                let values = [
                    ("form_factor", form_factor),
                    ("disc_area", disc_area),
                    ("start_resolution", "full"),
                    ("levels", "3"),
                    ("samples", "16"),
                ];
                let settings = settings("hierarchical", &values);
                let check = Check::new(GROUP, row, "hierarchical", &settings).detail(scene.name.clone());
                // 61 is odd on every level, so that the last texels extend beyond the screen.
                suite.guarded(check, |check| gather_levels(&session, &settings, [80, 61], check));
            }
        }
    }
}

fn gather_levels(session: &Session, settings: &Settings, size: [u32; 2], check: &Check) -> Result<Vec<Check>, Error> {
    let frames = frame(session, "hierarchical", settings, size)?;
    let mut checks = Vec::new();
    for k in 0..3 {
        let name = format!("gather_{k}");
        let pass = frames.plan().find(&name).ok_or_else(|| Error::Failed(format!("no pass is called {name}")))?;
        let param = |field: &str| {
            let found = pass.params.iter().find(|(name, _)| *name == field).map(|(_, value)| value);
            match found {
                Some(UniformValue::F32(v)) => *v,
                Some(UniformValue::U32(v)) => *v as f32,
                _ => 0.0,
            }
        };
        let constant = |name: &str| pass.constants.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, value)| *value);
        let surfels = GBuffer::read_surfels(&frames, param("scale") as u32);
        let twin = GatherTwin {
            scale: param("scale"),
            inner_square: param("inner_square"),
            outer_square: param("outer_square"),
            disc_area: f64::from(param("disc_area")),
            discs: f64::from(param("discs")),
            stream: param("level") as u32,
            samples: constant("SAMPLES") as u32,
            point_to_disc: constant("POINT_TO_DISC") > 0.5,
            frame: frames.view().frame,
            seed: frames.view().seed,
        };
        let exact: Vec<DVec3> = (0..surfels.pixels.len()).map(|i| twin.light(&surfels, i)).collect();
        let bytes = frames.read_bytes(&format!("gathered_{k}"))?.unwrap_or_default();
        let texels: &[[f32; 4]] = bytemuck::cast_slice(&bytes);
        let got: Vec<[f32; 3]> = texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
        let mut errors = relative_errors(&exact, &got);
        let worst = percentile(&mut errors, 0.97);
        let reason =
            "as the exhaustive sum; 3 % of the receivers may have a sample whose position rounds into another texel";
        checks.push(
            check.clone().bounded("97th percentile of the relative error", worst, 1e-4, reason).detail(format!(
                "{}, level {k}; median {:.1e}",
                check.detail,
                percentile(&mut errors, 0.5)
            )),
        );
    }
    Ok(checks)
}

/// The error of packing a surface into 128 bits: the float64 sum over surfels against that over the G-buffer.
fn surfels(suite: &mut Suite) {
    let row = "packed surfels against the G-buffer, both in float64";
    if !asked(suite, "hierarchical", row) {
        return;
    }
    for scene in scenes_of(suite) {
        let session = Session::new(suite.native, &scene).keep_all();
        let settings = settings("hierarchical", &[("start_resolution", "full"), ("levels", "1"), ("samples", "1")]);
        let check = Check::new(GROUP, row, "hierarchical", &settings).detail(scene.name.clone());
        suite.guarded(check, |check| {
            let frames = frame(&session, "hierarchical", &settings, [48, 32])?;
            let whole = GBuffer::read(&frames).exhaustive(true);
            let packed: Vec<[f32; 3]> =
                GBuffer::read_surfels(&frames, 1).exhaustive(true).iter().map(|v| v.as_vec3().to_array()).collect();
            let mean = |light: &mut dyn Iterator<Item = f64>| light.sum::<f64>() / whole.len() as f64;
            let before = mean(&mut whole.iter().map(|v| f64::from(luminance(v.as_vec3().to_array()))));
            let after = mean(&mut packed.iter().map(|&v| f64::from(luminance(v))));
            let mut errors = relative_errors(&whole, &packed);
            // Radiance has 12 bits under a shared exponent and rounds by 2^-13. A G-buffer normal may be too short.
            let bound = SHORT_NORMAL + 2f64.powi(-13);
            let reason = "radiance of 12 bits rounds by 2^-13; float16 normals of the G-buffer are up to 8.5e-4 short, \
                          those of surfels are not";
            let ninety_nine = percentile(&mut errors, 0.99);
            Ok(vec![
                check.clone().bounded("relative change of the mean", (after / before - 1.0).abs(), bound, reason),
                check.clone().reported(
                    "99th percentile of the relative error",
                    ninety_nine,
                    "16 bytes per surface instead of 32",
                ),
            ])
        });
    }
}

/// Rays through the voxel grid against float64, for both ways to build coarser levels.
fn march(suite: &mut Suite) {
    let row = "rays through the voxels against float64";
    if !asked(suite, "hierarchical", row) {
        return;
    }
    /// Rounding of positions and slices, texels: float32 resolves a position among 320 texels to 3e-5 and a slice to 1e-5 of
    /// its range; the march accumulates up to a hundred steps.
    const ROUNDING: f64 = 2e-3;
    let scene = bundled("bars");
    let session = Session::new(suite.native, &scene).keep_all();
    let quick = suite.options.quick;
    let all = [("surface", "or"), ("surface", "and"), ("solid", "or"), ("auto", "and")];
    for (kind, downsampling) in all.into_iter().take(if quick { 2 } else { 4 }) {
        let values = [("visibility", kind), ("visibility_downsampling", downsampling), ("levels", "3")];
        let settings = settings("hierarchical", &values);
        let check = Check::new(GROUP, row, "hierarchical", &settings);
        suite.guarded(check, |check| {
            let (frames, levels) = answered(&session, &with_small_shadows(&settings), [160, 90], 400)?;
            let mut grid = Grid::read(&frames, 4);
            let (mut wrong, mut ties, mut asked, mut hidden) = (0, 0, 0, 0);
            for Level { surfels, pairs, seen } in &levels {
                for (&pair, &seen) in pairs.iter().zip(seen) {
                    let [receiver, source] = surfels_of(surfels, pair);
                    let hides = |slack| grid.hides(surfels, &receiver, &source, slack);
                    let tie = hides(ROUNDING) != hides(-ROUNDING);
                    ties += usize::from(tie);
                    wrong += usize::from(!tie && seen == hides(0.0));
                    hidden += usize::from(!seen);
                    asked += 1;
                }
                grid = grid.coarser(downsampling == "or");
            }
            let reason = "a bit is set or not; rays within float32 rounding of a cell border are left out";
            let check = check.clone().bounded("rays with another answer", wrong as f64, 0.0, reason);
            Ok(vec![check.detail(format!("of {asked} rays, {hidden} hidden, {ties} left out"))])
        });
    }
}

/// Slices, strides and sectors of the bitmask against float64, with both estimators, both spacings, both resolutions and
/// each number of sectors.
fn sectors(suite: &mut Suite) {
    let row = "sectors of the bitmask against float64";
    if !asked(suite, "bitmask", row) {
        return;
    }
    let scene = scenes::court();
    let session = Session::new(suite.native, &scene).keep_all();
    let all = [
        ("radiometric", "exponential", "full", 0.0, 32),
        ("radiometric", "constant", "half", 1.2, 128),
        ("published", "constant", "full", 0.0, 64),
        ("published", "exponential", "half", 1.2, 32),
    ];
    for (estimator, spacing, resolution, radius, count) in all.into_iter().take(if suite.options.quick { 2 } else { 4 })
    {
        let (radius_text, sectors) = (radius.to_string(), count.to_string());
        let values = [
            ("estimator", estimator),
            ("spacing", spacing),
            ("resolution", resolution),
            ("radius", &radius_text),
            ("sectors", &sectors),
            ("slices", "2"),
            ("steps", "6"),
            ("thickness", "0.3"),
            ("thickness_slope", "0"),
            ("denoise", "0"),
            ("storage", "float32"),
        ];
        let settings = settings("bitmask", &values);
        let check = Check::new(GROUP, row, "bitmask", &settings);
        suite.guarded(check, |check| {
            let frames = frame(&session, "bitmask", &settings, [48, 36])?;
            let scale = if resolution == "half" { 2 } else { 1 };
            let image = GBuffer::read_surfels(&frames, scale);
            let twin = Gather {
                radiometric: estimator == "radiometric",
                radius: if radius > 0.0 { radius } else { 1e15 },
                thickness: 0.3,
                slices: 2,
                steps: 6,
                exponential: spacing == "exponential",
                sectors: count,
                frame: frames.view().frame,
                seed: frames.view().seed,
            };
            let bytes = frames.read_bytes("gathered")?.unwrap_or_default();
            let texels: &[[f32; 4]] = bytemuck::cast_slice(&bytes);
            let mut errors = Vec::new();
            for (index, found) in texels.iter().enumerate().filter(|(index, _)| image.pixels[*index].depth > 0.0) {
                let exact = twin.gather(&image, index, scale);
                let [light, open] = [f64::from(found[0]), f64::from(found[3])];
                errors.push((exact.light.x - light).abs().max((exact.open - open).abs()));
            }
            let reason = "float32 angles; 3 % of the receivers may have a sample that rounds into another texel, or a \
                          position on the border of two sectors";
            let worst = percentile(&mut errors, 0.97);
            Ok(vec![
                check
                    .clone()
                    .bounded("97th percentile of the error of light and ambient visibility", worst, 2e-3, reason)
                    .detail(format!("{} receivers; median {:.1e}", errors.len(), percentile(&mut errors, 0.5))),
            ])
        });
    }
}

/// Error, time and memory of each storage format of full-resolution light, for every technique that has a choice.
fn storage(suite: &mut Suite) {
    let row = "storage of light at full resolution";
    if !suite.wants(GROUP, row) {
        return;
    }
    let scene = scenes::lamp_court();
    let session = Session::new(suite.native, &scene).keep_all();
    let techniques: Vec<_> = suite.switches.iter().map(|s| s.technique).collect();
    for technique in techniques {
        let Some(declared) = parameter(technique, "storage") else { continue };
        let Kind::Choice(names) = declared.kind else { continue };
        for &name in names {
            let settings = Settings::from([(declared.key(), Value::Text(name.into()))]);
            let check =
                Check { settings: format!("storage={name}"), ..Check::new(GROUP, row, technique.name, &settings) };
            suite.guarded(check, |check| {
                let size = [160, 90];
                let mut frames = frame(&session, technique.name, &settings, size)?;
                let light = frames.read_rgb("indirect")?.unwrap_or_default();
                let bytes = frames.plan().technique_bytes() as f64;
                let mut times = Vec::new();
                for index in 1..6 {
                    let time = frames.run(index)?;
                    let own = time.passes.iter().filter(|pass| pass.part == Part::Technique);
                    times.push(own.map(|pass| pass.milliseconds).sum::<f64>());
                }
                let exact = Settings::from([(declared.key(), Value::Text("float32".into()))]);
                let exact = frame(&session, technique.name, &exact, size)?.read_rgb("indirect")?.unwrap_or_default();
                let exact: Vec<DVec3> = exact.iter().map(|&v| glam::Vec3::from(v).as_dvec3()).collect();
                let worst = relative_errors(&exact, &light).into_iter().fold(0.0, f64::max);
                let (bound, reason) = match name {
                    "float32" => (0.0, "the same seed gives the same bits"),
                    // A driver may truncate instead of rounding, once in each texture.
                    "float16" => {
                        let [halves, packed] =
                            [float16_textures, packed_textures].map(|count| count(frames.plan()) as f64);
                        let bound = halves * 2f64.powi(-10) + packed * 2f64.powi(-12);
                        (bound, "float16 keeps 11 bits and packed light 12 in each texture that light passes through")
                    }
                    _ => (f64::INFINITY, "no claim"),
                };
                Ok(vec![
                    check.clone().bounded("largest relative error against float32", worst, bound, reason),
                    check.clone().reported(
                        "technique's time, ms",
                        percentile(&mut times, 0.5),
                        "median of 5 frames at 160x90",
                    ),
                    check.clone().reported("technique's memory, bytes", bytes, "at 160x90"),
                ])
            });
        }
    }
}
