//! Which settings a technique is run with: they follow from the declarations of its parameters, so that a new technique
//! or a new switch is covered as soon as it is listed.

use std::collections::BTreeSet;

use halflight_renderer::{
    SceneFacts,
    parameters::{Kind, Parameter, Settings, Value},
    plan_technique_of_scene,
    techniques::Technique,
};

/// The values that a parameter is tried with: every choice; both ends of a range, the default, and where a range
/// begins at 0, which often means "off" or "find it yourself", a number just above.
pub fn values(parameter: &Parameter) -> Vec<Value> {
    let mut values = match parameter.kind {
        Kind::Choice(names) => names.iter().map(|name| Value::Text((*name).into())).collect(),
        Kind::Bool => vec![Value::Bool(false), Value::Bool(true)],
        Kind::Int(low, high) => vec![parameter.default.clone(), Value::Int(low), Value::Int(high)],
        Kind::Float(low, high) => {
            let mut values = vec![parameter.default.clone(), Value::Float(low), Value::Float(high)];
            // A millionth of the range: under a pixel of any radius, under a thousandth of any share.
            if low == 0.0 {
                values.push(Value::Float(1e-6 * high));
            }
            values
        }
    };
    let mut seen: Vec<Value> = Vec::new();
    values.retain(|value| {
        let new = !seen.contains(value);
        seen.push(value.clone());
        new
    });
    values
}

/// Values just outside a range: each must be refused.
pub fn outside(parameter: &Parameter) -> Vec<Value> {
    match parameter.kind {
        Kind::Int(low, high) => vec![Value::Int(low - 1), Value::Int(high + 1), Value::Text("many".into())],
        Kind::Float(low, high) => {
            let beyond = |v: f64, sign: f64| Value::Float(v + sign * v.abs().max(1.0));
            vec![beyond(low, -1.0), beyond(high, 1.0), Value::Float(f64::NAN), Value::Float(f64::INFINITY)]
        }
        Kind::Choice(_) => vec![Value::Text("nonesuch".into()), Value::Int(-1)],
        Kind::Bool => vec![Value::Text("maybe".into())],
    }
}

/// Settings of a technique, by how much they cover. Each holds only what differs from the defaults.
#[derive(Clone, Debug)]
pub struct Switches {
    /// The technique.
    pub technique: &'static Technique,
    /// Every value of every parameter at least once.
    pub each: Vec<Settings>,
    /// One value at a time; the first is the default.
    pub single: Vec<Settings>,
    /// Every pair of values of two parameters at least once.
    pub pairs: Vec<Settings>,
    /// Pairs of values that the technique refuses to have together, each with its sentence.
    pub refused: BTreeSet<String>,
}

/// A parameter's place and a value's place among its values.
type Pick = (usize, usize);

impl Switches {
    /// Those of a technique, for scenes that have what any setting may ask for.
    pub fn of(technique: &'static Technique, facts: &SceneFacts) -> Self {
        let parameters = (technique.parameters)();
        let all: Vec<Vec<Value>> = parameters.iter().map(values).collect();
        let settings = |row: &[usize]| -> Settings {
            let chosen = parameters.iter().zip(&all).zip(row).map(|((p, values), &value)| (p, &values[value]));
            chosen.filter(|(p, value)| **value != p.default).map(|(p, value)| (p.key(), value.clone())).collect()
        };
        let refusal = |settings: &Settings| {
            // A size that keeps levels apart and plans fast.
            plan_technique_of_scene(facts, technique, settings, [64, 36]).err().map(|error| error.to_string())
        };
        let defaults: Vec<usize> = parameters
            .iter()
            .zip(&all)
            .map(|(p, values)| values.iter().position(|value| *value == p.default).unwrap_or(0))
            .collect();
        let mut refused = BTreeSet::new();
        let mut single = vec![settings(&defaults)];
        for (parameter, values) in all.iter().enumerate() {
            for value in (0..values.len()).filter(|&value| value != defaults[parameter]) {
                single.extend(accepted(&all, &defaults, &[(parameter, value)], &settings, &refusal, &mut refused));
            }
        }
        let mut ones: BTreeSet<Vec<Pick>> =
            all.iter().enumerate().flat_map(|(p, values)| (0..values.len()).map(move |v| vec![(p, v)])).collect();
        let each = cover(&all, &defaults, &mut ones, &settings, &refusal, &mut refused);
        let mut twos: BTreeSet<Vec<Pick>> = BTreeSet::new();
        for (p, values) in all.iter().enumerate() {
            for (q, others) in all.iter().enumerate().skip(p + 1) {
                twos.extend((0..values.len()).flat_map(|v| (0..others.len()).map(move |w| vec![(p, v), (q, w)])));
            }
        }
        let pairs = match twos.is_empty() {
            true => each.clone(),
            false => cover(&all, &defaults, &mut twos, &settings, &refusal, &mut refused),
        };
        Self { technique, each, single, pairs, refused }
    }
}

/// The settings with these values and the defaults otherwise; where they are refused, with one other value more that
/// makes them acceptable.
fn accepted(
    all: &[Vec<Value>],
    defaults: &[usize],
    wanted: &[Pick],
    settings: &dyn Fn(&[usize]) -> Settings,
    refusal: &dyn Fn(&Settings) -> Option<String>,
    refused: &mut BTreeSet<String>,
) -> Option<Settings> {
    let mut row = defaults.to_vec();
    wanted.iter().for_each(|&(parameter, value)| row[parameter] = value);
    let plain = settings(&row);
    let Some(sentence) = refusal(&plain) else { return Some(plain) };
    let free = (0..all.len()).filter(|p| wanted.iter().all(|(wanted, _)| wanted != p));
    for parameter in free {
        for value in 0..all[parameter].len() {
            let mut row = row.clone();
            row[parameter] = value;
            let more = settings(&row);
            if refusal(&more).is_none() {
                return Some(more);
            }
        }
    }
    refused.insert(sentence);
    None
}

/// Rows of values that have every wanted combination at least once: each row starts with one that is missing and takes
/// for every other parameter the value that adds most (Cohen et al. 1997).
fn cover(
    all: &[Vec<Value>],
    defaults: &[usize],
    missing: &mut BTreeSet<Vec<Pick>>,
    settings: &dyn Fn(&[usize]) -> Settings,
    refusal: &dyn Fn(&Settings) -> Option<String>,
    refused: &mut BTreeSet<String>,
) -> Vec<Settings> {
    let mut rows = Vec::new();
    if all.is_empty() {
        return vec![settings(&[])];
    }
    while let Some(start) = missing.first().cloned() {
        let mut row: Vec<Option<usize>> = vec![None; all.len()];
        start.iter().for_each(|&(parameter, value)| row[parameter] = Some(value));
        let holds = |row: &[Option<usize>], wanted: &[Pick]| wanted.iter().all(|&(p, v)| row[p] == Some(v));
        for parameter in 0..all.len() {
            if row[parameter].is_some() {
                continue;
            }
            let gain = |value: usize| {
                let mut row = row.clone();
                row[parameter] = Some(value);
                let new = |wanted: &&Vec<Pick>| {
                    wanted.iter().any(|&(p, v)| (p, v) == (parameter, value)) && holds(&row, wanted)
                };
                missing.iter().filter(new).count()
            };
            // What none needs stays at its default, which every other value goes with.
            let best = (0..all[parameter].len()).max_by_key(|&v| (gain(v), v == defaults[parameter]));
            row[parameter] = best;
            let whole: Vec<usize> =
                row.iter().zip(defaults).map(|(value, &default)| value.unwrap_or(default)).collect();
            if refusal(&settings(&whole)).is_some() {
                row[parameter] = Some(defaults[parameter]);
            }
        }
        let whole: Vec<usize> = row.iter().zip(defaults).map(|(value, &default)| value.unwrap_or(default)).collect();
        if refusal(&settings(&whole)).is_none() {
            missing.retain(|wanted| !holds(&row, wanted));
            rows.push(settings(&whole));
        } else {
            rows.extend(accepted(all, defaults, &start, settings, refusal, refused));
        }
        missing.remove(&start);
    }
    rows
}
