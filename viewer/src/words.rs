//! Words for names: parameters, choices, views and scenes as the interface shows them. Techniques declare theirs. Keys, as
//! files and links have them, are in tooltips.

use halflight_renderer::{
    gi::Technique,
    parameters::{Parameter, Value},
};

/// Titles of the bundled scenes.
const SCENES: [(&str, &str); 16] = [
    ("atrium", "Atrium"),
    ("bars", "Bars"),
    ("bars_sky", "Bars under a sky"),
    ("cameras", "Extra cameras"),
    ("cornell", "Cornell box"),
    ("cornell_directions", "Cornell box, directions"),
    ("cornell_sky", "Cornell box under a sky"),
    ("furnace", "Furnace"),
    ("lights", "Many lights"),
    ("motion", "Moving block"),
    ("room", "Room"),
    ("room_sun", "Room with sun"),
    ("statue", "Statue"),
    ("statue_floor", "Statue on a floor"),
    ("translucent", "Translucent curtain"),
    ("dropped", "Your files"),
];

/// Titles of views.
const VIEWS: [(&str, &str); 9] = [
    ("final", "Picture"),
    ("direct", "Direct light"),
    ("indirect", "Indirect light"),
    ("ambient_occlusion", "Ambient visibility"),
    ("albedo", "Albedo"),
    ("normal", "Normals"),
    ("depth", "Depth"),
    ("error", "Error map"),
    ("truth", "Reference"),
];

/// Choices whose names say too little by themselves.
const CHOICES: [(&str, &str); 6] = [
    ("eq3", "Point to point"),
    ("eq4", "Point to disc"),
    ("cubes", "Voxels"),
    ("and", "All of four"),
    ("or", "Any of four"),
    ("2009", "As published in 2009"),
];

fn found<'a>(list: &[(&'static str, &'static str)], name: &'a str) -> Option<&'static str>
where
    'static: 'a,
{
    list.iter().find(|(key, _)| *key == name).map(|(_, title)| *title)
}

/// `some_name` as `Some name`.
pub fn sentence(name: &str) -> String {
    let words = name.replace(['_', '-'], " ");
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Title of a scene.
pub fn scene(name: &str) -> String {
    found(&SCENES, name).map_or_else(|| sentence(name), str::to_owned)
}

/// Title of a view by its name in links. Textures of the frame keep their names.
pub fn view(name: &str) -> String {
    found(&VIEWS, name).map_or_else(|| name.to_owned(), str::to_owned)
}

/// Title of a value of a choice.
pub fn choice(name: &str) -> String {
    found(&CHOICES, name).map_or_else(|| sentence(name), str::to_owned)
}

/// A summary as a sentence.
pub fn sentence_of(summary: &str) -> String {
    let mut letters = summary.chars();
    let first = letters.next().map_or_else(String::new, |first| first.to_uppercase().collect());
    format!("{first}{}.", letters.as_str())
}

/// A value in words.
pub fn value(value: &Value) -> String {
    match value {
        Value::Text(name) => choice(name),
        other => other.to_string(),
    }
}

/// Whether a parameter is one of the main ones of a technique.
pub fn is_main(technique: &Technique, parameter: &Parameter) -> bool {
    parameter.technique == technique.name && technique.main.contains(&parameter.name)
}

#[cfg(test)]
mod tests {
    use halflight_scenes::bundled::NAMES;

    use super::*;
    use crate::state::OUTPUTS;

    #[test]
    fn everything_has_a_title_and_every_title_something() {
        for name in NAMES {
            assert!(found(&SCENES, name).is_some(), "the scene {name} has no title");
        }
        for (name, _) in OUTPUTS {
            assert!(found(&VIEWS, name).is_some(), "the view {name} has no title");
        }
    }

    #[test]
    fn names_become_words() {
        assert_eq!(sentence("start_resolution"), "Start resolution");
        assert_eq!((choice("half"), choice("eq4")), ("Half".to_owned(), "Point to disc".to_owned()));
    }
}
