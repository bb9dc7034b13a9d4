//! A grid as the text of a grid file.

use std::fmt::Write as _;

use halflight_renderer::parameters::Value;

use super::{Grid, Moving};

impl Grid {
    /// The grid as the text of a grid file, in one notation whatever the file looked like. Reading it gives the same
    /// cells in the same order.
    pub fn to_toml(&self) -> String {
        // Destructured, so that a new field cannot be left out.
        let Self {
            name,
            preset,
            scenes,
            sizes,
            frames,
            seed,
            direct_from_truth,
            truth_samples,
            truth_rel_error,
            bounces,
            temporal,
            sweeps,
            only,
        } = self;
        let scenes = list(scenes.iter().map(|path| path.display().to_string()));
        let sizes = list(sizes.iter().map(|[width, height]| format!("{width}x{height}")));
        let mut text = format!("name = {}\nscenes = {scenes}\nsize = {sizes}\n", quoted(name));
        let mut line = |line: std::fmt::Arguments| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{line}");
        };
        if !preset.is_empty() {
            line(format_args!("preset = {}", quoted(preset)));
        }
        line(format_args!("frames = {frames}\nseed = {seed}"));
        line(format_args!("direct = \"{}\"", if *direct_from_truth { "truth" } else { "rendered" }));
        line(format_args!("truth_samples = {truth_samples}\ntruth_rel_error = {truth_rel_error:?}"));
        line(format_args!("bounces = {bounces}\ntemporal = {temporal}"));
        if let Some(only) = only {
            line(format_args!("only = {}", list(only.iter().cloned())));
        }
        for sweep in sweeps {
            line(format_args!("\n[[sweep]]\ntechnique = {}", quoted(sweep.technique.name)));
            if !sweep.section.is_empty() {
                line(format_args!("section = {}", quoted(&sweep.section)));
            }
            if sweep.moving != [Moving::Nothing] {
                line(format_args!("moving = {}", list(sweep.moving.iter().map(Moving::to_string))));
            }
            if !sweep.at_frames.is_empty() {
                line(format_args!("at_frames = {:?}", sweep.at_frames));
            }
            let fixed = sweep.fixed.iter().map(|(key, one)| format!("{} = {}", quoted(key), value(one)));
            for line_of_fixed in heading("[sweep.fixed]", fixed) {
                line(format_args!("{line_of_fixed}"));
            }
            let lists = sweep.lists.iter().map(|(key, values)| {
                let values: Vec<String> = values.iter().map(value).collect();
                format!("{} = [{}]", quoted(key), values.join(", "))
            });
            for line_of_list in heading("[sweep.grid]", lists) {
                line(format_args!("{line_of_list}"));
            }
        }
        text
    }
}

/// The lines under their heading; nothing where there are none.
fn heading(heading: &str, lines: impl Iterator<Item = String>) -> Vec<String> {
    let lines: Vec<String> = lines.collect();
    if lines.is_empty() { lines } else { [vec![heading.to_owned()], lines].concat() }
}

fn list(texts: impl Iterator<Item = String>) -> String {
    format!("[{}]", texts.map(|text| quoted(&text)).collect::<Vec<_>>().join(", "))
}

/// TOML's basic strings are escaped as those of JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn value(value: &Value) -> String {
    match value {
        Value::Text(text) => quoted(text),
        // With a point or an exponent, so that it stays a number with a fraction.
        Value::Float(number) => format!("{number:?}"),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    #[test]
    fn the_text_of_a_grid_gives_the_same_cells_in_the_same_order() {
        let text = "scenes = ['a \"b\".toml', 'c']\nsize = ['64x36', '8x8']\nframes = 3\nseed = 7\ndirect = 'truth'\n\
                    truth_rel_error = 0.02\npreset = 'p'\nonly = ['00ff', '0a']\n\
                    [[sweep]]\ntechnique = 'hierarchical'\nfixed = { radius = 20 }\n\
                    grid = { start_resolution = ['half', 'quarter'], radius = [1, 2.5, 1e-7], levels = [4] }\n\
                    [[sweep]]\ntechnique = 'none'\nat_frames = [1, 8]\nmoving = ['camera', 'nothing']\nsection = 'a \"b\"'\n";
        let read = |text: &str| Grid::parse(Path::new("g.toml"), text).unwrap();
        let (first, again) = (read(text), read(&read(text).to_toml()));
        assert_eq!(again.to_toml(), first.to_toml());
        let of = |grid: &Grid| {
            let cells: Vec<_> = grid
                .cells()
                .map(|cell| (cell.technique.name, cell.settings, cell.moving, cell.at_frame, cell.section))
                .collect();
            (grid.name.clone(), grid.scenes.clone(), grid.sizes.clone(), grid.only.clone(), grid.truth_rel_error, cells)
        };
        assert_eq!(of(&again), of(&first));
        assert_eq!((first.len(), first.scenes[0].to_str()), (10, Some("a \"b\".toml")));
        let radius = |index: usize| first.cells().nth(index).unwrap().settings["hierarchical.radius"].to_string();
        assert_eq!([radius(0), radius(1), radius(2), radius(3)], ["1", "2.5", "0.0000001", "1"]);
    }
}
