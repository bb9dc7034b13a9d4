//! What a search found, in sentences.

use halflight_recommend::{Advice, Answer, NoAnswer, Point, Step};

use crate::{error::Metric, numbers::milliseconds};

/// What would help, in the words of the viewer.
pub const ADVICE: Advice = Advice {
    other_techniques: "search all techniques",
    more_time: "allow more time, or choose a smaller size",
    larger_error: "allow a larger error",
    other_metric: "another metric",
};

/// A technique with the number of its changed settings.
fn named(point: &Point) -> String {
    let title = point.technique.title;
    match point.settings.len() {
        0 => title.to_owned(),
        1 => format!("{title} with 1 changed setting"),
        count => format!("{title} with {count} changed settings"),
    }
}

fn error(point: &Point, metric: Metric) -> String {
    metric.text(metric.of_column(point.error.value))
}

/// The best so far, in a few words.
pub fn so_far(answer: &Answer, metric: Metric) -> String {
    let about = if answer.point.verified { "" } else { "about " };
    let time = milliseconds(answer.point.time_ms.value);
    format!("{}, {about}{time}, {about}{}", answer.point.technique.title, error(&answer.point, metric))
}

/// The answer: time, error, metric, and the next step up.
pub fn found(answer: &Answer, budget_ms: f64, metric: Metric, cells: usize) -> String {
    let point = &answer.point;
    let how = if point.verified { "" } else { ", predicted from a smaller size" };
    let better = match &answer.better {
        Some(Step { point, more_ms, .. }) => format!(
            "{} more would give {} ({}{})",
            milliseconds(*more_ms),
            error(point, metric),
            named(point),
            if point.verified { "" } else { "; predicted" }
        ),
        None => "nothing better was found at any time".to_owned(),
    };
    format!(
        "Best for {budget_ms} ms: {}, now B. It takes {} and has {} ({}, against all bounces{how}); {better}. {cells} \
         configurations were measured.",
        named(point),
        milliseconds(point.time_ms.value),
        error(point, metric),
        metric.title(),
    )
}

/// Why there is no answer.
pub fn not_found(reason: &NoAnswer) -> String {
    let text = reason.to_string();
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

#[cfg(test)]
mod tests {
    use halflight_recommend::{Family, Goal, Interval, Measured, Outcome, Request, Search};
    use halflight_renderer::{
        parameters::{Settings, Value},
        scene::SceneFacts,
    };
    use halflight_scenes::bundled;
    use halflight_techniques::technique;

    use super::*;

    fn point(name: &str, settings: &[(&str, i64)], time: f64, error: f64, verified: bool) -> Point {
        let interval = |value| Interval { value, low: value, high: value };
        let settings: Settings = settings.iter().map(|(key, value)| ((*key).to_owned(), Value::Int(*value))).collect();
        let technique = technique(name).expect("a technique");
        Point { technique, settings, time_ms: interval(time), error: interval(error), verified }
    }

    fn answer(verified: bool) -> Answer {
        let better = point("horizon", &[("horizon.slices", 2)], 5.25, 0.01, false);
        Answer {
            point: point("ssdo", &[("ssdo.samples", 4), ("ssdo.radius", 2)], 3.25, 0.0625, verified),
            metric: halflight_recommend::metric("block_rel_mse").expect("a metric"),
            baseline_error: 1.0,
            predicted: None,
            faster: None,
            better: Some(Step { point: better, more_ms: 2.0, error_change: -0.84 }),
            frontier: Vec::new(),
            measured: Vec::new(),
            cells: 24,
            candidates: 100.0,
            remains: None,
        }
    }

    #[test]
    fn an_answer_names_time_error_metric_and_the_next_step() {
        let text = found(&answer(true), 4.0, Metric::Blocks, 24);
        for wanted in [
            "Best for 4 ms",
            "with 2 changed settings, now B",
            "takes 3.25 ms and has 25 %",
            "relative RMSE, 4x4 blocks",
            "2.00 ms more would give 10 %",
            "with 1 changed setting; predicted",
            "24 configurations",
        ] {
            assert!(text.contains(wanted), "{wanted}: {text}");
        }
        let alone = Answer { better: None, ..answer(false) };
        let text = found(&alone, 4.0, Metric::Blocks, 24);
        assert!(text.contains("predicted from a smaller size") && text.contains("nothing better"), "{text}");
        assert!(so_far(&alone, Metric::Blocks).ends_with("about 3.25 ms, about 25 %"));
    }

    /// The sentence of a search whose cells all take this time and have this error; without indirect light it is `baseline`.
    fn sentence(techniques: &[&str], budget_ms: f64, time: f64, error: f64, baseline: f64) -> String {
        let facts = SceneFacts::of(&bundled::scene("cornell").expect("a scene"));
        let metric = halflight_recommend::metric("block_rel_mse").expect("a metric");
        let families = techniques.iter().map(|name| {
            let technique = technique(name).expect("a technique");
            Family::of(technique).restricted(technique.main)
        });
        let goal = Goal::Budget(budget_ms);
        let request = Request { goal, metric, size: [96, 54], reduced: [96, 54], most_cells: None, advice: &ADVICE };
        let mut search = match Search::new(request, facts, families.collect()) {
            Ok(search) => search,
            Err(reason) => return not_found(&reason),
        };
        while let Some(cell) = search.next(0.0) {
            let none = cell.technique.name == "none";
            search.report(match time > cell.slowest_ms && !none {
                true => Outcome::TooSlow(time),
                false => Outcome::Measured(Measured {
                    times: if none { Vec::new() } else { vec![time] },
                    passes: Vec::new(),
                    errors: vec![if none { baseline } else { error }],
                    reference_noise: 0.0,
                }),
            });
        }
        search.answer().map_or_else(|reason| not_found(&reason), |_| "an answer".into())
    }

    #[test]
    fn sentences_of_the_search_are_in_the_words_of_the_viewer() {
        assert_eq!(sentence(&["ssdo"], 4.0, 3.0, 0.1, 0.8), "an answer");
        for (text, wanted) in [
            (sentence(&["ssdo"], 4.0, 5.0, 0.1, 0.8), "allow more time, or choose a smaller size."),
            (sentence(&["ssdo"], 0.1, 5.0, 0.1, 0.8), "Nothing comes near the budget"),
            (sentence(&["gtao"], 4.0, 3.0, 0.1, 0.8), "search all techniques."),
            (sentence(&["ssdo"], 4.0, 3.0, 0.9, 0.8), "By block relMSE, showing no indirect light"),
            (sentence(&["ssdo"], 4.0, 3.0, 0.9, 0.8), "by another metric some may be."),
            (sentence(&["ssdo"], 4.0, 3.0, 0.1, 0.0), "No indirect light reaches what the camera sees"),
            (sentence(&["ssdo"], 4.0, 3.0, 0.1, f64::NAN), "point the camera at a surface of the scene."),
        ] {
            assert!(text.contains(wanted) && !text.contains("--"), "{wanted}: {text}");
        }
    }
}
