//! Numbers of accessors, read from the buffers within their bounds.
//!
//! Component types are read as glTF defines them, normalised integers as their shares (KHR_mesh_quantization), and
//! sparse substitutes are put in. Memory is bounded by the buffers: each number comes from bytes that are there, and an
//! accessor without bytes of its own has no more numbers than the buffers have bytes.
//!
//! Not handled: matrices whose columns are padded, which those of four rows are not.

use crate::scene::gltf::buffers::{Data, slice};
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::schema::{Accessor, Index, Sparse, Whole};

/// What an element is: how many numbers, and glTF's word for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub parts: usize,
    pub name: &'static str,
}

pub(super) const SCALAR: Shape = Shape { parts: 1, name: "SCALAR" };
pub(super) const VEC2: Shape = Shape { parts: 2, name: "VEC2" };
pub(super) const VEC3: Shape = Shape { parts: 3, name: "VEC3" };
pub(super) const VEC4: Shape = Shape { parts: 4, name: "VEC4" };
pub(super) const MAT4: Shape = Shape { parts: 16, name: "MAT4" };

/// How one number is stored.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// The type of a code of glTF.
    fn of(Whole(code): Whole) -> Result<Component, String> {
        match code {
            5120 => Ok(Component::I8),
            5121 => Ok(Component::U8),
            5122 => Ok(Component::I16),
            5123 => Ok(Component::U16),
            5125 => Ok(Component::U32),
            5126 => Ok(Component::F32),
            _ => Err(format!("its componentType is {code}, which is none of 5120 to 5123, 5125 and 5126")),
        }
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }
}

/// How an element is stored.
#[derive(Clone, Copy)]
struct Layout {
    component: Component,
    parts: usize,
    normalized: bool,
}

impl Layout {
    fn size(self) -> usize {
        self.component.size() * self.parts
    }
}

impl Data<'_, '_> {
    /// All numbers of an accessor whose elements are of shape `wanted`, one element after the other.
    pub(super) fn numbers(&self, index: Index, wanted: Shape) -> Result<Vec<f64>, Fault> {
        let accessor = item(&self.root.accessors, index, "accessor")?;
        self.read(accessor, wanted).map_err(|fault| fault.within(&format!("accessor {}", index.0)))
    }

    fn read(&self, accessor: &Accessor, wanted: Shape) -> Result<Vec<f64>, Fault> {
        if accessor.kind != wanted.name {
            let found: String = accessor.kind.chars().filter(|c| !c.is_control()).take(40).collect();
            return Err(format!("its type is {found}, not {}", wanted.name).into());
        }
        let component = Component::of(accessor.component_type)?;
        let layout = Layout { component, parts: wanted.parts, normalized: accessor.normalized };
        let mut numbers = match accessor.buffer_view {
            Some(view) => self.part(view, accessor.byte_offset, layout, accessor.count)?,
            None => self.zeros(accessor.count, layout.parts)?,
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(sparse, layout, &mut numbers)?;
        }
        Ok(numbers)
    }

    /// What an accessor without a buffer view begins with.
    fn zeros(&self, count: Whole, parts: usize) -> Result<Vec<f64>, Fault> {
        let count = usize::try_from(count.0).ok().filter(|&count| count <= self.size());
        let count = count.ok_or("it has more elements than the buffers have bytes")?;
        Ok(vec![0.0; count * parts])
    }

    /// Puts the values of a sparse accessor in.
    fn substitute(&self, sparse: &Sparse, layout: Layout, numbers: &mut [f64]) -> Result<(), Fault> {
        let component = Component::of(sparse.indices.component_type)?;
        let of_places = Layout { component, parts: 1, normalized: false };
        let places = self.part(sparse.indices.buffer_view, sparse.indices.byte_offset, of_places, sparse.count)?;
        let values = self.part(sparse.values.buffer_view, sparse.values.byte_offset, layout, sparse.count)?;
        for (place, value) in places.iter().zip(values.chunks_exact(layout.parts)) {
            let start = (*place as usize).saturating_mul(layout.parts);
            let slot = numbers.get_mut(start..start.saturating_add(layout.parts));
            slot.ok_or_else(|| format!("its sparse index {place} is beyond its elements"))?.copy_from_slice(value);
        }
        Ok(())
    }

    /// Elements from an offset of a buffer view on.
    fn part(&self, view: Index, offset: Whole, layout: Layout, count: Whole) -> Result<Vec<f64>, Fault> {
        let (bytes, count) = (self.view(view)?, count.0);
        let size = layout.size();
        let stride = match self.root.buffer_views[view.0].byte_stride.0 {
            0 => size,
            given => usize::try_from(given).map_err(|_| "its byteStride is too large")?,
        };
        if count == 0 {
            return Ok(Vec::new());
        }
        if stride < size {
            return Err(format!("its elements of {size} bytes overlap, being {stride} bytes apart").into());
        }
        let length = (count - 1).checked_mul(stride as u64).and_then(|length| length.checked_add(size as u64));
        let bytes = length.and_then(|length| slice(bytes, offset.0, length)).ok_or_else(|| {
            format!("{count} elements of {size} bytes do not fit into the {} of buffer view {}", bytes.len(), view.0)
        })?;
        let parts = bytes.chunks(stride).flat_map(|element| element[..size].chunks_exact(layout.component.size()));
        Ok(parts.map(|part| number_of(part, layout)).collect())
    }
}

/// One component; integers as their share of the largest where they are normalised, -1 at the least.
fn number_of(bytes: &[u8], layout: Layout) -> f64 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    let (number, largest) = match layout.component {
        Component::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        Component::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        Component::I16 => (f64::from(i16::from_le_bytes(two())), f64::from(i16::MAX)),
        Component::U16 => (f64::from(u16::from_le_bytes(two())), f64::from(u16::MAX)),
        Component::U32 => (f64::from(u32::from_le_bytes(four())), f64::from(u32::MAX)),
        Component::F32 => return f64::from(f32::from_le_bytes(four())),
    };
    if layout.normalized { (number / largest).max(-1.0) } else { number }
}
