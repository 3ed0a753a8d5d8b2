//! Accessors: typed lists in the buffers, with a stride, a sparse overlay, or nothing but zeros.

use super::Gltf;
use super::json;
use crate::util::error::Result;

/// Type of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }
}

/// An accessor whose every element lies within its buffer.
pub struct Accessor<'a> {
    pub count: usize,
    /// Components of an element.
    pub width: usize,
    pub component: Component,
    pub normalized: bool,
    /// Bytes from the first element on; `None` where all that the overlay lacks is zero.
    base: Option<&'a [u8]>,
    stride: usize,
    overlay: Option<Overlay<'a>>,
}

/// Sparse overlay: elements that replace those of the base.
struct Overlay<'a> {
    /// Indices of the replaced elements; they rise.
    indices: Vec<u32>,
    values: &'a [u8],
}

/// What the reader needs to know of an accessor before it is read.
pub struct Shape {
    pub count: u64,
}

impl Gltf<'_> {
    /// Returns the declared shape of an accessor.
    pub fn shape(&self, place: &str, index: usize) -> Result<Shape> {
        let accessors = &self.document.accessors;
        let index = self.index(place, index, accessors.len(), "accessors")?;
        Ok(Shape { count: accessors[index].count })
    }

    /// Checks an accessor and opens it for reading. `place` is what refers to it.
    pub fn accessor(&self, place: &str, index: usize) -> Result<Accessor<'_>> {
        let accessors = &self.document.accessors;
        let accessor = &accessors[self.index(place, index, accessors.len(), "accessors")?];
        let fault = |why: String| self.fault(place, format!("accessor {index} {why}"));
        let Some(component) = Component::of(accessor.component_type) else {
            return Err(fault(format!("has the unknown componentType {}", accessor.component_type)));
        };
        let width = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => {
                let kind = crate::model::paths::shorten(&accessor.kind);
                return Err(fault(format!("has the type {kind}, where a scalar or vector is needed")));
            }
        };
        let count = u32::try_from(accessor.count)
            .map_err(|_| fault(format!("has {} elements, more than an index can name", accessor.count)))?;
        let (count, element) = (count as usize, component.bytes() * width);
        let mut stride = element;
        let mut base = None;
        if let Some(view) = accessor.buffer_view {
            let bytes = self.view(place, view)?;
            if let Some(given) = self.document.buffer_views[view].byte_stride {
                let fits = usize::try_from(given).ok().filter(|given| *given >= element);
                stride = fits.ok_or_else(|| {
                    fault(format!("has elements of {element} bytes, bufferView {view} a stride of {given}"))
                })?;
            }
            let need = span(count, stride, element);
            base = Some(window(bytes, accessor.byte_offset, need).ok_or_else(|| {
                let (offset, there) = (accessor.byte_offset, bytes.len());
                fault(format!(
                    "reads past the end of bufferView {view}: {need} bytes from byte {offset}, there are \
                     {there}"
                ))
            })?);
        }
        let overlay = match &accessor.sparse {
            Some(sparse) => Some(self.overlay(place, index, sparse, count, element)?),
            None => None,
        };
        Ok(Accessor { count, width, component, normalized: accessor.normalized, base, stride, overlay })
    }

    fn overlay(
        &self,
        place: &str,
        index: usize,
        sparse: &json::Sparse,
        count: usize,
        element: usize,
    ) -> Result<Overlay<'_>> {
        let fault = |why: String| self.fault(place, format!("accessor {index}, sparse: {why}"));
        let component = Component::of(sparse.indices.component_type)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| fault("the indices are no unsigned integers".into()))?;
        if sparse.count > count as u64 {
            return Err(fault(format!("{} elements replace {count}", sparse.count)));
        }
        let length = sparse.count as usize;
        let part = |view: usize, offset: u64, need: usize| -> Result<&[u8]> {
            window(self.view(place, view)?, offset, need as u128)
                .ok_or_else(|| fault(format!("it reads past the end of bufferView {view}")))
        };
        let size = component.bytes();
        let from = &sparse.indices;
        let bytes = part(from.buffer_view, from.byte_offset, length * size)?;
        let values = part(sparse.values.buffer_view, sparse.values.byte_offset, length * element)?;
        let indices: Vec<u32> = bytes.chunks_exact(size).map(unsigned).collect();
        let rise = indices.windows(2).all(|pair| pair[0] < pair[1]);
        if !rise || indices.last().is_some_and(|last| *last as usize >= count) {
            return Err(fault(format!("the indices do not rise, or reach past {count} elements")));
        }
        Ok(Overlay { indices, values })
    }
}

/// Bytes from the first to the end of the last of `count` elements.
fn span(count: usize, stride: usize, element: usize) -> u128 {
    match count {
        0 => 0,
        _ => (count as u128 - 1) * stride as u128 + element as u128,
    }
}

fn window(bytes: &[u8], offset: u64, need: u128) -> Option<&[u8]> {
    let end = u128::from(offset) + need;
    (end <= bytes.len() as u128).then(|| &bytes[offset as usize..end as usize])
}

fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte))
}

impl Accessor<'_> {
    /// Bytes of an element; `None` where it is zero.
    fn element(&self, index: usize) -> Option<&[u8]> {
        let size = self.component.bytes() * self.width;
        if let Some(overlay) = &self.overlay
            && let Ok(at) = overlay.indices.binary_search(&(index as u32))
        {
            return Some(&overlay.values[at * size..][..size]);
        }
        self.base.map(|base| &base[index * self.stride..][..size])
    }

    /// Returns an unsigned integer of a scalar accessor.
    pub fn index_at(&self, index: usize) -> u32 {
        self.element(index).map_or(0, unsigned)
    }

    /// Returns an element as floats: the components it has, and zeros.
    pub fn floats(&self, index: usize) -> [f32; 4] {
        let mut out = [0.0; 4];
        let Some(bytes) = self.element(index) else { return out };
        let size = self.component.bytes();
        for (value, bytes) in out.iter_mut().zip(bytes.chunks_exact(size)) {
            *value = self.float(bytes);
        }
        out
    }

    /// One component. Normalised integers go to 0…1 or −1…1 (glTF 2.0, §3.11).
    fn float(&self, bytes: &[u8]) -> f32 {
        let bits = unsigned(bytes);
        let scaled = |value: f32, most: f32| if self.normalized { (value / most).max(-1.0) } else { value };
        match self.component {
            Component::I8 => scaled(f32::from(bits as u8 as i8), 127.0),
            Component::U8 => scaled(bits as f32, 255.0),
            Component::I16 => scaled(f32::from(bits as u16 as i16), 32767.0),
            Component::U16 => scaled(bits as f32, 65535.0),
            Component::U32 => bits as f32,
            Component::F32 => f32::from_bits(bits),
        }
    }
}
