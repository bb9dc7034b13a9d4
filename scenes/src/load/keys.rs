//! Typed reading of TOML tables, with one sentence for everything that can be wrong. Scene files and grid files are
//! read with it.

use std::ops::{Range, RangeInclusive};
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::SceneError;

/// The candidate that `name` is probably a misspelling of: the one with the smallest edit distance
/// (Damerau-Levenshtein), unless the distance is too large for a misspelling.
pub fn nearest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |s: &str| s.to_lowercase().replace(['-', ' '], "_");
    let name = plain(name);
    candidates
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(&name, &plain(candidate)), candidate))
        .min_by_key(|&(edits, _)| edits)
        .filter(|&(edits, candidate)| edits <= 1 + name.len().min(candidate.len()) / 3)
        .map(|(_, candidate)| candidate)
}

/// `a, b or c`, each name in backquotes.
pub fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<_> = names.into_iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => "nothing".into(),
    }
}

/// A TOML file while it is being read.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// Its path, for messages.
    pub path: &'a Path,
    /// Its contents.
    pub text: &'a str,
}

impl<'a> Source<'a> {
    /// Parses the contents.
    ///
    /// # Errors
    /// The line and the reason if the contents are not valid TOML.
    pub fn parse(&self) -> Result<Spanned<DeTable<'a>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| {
            let message = error.message().replace('\n', ", ");
            self.error(error.span().unwrap_or_default(), format_args!("not valid TOML: {message}"))
        })
    }

    /// The error `path:line: sentence` for a position in the file.
    pub fn error(&self, span: Range<usize>, sentence: impl std::fmt::Display) -> SceneError {
        let line = 1 + self.text.as_bytes()[..span.start.min(self.text.len())].iter().filter(|&&b| b == b'\n').count();
        SceneError(format!("{}:{line}: {sentence}", self.path.display()))
    }
}

/// A table whose keys are read one by one. Each getter refuses a value of the wrong type or range with a sentence that
/// names file, line, key, value, and what is allowed.
#[derive(Clone, Copy)]
pub struct Table<'a> {
    source: Source<'a>,
    /// Name for messages, such as `camera`; empty for the whole file.
    name: &'static str,
    span: (usize, usize),
    table: &'a DeTable<'a>,
}

/// A value and its position in the file.
pub type Value<'a> = Spanned<DeValue<'a>>;

impl<'a> Table<'a> {
    /// The top-level table of a file. Keys other than these are refused.
    pub fn file(source: Source<'a>, table: &'a Spanned<DeTable<'a>>, keys: &[&str]) -> Result<Self, SceneError> {
        Self { source, name: "", span: (0, 0), table: table.get_ref() }.only(keys)
    }

    /// Refuses keys other than these. The message suggests the nearest valid key.
    pub fn only(self, keys: &[&str]) -> Result<Self, SceneError> {
        let unknown = self.table.keys().filter(|key| !keys.contains(&key.get_ref().as_ref()));
        let Some(unknown) = unknown.min_by_key(|key| key.span().start) else { return Ok(self) };
        let fix = nearest_name(unknown.get_ref(), keys.iter().copied())
            .map_or_else(|| format!("use {}", listed(keys.iter().copied())), |near| format!("did you mean `{near}`?"));
        let sentence = format!("unknown key `{}`; {fix}", self.full(unknown.get_ref()));
        Err(self.source.error(unknown.span(), sentence))
    }

    fn full(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// The raw value under this key.
    pub fn get(&self, key: &str) -> Option<&'a Value<'a>> {
        self.table.get(key)
    }

    /// An error at this key, or at the head of the table if the key is absent.
    pub fn error(&self, key: &str, sentence: impl std::fmt::Display) -> SceneError {
        let span = self.get(key).map_or(self.span.0..self.span.1, Spanned::span);
        self.source.error(span, format_args!("`{}` {sentence}", self.full(key)))
    }

    /// The error that the value of this key has the wrong type or range.
    pub fn wrong(&self, key: &str, value: &Value<'a>, wanted: impl std::fmt::Display) -> SceneError {
        let text = self.source.text.get(value.span()).unwrap_or_default();
        let text = text.lines().next().unwrap_or_default();
        self.error(key, format_args!("is {text}; it must be {wanted}"))
    }

    /// Whether the key is there.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// The value.
    ///
    /// # Errors
    /// A sentence with the example if the value is missing.
    pub fn required<T>(&self, key: &str, value: Option<T>, example: &str) -> Result<T, SceneError> {
        value.ok_or_else(|| self.error(key, format_args!("is missing; write for example `{example}`")))
    }

    /// Text.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        let read =
            |value: &'a Value<'a>| value.get_ref().as_str().ok_or_else(|| self.wrong(key, value, "text in quotes"));
        self.get(key).map(read).transpose()
    }

    /// `true` or `false`.
    pub fn boolean(&self, key: &str) -> Result<Option<bool>, SceneError> {
        let read =
            |value: &Value<'a>| value.get_ref().as_bool().ok_or_else(|| self.wrong(key, value, "`true` or `false`"));
        self.get(key).map(read).transpose()
    }

    /// A number in a range.
    pub fn number(&self, key: &str, range: RangeInclusive<f32>) -> Result<Option<f32>, SceneError> {
        let read = |value: &Value<'a>| {
            number(value).filter(|x| range.contains(x)).ok_or_else(|| {
                self.wrong(key, value, format_args!("a number from {} to {}", range.start(), range.end()))
            })
        };
        self.get(key).map(read).transpose()
    }

    /// A whole number in a range.
    pub fn integer(&self, key: &str, range: RangeInclusive<u32>) -> Result<Option<u32>, SceneError> {
        let read = |value: &Value<'a>| {
            let number = match value.get_ref() {
                DeValue::Integer(integer) => u32::from_str_radix(integer.as_str(), integer.radix()).ok(),
                _ => None,
            };
            number.filter(|n| range.contains(n)).ok_or_else(|| {
                self.wrong(key, value, format_args!("a whole number from {} to {}", range.start(), range.end()))
            })
        };
        self.get(key).map(read).transpose()
    }

    /// A list of texts.
    pub fn texts(&self, key: &str) -> Result<Option<Vec<&'a str>>, SceneError> {
        let read = |value: &'a Value<'a>| {
            let texts = value.get_ref().as_array().and_then(|list| list.iter().map(|v| v.get_ref().as_str()).collect());
            texts.ok_or_else(|| self.wrong(key, value, "a list of texts in quotes"))
        };
        self.get(key).map(read).transpose()
    }

    /// All keys and values of the table under this key, in the order of the file.
    pub fn entries(&self, key: &str) -> Result<Vec<(&'a str, &'a Value<'a>)>, SceneError> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let table = value.get_ref().as_table().ok_or_else(|| self.wrong(key, value, "a table"))?;
        let mut entries: Vec<_> = table.iter().map(|(key, value)| (key.get_ref().as_ref(), value)).collect();
        entries.sort_by_key(|(_, value)| value.span().start);
        Ok(entries)
    }

    /// The file that contains the table.
    pub fn source(&self) -> Source<'a> {
        self.source
    }

    /// Three finite numbers that satisfy `accept`; `wanted` describes them.
    pub fn vector(
        &self,
        key: &str,
        wanted: &str,
        accept: impl Fn([f32; 3]) -> bool,
    ) -> Result<Option<[f32; 3]>, SceneError> {
        let read = |value: &Value<'a>| {
            three_numbers(value)
                .filter(|&v| accept(v))
                .ok_or_else(|| self.wrong(key, value, format_args!("[x, y, z], {wanted}")))
        };
        self.get(key).map(read).transpose()
    }

    /// Three numbers that are finite in float32, as float64: positions far from the origin need its digits.
    pub fn position(&self, key: &str) -> Result<Option<[f64; 3]>, SceneError> {
        let read = |value: &Value<'a>| {
            let numbers: Option<Vec<f64>> =
                value.get_ref().as_array().and_then(|list| list.iter().map(exact_number).collect());
            let three = numbers.and_then(|numbers| numbers.try_into().ok());
            three.ok_or_else(|| self.wrong(key, value, "[x, y, z], finite numbers"))
        };
        self.get(key).map(read).transpose()
    }

    /// One number for all axes, or three; none of them 0.
    pub fn scale(&self, key: &str) -> Result<Option<[f32; 3]>, SceneError> {
        let read = |value: &Value<'a>| {
            number(value)
                .map(|s| [s; 3])
                .or_else(|| three_numbers(value))
                .filter(|s| s.iter().all(|&x| x != 0.0))
                .ok_or_else(|| self.wrong(key, value, "a finite number or [x, y, z], none of them 0"))
        };
        self.get(key).map(read).transpose()
    }

    /// A table under this key.
    pub fn table(&self, key: &'static str, keys: &[&str]) -> Result<Option<Self>, SceneError> {
        let read = |value: &'a Value<'a>| {
            self.child(key, value, keys).ok_or_else(|| self.wrong(key, value, format_args!("a table, [{key}]")))?
        };
        self.get(key).map(read).transpose()
    }

    /// An array of tables under this key; empty if the key is absent.
    pub fn tables(&self, key: &'static str, keys: &[&str]) -> Result<Vec<Self>, SceneError> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let wrong = |value| self.wrong(key, value, format_args!("an array of tables, [[{key}]]"));
        let array = value.get_ref().as_array().ok_or_else(|| wrong(value))?;
        array.iter().map(|value| self.child(key, value, keys).ok_or_else(|| wrong(value))?).collect()
    }

    /// `None` if the value is not a table.
    fn child(&self, name: &'static str, value: &'a Value<'a>, keys: &[&str]) -> Option<Result<Self, SceneError>> {
        let span = (value.span().start, value.span().end);
        value.get_ref().as_table().map(|table| Self { source: self.source, name, span, table }.only(keys))
    }
}

/// A finite number.
fn number(value: &Value<'_>) -> Option<f32> {
    let number = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok()?,
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok()? as f32,
        _ => return None,
    };
    Some(number).filter(|x: &f32| x.is_finite())
}

/// A number that is finite in float32, with the digits of float64.
fn exact_number(value: &Value<'_>) -> Option<f64> {
    let number = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok()?,
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok()? as f64,
        _ => return None,
    };
    Some(number).filter(|x: &f64| (*x as f32).is_finite())
}

fn three_numbers(value: &Value<'_>) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = value.get_ref().as_array()?.iter().map(number).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelling_gets_the_nearest_name() {
        let keys = ["half_angle_degrees", "intensity", "position"];
        assert_eq!(nearest_name("intesity", keys), Some("intensity"));
        assert_eq!(nearest_name("Half-Angle-Degrees", keys), Some("half_angle_degrees"));
        assert_eq!(nearest_name("fog", keys), None);
        assert_eq!(nearest_name("fog", []), None);
    }
}
