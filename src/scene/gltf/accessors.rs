//! Numbers of accessors, read from the buffers within their bounds.
//!
//! Component types are read as glTF defines them, normalised integers as their shares (KHR_mesh_quantization), and
//! sparse substitutes are put in. Memory is bounded by the buffers: each number comes from bytes that are there, and an
//! accessor without bytes of its own has no more numbers than the buffers have bytes.
//!
//! Not handled: matrices, whose columns are padded; nothing that is read here has any.

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::View;
use gltf_json::validation::Checked;
use gltf_json::{Accessor, Index, Root};

use crate::scene::gltf::document::Bytes;

/// The document with its buffers.
pub(super) struct Data<'a> {
    pub root: &'a Root,
    pub buffers: &'a [Bytes<'a>],
}

/// How an element is stored.
#[derive(Clone, Copy)]
struct Layout {
    kind: ComponentType,
    parts: usize,
    normalized: bool,
}

impl Layout {
    fn size(self) -> usize {
        self.kind.size() * self.parts
    }
}

impl Data<'_> {
    /// All numbers of an accessor whose elements are of type `wanted`, one element after the other.
    pub(super) fn numbers(&self, index: Index<Accessor>, wanted: Type) -> Result<Vec<f64>, String> {
        self.read(&self.root.accessors[index.value()], wanted).map_err(|what| format!("accessor {index}: {what}"))
    }

    fn read(&self, accessor: &Accessor, wanted: Type) -> Result<Vec<f64>, String> {
        let (Checked::Valid(kind), Checked::Valid(found)) = (&accessor.component_type, &accessor.type_) else {
            return Err("its types are unknown".to_owned());
        };
        if *found != wanted {
            return Err(format!("its type is {found:?}, not {wanted:?}"));
        }
        let GenericComponentType(kind) = *kind;
        let layout = Layout { kind, parts: wanted.multiplicity(), normalized: accessor.normalized };
        let mut numbers = match accessor.buffer_view {
            Some(view) => self.part(view, accessor.byte_offset.unwrap_or_default().0, layout, accessor.count.0)?,
            None => self.zeros(accessor.count.0, layout.parts)?,
        };
        self.substitute(accessor, layout, &mut numbers)?;
        Ok(numbers)
    }

    /// What an accessor without a buffer view begins with.
    fn zeros(&self, count: u64, parts: usize) -> Result<Vec<f64>, String> {
        let most: usize = self.buffers.iter().map(|bytes| bytes.len()).sum();
        let count = usize::try_from(count).ok().filter(|&count| count <= most);
        let count = count.ok_or("it has more elements than the buffers have bytes")?;
        Ok(vec![0.0; count * parts])
    }

    /// Puts the values of a sparse accessor in.
    fn substitute(&self, accessor: &Accessor, layout: Layout, numbers: &mut [f64]) -> Result<(), String> {
        let Some(sparse) = &accessor.sparse else {
            return Ok(());
        };
        let Checked::Valid(kind) = &sparse.indices.component_type else {
            return Err("the type of its sparse indices is unknown".to_owned());
        };
        let of_places = Layout { kind: kind.0, parts: 1, normalized: false };
        let places = self.part(sparse.indices.buffer_view, sparse.indices.byte_offset.0, of_places, sparse.count.0)?;
        let values = self.part(sparse.values.buffer_view, sparse.values.byte_offset.0, layout, sparse.count.0)?;
        for (place, value) in places.iter().zip(values.chunks_exact(layout.parts)) {
            let start = *place as usize * layout.parts;
            let slot = numbers.get_mut(start..start + layout.parts);
            slot.ok_or_else(|| format!("its sparse index {place} is beyond its elements"))?.copy_from_slice(value);
        }
        Ok(())
    }

    /// Elements from an offset of a buffer view on.
    fn part(&self, view: Index<View>, offset: u64, layout: Layout, count: u64) -> Result<Vec<f64>, String> {
        let number = view;
        let view = &self.root.buffer_views[view.value()];
        let bytes =
            slice(&self.buffers[view.buffer.value()], view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = bytes.ok_or_else(|| format!("buffer view {number} goes beyond buffer {}", view.buffer))?;
        let size = layout.size();
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return Err(format!("its elements of {size} bytes overlap, being {stride} bytes apart"));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let length = (count - 1).checked_mul(stride as u64).and_then(|length| length.checked_add(size as u64));
        let bytes = length.and_then(|length| slice(bytes, offset, length)).ok_or_else(|| {
            format!("{count} elements of {size} bytes do not fit into the {} of buffer view {number}", bytes.len())
        })?;
        let parts = bytes.chunks(stride).flat_map(|element| element[..size].chunks_exact(layout.kind.size()));
        Ok(parts.map(|part| number_of(part, layout)).collect())
    }
}

/// The bytes from `start` on, if there are so many.
pub(super) fn slice(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    let (start, length) = (usize::try_from(start).ok()?, usize::try_from(length).ok()?);
    bytes.get(start..start.checked_add(length)?)
}

/// One component; integers as their share of the largest where they are normalised, -1 at the least.
fn number_of(bytes: &[u8], layout: Layout) -> f64 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    let (number, largest) = match layout.kind {
        ComponentType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes(two())), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes(two())), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(four())), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(four())),
    };
    if layout.normalized { (number / largest).max(-1.0) } else { number }
}
