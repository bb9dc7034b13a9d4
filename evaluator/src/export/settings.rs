//! How the numbers of a plan depend on settings: which ones a player may change at once.

use std::collections::BTreeMap;

use halflight_frame_graph::FramePlan;
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Parameter, Settings, Value},
};

use super::{
    document::{AtZero, BySetting, Change, Function, Range, Setting},
    numbers::{Probes, number, same_structure},
    planned,
    rules::{SIZES, Squares, close},
};

/// Values at which settings are tried, apart from the ends of their ranges.
const TRIED: [f64; 9] = [0.013, 0.3, 0.41, 0.9, 1.7, 3.0, 12.0, 47.0, 1000.0];

/// Share of an old image that is left when the temporal filter begins to average without limit.
const SETTLED: f64 = 1.0 / 256.0;

/// Field of a pass, by its indices.
type Place = (usize, usize);

/// The settings of a technique that change numbers only.
pub(super) struct LiveSettings {
    parameters: Vec<(Parameter, Change, Option<Range>)>,
    fields: BTreeMap<Place, BySetting>,
}

impl LiveSettings {
    /// Finds the settings whose every value gives the same passes, textures and shaders, and numbers that follow a rule.
    pub(super) fn find(technique: &Technique, settings: &Settings, probes: &Probes) -> Self {
        let parameters: Vec<_> = (technique.parameters)();
        let mut found: Vec<_> = parameters.iter().map(|parameter| follow(technique, parameter, probes)).collect();
        // A number that follows two settings has no rule here.
        loop {
            let mut places: BTreeMap<Place, usize> = BTreeMap::new();
            for place in found.iter().flatten().flat_map(|(_, fields)| fields.keys()) {
                *places.entry(*place).or_default() += 1;
            }
            let shared = |fields: &BTreeMap<Place, BySetting>| fields.keys().any(|place| places[place] > 1);
            let Some(index) = found.iter().position(|one| one.as_ref().is_some_and(|(_, fields)| shared(fields)))
            else {
                break;
            };
            found[index] = None;
        }
        debug_assert!(parameters.iter().all(|parameter| settings.contains_key(&parameter.key())));
        let fields = found.iter().flatten().flat_map(|(_, fields)| fields.clone()).collect();
        let changes = found.into_iter().map(|one| match one {
            None => (Change::Export, None),
            Some((_, fields)) if fields.is_empty() => (Change::None, None),
            Some((range, _)) => (Change::Live, Some(range)),
        });
        let parameters = parameters.into_iter().zip(changes);
        Self { parameters: parameters.map(|(parameter, (change, range))| (parameter, change, range)).collect(), fields }
    }

    /// How a field of a pass follows a setting.
    pub(super) fn of(&self, pass: usize, field: usize) -> Option<&BySetting> {
        self.fields.get(&(pass, field))
    }

    /// All settings of the technique, as plan.json says them.
    pub(super) fn document(&self, settings: &Settings) -> Vec<Setting> {
        let setting = |(parameter, change, range): &(Parameter, Change, Option<Range>)| Setting {
            name: parameter.name,
            value: serde_json::to_value(settings.get(&parameter.key()).unwrap_or(&parameter.default))
                .unwrap_or_default(),
            doc: parameter.doc,
            unit: parameter.unit,
            change: *change,
            range: *range,
        };
        self.parameters.iter().map(setting).collect()
    }
}

/// The plan with another value of a setting; `None` if it has other passes, textures or shaders.
fn at(technique: &Technique, parameter: &Parameter, probes: &Probes, value: f64, size: [u32; 2]) -> Option<FramePlan> {
    let mut settings = probes.settings().clone();
    let value = match parameter.kind {
        Kind::Int(..) => Value::Int(value as i64),
        _ => Value::Float(value),
    };
    settings.insert(parameter.key(), value);
    let plan = planned(technique, &settings, size).ok()?;
    same_structure(probes.exported(), &plan).then_some(plan)
}

/// How the plan follows one setting; `None` if the setting changes more than numbers.
fn follow(
    technique: &Technique,
    parameter: &Parameter,
    probes: &Probes,
) -> Option<(Range, BTreeMap<Place, BySetting>)> {
    let (low, high, whole) = match parameter.kind {
        Kind::Int(low, high) => (low as f64, high as f64, true),
        Kind::Float(low, high) => (low, high, false),
        Kind::Choice(_) => return None,
    };
    let size = probes.exported().display_size;
    let exported = match probes.settings().get(&parameter.key()) {
        Some(Value::Int(value)) => *value as f64,
        Some(Value::Float(value)) => *value,
        _ => low,
    };
    let tried = TRIED.into_iter().chain([low, high, exported]);
    let mut values: Vec<f64> = tried.filter(|v| (low..=high).contains(v)).collect();
    if whole {
        values.iter_mut().for_each(|value| *value = value.round().max(low));
    }
    values.retain(|&value| value != 0.0);
    values.sort_by(f64::total_cmp);
    values.dedup();
    let plans: Vec<(f64, FramePlan)> = values
        .iter()
        .map(|&value| Some((value, at(technique, parameter, probes, value, size)?)))
        .collect::<Option<_>>()?;
    let zero = (low == 0.0).then(|| at(technique, parameter, probes, 0.0, size)).flatten();
    let mut fields = BTreeMap::new();
    for (pass, planned) in probes.exported().passes.iter().enumerate() {
        for (field, (_, exported)) in planned.params.iter().enumerate() {
            let value = |plan: &FramePlan| plan.passes[pass].params[field].1.clone();
            let first = value(&plans[0].1);
            let moves = plans.iter().any(|(_, plan)| value(plan) != first);
            let differs_at_zero = zero.as_ref().is_some_and(|zero| value(zero) != first);
            if !moves && !differs_at_zero && *exported == first {
                continue;
            }
            let numbers: Vec<(f64, f64)> =
                plans.iter().map(|(v, plan)| Some((*v, number(&value(plan))?))).collect::<Option<_>>()?;
            let function = fit(&numbers)?;
            let at_zero = match &zero {
                None => None,
                Some(zero) => at_zero(function, (technique, parameter, probes), (pass, field), number(&value(zero))?)?,
            };
            fields.insert((pass, field), BySetting { setting: parameter.name, function, at_zero });
        }
    }
    let above = low == 0.0 && zero.is_none();
    Some((Range { at_least: low, at_most: high, above, whole }, fields))
}

/// The number at a setting of 0, if the function does not give it: outer `None` if there is no rule.
fn at_zero(
    function: Function,
    (technique, parameter, probes): (&Technique, &Parameter, &Probes),
    (pass, field): Place,
    found: f64,
) -> Option<Option<AtZero>> {
    let by_function = match function {
        Function::Power { .. } => Some(0.0),
        Function::FramesUntil(_) => None,
    };
    let of_size = |size: [u32; 2]| {
        let plan = at(technique, parameter, probes, 0.0, size)?;
        Some((size, number(&plan.passes[pass].params[field].1)?))
    };
    let by_size: Vec<_> =
        if probes.any_size() { SIZES.into_iter().map(of_size).collect::<Option<_>>()? } else { Vec::new() };
    if by_size.iter().any(|&(_, value)| value != found) {
        return Some(Some(AtZero::BySize(Squares::fit(&by_size)?)));
    }
    Some((by_function != Some(found)).then_some(AtZero::Number(found)))
}

/// The function that gives these numbers.
fn fit(numbers: &[(f64, f64)]) -> Option<Function> {
    let &(value, result) = numbers.last()?;
    // A single value would fit everything.
    if numbers.len() < 2 {
        return None;
    }
    let power = |power: i32| {
        let times = result / value.powi(power);
        // Factors that are simple numbers are meant as such: float32 rounds by less than 1e-7.
        let rounded = (times * 4096.0).round() / 4096.0;
        let times = if (rounded - times).abs() <= 1e-7 * times.abs() { rounded } else { times };
        numbers.iter().all(|&(v, r)| close(times * v.powi(power), r)).then_some(Function::Power { times, power })
    };
    let frames = |v: f64| if v > 0.0 { (SETTLED.ln() / v.ln()).ceil() } else { 0.0 };
    let until = || numbers.iter().all(|&(v, r)| frames(v) == r).then_some(Function::FramesUntil(SETTLED));
    power(1).or_else(|| power(2)).or_else(until)
}
