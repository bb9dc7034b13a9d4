//! Plans that a device can hold, or one sentence that says what would fit.

use halflight_frame_graph::{BeyondLimits, DeviceLimits, FramePlan, Limit, Resource};

use super::frame_parameters;
use crate::{
    parameters::{Kind, Parameter, Settings, SettingsError, Value},
    scene::SceneFacts,
};

/// Makes a plan from settings and the image's size in pixels.
pub type Planner<'a> = dyn Fn(&Settings, [u32; 2]) -> Result<FramePlan, SettingsError> + 'a;

/// What a plan is made from, apart from the scene.
#[derive(Clone, Copy)]
pub struct PlanInputs<'a> {
    /// Parameters of the technique. Those of every frame need not be among them.
    pub parameters: &'a [Parameter],
    /// Settings.
    pub settings: &'a Settings,
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
}

/// A plan of a scene with these facts that fits a device. `plan` makes it from settings and a size. It is called with
/// other settings and sizes to find those that would fit.
///
/// # Errors
/// An error of `plan`, a scene whose lengths float32 cannot compute with ([`SceneFacts::check_lengths`]), or a plan that the device cannot hold: what is too large, by how much, and what would fit.
pub fn plan_within(
    device: &DeviceLimits,
    facts: &SceneFacts,
    inputs: PlanInputs,
    plan: &Planner,
) -> Result<FramePlan, SettingsError> {
    let most = device.limits.max_texture_dimension_2d;
    let [width, height] = inputs.size;
    if width.max(height) > most || width.min(height) == 0 {
        // Without a plan of this size, whose numbers could overflow.
        let [w, h] = largest_size(device, facts, inputs, plan, inputs.size.map(|side| side.clamp(1, most)));
        return Err(SettingsError(format!(
            "an image of {width}x{height} pixels is not possible, because this device allows 1 to {most} along a side: use \
             at most {w}x{h} pixels"
        )));
    }
    facts.check_lengths()?;
    let made = plan(inputs.settings, inputs.size)?;
    match made.check(device, &|name| facts.size.buffer(name)) {
        Ok(()) => Ok(made),
        Err(beyond) => Err(with_fix(device, facts, inputs, plan, &made, beyond)),
    }
}

/// The largest image of this shape, at most of this size, that fits; this size if not even the smallest does, because
/// then something else is too large.
fn largest_size(
    device: &DeviceLimits,
    facts: &SceneFacts,
    inputs: PlanInputs,
    plan: &Planner,
    size: [u32; 2],
) -> [u32; 2] {
    let sized = |scale: u32| size.map(|side| part(side, scale));
    let fits = |scale: u32| {
        let made = plan(inputs.settings, sized(scale));
        made.is_ok_and(|made| made.check(device, &|name| facts.size.buffer(name)).is_ok())
    };
    if fits(STEPS) || !fits(0) { size } else { sized(largest(0, STEPS, fits)) }
}

/// A part of a side of the image: `scale` of [`STEPS`], at least one pixel.
fn part(side: u32, scale: u32) -> u32 {
    ((u64::from(side) * u64::from(scale)) / u64::from(STEPS)).max(1) as u32
}

/// The error with the largest values that would fit: of the image's size, or of one setting.
fn with_fix(
    device: &DeviceLimits,
    facts: &SceneFacts,
    inputs: PlanInputs,
    plan: &Planner,
    made: &FramePlan,
    beyond: BeyondLimits,
) -> SettingsError {
    if beyond.demand.external.is_some() {
        // A buffer or texture of the scene: its sentence already says how much fits.
        return SettingsError(beyond.to_string());
    }
    let fits = |plan: &FramePlan| plan.check(device, &|name| facts.size.buffer(name)).is_ok();
    // Whether another plan is the better one: it fits, and what is too large is smaller in it, so that the value that
    // was changed is the cause.
    let of = beyond.demand.of.as_str();
    let bytes =
        |plan: &FramePlan| plan.resources.iter().find(|resource| resource.name == of).map_or(0, Resource::bytes);
    let is_cause =
        |other: &FramePlan| fits(other) && (beyond.demand.limit == Limit::Workgroups || bytes(other) < bytes(made));
    let sized = |scale: u32| inputs.size.map(|side| part(side, scale));
    let at_scale = |scale: u32| plan(inputs.settings, sized(scale)).ok();
    if at_scale(0).is_some_and(|smallest| is_cause(&smallest)) {
        let scale = largest(0, STEPS, |scale| at_scale(scale).is_some_and(|plan| fits(&plan)));
        let [w, h] = sized(scale);
        return SettingsError(format!("{}: use at most {w}x{h} pixels", beyond.demand.excess()));
    }
    let own = frame_parameters();
    let others = inputs.parameters.iter().filter(|parameter| own.iter().all(|own| own.key() != parameter.key()));
    for parameter in own.iter().chain(others) {
        let key = parameter.key();
        let (Kind::Int(low, _), Value::Int(now)) =
            (parameter.kind, inputs.settings.get(&key).unwrap_or(&parameter.default))
        else {
            continue;
        };
        let with = |value: u32| {
            let mut settings = inputs.settings.clone();
            settings.insert(key.clone(), Value::Int(value.into()));
            plan(&settings, inputs.size).ok()
        };
        let (Ok(low), Ok(now)) = (u32::try_from(low), u32::try_from(*now)) else { continue };
        if low < now && with(low).is_some_and(|smallest| is_cause(&smallest)) {
            let most = largest(low, now, |value| with(value).is_some_and(|plan| fits(&plan)));
            return SettingsError(format!("{}: use `{key}` of at most {most}", beyond.demand.excess()));
        }
    }
    SettingsError(beyond.to_string())
}

/// Parts of the image's size that are tried.
const STEPS: u32 = 1 << 14;

/// The largest value from `low`, which is good, to below `high`, which is not, by halving.
fn largest(mut low: u32, mut high: u32, good: impl Fn(u32) -> bool) -> u32 {
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if good(middle) { low = middle } else { high = middle }
    }
    low
}
