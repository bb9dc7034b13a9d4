//! A sweep: all combinations of lists of values, made one at a time.

use clap::ValueEnum as _;
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{
    SceneError,
    keys::{Table, listed},
};
use halflight_techniques::preset::{check, declaration};

use super::{Cell, Moving};

/// All combinations of lists of values of one technique's settings. They are counted and made by number, never listed:
/// a grid of a million cells takes no more memory than one of ten.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The technique.
    pub technique: &'static Technique,
    /// What the file fixes.
    pub fixed: Settings,
    /// Settings with the values that they take, in the order of the file: the last one changes first.
    pub lists: Vec<(String, Vec<Value>)>,
    /// Part of the report that shows the cells; empty for the first.
    pub section: String,
    /// What moves: one cell for each, and for each combination of settings.
    pub moving: Vec<Moving>,
    /// The frames that are measured, counted from 1, in rising order: one cell for each. Empty for
    /// [`Cell::at_frame`] `None`.
    pub at_frames: Vec<u32>,
    /// Every setting of the technique, with what is fixed.
    complete: Settings,
}

impl Sweep {
    pub(super) fn read(table: &Table) -> Result<Self, SceneError> {
        let name = table.required("technique", table.text("technique")?, "technique = \"hierarchical\"")?;
        let technique = halflight_techniques::technique(name)
            .map_err(|e| table.error("technique", format_args!("is wrong: {e}")))?;
        let declared = halflight_techniques::parameters_of(technique);
        let source = table.source();
        let complete = |settings: &Settings| {
            let own =
                (technique.complete)(settings).map_err(|e| table.error("technique", format_args!("is wrong: {e}")))?;
            // Settings of direct light are not the technique's own but count for the frame.
            let mut all = settings.clone();
            all.extend(own);
            Ok::<_, SceneError>(all)
        };
        let mut fixed = Settings::new();
        for (key, value) in table.entries("fixed")? {
            let parameter = declaration(source, technique, &declared, key, value)?;
            fixed.insert(parameter.key(), check(source, parameter, value)?);
        }
        let mut lists = Vec::new();
        for (key, values) in table.entries("grid")? {
            let parameter = declaration(source, technique, &declared, key, values)?;
            let list = values.get_ref().as_array().filter(|list| !list.is_empty()).ok_or_else(|| {
                source.error(values.span(), format_args!("`grid.{key}` must be a list of values, for example [4, 5]"))
            })?;
            let key = parameter.key();
            let value = |value| {
                // In the notation of the declaration: 40 of a length becomes 40.0.
                let mut settings = complete(&Settings::from([(key.clone(), check(source, parameter, value)?)]))?;
                settings.remove(&key).ok_or_else(|| table.error("technique", "has no such setting"))
            };
            let values = list.iter().map(value).collect::<Result<_, _>>()?;
            lists.push((key, values));
        }
        let (moving, at_frames) = (read_moving(table)?, read_frames(table)?);
        let section = table.text("section")?.unwrap_or_default().to_owned();
        Ok(Self { technique, complete: complete(&fixed)?, fixed, lists, section, moving, at_frames })
    }

    /// Number of combinations; `u64::MAX` where it is larger.
    pub fn len(&self) -> u64 {
        let settings =
            self.lists.iter().fold(1, |product: u64, (_, values)| product.saturating_mul(values.len() as u64));
        settings.saturating_mul(self.moving.len() as u64).saturating_mul(self.at_frames.len().max(1) as u64)
    }

    /// Whether it has no combination. A sweep of a file has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The combination of this number, from 0.
    pub fn cell(&self, index: u64) -> Cell {
        let mut settings = self.complete.clone();
        let mut rest = index;
        let mut digit = |count: usize| {
            let count = count.max(1) as u64;
            let digit = (rest % count) as usize;
            rest /= count;
            digit
        };
        let at_frame = self.at_frames.get(digit(self.at_frames.len())).copied();
        let moving = self.moving.get(digit(self.moving.len())).copied().unwrap_or_default();
        for (key, values) in self.lists.iter().rev() {
            if let Some(value) = values.get(digit(values.len())) {
                settings.insert(key.clone(), value.clone());
            }
        }
        Cell { technique: self.technique, settings, moving, at_frame, section: self.section.clone() }
    }
}

/// Largest number of a frame that is measured, from 1. `evaluator render` shows a history of as many frames.
pub const MOST_FRAMES: u32 = 256;

fn read_frames(table: &Table) -> Result<Vec<u32>, SceneError> {
    let Some(value) = table.get("at_frames") else { return Ok(Vec::new()) };
    let number = |value: &toml::de::DeValue| {
        let number = value.as_integer().and_then(|n| u32::from_str_radix(n.as_str(), n.radix()).ok());
        number.filter(|number| (1..=MOST_FRAMES).contains(number))
    };
    let list = value.get_ref().as_array();
    let frames: Option<Vec<u32>> = list.and_then(|list| list.iter().map(|value| number(value.get_ref())).collect());
    frames.filter(|frames| !frames.is_empty() && frames.windows(2).all(|pair| pair[0] < pair[1])).ok_or_else(|| {
        let wanted =
            format!("a list of numbers of frames from 1 to {MOST_FRAMES} in rising order, for example [1, 8, 32, 128]");
        table.wrong("at_frames", value, wanted)
    })
}

fn read_moving(table: &Table) -> Result<Vec<Moving>, SceneError> {
    let Some(value) = table.get("moving") else { return Ok(vec![Moving::Nothing]) };
    let word = |value: &toml::de::DeValue| value.as_str().and_then(Moving::of_name);
    let list = value.get_ref().as_array();
    let moving: Option<Vec<Moving>> = list.and_then(|list| list.iter().map(|value| word(value.get_ref())).collect());
    let is_new = |(index, one): (usize, &Moving), list: &[Moving]| !list[..index].contains(one);
    moving.filter(|list| !list.is_empty() && list.iter().enumerate().all(|one| is_new(one, list))).ok_or_else(|| {
        let names = Moving::value_variants().iter().map(Moving::to_string).collect::<Vec<_>>();
        let wanted = format!("a list of different words of {}", listed(names.iter().map(String::as_str)));
        table.wrong("moving", value, wanted)
    })
}
