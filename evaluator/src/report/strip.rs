//! One picture a level, side by side, where a group has rows that gather a single level (Soler et al. 2009, Figure 4).

use super::grouping::{Group, last_segment};
use crate::measurement::{Measurement, plain};

/// Pictures side by side.
#[derive(Debug)]
pub struct Strip<'a> {
    /// What its rows share beside the level; empty where nothing else varies.
    pub name: String,
    /// Row, title and path of each picture; the truth has no row.
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
                let truth = row.image("truth_indirect").map(|picture| (None, "path-traced truth".to_owned(), picture));
                strips.push(Strip { name, pictures: truth.into_iter().collect() });
                let last = strips.len() - 1;
                &mut strips[last]
            }
        };
        strip.pictures.push((Some(index), title, picture));
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
        let told: Vec<_> = strips(&groups(&rows)[0])
            .iter()
            .map(|strip| {
                let pictures = strip.pictures.iter().map(|(index, title, _)| (*index, title.clone()));
                (strip.name.clone(), pictures.collect::<Vec<_>>())
            })
            .collect();
        let strip = |name: &str, first: usize| {
            let titles = ["path-traced truth", "all levels", "level 0"].map(str::to_owned);
            let [truth, all, level] = titles;
            (name.to_owned(), vec![(None, truth), (Some(first), all), (Some(first + 1), level)])
        };
        assert_eq!(told, [strip("samples 16", 0), strip("samples 64", 2)]);
        assert!(strips(&groups(&rows[..1])[0]).is_empty());
    }
}
