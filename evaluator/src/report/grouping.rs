//! Rows that may be compared with each other, and what tells them apart.

use serde_json::Value;

use crate::measurement::{Measurement, plain};

/// Rows up to which each is shown with its picture, passes and command; of more, those of the frontiers are.
pub const MANY: usize = 500;

/// The rows of one scene, camera, size, motion and adapter: times and errors compare only within a group. A software adapter is
/// as fast as its processor, so there the processor counts as well.
#[derive(Debug)]
pub struct Group<'a> {
    /// Index of each row in the whole results, and the row.
    pub rows: Vec<(usize, &'a Measurement)>,
    /// Parameters whose values differ between rows, full names in order of appearance.
    pub varying: Vec<String>,
    /// Parameters that are the same in all rows, with their value.
    pub fixed: Vec<(String, String)>,
    /// Whether rows of more than one technique are in it, the baseline not counted.
    pub mixed_techniques: bool,
    /// The frames that rows were measured at, in rising order. Rows without a history are the same in every frame and have
    /// none.
    pub frames: Vec<u32>,
}

/// Whether a row is there to be compared with only: it has no indirect light and no settings.
pub fn is_baseline(row: &Measurement) -> bool {
    row.technique == "none"
}

/// What rows must share to be compared: scene, camera, motion, adapter, processor and size.
fn subject(row: &Measurement) -> ([&str; 6], [u32; 2]) {
    let processor = if row.software_adapter { row.processor.as_str() } else { "" };
    ([&row.scene, &row.camera, &row.moving, &row.adapter, &row.backend, processor], [row.width, row.height])
}

/// Groups in order of first appearance. The rows of a section are a group of their own, with the baselines of their subject.
pub fn groups(rows: &[Measurement]) -> Vec<Group<'_>> {
    let mut sets = sets(rows, |row| (subject(row), row.section.as_str()));
    let baselines: Vec<(usize, &Measurement)> = rows.iter().enumerate().filter(|(_, row)| is_baseline(row)).collect();
    for ((key, section), set) in &mut sets {
        let is_missing =
            |baseline: &&(usize, &Measurement)| subject(baseline.1) == *key && baseline.1.section != *section;
        set.extend(baselines.iter().filter(is_missing).filter(|_| !section.is_empty()));
    }
    sets.into_iter().map(|(_, rows)| Group::new(rows)).collect()
}

/// As [`groups`], with the rows of all sections together.
pub fn subjects(rows: &[Measurement]) -> Vec<Group<'_>> {
    sets(rows, subject).into_iter().map(|(_, rows)| Group::new(rows)).collect()
}

/// Rows that have the same key, with their index.
fn sets<'a, K: PartialEq>(
    rows: &'a [Measurement],
    key: impl Fn(&'a Measurement) -> K,
) -> Vec<(K, Vec<(usize, &'a Measurement)>)> {
    let mut sets: Vec<(_, Vec<(usize, &Measurement)>)> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let key = key(row);
        match sets.iter_mut().find(|(known, _)| *known == key) {
            Some((_, set)) => set.push((index, row)),
            None => sets.push((key, vec![(index, row)])),
        }
    }
    sets
}

impl<'a> Group<'a> {
    fn new(rows: Vec<(usize, &'a Measurement)>) -> Self {
        let mut names: Vec<&String> = Vec::new();
        for name in rows.iter().flat_map(|(_, row)| row.parameters.keys()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        // A row of another technique does not have the parameter: that alone does not make it vary.
        let values = |name: &str| rows.iter().filter_map(|(_, row)| row.parameters.get(name)).collect::<Vec<_>>();
        let (varying, fixed): (Vec<_>, Vec<_>) =
            names.into_iter().partition(|name| values(name).windows(2).any(|pair| pair[0] != pair[1]));
        let fixed = fixed.into_iter().map(|name| (name.clone(), plain(values(name)[0]))).collect();
        let varying = varying.into_iter().cloned().collect();
        let mut techniques = rows.iter().filter(|(_, row)| !is_baseline(row)).map(|(_, row)| &row.technique);
        let first = techniques.next();
        let mixed_techniques = techniques.any(|technique| Some(technique) != first);
        let mut frames: Vec<u32> = rows.iter().filter_map(|(_, row)| row.at_frame).collect();
        frames.sort_unstable();
        frames.dedup();
        Self { rows, varying, fixed, mixed_techniques, frames }
    }

    /// Some of its rows, by position, with what tells all of its rows apart.
    pub fn subset(&self, positions: &[usize]) -> Self {
        Self {
            rows: positions.iter().map(|&position| self.rows[position]).collect(),
            varying: self.varying.clone(),
            fixed: self.fixed.clone(),
            mixed_techniques: self.mixed_techniques,
            frames: self.frames.clone(),
        }
    }

    /// Indices of its rows in the whole results.
    pub fn indices(&self) -> Vec<usize> {
        self.rows.iter().map(|(index, _)| *index).collect()
    }

    /// Whether rows were measured at several frames, so that what is best depends on the frame.
    pub fn has_several_frames(&self) -> bool {
        self.frames.len() > 1
    }

    /// Each of its frames, and the positions of the rows that count there: those measured at it, and those that are the same in
    /// every frame. One item without a frame where the rows are not of several.
    pub fn by_frame(&self) -> Vec<(Option<u32>, Vec<usize>)> {
        if !self.has_several_frames() {
            return vec![(None, (0..self.rows.len()).collect())];
        }
        let counts = |frame: u32, row: &Measurement| row.at_frame.is_none_or(|own| own == frame);
        let positions = |frame| (0..self.rows.len()).filter(|&index| counts(frame, self.rows[index].1)).collect();
        self.frames.iter().map(|&frame| (Some(frame), positions(frame))).collect()
    }

    /// Any row, the baseline only where there is nothing else: what the rows share is the same in each.
    pub fn first(&self) -> &'a Measurement {
        self.rows.iter().find(|(_, row)| !is_baseline(row)).unwrap_or(&self.rows[0]).1
    }

    /// Whether a baseline stands among configurations of something else.
    pub fn has_baseline(&self) -> bool {
        !is_baseline(self.first()) && self.rows.iter().any(|(_, row)| is_baseline(row))
    }

    /// `atrium · nave · 1280x720`.
    pub fn title(&self) -> String {
        let Measurement { scene, camera, width, height, moving, section, .. } = self.first();
        let moving = match moving.as_str() {
            "camera" => "the camera moves",
            "lights" => "after the lights turned",
            _ => "",
        };
        let parts = [section.clone(), scene.clone(), camera.clone(), format!("{width}×{height}"), moving.to_owned()];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ")
    }

    /// Short name of a row within the group: the technique if there are several, and the varying values.
    pub fn label(&self, row: &Measurement) -> String {
        let named = self.mixed_techniques || self.varying.is_empty() || is_baseline(row);
        let technique = named.then(|| row.technique.clone());
        let values = self.varying.iter().filter_map(|name| Some(value_label(name, row.parameters.get(name)?)));
        // A frame that all rows share goes without saying.
        let several = self.has_several_frames() || self.mixed_techniques;
        let frame = row.at_frame.filter(|_| several).map(|frame| format!("frame {frame}"));
        technique.into_iter().chain(values).chain(frame).collect::<Vec<_>>().join(" · ")
    }

    /// Head of a parameter's column: without the technique where that goes without saying.
    pub fn short_name<'n>(&self, parameter: &'n str) -> &'n str {
        if self.mixed_techniques { parameter } else { last_segment(parameter) }
    }
}

/// `hierarchical.levels` -> `levels`.
pub fn last_segment(parameter: &str) -> &str {
    parameter.rsplit('.').next().unwrap_or(parameter)
}

/// A setting in a few words: `levels 4`, `visibility off`, but a word that says it all stands alone: `quarter`.
pub fn value_label(parameter: &str, value: &Value) -> String {
    let name = last_segment(parameter).replace('_', " ");
    match value {
        Value::Bool(on) => format!("{name} {}", if *on { "on" } else { "off" }),
        Value::String(word) if ["full", "half", "quarter", "eq3", "eq4"].contains(&word.as_str()) => word.clone(),
        other => format!("{name} {}", plain(other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn row(technique: &str, parameters: Value) -> Measurement {
        let parameters = parameters.as_object().cloned().unwrap_or_default();
        Measurement {
            scene: "atrium".into(),
            width: 8,
            height: 4,
            technique: technique.into(),
            parameters,
            ..Measurement::default()
        }
    }

    #[test]
    fn labels_name_what_differs_and_nothing_else() {
        let rows = [
            row(
                "hierarchical",
                json!({"hierarchical.start_resolution": "half", "hierarchical.levels": 4, "hierarchical.visibility": "off"}),
            ),
            row(
                "hierarchical",
                json!({"hierarchical.start_resolution": "quarter", "hierarchical.levels": 4, "hierarchical.visibility": "auto"}),
            ),
        ];
        let groups = groups(&rows);
        let [group] = &groups[..] else { panic!("one group") };
        assert_eq!(group.label(&rows[1]), "quarter · visibility auto");
        assert_eq!(group.fixed, [("hierarchical.levels".to_string(), "4".to_string())]);
        assert_eq!((group.title().as_str(), group.short_name("hierarchical.levels")), ("atrium · 8×4", "levels"));
    }

    #[test]
    fn techniques_mix_but_adapters_do_not() {
        let mut rows = vec![
            row("hierarchical", json!({"hierarchical.levels": 4})),
            row("none", json!({})),
            row("none", json!({})),
        ];
        rows[2].adapter = "another".into();
        // The processor of a GPU's computer is no difference.
        rows[1].processor = "another".into();
        let groups = groups(&rows);
        assert_eq!(groups.iter().map(|group| group.rows.len()).collect::<Vec<_>>(), [2, 1]);
        assert!(groups[0].varying.is_empty(), "levels do not vary where only one technique has them");
        assert_eq!(groups[0].label(&rows[1]), "none");
    }

    #[test]
    fn software_adapters_of_two_processors_stay_apart() {
        let mut rows = vec![row("none", json!({})), row("none", json!({}))];
        rows.iter_mut().for_each(|row| row.software_adapter = true);
        rows[1].machine = "another".into();
        assert_eq!(groups(&rows).len(), 1);
        rows[1].processor = "another".into();
        assert_eq!(groups(&rows).len(), 2);
    }

    #[test]
    fn frames_are_named_and_motion_stays_apart() {
        let at = |frame: u32, moving: &str| Measurement {
            at_frame: Some(frame),
            moving: moving.into(),
            ..row("radiance-cache", json!({}))
        };
        let rows = [row("none", json!({})), at(8, ""), at(1, ""), row("bitmask", json!({})), at(8, "camera")];
        let groups = groups(&rows);
        let titles: Vec<String> = groups.iter().map(Group::title).collect();
        assert_eq!(titles, ["atrium · 8×4", "atrium · 8×4 · the camera moves"]);
        assert_eq!(groups[0].label(&rows[1]), "radiance-cache · frame 8");
        assert_eq!(groups[0].by_frame(), [(Some(1), vec![0, 2, 3]), (Some(8), vec![0, 1, 3])]);
        assert_eq!(groups[1].by_frame(), [(None, vec![0])]);
        assert_eq!(groups[1].label(&rows[4]), "radiance-cache");
    }

    #[test]
    fn a_section_is_a_group_with_the_baseline() {
        let mut rows = vec![row("none", json!({})), row("bitmask", json!({})), row("hierarchical", json!({}))];
        rows[2].section = "levels".into();
        let found = groups(&rows);
        let indices = |group: &Group| group.rows.iter().map(|(index, _)| *index).collect::<Vec<_>>();
        assert_eq!(found.iter().map(indices).collect::<Vec<_>>(), [vec![0, 1], vec![2, 0]]);
        assert_eq!(found[1].title(), "levels · atrium · 8×4");
        let all = subjects(&rows);
        assert_eq!(all.iter().map(indices).collect::<Vec<_>>(), [vec![0, 1, 2]]);
        assert!(all[0].mixed_techniques && !found[0].mixed_techniques);
    }

    #[test]
    fn a_baseline_does_not_mix() {
        let levels = |levels: u32| row("hierarchical", json!({ "hierarchical.levels": levels }));
        let rows = [row("none", json!({})), levels(4), levels(5)];
        let groups = groups(&rows);
        assert!(!groups[0].mixed_techniques && groups[0].has_baseline());
        assert_eq!(groups[0].first().technique, "hierarchical");
        assert_eq!([0, 1].map(|i| groups[0].label(&rows[i])), ["none", "levels 4"]);
    }
}
