//! Controls of parameters (from their declarations), presets, lights and camera.

use eframe::egui::{Button, CollapsingHeader, ComboBox, DragValue, RichText, Slider, TextEdit, Ui, vec2};
use halflight_renderer::parameters::{Kind, Parameter, Role, Value};
use halflight_scenes::{Camera, Light};
use halflight_techniques::{TECHNIQUES, parameters_of, preset::Preset};

use crate::{
    export::presets_of,
    marks::Marks,
    state::{BOOKMARKS, Configuration, LightChange, State},
    words,
};

/// Range of whole numbers or lengths above which a slider is logarithmic.
const LOGARITHMIC_ABOVE: f64 = 100.0;

/// Width of a parameter's name, points.
const LABEL: f32 = 126.0;

/// Technique, presets and parameters of a side: its main parameters, and all others folded and searched by `search`.
/// `name` identifies the side.
pub fn configuration(ui: &mut Ui, name: &str, side: &mut Configuration, search: &mut String, marks: &mut Marks) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label("Technique");
        let chosen = ComboBox::from_id_salt((name, "technique"))
            .selected_text(side.technique().title)
            .width(210.0)
            .height(420.0)
            .show_ui(ui, |ui| {
                for technique in TECHNIQUES {
                    let choice = ui.selectable_label(side.technique == technique.name, technique.title);
                    let tip = format!("{}\n\nkey: {}", words::sentence_of(technique.summary), technique.name);
                    marks.add(&format!("{name}.technique.{}", technique.name), choice.rect);
                    if choice.on_hover_text(tip).clicked() && side.technique != technique.name {
                        *side = Configuration { technique: technique.name, ..Configuration::default() };
                    }
                }
            });
        marks.add(&format!("{name}.technique"), chosen.response.labelled_by(label.id).rect);
    });
    ui.label(RichText::new(words::sentence_of(side.technique().summary)).weak());
    let presets = presets_of(side.technique);
    if !presets.is_empty() || !side.settings.is_empty() {
        ui.horizontal_wrapped(|ui| {
            if !presets.is_empty() {
                ui.label("Presets");
            }
            for (title, preset) in &presets {
                let mut applied = side.clone();
                apply(&mut applied, preset);
                let button = ui.selectable_label(applied == *side, *title);
                marks.add(&format!("{name}.preset.{title}"), button.rect);
                if button.on_hover_text("Settings of this technique").clicked() {
                    *side = applied;
                }
            }
            if !side.settings.is_empty() && ui.button("Reset all").clicked() {
                side.settings.clear();
            }
        });
    }
    let (main, rest): (Vec<_>, Vec<_>) =
        parameters_of(side.technique()).into_iter().partition(|parameter| words::is_main(side.technique(), parameter));
    for parameter in &main {
        self::parameter(ui, name, side, parameter, marks);
    }
    if rest.is_empty() {
        return;
    }
    let changed = rest.iter().filter(|parameter| side.settings.contains_key(&parameter.key())).count();
    let changed = if changed == 0 { String::new() } else { format!(", {changed} changed") };
    let title = format!("{} more parameters{changed}", rest.len());
    let folded = CollapsingHeader::new(title).id_salt((name, "more")).show(ui, |ui| {
        let found = ui.add(TextEdit::singleline(search).hint_text("Search names and descriptions"));
        marks.add(&format!("{name}.search"), found.rect);
        let mut shown = rest.iter().filter(|parameter| matches(side, parameter, search)).peekable();
        if shown.peek().is_none() {
            ui.label(RichText::new("No parameter has these words.").weak());
        }
        let shown: Vec<_> = shown.collect();
        shown.into_iter().for_each(|parameter| self::parameter(ui, name, side, parameter, marks));
    });
    marks.add(&format!("{name}.more"), folded.header_response.rect);
}

/// Whether the title, key or description of a parameter contains every word of the search.
fn matches(side: &Configuration, parameter: &Parameter, search: &str) -> bool {
    let text = format!("{} {} {}", title(side, parameter), parameter.key(), parameter.doc).to_lowercase();
    search.to_lowercase().split_whitespace().all(|word| text.contains(word))
}

/// Applies a preset.
pub fn apply(side: &mut Configuration, preset: &Preset) {
    *side = Configuration { technique: preset.technique.name, ..Configuration::default() };
    for (key, value) in &preset.settings {
        side.set(key, value.clone());
    }
}

/// The name of a parameter in words. Where two of a technique have the same one, that of the other group has the group's
/// name before it.
fn title(side: &Configuration, parameter: &Parameter) -> String {
    let same = parameters_of(side.technique()).iter().filter(|other| other.name == parameter.name).count();
    let key = parameter.key();
    let is_own = key.strip_prefix(side.technique).is_some_and(|rest| rest.starts_with('.'));
    let words = if same > 1 && !is_own { key.replace('.', " ") } else { parameter.name.to_owned() };
    words::sentence(&words)
}

/// One parameter: name, slider or choice, unit, tooltip, and a button that resets it.
fn parameter(ui: &mut Ui, name: &str, side: &mut Configuration, parameter: &Parameter, marks: &mut Marks) {
    let key = parameter.key();
    let mut value = side.settings.get(&key).unwrap_or(&parameter.default).clone();
    let before = value.clone();
    let title = title(side, parameter);
    let tooltip = tooltip(parameter);
    let unit = if matches!(parameter.unit, "" | "1") { String::new() } else { format!(" {}", parameter.unit) };
    ui.horizontal_wrapped(|ui| {
        let label = ui.allocate_ui(vec2(LABEL, 20.0), |ui| {
            ui.set_min_width(LABEL);
            ui.label(title).on_hover_text(&tooltip)
        });
        let label = label.inner;
        let response = match (parameter.kind, &mut value) {
            (Kind::Int(low, high), Value::Int(number)) => ui.add(
                Slider::new(number, low..=high).logarithmic((high - low) as f64 > LOGARITHMIC_ABOVE).suffix(&unit),
            ),
            (Kind::Float(low, high), Value::Float(number)) => {
                let long = high - low > LOGARITHMIC_ABOVE;
                ui.add(
                    Slider::new(number, low..=high)
                        .logarithmic(long)
                        .smallest_positive(0.1)
                        .max_decimals(3)
                        .suffix(&unit),
                )
            }
            (Kind::Choice(names), Value::Text(chosen)) => {
                let combo = ComboBox::from_id_salt((name, &key)).selected_text(words::choice(chosen));
                combo
                    .show_ui(ui, |ui| {
                        for name in names {
                            let choice = ui.selectable_value(chosen, (*name).to_owned(), words::choice(name));
                            choice.on_hover_text(format!("key: {name}"));
                        }
                    })
                    .response
            }
            // The parameter's check refuses values of another kind, so this is not reached.
            _ => ui.label(before.to_string()),
        };
        marks.add(&format!("{name}.{key}"), response.rect);
        response.labelled_by(label.id).on_hover_text(&tooltip);
        if side.settings.contains_key(&key) {
            let reset =
                ui.small_button("reset").on_hover_text(format!("Reset to {}", words::value(&parameter.default)));
            marks.add(&format!("{name}.{key}.reset"), reset.rect);
            if reset.clicked() {
                value = parameter.default.clone();
            }
        }
    });
    if value != before
        && let Ok(value) = parameter.check(&value)
    {
        side.set(&key, value);
    }
}

fn tooltip(parameter: &Parameter) -> String {
    let unit = if matches!(parameter.unit, "" | "1") { String::new() } else { format!(" {}", parameter.unit) };
    let effect = match parameter.role {
        Role::Override => "A new value compiles a shader.",
        Role::Uniform => "Takes effect at once.",
        Role::Plan => "Changes the passes and textures of the frame.",
    };
    let (doc, key, range, default) = (parameter.doc, parameter.key(), parameter.range(), &parameter.default);
    format!("{doc}\n\n{key}: {range}{unit}; default {default}{unit}\n{effect}")
}

/// Lights: direction as two angles, position, strength.
pub fn lights(ui: &mut Ui, state: &mut State, original: &[Light], diagonal: f32) {
    if original.is_empty() {
        ui.label("This scene has no lights; its emitters light it.");
    }
    for (index, light) in original.iter().enumerate() {
        let none = LightChange::none(light);
        let mut change = state.lights.iter().find(|(at, _)| *at == index).map_or(none, |(_, change)| *change);
        let kind = match light {
            Light::Directional { .. } => "Directional light",
            Light::Point { .. } => "Point light",
            Light::Spot { .. } => "Spot light",
        };
        ui.push_id(index, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.strong(format!("{kind} {}", index + 1));
                if change != none && ui.small_button("reset").clicked() {
                    change = none;
                }
            });
            if !matches!(light, Light::Point { .. }) {
                let mut angles = angles(change.direction);
                let before = angles;
                ui.add(Slider::new(&mut angles[0], -180.0..=180.0).suffix("°").text("azimuth").max_decimals(1));
                ui.add(Slider::new(&mut angles[1], -90.0..=90.0).suffix("°").text("elevation").max_decimals(1));
                if angles != before {
                    change.direction = direction(angles);
                }
            }
            if !matches!(light, Light::Directional { .. }) {
                ui.horizontal_wrapped(|ui| {
                    ui.label("position");
                    for (axis, value) in ["x ", "y ", "z "].iter().zip(&mut change.position) {
                        ui.add(DragValue::new(value).prefix(*axis).speed(diagonal * 2e-3).max_decimals(3));
                    }
                });
            }
            ui.add(Slider::new(&mut change.strength, 0.0..=10.0).text("strength").logarithmic(true).max_decimals(2));
        });
        state.change_light(index, light, change);
    }
}

/// Where the light comes from: azimuth about +y from +z towards +x, and elevation above the horizon, degrees.
fn angles(direction: [f32; 3]) -> [f32; 2] {
    let [x, y, z] = (-glam::Vec3::from(direction)).normalize_or(glam::Vec3::Y).to_array();
    [x.atan2(z).to_degrees(), y.clamp(-1.0, 1.0).asin().to_degrees()]
}

fn direction([azimuth, elevation]: [f32; 2]) -> [f32; 3] {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    [-azimuth.sin() * elevation.cos(), -elevation.sin(), -azimuth.cos() * elevation.cos()]
}

/// The camera as numbers.
pub fn camera(ui: &mut Ui, state: &mut State, own: &Camera, diagonal: f32) {
    let mut camera = state.camera.unwrap_or(*own);
    for (name, vector) in [("eye", &mut camera.eye), ("target", &mut camera.target)] {
        ui.horizontal_wrapped(|ui| {
            ui.label(name);
            for value in vector {
                ui.add(DragValue::new(value).speed(diagonal * 2e-3).max_decimals(3));
            }
        });
    }
    ui.add(
        Slider::new(&mut camera.vertical_fov_degrees, 10.0..=120.0).suffix("°").text("field of view").max_decimals(1),
    );
    if camera != state.camera.unwrap_or(*own) {
        state.camera = Some(camera);
    }
    bookmarks(ui, state, camera);
    if state.camera.is_some() && ui.button("Reset to the scene's camera").clicked() {
        state.camera = None;
    }
    ui.label(
        RichText::new(
            "Drag to orbit, right-drag to look around, shift-drag or drag two fingers to pan, wheel or pinch to zoom. \
             When the picture has the focus: arrow keys orbit, W A S D Q E fly, + and - zoom.",
        )
        .weak(),
    );
}

/// Buttons that keep the camera and go back to kept ones.
fn bookmarks(ui: &mut Ui, state: &mut State, camera: Camera) {
    ui.horizontal_wrapped(|ui| {
        ui.label("bookmarks");
        let free = BOOKMARKS.clone().any(|key| !state.bookmarks.contains_key(&key));
        let keep = ui.add_enabled(free, Button::new("Keep this view")).on_hover_text("K");
        if keep.clicked() {
            state.bookmark(camera);
        }
        let mut removed = None;
        for (&key, &kept) in &state.bookmarks {
            let go = ui
                .selectable_label(kept == camera, key.to_string())
                .on_hover_text(format!("Go to this view: key {key}. Right-click to remove it."));
            if go.clicked() {
                state.camera = Some(kept);
            }
            if go.secondary_clicked() {
                removed = Some(key);
            }
        }
        removed.map(|key| state.bookmarks.remove(&key));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_finds_names_keys_and_descriptions() {
        let side = Configuration { technique: "radiance-cache", ..Configuration::default() };
        let all = parameters_of(side.technique());
        let found = |search: &str| -> Vec<&str> {
            all.iter().filter(|parameter| matches(&side, parameter, search)).map(|parameter| parameter.name).collect()
        };
        assert_eq!(found("spatial FILTER"), ["denoise"]);
        assert_eq!(found("cache.trusted"), ["trusted"]);
        assert_eq!(found("no such thing"), Vec::<&str>::new());
        assert_eq!(found("").len(), all.len());
        // Two parameters are called storage.
        let titles: Vec<String> = all.iter().map(|parameter| title(&side, parameter)).collect();
        assert!(titles.contains(&"Storage".to_owned()) && titles.contains(&"Direct storage".to_owned()), "{titles:?}");
    }

    #[test]
    fn angles_and_directions_are_inverse() {
        for wanted in [[0.0, 45.0], [90.0, 10.0], [-135.0, -60.0], [179.0, 89.0]] {
            let found = angles(direction(wanted));
            assert!((0..2).all(|i| (found[i] - wanted[i]).abs() < 1e-2), "{wanted:?} {found:?}");
        }
        // At an elevation of 90 degrees light travels straight down.
        assert!(direction([0.0, 90.0])[1] < -0.999_999);
    }
}
