//! Check of a single value in a binary file of USD, before the crate `openusd` reads it.

use super::bytes::{Bytes, ints};
use super::sizes::Layout;

/// Bytes of memory for an integer while its row is decoded, here and in the crate, and for a token.
const INT: u128 = 24;

/// Value as a file refers to it: its type, whether it is an array, and where it lies.
#[derive(Clone, Copy)]
pub(super) struct Reference(pub u64);

/// Numbers of the types in a file.
mod kind {
    pub const BOOL: u8 = 1;
    pub const INT: u8 = 3;
    pub const HALF: u8 = 7;
    pub const FLOAT: u8 = 8;
    pub const DOUBLE: u8 = 9;
    pub const TOKEN: u8 = 11;
    pub const MATRIX: u8 = 15;
    pub const QUATERNIONS: [u8; 3] = [16, 17, 18];
    pub const VEC3D: u8 = 23;
    pub const VEC3F: u8 = 24;
    pub const VEC3H: u8 = 25;
    pub const SPECIFIER: u8 = 42;
    pub const TIME_SAMPLES: u8 = 46;
    pub const DOUBLES: u8 = 48;
    pub const BLOCK: u8 = 51;
}

impl Reference {
    fn kind(self) -> u8 {
        (self.0 >> 48) as u8
    }

    fn is_array(self) -> bool {
        self.0 >> 63 & 1 == 1
    }

    fn is_inlined(self) -> bool {
        self.0 >> 62 & 1 == 1
    }

    fn is_compressed(self) -> bool {
        self.0 >> 61 & 1 == 1
    }

    fn payload(self) -> u64 {
        self.0 & ((1 << 48) - 1)
    }

    /// Whether the value is a row of values, each with its time.
    pub fn is_timed(self) -> bool {
        self.kind() == kind::TIME_SAMPLES
    }

    /// Bytes that reading a value takes in memory. `None`: the value is broken, or of a kind that curves do
    /// not have.
    pub fn size(self, all: &[u8], layout: Layout) -> Option<u128> {
        match self.kind() {
            _ if self.is_row() => {
                let Some((rest, count, packed)) = self.open(all, layout)? else { return Some(0) };
                let edge = self.edge()?;
                let fits = packed || count <= rest.left() / edge;
                // The code of packed numbers, their places in a table, and the crate's copy of halves.
                fits.then_some((INT + 4 * edge as u128) * count as u128)
            }
            kind::TOKEN => {
                let is_known = self.is_inlined() && ((self.payload() as u32) as usize) < layout.tokens;
                is_known.then_some(0)
            }
            kind::BOOL | kind::INT | kind::HALF | kind::FLOAT | kind::DOUBLE | kind::MATRIX => Some(0),
            kind::VEC3D | kind::VEC3F | kind::VEC3H | kind::SPECIFIER | kind::BLOCK => Some(0),
            own if kind::QUATERNIONS.contains(&own) => Some(0),
            _ => None,
        }
    }

    fn is_row(self) -> bool {
        self.is_array() || self.kind() == kind::DOUBLES
    }

    /// Bytes behind the number of elements in an array, this number, and whether the elements are packed.
    /// The inner `None` is an empty array.
    fn open(self, all: &[u8], layout: Layout) -> Option<Option<(Bytes<'_>, usize, bool)>> {
        if self.is_inlined() {
            return None;
        }
        let since = match self.kind() {
            kind::INT => 5,
            kind::HALF | kind::FLOAT | kind::DOUBLE | kind::DOUBLES => 6,
            _ if self.is_compressed() => return None,
            _ => u8::MAX,
        };
        if self.payload() == 0 {
            return Some(None);
        }
        let mut at = Bytes::at(all, self.payload())?;
        if layout.version < 5 {
            at.u32()?;
        }
        let count = if layout.version < 7 { at.u32()? as usize } else { at.count()? };
        let packed = self.is_compressed() && layout.version >= since && count >= 4;
        Some(Some((at, count, packed)))
    }

    /// Whether the elements of an array lead nowhere that does not exist. Other values need no such look. The
    /// memory of [`Reference::size`] is taken meanwhile.
    pub fn is_sound(self, all: &[u8], layout: Layout) -> bool {
        !self.is_row() || self.elements(all, layout).is_some()
    }

    fn elements(self, all: &[u8], layout: Layout) -> Option<()> {
        let Some((mut at, count, packed)) = self.open(all, layout)? else { return Some(()) };
        match self.kind() {
            kind::TOKEN => {
                let known = |index: &[u8; 4]| (u32::from_le_bytes(*index) as usize) < layout.tokens;
                let all_known = at.take(4 * count)?.as_chunks::<4>().0.iter().all(known);
                all_known.then_some(())
            }
            kind::INT if packed => ints(at.block()?, count).map(drop),
            _ if packed => match at.u8()? {
                b'i' => ints(at.block()?, count).map(drop),
                b't' => {
                    let table = at.u32()? as usize;
                    at.take(table.checked_mul(self.edge()?)?)?;
                    let places = ints(at.block()?, count)?;
                    places.iter().all(|place| (*place as usize) < table).then_some(())
                }
                _ => None,
            },
            _ => Some(()),
        }
    }

    /// Bytes of an element of an array.
    fn edge(self) -> Option<usize> {
        Some(match self.kind() {
            kind::HALF => 2,
            kind::INT | kind::FLOAT | kind::TOKEN => 4,
            kind::DOUBLE | kind::DOUBLES => 8,
            kind::VEC3H => 6,
            kind::VEC3F => 12,
            kind::VEC3D => 24,
            _ => return None,
        })
    }

    /// References of a row of times and of the values at them. Both are still to be checked.
    pub fn samples(self, all: &[u8]) -> Option<(Reference, Vec<Reference>)> {
        if self.is_inlined() || self.is_compressed() || self.is_array() {
            return None;
        }
        let mut at = Bytes::at(all, self.payload())?.jump()?;
        let times = Reference(at.u64()?);
        if !(times.kind() == kind::DOUBLES || times.kind() == kind::DOUBLE && times.is_array()) {
            return None;
        }
        let mut values = at.jump()?;
        let count = values.count().filter(|count| *count <= values.left() / 8)?;
        let values: Option<Vec<Reference>> = (0..count).map(|_| values.u64().map(Reference)).collect();
        Some((times, values?))
    }
}
