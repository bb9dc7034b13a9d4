//! A sweep: all combinations of lists of values, made one at a time.

use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::{SceneError, keys::Table};
use halflight_techniques::preset::{check, declaration};

use super::Cell;

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
        Ok(Self { technique, complete: complete(&fixed)?, fixed, lists })
    }

    /// Number of combinations; `u64::MAX` where it is larger.
    pub fn len(&self) -> u64 {
        self.lists.iter().fold(1, |product: u64, (_, values)| product.saturating_mul(values.len() as u64))
    }

    /// Whether it has no combination. A sweep of a file has at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The combination of this number, from 0.
    pub fn cell(&self, index: u64) -> Cell {
        let mut settings = self.complete.clone();
        let mut rest = index;
        for (key, values) in self.lists.iter().rev() {
            let count = values.len().max(1) as u64;
            if let Some(value) = values.get((rest % count) as usize) {
                settings.insert(key.clone(), value.clone());
            }
            rest /= count;
        }
        Cell { technique: self.technique, settings }
    }
}
