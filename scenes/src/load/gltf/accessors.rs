//! Numbers in buffers. Every access is checked: the crate `gltf` panics over views that are too short.

use std::borrow::Cow;

use ::gltf::accessor::{Accessor, DataType, sparse::IndexType};
use ::gltf::buffer::View;

/// The contents of the buffers.
pub(super) struct Buffers<'a>(pub Vec<Cow<'a, [u8]>>);

/// Largest number of elements that have no bytes of their own in the file. Vertices without a position of their own are
/// all in one place, so only a damaged count has more.
const MOST_ZEROS: usize = 1 << 18;

impl Buffers<'_> {
    /// The bytes of a view.
    pub fn view(&self, view: &View) -> Result<&[u8], String> {
        let buffer = self.0.get(view.buffer().index()).map_or(&[][..], |bytes| bytes);
        let end = view.offset().checked_add(view.length());
        let bytes = end.and_then(|end| buffer.get(view.offset()..end));
        bytes.ok_or_else(|| format!("buffer view {} reaches beyond its buffer", view.index()))
    }

    /// Vectors of numbers, the first `N` components of each; whole numbers are normalized if the accessor says so.
    pub fn vectors<const N: usize>(&self, accessor: &Accessor) -> Result<Vec<[f32; N]>, String> {
        let components = accessor.dimensions().multiplicity();
        if components < N {
            return Err(format!("accessor {} has {components} components and not {N}", accessor.index()));
        }
        let (kind, normalized) = (accessor.data_type(), accessor.normalized());
        let read = |bytes: &[u8]| {
            let size = kind.size();
            let mut vector = [0.0; N];
            for (value, bytes) in vector.iter_mut().zip(bytes.chunks_exact(size)) {
                *value = number(kind, normalized, bytes);
            }
            vector
        };
        self.elements(accessor, [0.0; N], read)
    }

    /// Whole numbers, one per element.
    pub fn indices(&self, accessor: &Accessor) -> Result<Vec<u32>, String> {
        let kind = accessor.data_type();
        if !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32) {
            return Err(format!("accessor {} does not hold indices", accessor.index()));
        }
        self.elements(accessor, 0, |bytes| whole(bytes, kind.size()))
    }

    fn elements<T: Clone>(&self, accessor: &Accessor, zero: T, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, String> {
        let (count, size) = (accessor.count(), accessor.size());
        let mut elements = match accessor.view() {
            Some(view) => {
                let bytes = self.view(&view)?;
                let stride = view.stride().unwrap_or(size);
                strided(accessor, bytes, [accessor.offset(), stride, size], count, &read)?
            }
            None if accessor.sparse().is_some() && count <= MOST_ZEROS => vec![zero; count],
            None => return Err(format!("accessor {} has no data", accessor.index())),
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let index_size = match indices.index_type() {
                IndexType::U8 => 1,
                IndexType::U16 => 2,
                IndexType::U32 => 4,
            };
            let bytes = self.view(&indices.view())?;
            let index = |bytes: &[u8]| whole(bytes, index_size);
            let at = strided(accessor, bytes, [indices.offset(), index_size, index_size], sparse.count(), &index)?;
            let bytes = self.view(&values.view())?;
            let values = strided(accessor, bytes, [values.offset(), size, size], sparse.count(), &read)?;
            for (at, value) in at.into_iter().zip(values) {
                let slot = elements.get_mut(at as usize);
                *slot.ok_or_else(|| format!("accessor {} replaces elements that it has not", accessor.index()))? =
                    value;
            }
        }
        Ok(elements)
    }
}

/// Elements of `size` bytes, `stride` bytes apart.
fn strided<T>(
    accessor: &Accessor,
    bytes: &[u8],
    [offset, stride, size]: [usize; 3],
    count: usize,
    read: &impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, String> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let stride = stride.max(1);
    let start = |i: usize| i.checked_mul(stride)?.checked_add(offset);
    // The last element needs only its own size.
    let end = start(count - 1).and_then(|start| start.checked_add(size));
    if end.is_none_or(|end| end > bytes.len()) {
        return Err(format!("accessor {} reaches beyond its buffer view", accessor.index()));
    }
    Ok((0..count).map(|i| read(&bytes[offset + i * stride..offset + i * stride + size])).collect())
}

/// One number of these bytes; 0 if they are too few.
fn number(kind: DataType, normalized: bool, bytes: &[u8]) -> f32 {
    let two = || bytes.first_chunk::<2>().copied().unwrap_or_default();
    let four = || bytes.first_chunk::<4>().copied().unwrap_or_default();
    let one = bytes.first().copied().unwrap_or_default();
    let scaled = |value: f32, largest: f32| if normalized { (value / largest).max(-1.0) } else { value };
    match kind {
        DataType::I8 => scaled(f32::from(one as i8), 127.0),
        DataType::U8 => scaled(f32::from(one), 255.0),
        DataType::I16 => scaled(f32::from(i16::from_le_bytes(two())), 32767.0),
        DataType::U16 => scaled(f32::from(u16::from_le_bytes(two())), 65535.0),
        DataType::U32 => u32::from_le_bytes(four()) as f32,
        DataType::F32 => f32::from_le_bytes(four()),
    }
}

fn whole(bytes: &[u8], size: usize) -> u32 {
    bytes.iter().take(size).rev().fold(0, |value, &byte| (value << 8) | u32::from(byte))
}
