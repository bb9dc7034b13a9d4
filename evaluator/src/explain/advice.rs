//! One sentence on what would help.

use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_techniques::radiance_cache::RadianceCache;

use super::{
    ELSEWHERE, EVERYWHERE, FURTHER, INTERPOLATION, REST, SHOWN, UNTRACED,
    chain::{Link, Moments},
};

/// What the largest part of the error is, whether more samples can help, and what to try.
pub fn advice(technique: &Technique, settings: &Settings, links: &[Link], moments: &Moments) -> String {
    let share = |name: &str| {
        let index = links.iter().position(|link| link.name == name);
        index.map_or(0.0, |index| moments.shares[index].value)
    };
    let Some((largest, part)) =
        links.iter().map(|link| (link.name, share(link.name))).max_by(|a, b| a.1.total_cmp(&b.1))
    else {
        return "there is nothing to explain".into();
    };
    if moments.square.value <= 2.0 * moments.square.standard_error {
        return "the error is not larger than the noise of the reference: raise --samples-per-pixel".into();
    }
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let complete = (technique.complete)(settings).unwrap_or_default();
    let has = |name: &str| complete.get(&format!("{}.{name}", technique.name));
    let tries = match largest {
        "noise" if has("samples").is_some() => "try more samples, or a filter over frames".to_owned(),
        "noise" => "try a filter over frames".to_owned(),
        "direct light" => "try a larger direct.shadow_map_size".to_owned(),
        "estimator and hierarchy" => {
            let mut options = Vec::new();
            if has("disc_area") == Some(&Value::parse("sample")) {
                options.push("disc_area=texel");
            }
            if has("start_resolution").is_some_and(|v| *v != Value::parse("full")) {
                options.push("a finer start_resolution");
            }
            if has("levels").is_some() {
                options.push("another number of levels");
            }
            if options.is_empty() { "no setting of it helps".to_owned() } else { format!("try {}", options.join(", ")) }
        }
        "missing visibility" => match has("visibility") {
            Some(v) if *v == Value::parse("off") => "try visibility=auto".to_owned(),
            Some(_) => "its own test leaves this: try a finer start_resolution".to_owned(),
            None => "no setting of it tests for occluders between a surface and its source".to_owned(),
        },
        EVERYWHERE | SHOWN | ELSEWHERE => {
            let options = ["voxel_resolution", "light_view_size"].into_iter().filter(|name| has(name).is_some());
            let options: Vec<_> = options.chain(has("start_resolution").map(|_| "start_resolution")).collect();
            format!("try a finer {}", options.join(", "))
        }
        UNTRACED => "wait for more frames, or try more rays".to_owned(),
        INTERPOLATION => "try a smaller spacing".to_owned(),
        FURTHER if technique.name == RadianceCache::TECHNIQUE => "try more links".to_owned(),
        FURTHER => "try another number of bounces".to_owned(),
        REST => "no setting of it helps".to_owned(),
        _ => "no method that reads one screen can add it: show more of the scene, or use one that has other views"
            .to_owned(),
    };
    let samples = match share("noise") {
        _ if largest == "noise" || links.iter().any(|link| link.name == UNTRACED) => String::new(),
        noise if noise < 0.05 => "more samples cannot help: ".into(),
        noise => format!("more samples can take away {} at most: ", percent(noise)),
    };
    format!("{samples}{} of the squared error is {}; {tries}", percent(part), said(largest))
}

/// A link's name inside a sentence.
fn said(link: &str) -> &str {
    match link {
        "missing visibility" => "light that passes through occluders",
        "off-screen and hidden light" => "light from surfaces that the screen does not show",
        "estimator and hierarchy" => "the estimator and its hierarchy",
        "direct light" => "the rendered direct light",
        INTERPOLATION => "the interpolation between records",
        REST => "light that records find wrong: at hits, in links, and within a pixel",
        FURTHER => "that of further bounces",
        other => other,
    }
}
