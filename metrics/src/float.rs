//! Floats in JSON, which has no infinity and no NaN. Both are measurements and must not turn into "not measured", so
//! they are written as the strings "inf", "-inf" and "NaN". For `#[serde(with = "...")]`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Deserialize)]
#[serde(untagged)]
enum Text {
    Number(f64),
    Word(String),
}

impl Text {
    fn value<E: serde::de::Error>(self) -> Result<f64, E> {
        match self {
            Self::Number(value) => Ok(value),
            Self::Word(word) => word.parse().map_err(|_| E::custom(format!("`{word}` is not a number"))),
        }
    }
}

/// Writes a number, or a word for what JSON cannot hold.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { value.serialize(serializer) } else { serializer.collect_str(value) }
}

/// The reverse of [`serialize`].
///
/// # Errors
/// Where there is neither a number nor one of the words.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Text::deserialize(deserializer)?.value()
}

/// A float that serializes in this way.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Float(#[serde(with = "crate::float")] pub f64);

/// The same for a value that may be missing (null).
pub mod optional {
    use super::*;

    /// Writes a number, a word or null.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => super::serialize(value, serializer),
            None => serializer.serialize_none(),
        }
    }

    /// The reverse of [`serialize`].
    ///
    /// # Errors
    /// Where there is neither a number, nor one of the words, nor null.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
        Option::<Text>::deserialize(deserializer)?.map(Text::value).transpose()
    }
}
