//! The candidates of a technique: all combinations of the grid values that its parameters declare.

use std::hash::{DefaultHasher, Hash, Hasher};

use halflight_frame_graph::{Part, Work};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
    plan_technique_of_scene,
    scene::SceneFacts,
};

/// A parameter with at least two values to choose from.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// `technique.parameter`.
    pub key: String,
    /// The default, then the other grid values of the declaration.
    pub values: Vec<Value>,
}

impl Axis {
    /// A value as a positive number; `None` for words and 0, whose meaning is special ("choose for me", "off").
    pub(crate) fn number(&self, index: usize) -> Option<f64> {
        let number = match self.values[index] {
            Value::Int(v) => v as f64,
            Value::Float(v) => v,
            Value::Bool(_) | Value::Text(_) => return None,
        };
        (number > 0.0).then_some(number)
    }
}

/// A technique with its axes. A candidate is one index into the values of each axis; all 0 are the defaults.
#[derive(Clone, Debug)]
pub struct Family {
    /// The technique.
    pub technique: &'static Technique,
    /// Its axes, in the order of their declaration.
    pub axes: Vec<Axis>,
}

/// A pass of a technique: its name, and what its time is proportional to in the first place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// Name.
    pub name: String,
    /// Invocations of a compute pass. 1 for raster passes, whose targets mostly do not depend on the display.
    pub invocations: f64,
}

/// What the plan of a candidate tells before anything is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Equal for candidates that do the same: settings without effect do not count.
    pub fingerprint: u64,
    /// Passes of the technique.
    pub passes: Vec<PlannedPass>,
    /// Whether it has indirect light. A technique may find ambient visibility alone.
    pub has_light: bool,
}

impl Family {
    /// All that the declarations of a technique offer.
    pub fn of(technique: &'static Technique) -> Self {
        let axes = (technique.parameters)().into_iter().filter_map(|parameter| {
            let mut values = vec![parameter.default.clone()];
            let others = parameter.grid.iter().filter(|value| **value != parameter.default);
            values.extend(others.cloned());
            (values.len() > 1).then(|| Axis { key: parameter.key(), values })
        });
        Self { technique, axes: axes.collect() }
    }

    /// Keeps these parameters only. The others have their defaults.
    #[must_use]
    pub fn restricted(mut self, names: &[&str]) -> Self {
        self.axes.retain(|axis| names.iter().any(|name| axis.key.rsplit('.').next() == Some(name)));
        self
    }

    /// Number of candidates.
    pub fn size(&self) -> f64 {
        self.axes.iter().map(|axis| axis.values.len() as f64).product()
    }

    /// The settings of a candidate that differ from the defaults.
    pub fn settings(&self, candidate: &[usize]) -> Settings {
        let changed = self.axes.iter().zip(candidate).filter(|(_, index)| **index > 0);
        changed.map(|(axis, &index)| (axis.key.clone(), axis.values[index].clone())).collect()
    }

    /// All candidates, the defaults first.
    pub fn candidates(&self) -> Vec<Vec<usize>> {
        self.axes.iter().fold(vec![Vec::new()], |all, axis| {
            let extended = |candidate: &Vec<usize>, index| [candidate.as_slice(), &[index]].concat();
            all.iter()
                .flat_map(|candidate| (0..axis.values.len()).map(move |index| extended(candidate, index)))
                .collect()
        })
    }

    /// The plan of a candidate; `None` where its settings contradict each other.
    pub fn plan(&self, facts: &SceneFacts, candidate: &[usize], size: [u32; 2]) -> Option<Planned> {
        let plan = plan_technique_of_scene(facts, self.technique, &self.settings(candidate), size).ok()?;
        let mut hasher = DefaultHasher::new();
        for pass in &plan.passes {
            // Bindings are indices into the resources, which come in order as well.
            format!("{:?} {:?} {:?} {:?}", pass.shader.name, pass.constants, pass.params, pass.work).hash(&mut hasher);
        }
        for resource in &plan.resources {
            format!("{resource:?}").hash(&mut hasher);
        }
        let technique_passes = plan.passes.iter().filter(|pass| pass.part == Part::Technique);
        let passes = technique_passes.map(|pass| PlannedPass {
            name: pass.name.clone(),
            invocations: match &pass.work {
                Work::Dispatch { size: [w, h], .. } => (f64::from(*w) * f64::from(*h)).max(1.0),
                Work::Draw { .. } | Work::Voxelize { .. } => 1.0,
            },
        });
        Some(Planned {
            fingerprint: hasher.finish(),
            passes: passes.collect(),
            has_light: plan.outputs.contains_key("indirect"),
        })
    }
}
