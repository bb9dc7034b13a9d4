//! Plans for many sizes, and how the numbers in them depend on the size.

use halflight_frame_graph::{FramePlan, Pass, Resource, ResourceKind};
use halflight_renderer::{gi::Technique, parameters::Settings};
use halflight_shared_shaders::UniformValue;

use super::{
    invocations, planned,
    rules::{Axis, SIZES, Side, Squares},
};
use crate::Error;

/// Plans of one technique and settings for several sizes.
pub(super) struct Probes {
    technique: &'static str,
    settings: Settings,
    /// The exported one first. It is alone if the plan is valid for no other size.
    plans: Vec<FramePlan>,
    reason: Option<String>,
}

/// A number of a uniform block; `None` for vectors and matrices.
pub(super) fn number(value: &UniformValue) -> Option<f64> {
    match *value {
        UniformValue::U32(v) => Some(v.into()),
        UniformValue::I32(v) => Some(v.into()),
        UniformValue::F32(v) => Some(v.into()),
        _ => None,
    }
}

impl Probes {
    /// Plans for all sizes.
    pub(super) fn new(technique: &Technique, settings: &Settings, exported: &FramePlan) -> Result<Self, Error> {
        let mut all =
            Self { technique: technique.name, settings: settings.clone(), plans: vec![exported.clone()], reason: None };
        for size in SIZES.into_iter().filter(|size| *size != exported.display_size) {
            all.plans.push(planned(technique, settings, size)?);
        }
        all.reason = all.first_without_rule();
        if all.reason.is_some() {
            all.plans.truncate(1);
        }
        Ok(all)
    }

    /// What depends on the size without a rule, as a sentence; `None` if there is a rule for everything.
    fn first_without_rule(&self) -> Option<String> {
        let exported = self.exported();
        if let Some(plan) = self.plans.iter().find(|plan| !same_structure(exported, plan)) {
            let [width, height] = plan.display_size;
            return Some(format!("{} has other passes, textures or shaders at {width}x{height}.", self.technique));
        }
        for (index, resource) in exported.resources.iter().enumerate() {
            for axis in [0, 1] {
                let sizes = self.values(&|plan: &FramePlan| texture_size(&plan.resources[index])[axis]);
                if Side::fit(&sizes, Axis::Width, 1).is_none() {
                    return Some(format!("No rule gives the size of the texture {}.", resource.name));
                }
            }
        }
        for (index, pass) in exported.passes.iter().enumerate() {
            for axis in [0, 1] {
                let per = workgroup_size(pass)[axis];
                let counts = self.values(&|plan: &FramePlan| workgroups(&plan.passes[index])[axis]);
                if Side::fit(&counts, Axis::Width, per).is_none() {
                    return Some(format!("No rule gives the number of workgroups of the pass {}.", pass.name));
                }
            }
            for (field, (name, _)) in pass.params.iter().enumerate() {
                if !self.is_constant(index, field) && self.by_size(index, field).is_none() {
                    return Some(format!("No rule gives {name} of the pass {} at other sizes.", pass.name));
                }
            }
        }
        None
    }

    /// The plan of the exported size.
    pub(super) fn exported(&self) -> &FramePlan {
        &self.plans[0]
    }

    /// The settings of all plans.
    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether the plan is valid for any size.
    pub(super) fn any_size(&self) -> bool {
        self.reason.is_none()
    }

    /// Why it is valid for one size alone.
    pub(super) fn reason(&self) -> Option<String> {
        self.reason.clone()
    }

    /// A number of each plan, by its size.
    pub(super) fn values(&self, value: &dyn Fn(&FramePlan) -> u32) -> Vec<([u32; 2], u32)> {
        self.plans.iter().map(|plan| (plan.display_size, value(plan))).collect()
    }

    /// Whether a field of a pass is the same at all sizes.
    pub(super) fn is_constant(&self, pass: usize, field: usize) -> bool {
        let value = |plan: &FramePlan| plan.passes[pass].params[field].1.clone();
        self.plans.iter().all(|plan| value(plan) == value(self.exported()))
    }

    /// How a field of a pass depends on the size; `None` if it does not, or if there is no rule.
    pub(super) fn by_size(&self, pass: usize, field: usize) -> Option<Squares> {
        if self.plans.len() < 2 || self.is_constant(pass, field) {
            return None;
        }
        let value = |plan: &FramePlan| Some((plan.display_size, number(&plan.passes[pass].params[field].1)?));
        Squares::fit(&self.plans.iter().map(value).collect::<Option<Vec<_>>>()?)
    }
}

/// Width and height of a texture; 0 for other resources.
fn texture_size(resource: &Resource) -> [u32; 2] {
    match resource.kind {
        ResourceKind::Texture { size, .. } | ResourceKind::Previous { size, .. } => size,
        _ => [0; 2],
    }
}

/// Invocations of a workgroup.
pub(super) fn workgroup_size(pass: &Pass) -> [u32; 3] {
    pass.shader.entry_points[0].workgroup_size.map(|side| side.max(1))
}

/// Workgroups of a pass along x and y.
pub(super) fn workgroups(pass: &Pass) -> [u32; 2] {
    let (size, group) = (invocations(&pass.work), workgroup_size(pass));
    [size[0].div_ceil(group[0]), size[1].div_ceil(group[1])]
}

/// Whether two plans differ in nothing but sizes and numbers of uniform blocks.
pub(super) fn same_structure(a: &FramePlan, b: &FramePlan) -> bool {
    let same_resource = |(a, b): (&Resource, &Resource)| {
        a.name == b.name
            && match (&a.kind, &b.kind) {
                (
                    ResourceKind::Texture { layers, format, .. },
                    ResourceKind::Texture { layers: other_layers, format: other_format, .. },
                ) => (layers, format) == (other_layers, other_format),
                (
                    ResourceKind::Previous { of, format, .. },
                    ResourceKind::Previous { of: other_of, format: other_format, .. },
                ) => (of, format) == (other_of, other_format),
                (a, b) => a == b,
            }
    };
    let same_pass = |(a, b): (&Pass, &Pass)| {
        let names = |pass: &Pass| pass.params.iter().map(|(name, _)| *name).collect::<Vec<_>>();
        a.name == b.name
            && a.shader == b.shader
            && a.constants == b.constants
            && a.bindings == b.bindings
            && a.cost == b.cost
            && names(a) == names(b)
    };
    a.resources.len() == b.resources.len()
        && a.passes.len() == b.passes.len()
        && a.outputs == b.outputs
        && a.resources.iter().zip(&b.resources).all(same_resource)
        && a.passes.iter().zip(&b.passes).all(same_pass)
}
