//! Long arrays of plain numbers as one run of bytes, for `#[serde(with = "halflight_scenes::bulk")]`.
//!
//! serde writes an array number by number. That takes long for a mesh, and most of the time in a browser, where a scene
//! travels from a worker to the page as bytes. Bytes are in the order of the machine: what was written on one machine is not
//! for another.

use std::{fmt, marker::PhantomData};

use bytemuck::Pod;
use serde::{
    Deserializer, Serializer,
    de::{Error, Visitor},
};

/// Writes an array.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<T: Pod, S: Serializer>(values: &[T], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytemuck::cast_slice(values))
}

/// Reads an array.
///
/// # Errors
/// If the bytes are not a whole number of values, and those of the deserializer.
pub fn deserialize<'de, T: Pod, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    deserializer.deserialize_bytes(Values(PhantomData))
}

struct Values<T>(PhantomData<T>);

impl<T: Pod> Visitor<'_> for Values<T> {
    type Value = Vec<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "bytes in units of {}", size_of::<T>())
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<T>, E> {
        if !bytes.len().is_multiple_of(size_of::<T>()) {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }
}
