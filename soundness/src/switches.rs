//! The settings that a technique is tested with. They follow from the declarations of its parameters, so that a new
//! technique or parameter is covered as soon as it is listed.

use std::collections::BTreeSet;

use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Parameter, Settings, Value},
    plan_technique_of_scene,
    scene::SceneFacts,
};

/// The values that a parameter is tested with: every choice; both ends of a range and the default; and, where a range
/// begins at 0, which often means "off" or "automatic", a number just above 0.
pub fn values(parameter: &Parameter) -> Vec<Value> {
    let mut values = match parameter.kind {
        Kind::Choice(names) => names.iter().map(|name| Value::Text((*name).into())).collect(),
        Kind::Int(low, high) => vec![parameter.default.clone(), Value::Int(low), Value::Int(high)],
        Kind::Float(low, high) => {
            let mut values = vec![parameter.default.clone(), Value::Float(low), Value::Float(high)];
            // A millionth of the range: less than a pixel of any radius.
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
    }
}

/// Settings of a technique by how much they cover. Each holds only the values that differ from the defaults.
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
    /// Messages with which the technique refuses pairs of values.
    pub refused: BTreeSet<String>,
}

/// Index of a parameter, and index of a value among its values.
type Pick = (usize, usize);

impl Switches {
    /// The settings of a technique, for scenes that have everything that a setting may need.
    pub fn of(technique: &'static Technique, facts: &SceneFacts) -> Self {
        let parameters = (technique.parameters)();
        let all: Vec<Vec<Value>> = parameters.iter().map(values).collect();
        let settings = |row: &[usize]| -> Settings {
            let chosen = parameters.iter().zip(&all).zip(row).map(|((p, values), &value)| (p, &values[value]));
            chosen.filter(|(p, value)| **value != p.default).map(|(p, value)| (p.key(), value.clone())).collect()
        };
        let refusal = |settings: &Settings| {
            // Large enough for several levels, and fast to plan.
            plan_technique_of_scene(facts, technique, settings, [64, 36]).err().map(|error| error.to_string())
        };
        let defaults: Vec<usize> = parameters
            .iter()
            .zip(&all)
            .map(|(p, values)| values.iter().position(|value| *value == p.default).unwrap_or(0))
            .collect();
        let mut refused = BTreeSet::new();
        let space = Space { all: &all, defaults: &defaults, settings: &settings, refusal: &refusal };
        let mut single = vec![settings(&defaults)];
        for (parameter, values) in all.iter().enumerate() {
            for value in (0..values.len()).filter(|&value| value != defaults[parameter]) {
                single.extend(space.accepted(&[(parameter, value)], &mut refused).map(|row| settings(&row)));
            }
        }
        let mut ones: BTreeSet<Vec<Pick>> =
            all.iter().enumerate().flat_map(|(p, values)| (0..values.len()).map(move |v| vec![(p, v)])).collect();
        let each = space.cover(&mut ones, &mut refused);
        let mut twos: BTreeSet<Vec<Pick>> = BTreeSet::new();
        for (p, values) in all.iter().enumerate() {
            for (q, others) in all.iter().enumerate().skip(p + 1) {
                twos.extend((0..values.len()).flat_map(|v| (0..others.len()).map(move |w| vec![(p, v), (q, w)])));
            }
        }
        let pairs = match twos.is_empty() {
            true => each.clone(),
            false => space.cover(&mut twos, &mut refused),
        };
        Self { technique, each, single, pairs, refused }
    }
}

/// The values of the parameters of one technique.
struct Space<'a> {
    /// Values of every parameter.
    all: &'a [Vec<Value>],
    /// Indices of the defaults.
    defaults: &'a [usize],
    /// Settings by indices of values.
    settings: &'a dyn Fn(&[usize]) -> Settings,
    /// The message with which the technique refuses settings.
    refusal: &'a dyn Fn(&Settings) -> Option<String>,
}

impl Space<'_> {
    fn accepts(&self, row: &[usize]) -> bool {
        (self.refusal)(&(self.settings)(row)).is_none()
    }

    /// The wanted values, and defaults for the others; where these are refused, with one more value that makes them
    /// acceptable. `None` where there is none; then the message is added to `refused`.
    fn accepted(&self, wanted: &[Pick], refused: &mut BTreeSet<String>) -> Option<Vec<usize>> {
        let mut plain = self.defaults.to_vec();
        wanted.iter().for_each(|&(parameter, value)| plain[parameter] = value);
        let Some(sentence) = (self.refusal)(&(self.settings)(&plain)) else { return Some(plain) };
        let free = (0..self.all.len()).filter(|p| wanted.iter().all(|(wanted, _)| wanted != p));
        for parameter in free {
            for value in 0..self.all[parameter].len() {
                let mut row = plain.clone();
                row[parameter] = value;
                if self.accepts(&row) {
                    return Some(row);
                }
            }
        }
        refused.insert(sentence);
        None
    }

    /// Settings that have every wanted combination at least once. Each starts with a missing combination and takes for every
    /// other parameter the accepted value that covers most of the missing ones (Cohen et al. 1997).
    fn cover(&self, missing: &mut BTreeSet<Vec<Pick>>, refused: &mut BTreeSet<String>) -> Vec<Settings> {
        if self.all.is_empty() {
            return vec![(self.settings)(&[])];
        }
        let mut rows = Vec::new();
        let holds = |row: &[usize], wanted: &[Pick]| wanted.iter().all(|&(p, v)| row[p] == v);
        while let Some(start) = missing.pop_first() {
            let Some(mut row) = self.accepted(&start, refused) else { continue };
            let mut fixed: Vec<bool> = row.iter().zip(self.defaults).map(|(value, default)| value != default).collect();
            start.iter().for_each(|&(parameter, _)| fixed[parameter] = true);
            for parameter in (0..self.all.len()).filter(|&p| !fixed[p]).collect::<Vec<_>>() {
                let gain = |value: usize| {
                    // Combinations with this value whose other values are already fixed.
                    let new = |wanted: &&Vec<Pick>| {
                        wanted.contains(&(parameter, value))
                            && wanted.iter().all(|&(p, v)| p == parameter || (fixed[p] && row[p] == v))
                    };
                    missing.iter().filter(new).count()
                };
                let mut order: Vec<usize> = (0..self.all[parameter].len()).collect();
                // A value that covers nothing stays at its default, which is compatible with every other value.
                order.sort_by_key(|&v| std::cmp::Reverse((gain(v), v == self.defaults[parameter])));
                let fits = |&&value: &&usize| {
                    let mut row = row.clone();
                    row[parameter] = value;
                    self.accepts(&row)
                };
                if let Some(&value) = order.iter().find(fits) {
                    row[parameter] = value;
                }
                fixed[parameter] = true;
            }
            missing.retain(|wanted| !holds(&row, wanted));
            rows.push((self.settings)(&row));
        }
        rows
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
mod tests {
    use halflight_techniques::TECHNIQUES;

    use super::*;
    use crate::scenes::everything;

    /// Whether a parameter has this value in settings that may leave it at its default.
    fn has(settings: &Settings, parameter: &Parameter, value: &Value) -> bool {
        settings.get(&parameter.key()).unwrap_or(&parameter.default) == value
    }

    #[test]
    fn every_pair_of_values_is_run_or_refused() {
        let facts = SceneFacts::of(&everything());
        for technique in TECHNIQUES {
            let switches = Switches::of(technique, &facts);
            let parameters = (technique.parameters)();
            let mut missing = Vec::new();
            for (i, p) in parameters.iter().enumerate() {
                for v in values(p) {
                    assert!(switches.each.iter().any(|s| has(s, p, &v)), "{} = {v} is never run", p.key());
                    assert!(switches.single.iter().any(|s| has(s, p, &v)), "{} = {v} is never run alone", p.key());
                    for q in &parameters[i + 1..] {
                        for w in values(q) {
                            if !switches.pairs.iter().any(|s| has(s, p, &v) && has(s, q, &w)) {
                                missing.push(Settings::from([(p.key(), v.clone()), (q.key(), w)]));
                            }
                        }
                    }
                }
            }
            // The technique refuses what is missing.
            for settings in &missing {
                let refused = plan_technique_of_scene(&facts, technique, settings, [64, 36]).is_err();
                assert!(refused, "{settings:?} is accepted and never run");
            }
            // The number of rows is at least the product of the two longest lists of values, and grows with the logarithm
            // of the number of parameters.
            let mut lengths: Vec<usize> = parameters.iter().map(|p| values(p).len()).collect();
            lengths.sort_unstable();
            let least: usize = lengths.iter().rev().take(2).product();
            println!("{}: {} rows for at least {least}", technique.name, switches.pairs.len());
            let most = least.max(1) * parameters.len().max(8).ilog2() as usize;
            assert!(switches.pairs.len() <= most, "{}: {} rows", technique.name, switches.pairs.len());
        }
    }

    #[test]
    fn values_outside_a_range_are_outside() {
        for technique in TECHNIQUES {
            for parameter in (technique.parameters)() {
                for value in values(&parameter) {
                    assert_eq!(parameter.check(&value).as_ref(), Ok(&value), "{}", parameter.key());
                }
                for value in outside(&parameter) {
                    assert!(parameter.check(&value).is_err(), "{} = {value}", parameter.key());
                }
            }
        }
    }
}
