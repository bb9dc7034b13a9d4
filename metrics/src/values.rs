//! The values of the metrics of one image.

use std::fmt;

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{MapAccess, Visitor},
    ser::SerializeMap,
};

use crate::{
    DisplayPair, LinearPair,
    float::Float,
    table::{COUNT, Function, METRICS, MetricId},
};

/// A value for each metric of [`METRICS`]; `None` is not measured.
///
/// It serializes as a map from [`crate::Metric::key`] to the value, in the order of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values([Option<f64>; COUNT]);

impl Default for Values {
    fn default() -> Self {
        Self([None; COUNT])
    }
}

impl Values {
    /// The value of a metric.
    pub fn get(&self, id: MetricId) -> Option<f64> {
        self.0[id as usize]
    }

    /// Sets the value of a metric.
    pub fn set(&mut self, id: MetricId, value: Option<f64>) {
        self.0[id as usize] = value;
    }

    /// Measures everything that is defined on indirect light (`albedo * indirect`) of this many pixels per row.
    pub fn measure_indirect(&mut self, pair: &LinearPair, width: u32) {
        self.measure(|function| match function {
            Function::Indirect(of) => Some(of(pair)),
            Function::IndirectBlocks(of) => Some(of(pair, width)),
            _ => None,
        });
    }

    /// Measures everything that is defined on ambient visibility.
    pub fn measure_occlusion(&mut self, pair: &LinearPair) {
        self.measure(|function| match function {
            Function::Occlusion(of) => Some(of(pair)),
            _ => None,
        });
    }

    /// Measures everything that is defined on the final image.
    pub fn measure_final(&mut self, pair: &DisplayPair) {
        self.measure(|function| match function {
            Function::Final(of) => Some(of(pair)),
            _ => None,
        });
    }

    fn measure(&mut self, of: impl Fn(&Function) -> Option<f64>) {
        for (value, metric) in self.0.iter_mut().zip(METRICS) {
            if let Some(measured) = of(&metric.function) {
                *value = Some(measured);
            }
        }
    }
}

impl Serialize for Values {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (value, metric) in self.0.iter().zip(METRICS) {
            if value.is_some() || !metric.optional {
                map.serialize_entry(metric.key, &value.map(Float))?;
            }
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Values {
    /// Reads the keys of metrics and ignores all others, so that values can share a flat object with other columns.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Columns;
        impl<'de> Visitor<'de> for Columns {
            type Value = Values;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object of metrics")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Values, A::Error> {
                let mut values = Values::default();
                while let Some(key) = map.next_key::<String>()? {
                    match METRICS.iter().find(|metric| metric.key == key) {
                        Some(metric) => values.set(metric.id, map.next_value::<Option<Float>>()?.map(|Float(v)| v)),
                        None => drop(map.next_value::<serde::de::IgnoredAny>()?),
                    }
                }
                Ok(values)
            }
        }
        deserializer.deserialize_map(Columns)
    }
}
