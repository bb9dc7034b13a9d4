//! Parameters as users meet them: one declaration, checked values, names that are suggested.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use halflight_renderer::{
    frame_parameters,
    parameters::{Kind, Parameter, Settings, Value, check_settings},
};
use halflight_techniques::{TECHNIQUES, hierarchical::Hierarchical, parameters_of, technique};

fn all() -> Vec<Parameter> {
    let techniques = TECHNIQUES.iter().flat_map(|technique| (technique.parameters)());
    techniques.chain(frame_parameters()).collect()
}

#[test]
fn every_declaration_is_complete_and_takes_its_own_values() {
    let mut keys = BTreeSet::new();
    for parameter in all() {
        let key = parameter.key();
        assert!(keys.insert(key.clone()), "{key} is declared twice");
        assert!(!parameter.doc.is_empty() && !parameter.grid.is_empty(), "{key} has no text or no grid");
        assert_eq!(parameter.check(&parameter.default).unwrap(), parameter.default, "{key}");
        for value in &parameter.grid {
            assert_eq!(parameter.check(value).unwrap(), *value, "{key}");
        }
        // Numbers have a unit, choices have none.
        assert_eq!(parameter.unit.is_empty(), matches!(parameter.kind, Kind::Choice(_)), "{key}");
    }
}

/// The two ends of a range or all choices; then values just outside.
fn inside_and_outside(kind: Kind) -> (Vec<Value>, Vec<Value>) {
    let text = |name: &str| Value::Text(name.into());
    match kind {
        Kind::Int(low, high) => (
            vec![Value::Int(low), Value::Int(high)],
            vec![
                Value::Int(low - 1),
                Value::Int(high + 1),
                Value::Float(low as f64 + 0.5),
                text("many"),
                Value::Bool(true),
            ],
        ),
        Kind::Float(low, high) => (
            vec![Value::Float(low), Value::Float(high)],
            vec![
                Value::Float(low - 1.0),
                Value::Float(high + 1.0),
                Value::Float(f64::NAN),
                Value::Float(f64::INFINITY),
                text("many"),
            ],
        ),
        Kind::Choice(names) => (
            names.iter().map(|name| text(name)).collect(),
            vec![text(""), text("nonesuch"), Value::Bool(true), Value::Float(0.5), Value::Int(-1)],
        ),
    }
}

#[test]
fn values_inside_a_range_survive_and_values_outside_are_refused() {
    for technique in TECHNIQUES {
        for parameter in (technique.parameters)() {
            let key = parameter.key();
            let (inside, outside) = inside_and_outside(parameter.kind);
            for value in inside {
                let settings = Settings::from([(key.clone(), value.clone())]);
                let complete = (technique.complete)(&settings).unwrap();
                assert_eq!(complete[&key], value, "{key} did not arrive");
                // Completed settings hold every parameter and complete to themselves.
                assert_eq!(complete.len(), (technique.parameters)().len());
                assert_eq!((technique.complete)(&complete).unwrap(), complete);
                // What a command line writes comes back as the same value.
                let parsed = parameter.check(&Value::parse(&value.to_string())).unwrap();
                assert_eq!(parsed, value, "{key} = {value} as text");
            }
            for value in outside {
                let settings = Settings::from([(key.clone(), value.clone())]);
                let error = (technique.complete)(&settings).unwrap_err().to_string();
                assert!(error.contains(&key) && error.contains(&parameter.range()), "{error}");
                assert_eq!(check_settings(&settings, &parameters_of(technique)).unwrap_err().to_string(), error);
            }
        }
    }
}

#[test]
fn settings_of_other_techniques_are_left_out() {
    let settings = Settings::from([("exhaustive.form_factor".into(), Value::Text("eq3".into()))]);
    let complete = (technique("hierarchical").unwrap().complete)(&settings).unwrap();
    assert_eq!(complete, Hierarchical::default().to_settings());
}

#[test]
fn unknown_names_suggest_the_nearest() {
    let declared = parameters_of(technique("hierarchical").unwrap());
    let error =
        |key: &str| check_settings(&Settings::from([(key.into(), Value::Int(4))]), &declared).unwrap_err().to_string();
    assert!(error("hierarchical.levles").contains("did you mean hierarchical.levels?"));
    assert!(error("direct.shadow_map_sizes").contains("did you mean direct.shadow_map_size?"));
    // Nothing is near: all of them are named.
    let far = error("x");
    assert!(declared.iter().all(|parameter| far.contains(&parameter.key())), "{far}");
    assert!(technique("Hierarchical").unwrap_err().to_string().contains("did you mean hierarchical?"));
    let unknown = technique("").unwrap_err().to_string();
    assert!(TECHNIQUES.iter().all(|technique| unknown.contains(technique.name)), "{unknown}");
}

#[test]
fn text_is_read_as_the_value_that_it_looks_like() {
    assert_eq!(Value::parse("true"), Value::Bool(true));
    assert_eq!(Value::parse("-12"), Value::Int(-12));
    assert_eq!(Value::parse("1e3"), Value::Float(1000.0));
    assert_eq!(Value::parse("quarter"), Value::Text("quarter".into()));
    // A whole number is a number where a number is wanted, and a name where a choice has it.
    let declared = Hierarchical::parameters();
    let check =
        |name: &str, text: &str| declared.iter().find(|p| p.name == name).unwrap().check(&Value::parse(text)).unwrap();
    assert_eq!(check("radius", "40"), Value::Float(40.0));
    assert_eq!(check("ring", "2009"), Value::Text("2009".into()));
}
