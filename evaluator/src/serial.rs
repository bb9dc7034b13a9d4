//! JSON has no infinity and no NaN; a report must not turn either into "not measured".

/// A float whose non-finite values are the strings "inf", "-inf" and "NaN".
pub mod float {
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

    /// Number, or word for what JSON cannot hold.
    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() { value.serialize(serializer) } else { serializer.collect_str(value) }
    }

    /// The reverse of [`serialize`].
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Text::deserialize(deserializer)?.value()
    }

    /// The same for a value that may be missing (null).
    pub mod optional {
        use super::*;

        /// Number, word or null.
        pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
            match value {
                Some(value) => super::serialize(value, serializer),
                None => serializer.serialize_none(),
            }
        }

        /// The reverse of [`serialize`].
        pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
            Option::<Text>::deserialize(deserializer)?.map(Text::value).transpose()
        }
    }
}
