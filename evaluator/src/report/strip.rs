//! Pictures side by side: one a level, where a group has rows that gather a single level (Soler et al. 2009, Figure 4); one a
//! row with its error, where the rows belong to a figure of a paper.

use halflight_metrics::MetricId;

use super::grouping::{Group, last_segment};
use crate::format::number;
use crate::measurement::{Measurement, plain};

/// Pictures side by side.
#[derive(Debug)]
pub struct Strip<'a> {
    /// What its rows share beside the level; empty where nothing else varies.
    pub name: String,
    /// Row, title and path of each picture; the reference has no row.
    pub pictures: Vec<(Option<usize>, String, &'a str)>,
}

/// One strip for each combination of the other settings; none where `only_level` does not vary.
pub fn strips<'a>(group: &Group<'a>) -> Vec<Strip<'a>> {
    let Some(only) = group.varying.iter().find(|name| last_segment(name) == "only_level") else { return vec![] };
    let mut strips: Vec<Strip> = Vec::new();
    for &(index, row) in &group.rows {
        let (Some(level), Some(picture)) = (row.parameters.get(only), row.image("indirect")) else { continue };
        let title = match plain(level).as_str() {
            "all" => "all levels".to_owned(),
            level => format!("level {level}"),
        };
        let name = label_without(group, row, only);
        let strip = match strips.iter().position(|strip| strip.name == name) {
            Some(known) => &mut strips[known],
            None => {
                let truth =
                    row.image("truth_indirect").map(|picture| (None, "path-traced reference".to_owned(), picture));
                strips.push(Strip { name, pictures: truth.into_iter().collect() });
                let last = strips.len() - 1;
                &mut strips[last]
            }
        };
        strip.pictures.push((Some(index), title, picture));
    }
    strips
}

/// What a preset ends with, but for a number, where its rows are the pictures of a paper's figure.
const FIGURE: &str = "_fig";
/// Presets that show their figure another way, or are a table that the paper calls a figure.
const NO_STRIP: [&str; 3] = [super::slice::PRESET, "soler2009_fig6", "soler2010_fig9"];

/// For a preset that is a figure, one strip for each reference (of an occlusion radius, or of all light): the reference,
/// then every row that is compared with it, with its error.
pub fn figures<'a>(group: &Group<'a>) -> Vec<Strip<'a>> {
    let mut strips: Vec<Strip> = Vec::new();
    let of_figure = |row: &Measurement| row.preset.contains(FIGURE) && !NO_STRIP.contains(&row.preset.as_str());
    for &(index, row) in group.rows.iter().filter(|(_, row)| of_figure(row)) {
        let is_light = row.errors.get(MetricId::OcclusionRmse).is_none();
        let kind = if is_light { "indirect" } else { "final" };
        let (Some(picture), Some(truth)) = (row.image(kind), row.image(&format!("truth_{kind}"))) else { continue };
        let strip = match strips.iter().position(|strip| strip.pictures[0].2 == truth) {
            Some(known) => &mut strips[known],
            None => {
                let name = if is_light { "Indirect light (albedo · indirect)" } else { "Ambient visibility" };
                let title = if is_light { "path-traced reference" } else { "traced ambient visibility" };
                strips.push(Strip { name: name.into(), pictures: vec![(None, title.into(), truth)] });
                let last = strips.len() - 1;
                &mut strips[last]
            }
        };
        let value = |id| row.errors.get(id);
        let error = value(MetricId::OcclusionRmse).or(value(MetricId::IndirectRmse));
        let bias = value(MetricId::OcclusionBias).or(value(MetricId::IndirectBias));
        let values = [("RMSE", error, ""), ("bias", bias, "+"), ("noise", value(MetricId::NoiseStd), "")];
        let values = values.iter().filter_map(|(name, value, plus)| {
            let value = (*value)?;
            Some(format!("{name} {}{}", if value > 0.0 { plus } else { "" }, number(value, 2)))
        });
        strip.pictures.push((
            Some(index),
            format!("{}: {}", group.label(row), values.collect::<Vec<_>>().join(", ")),
            picture,
        ));
    }
    strips
}

fn label_without(group: &Group, row: &Measurement, only: &str) -> String {
    let mut row = row.clone();
    row.parameters.remove(only);
    group.label(&row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::grouping::groups;
    use serde_json::json;

    #[test]
    fn a_figure_has_a_strip_for_each_reference() {
        let row = |technique: &str, radius: u32, rmse: f64| {
            let mut errors = halflight_metrics::Values::default();
            errors.set(MetricId::OcclusionRmse, Some(rmse));
            Measurement {
                technique: technique.into(),
                preset: "therrien2023_fig9".into(),
                parameters: json!({ format!("{technique}.radius"): radius }).as_object().cloned().unwrap_or_default(),
                images: json!({"final": format!("{technique}{radius}.png"), "truth_final": format!("t{radius}.png")})
                    .as_object()
                    .cloned()
                    .unwrap_or_default(),
                errors,
                ..Measurement::default()
            }
        };
        let mut rows = vec![row("gtao", 1, 0.2), row("gtao", 2, 0.3), row("bitmask", 1, 0.1), row("bitmask", 2, 0.25)];
        let found: Vec<Vec<_>> = figures(&groups(&rows)[0])
            .into_iter()
            .map(|strip| strip.pictures.into_iter().map(|(row, title, _)| (row, title)).collect())
            .collect();
        let strip = |radius: u32, first: usize, errors: [&str; 2]| {
            let titles =
                [("gtao", errors[0]), ("bitmask", errors[1])].map(|(t, e)| format!("{t} · radius {radius}: RMSE {e}"));
            let [gtao, bitmask] = titles;
            vec![(None, "traced ambient visibility".to_owned()), (Some(first), gtao), (Some(first + 2), bitmask)]
        };
        assert_eq!(found, [strip(1, 0, ["0.20", "0.10"]), strip(2, 1, ["0.30", "0.25"])]);
        // Rows of no figure have none.
        rows.iter_mut().for_each(|row| row.preset = "therrien2023_table1".into());
        assert!(figures(&groups(&rows)[0]).is_empty());
    }

    #[test]
    fn each_combination_has_its_strip() {
        let row = |samples: u32, level: &str| Measurement {
            technique: "hierarchical".into(),
            parameters: json!({"hierarchical.samples": samples, "hierarchical.only_level": level})
                .as_object()
                .cloned()
                .unwrap_or_default(),
            images: json!({"indirect": "i.png", "truth_indirect": "t.png"}).as_object().cloned().unwrap_or_default(),
            ..Measurement::default()
        };
        let rows = [row(16, "all"), row(16, "0"), row(64, "all"), row(64, "0")];
        let found: Vec<_> = strips(&groups(&rows)[0])
            .iter()
            .map(|strip| {
                let pictures = strip.pictures.iter().map(|(index, title, _)| (*index, title.clone()));
                (strip.name.clone(), pictures.collect::<Vec<_>>())
            })
            .collect();
        let strip = |name: &str, first: usize| {
            let titles = ["path-traced reference", "all levels", "level 0"].map(str::to_owned);
            let [truth, all, level] = titles;
            (name.to_owned(), vec![(None, truth), (Some(first), all), (Some(first + 1), level)])
        };
        assert_eq!(found, [strip("samples 16", 0), strip("samples 64", 2)]);
        assert!(strips(&groups(&rows[..1])[0]).is_empty());
    }
}
