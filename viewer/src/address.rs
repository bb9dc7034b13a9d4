//! The state as text, for links: `scene=atrium&size=1280x720&a.hierarchical.samples=16`. Only values that differ from the
//! defaults are written. A part that cannot be read is reported and left at its default.

use std::fmt::Write;

use halflight_renderer::parameters::Value;
use halflight_scenes::{Camera, bundled::NAMES};
use halflight_techniques::{
    link::{self, escape},
    parameters_of, technique,
};
use percent_encoding::percent_decode_str;

use crate::{
    error::Metric,
    state::{BOOKMARKS, Configuration, DROPPED, LightChange, State, View},
};

/// Names of the sides in keys.
const SIDES: [&str; 2] = ["a", "b"];

/// Vertical fields of view of a camera, degrees.
const FIELDS_OF_VIEW: std::ops::RangeInclusive<f32> = 1.0..=170.0;

/// Longest side of a picture, pixels: the texture size that WebGPU guarantees.
const LARGEST: u32 = 8192;

/// The state as text.
pub fn write(state: &State) -> String {
    let default = State::default();
    let mut text = link::scene(&state.scene, state.size);
    let mut add = |key: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = write!(text, "&{key}={value}");
    };
    if let Some(Camera { eye, target, up, vertical_fov_degrees }) = state.camera {
        add("eye", numbers(&eye));
        add("target", numbers(&target));
        add("up", numbers(&up));
        add("fov", vertical_fov_degrees.to_string());
    }
    for (key, camera) in &state.bookmarks {
        let Camera { eye, target, up, vertical_fov_degrees } = camera;
        add(&format!("bookmark.{key}"), numbers(&[&eye[..], target, up, &[*vertical_fov_degrees]].concat()));
    }
    for (index, LightChange { position, direction, strength }) in &state.lights {
        add(&format!("light.{index}"), numbers(&[&position[..], &direction[..], &[*strength]].concat()));
    }
    if state.view != default.view {
        add("view", escape(state.view.name()));
    }
    if let Some(stops) = state.exposure {
        add("exposure", stops.to_string());
    }
    for (name, side) in SIDES.iter().zip(&state.sides) {
        let technique = (side.technique != Configuration::default().technique).then_some(side.technique);
        text += &link::side(name, technique, &side.settings);
    }
    let mut add = |key: &str, value: String| {
        let _ = write!(text, "&{key}={value}");
    };
    if state.compare {
        add("divider", state.divider.to_string());
    }
    if state.metric != default.metric {
        add("metric", state.metric.name().into());
    }
    if !state.antialiasing {
        add("antialiasing", "off".into());
    }
    if !state.reference {
        add("truth", "off".into());
    }
    if state.frame != 0 {
        add("frame", state.frame.to_string());
    }
    if state.seed != 0 {
        add("seed", state.seed.to_string());
    }
    text
}

/// What the viewer opens with if there is no link: a scene with a sky, without indirect light beside the technique that takes
/// all of it. A has sunlit surfaces, B is in the shade, and the exposure shows both.
pub const OPENING: &str = "scene=atrium&eye=6,2,-2.2&target=-9,2,1.6&up=0,1,0&fov=62&exposure=0.2\
                           &a=none&b=radiance-cache&divider=0.5";

/// The state of a link, and a sentence for each part of it that cannot be used.
pub fn read(text: &str) -> (State, Vec<String>) {
    let mut state = State::default();
    let mut errors = Vec::new();
    for part in text.split('&').filter(|part| !part.is_empty()) {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        let (key, value) = (unescape(key), unescape(value));
        if let Err(fix) = set(&mut state, &key, &value) {
            errors.push(format!("{key}={value} of the link cannot be used: {fix}"));
        }
    }
    // Settings are checked last, because their technique may come after them.
    for (name, side) in SIDES.iter().zip(&mut state.sides) {
        let declared = parameters_of(side.technique());
        side.settings = std::mem::take(&mut side.settings)
            .into_iter()
            .filter_map(|(key, value)| {
                let parameter = declared.iter().find(|p| p.key() == key);
                let checked = match parameter {
                    Some(parameter) => parameter.check(&value).map_err(|e| e.to_string()),
                    None => Err(format!("the technique {} has no parameter {key}", side.technique)),
                };
                match checked {
                    Ok(value) => parameter.is_some_and(|p| p.default != value).then_some((key, value)),
                    Err(fix) => {
                        errors.push(format!("{name}.{key}={value} of the link cannot be used: {fix}"));
                        None
                    }
                }
            })
            .collect();
    }
    (state, errors)
}

fn set(state: &mut State, key: &str, value: &str) -> Result<(), String> {
    let wrong = |wanted: &str| format!("give {wanted}");
    let camera = |state: &mut State| state.camera.unwrap_or_default();
    match key {
        "scene" if value == DROPPED => {
            return Err("a link cannot contain a dropped scene; drop its files again".into());
        }
        "scene" => {
            NAMES.iter().find(|name| **name == value).ok_or_else(|| wrong(&NAMES.join(", ")))?;
            state.scene = value.to_owned();
        }
        "size" => {
            let sides = value.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
            state.size = sides
                .filter(|size: &[u32; 2]| size.iter().all(|v| (1..=LARGEST).contains(v)))
                .ok_or_else(|| wrong("WIDTHxHEIGHT, each from 1 to 8192"))?;
        }
        "eye" => state.camera = Some(Camera { eye: three(value)?, ..camera(state) }),
        "target" => state.camera = Some(Camera { target: three(value)?, ..camera(state) }),
        "up" => state.camera = Some(Camera { up: three(value)?, ..camera(state) }),
        "fov" => {
            let vertical_fov_degrees = number(value, *FIELDS_OF_VIEW.start(), *FIELDS_OF_VIEW.end())?;
            state.camera = Some(Camera { vertical_fov_degrees, ..camera(state) });
        }
        "view" => state.view = View::of(value),
        "exposure" => state.exposure = Some(number(value, -30.0, 30.0)?),
        "divider" => (state.compare, state.divider) = (true, number(value, 0.0, 1.0)?),
        "compare" => state.compare = switch(value)?,
        "antialiasing" => state.antialiasing = switch(value)?,
        "truth" => state.reference = switch(value)?,
        "metric" => {
            let names = Metric::ALL.map(Metric::name).join(", ");
            let named = Metric::ALL.into_iter().find(|metric| metric.name() == value);
            state.metric = named.ok_or_else(|| wrong(&names))?;
        }
        "frame" => state.frame = value.parse().map_err(|_| wrong("a whole number from 0 to 4294967295"))?,
        "seed" => state.seed = value.parse().map_err(|_| wrong("a whole number from 0 to 4294967295"))?,
        "a" => state.sides[0].technique = technique(value).map_err(|e| e.to_string())?.name,
        "b" => state.sides[1].technique = technique(value).map_err(|e| e.to_string())?.name,
        _ => match key.split_once('.') {
            Some(("a", name)) => drop(state.sides[0].settings.insert(name.to_owned(), Value::parse(value))),
            Some(("b", name)) => drop(state.sides[1].settings.insert(name.to_owned(), Value::parse(value))),
            Some(("bookmark", key)) => {
                let key = key
                    .parse()
                    .ok()
                    .filter(|key| BOOKMARKS.contains(key))
                    .ok_or_else(|| wrong("bookmark.4 to bookmark.9"))?;
                let [ex, ey, ez, tx, ty, tz, ux, uy, uz, vertical_fov_degrees] = list(value)?;
                if !FIELDS_OF_VIEW.contains(&vertical_fov_degrees) {
                    return Err(wrong("a field of view from 1 to 170 as the last number"));
                }
                let (eye, target, up) = ([ex, ey, ez], [tx, ty, tz], [ux, uy, uz]);
                state.bookmarks.insert(key, Camera { eye, target, up, vertical_fov_degrees });
            }
            Some(("light", index)) => {
                let index = index.parse().map_err(|_| wrong("light.0, light.1 and so on"))?;
                let [px, py, pz, dx, dy, dz, strength] = list(value)?;
                let change = LightChange { position: [px, py, pz], direction: [dx, dy, dz], strength };
                if !(0.0..=100.0).contains(&strength) {
                    return Err(wrong("a strength from 0 to 100"));
                }
                state.lights.retain(|(at, _)| *at != index);
                state.lights.push((index, change));
                state.lights.sort_by_key(|(at, _)| *at);
            }
            _ => return Err("there is no such key; it is ignored".into()),
        },
    }
    Ok(())
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("give on or off".into()),
    }
}

fn number(text: &str, low: f32, high: f32) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v| (low..=high).contains(v));
    number.ok_or_else(|| format!("give a number from {low} to {high}"))
}

fn list<const N: usize>(text: &str) -> Result<[f32; N], String> {
    let numbers: Vec<f32> = text.split(',').filter_map(|v| v.parse().ok()).filter(|v: &f32| v.is_finite()).collect();
    numbers.try_into().map_err(|_| format!("give {N} numbers, separated by commas"))
}

fn three(text: &str) -> Result<[f32; 3], String> {
    list(text)
}

/// Numbers separated by commas. Display writes the fewest digits that read back as the same float32.
fn numbers(values: &[f32]) -> String {
    values.iter().map(f32::to_string).collect::<Vec<_>>().join(",")
}

fn unescape(text: &str) -> String {
    percent_decode_str(text).decode_utf8_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use halflight_renderer::parameters::Kind;
    use halflight_techniques::TECHNIQUES;

    use super::*;

    fn round_trip(state: &State) {
        let text = write(state);
        assert_eq!(read(&text), (state.clone(), Vec::new()), "{text}");
    }

    #[test]
    fn the_default_state_is_short() {
        assert_eq!(write(&State::default()), "scene=cornell&size=640x360");
        assert_eq!(read(""), (State::default(), Vec::new()));
        assert_eq!(read(OPENING).1, Vec::<String>::new());
    }

    /// The links of the page's set-ups.
    #[test]
    fn every_set_up_of_the_page_is_a_link_without_an_error() {
        let page = include_str!("../../web/page/index.html").replace("&amp;", "&");
        let links: Vec<&str> = page.split("href=\"#").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        assert!(links.len() >= 4, "{links:?}");
        for link in &links {
            assert_eq!(read(link).1, Vec::<String>::new(), "{link}");
        }
        // The first one is what the page opens with.
        assert_eq!(read(links[0]), read(OPENING));
    }

    #[test]
    fn a_link_can_compare_without_a_divider() {
        let (state, errors) = read("compare=on&a=none");
        assert!(state.compare && errors.is_empty());
        assert_eq!(state.divider, State::default().divider);
        // Keys are applied in their order.
        assert!(!read("divider=0.3&compare=off").0.compare);
    }

    #[test]
    fn every_parameter_of_every_technique_survives_a_link() {
        for technique in TECHNIQUES {
            for parameter in parameters_of(technique) {
                let values = match parameter.kind {
                    Kind::Int(low, high) => vec![Value::Int(low), Value::Int(high)],
                    Kind::Float(low, high) => vec![Value::Float(low), Value::Float(0.1 * low + 0.9 * high)],
                    Kind::Choice(names) => names.iter().map(|name| Value::Text((*name).into())).collect(),
                };
                for value in values {
                    let mut side = Configuration { technique: technique.name, ..Default::default() };
                    side.set(&parameter.key(), value);
                    round_trip(&State { sides: [Configuration::default(), side], compare: true, ..State::default() });
                }
            }
        }
    }

    #[test]
    fn camera_lights_and_view_survive_a_link() {
        let camera = Camera { eye: [0.1, -2.5e-7, 1e9], target: [1.0 / 3.0, 0.0, -0.0], ..Camera::default() };
        let change = LightChange { position: [1.5, 2.0, -3.25], direction: [0.1, -1.0, 0.2], strength: 0.3 };
        for view in ["direct", "error", "truth", "surfels_8", "a b&c=d%"] {
            round_trip(&State {
                scene: "atrium".into(),
                size: [1281, 7],
                camera: Some(camera),
                bookmarks: [(4, camera), (9, Camera::default())].into(),
                lights: vec![(0, change), (3, change)],
                view: View::of(view),
                exposure: Some(-1.5),
                compare: true,
                divider: 0.123,
                antialiasing: false,
                reference: false,
                frame: 17,
                seed: u32::MAX,
                metric: Metric::Absolute,
                ..State::default()
            });
        }
    }

    #[test]
    fn parts_that_cannot_be_read_are_reported_and_ignored() {
        for (text, wanted) in [
            ("scene=moon", "scene=moon of the link cannot be used: give atrium"),
            ("scene=dropped", "drop its files again"),
            ("size=12", "WIDTHxHEIGHT"),
            ("size=0x9", "WIDTHxHEIGHT"),
            ("eye=1,2", "give 3 numbers"),
            ("eye=1,2,NaN", "give 3 numbers"),
            ("fov=200", "from 1 to 170"),
            ("a=hierarchcal", "did you mean hierarchical?"),
            ("a.hierarchical.samples=0", "out of range"),
            ("a.hierarchical.sampels=4", "has no parameter"),
            ("light.0=1,2", "give 7 numbers"),
            ("bookmark.3=0,0,0,0,0,0,0,0,0,50", "bookmark.4 to bookmark.9"),
            ("bookmark.4=0,0,0", "give 10 numbers"),
            ("bookmark.4=0,0,0,0,0,1,0,1,0,500", "a field of view from 1 to 170"),
            ("truth=maybe", "on or off"),
            ("compare=yes", "on or off"),
            ("metric=ssim", "give blocks, pixels, rmse, flip"),
            ("nonsense", "no such key"),
            ("%", "no such key"),
        ] {
            let (state, errors) = read(text);
            assert_eq!(state, State::default(), "{text}");
            assert!(errors.len() == 1 && errors[0].contains(wanted), "{text}: {errors:?}");
        }
    }
}
