//! Parameters. Each one is declared once, with [`crate::parameters!`]. The shader, the command line, the grid file, the
//! slider and the report's column use that declaration.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

/// A value of a parameter, in the notation of grid files, command lines and tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f64),
    /// The name of a choice.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(v) => v.fmt(f),
            Self::Int(v) => v.fmt(f),
            Self::Float(v) => v.fmt(f),
            Self::Text(v) => v.fmt(f),
        }
    }
}

impl Value {
    /// Parses a value of a command line: `true`, `12`, `0.5`, otherwise a name.
    pub fn parse(text: &str) -> Self {
        if let Ok(v) = text.parse() {
            Self::Bool(v)
        } else if let Ok(v) = text.parse() {
            Self::Int(v)
        } else {
            text.parse().map_or_else(|_| Self::Text(text.to_owned()), Self::Float)
        }
    }
}

/// Settings by `technique.parameter`.
pub type Settings = BTreeMap<String, Value>;

/// Allowed values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Whole numbers from the first to the second.
    Int(i64, i64),
    /// Numbers from the first to the second.
    Float(f64, f64),
    /// One of these names.
    Choice(&'static [&'static str]),
}

/// How a parameter reaches the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A pipeline-overridable constant: each new value compiles a pipeline.
    Override,
    /// A number in a pass's uniform block, or an input of one.
    Uniform,
    /// It changes the passes, textures or shader variants of the plan.
    Plan,
}

/// The declaration of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Technique that it belongs to.
    pub technique: &'static str,
    /// Name within the technique.
    pub name: &'static str,
    /// Unit; `1` for a pure number, empty for choices.
    pub unit: &'static str,
    /// Allowed values.
    pub kind: Kind,
    /// Default value.
    pub default: Value,
    /// Suggested values for a grid.
    pub grid: Vec<Value>,
    /// How it reaches the device.
    pub role: Role,
    /// Its meaning, one or more sentences.
    pub doc: &'static str,
}

impl Parameter {
    /// `technique.name`, the key in settings and tables.
    pub fn key(&self) -> String {
        format!("{}.{}", self.technique, self.name)
    }

    /// The allowed values in words: `1 to 1024`, `half, quarter or full`.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Int(low, high) => format!("{low} to {high}"),
            Kind::Float(low, high) => format!("{low} to {high}"),
            Kind::Choice(names) => names.join(" | "),
        }
    }

    /// Checks a value. Converts whole numbers to floats if the parameter is a float.
    ///
    /// # Errors
    /// One sentence with the key, the value and the allowed values.
    pub fn check(&self, value: &Value) -> Result<Value, SettingsError> {
        let checked = match (self.kind, value) {
            (Kind::Int(low, high), &Value::Int(v)) if (low..=high).contains(&v) => Some(Value::Int(v)),
            (Kind::Float(low, high), &Value::Int(v)) if (low..=high).contains(&(v as f64)) => {
                Some(Value::Float(v as f64))
            }
            (Kind::Float(low, high), &Value::Float(v)) if (low..=high).contains(&v) => Some(Value::Float(v)),
            (Kind::Choice(names), Value::Text(v)) if names.contains(&v.as_str()) => Some(value.clone()),
            // The name of a choice may look like a number.
            (Kind::Choice(names), Value::Int(v)) if names.contains(&v.to_string().as_str()) => {
                Some(Value::Text(v.to_string()))
            }
            _ => None,
        };
        checked.ok_or_else(|| {
            let unit = if matches!(self.unit, "" | "1") { String::new() } else { format!(" {}", self.unit) };
            SettingsError(format!("{} = {value} is out of range: give {}{unit}", self.key(), self.range()))
        })
    }
}

/// An invalid setting: one sentence with the key and the fix.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", halflight_scenes::one_line(.0))]
pub struct SettingsError(pub String);

/// A Rust type that a parameter can have.
pub trait ParameterType: Sized {
    /// Values of the type. Numbers are limited by the range of the declaration.
    fn kind(low: f64, high: f64) -> Kind;
    /// Converts a value that passed [`Parameter::check`].
    fn from_value(value: &Value) -> Option<Self>;
    /// Converts to a value.
    fn to_value(&self) -> Value;
}

impl ParameterType for u32 {
    fn kind(low: f64, high: f64) -> Kind {
        Kind::Int(low as i64, high as i64)
    }
    fn from_value(value: &Value) -> Option<Self> {
        if let Value::Int(v) = value { u32::try_from(*v).ok() } else { None }
    }
    fn to_value(&self) -> Value {
        Value::Int(i64::from(*self))
    }
}

impl ParameterType for f32 {
    fn kind(low: f64, high: f64) -> Kind {
        Kind::Float(low, high)
    }
    fn from_value(value: &Value) -> Option<Self> {
        if let Value::Float(v) = value { Some(*v as f32) } else { None }
    }
    fn to_value(&self) -> Value {
        // The shortest decimal, 0.9, instead of the nearest float32 in 16 digits.
        Value::Float(self.to_string().parse().unwrap_or_else(|_| f64::from(*self)))
    }
}

/// Declares a choice: an enum whose variants have a name in files and a number in shaders.
#[macro_export]
macro_rules! choice {
    ($(#[$meta:meta])* pub enum $type:ident { $($(#[$variant_meta:meta])* $variant:ident = $name:literal),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $type { $($(#[$variant_meta])* $variant),+ }

        impl $crate::parameters::ParameterType for $type {
            fn kind(_: f64, _: f64) -> $crate::parameters::Kind {
                $crate::parameters::Kind::Choice(&[$($name),+])
            }
            fn from_value(value: &$crate::parameters::Value) -> Option<Self> {
                let $crate::parameters::Value::Text(text) = value else { return None };
                match text.as_str() { $($name => Some(Self::$variant),)+ _ => None }
            }
            fn to_value(&self) -> $crate::parameters::Value {
                $crate::parameters::Value::Text(match self { $(Self::$variant => $name),+ }.into())
            }
        }
    };
}

/// Declares the parameters of a technique: a struct with defaults, and the table of declarations. Field syntax: `///
/// doc` `name: type = default, in low..=high, unit "px", grid [a, b], role Uniform;`
#[macro_export]
macro_rules! parameters {
    (
        $(#[$meta:meta])*
        pub struct $type:ident($technique:literal) {
            $(
                $(#[doc = $doc:literal])+
                $name:ident: $field:ty = $default:expr, $(in $low:literal..=$high:literal,)? unit $unit:literal,
                grid [$($grid:expr),*], role $role:expr;
            )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $type { $($(#[doc = $doc])+ pub $name: $field,)* }

        impl Default for $type {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl $type {
            /// Name of the technique.
            pub const TECHNIQUE: &'static str = $technique;

            /// The declarations, in order.
            pub fn parameters() -> Vec<$crate::parameters::Parameter> {
                #[allow(unused_imports)]
                use $crate::parameters::{Parameter, ParameterType, Role::*};
                vec![$(Parameter {
                    technique: $technique,
                    name: stringify!($name),
                    unit: $unit,
                    kind: {
                        #[allow(unused_mut, unused_assignments)]
                        let mut range = (0.0, 0.0);
                        $(range = (f64::from($low), f64::from($high));)?
                        <$field>::kind(range.0, range.1)
                    },
                    default: <$field as ParameterType>::to_value(&$default),
                    grid: vec![$(<$field as ParameterType>::to_value(&$grid)),*],
                    role: $role,
                    doc: concat!($($doc),+).trim_ascii_start(),
                }),*]
            }

            /// Reads the settings of this technique and ignores those of others.
            ///
            /// # Errors
            /// A value that its declaration does not allow.
            pub fn from_settings(
                settings: &$crate::parameters::Settings,
            ) -> Result<Self, $crate::parameters::SettingsError> {
                #[allow(unused_imports)]
                use $crate::parameters::ParameterType;
                #[allow(unused_mut)]
                let mut result = Self::default();
                #[allow(unused_variables)]
                let declared = Self::parameters();
                $(if let Some(value) = settings.get(concat!($technique, ".", stringify!($name)))
                    && let Some(parameter) = declared.iter().find(|p| p.name == stringify!($name))
                    && let Some(value) = <$field>::from_value(&parameter.check(value)?)
                {
                    result.$name = value;
                })*
                Ok(result)
            }

            /// Every parameter with its value.
            pub fn to_settings(&self) -> $crate::parameters::Settings {
                #[allow(unused_imports)]
                use $crate::parameters::ParameterType;
                $crate::parameters::Settings::from([
                    $((concat!($technique, ".", stringify!($name)).to_owned(), self.$name.to_value())),*
                ])
            }
        }
    };
}

/// Rejects unknown settings and suggests the nearest key.
///
/// # Errors
/// The first unknown key, or a value out of range.
pub fn check_settings(settings: &Settings, declared: &[Parameter]) -> Result<(), SettingsError> {
    for (key, value) in settings {
        match declared.iter().find(|parameter| parameter.key() == *key) {
            Some(parameter) => drop(parameter.check(value)?),
            None => {
                let keys: Vec<String> = declared.iter().map(Parameter::key).collect();
                let names = keys.iter().map(String::as_str);
                let hint = halflight_scenes::nearest_name(key, names).map_or_else(
                    || format!("the parameters are {}", keys.join(", ")),
                    |near| format!("did you mean {near}?"),
                );
                return Err(SettingsError(format!("{key} is not a parameter: {hint}")));
            }
        }
    }
    Ok(())
}
