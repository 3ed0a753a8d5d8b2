//! Values of a node: a mask of those that are active, and numbers that may be left out or compressed.

use super::super::codec::Decoder;
use super::super::source::Source;
use super::head::Refusal;
use crate::util::error::Result;
use crate::util::npy::float16;

/// Flags of the compression of a grid.
const ZIP: u32 = 1;
const ACTIVE_MASK: u32 = 2;
const BLOSC: u32 = 4;

/// Words for the compression of a grid.
pub(super) fn compression_words(flags: u32) -> String {
    let codec = match flags & (ZIP | BLOSC) {
        0 => "none",
        ZIP => "zip",
        _ => "blosc",
    };
    let mask = if flags & ACTIVE_MASK != 0 { " + active mask" } else { "" };
    let unknown = flags & !(ZIP | ACTIVE_MASK | BLOSC);
    let unknown = if unknown != 0 { format!(" + unknown ({unknown:#x})") } else { String::new() };
    format!("{codec}{mask}{unknown}")
}

/// Refuses a compression that is not known.
pub(super) fn check_compression(flags: u32) -> std::result::Result<(), Refusal> {
    match flags & !(ZIP | ACTIVE_MASK | BLOSC) {
        0 => Ok(()),
        _ => Err((
            format!("its compression is {}", compression_words(flags)),
            "write it with blosc, zip or no compression".into(),
        )),
    }
}

/// Type of the numbers of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Float,
    Double,
    Int32,
    Int64,
}

/// Type of the values of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    number: Number,
    pub channels: usize,
    is_half: bool,
}

impl Kind {
    /// The type of a tree that OpenVDB calls `name`.
    pub fn of(name: &str, is_half: bool) -> Option<Kind> {
        let (number, channels) = match name {
            "float" => (Number::Float, 1),
            "double" => (Number::Double, 1),
            "int32" => (Number::Int32, 1),
            "int64" => (Number::Int64, 1),
            "vec3s" => (Number::Float, 3),
            "vec3d" => (Number::Double, 3),
            "vec3i" => (Number::Int32, 3),
            _ => return None,
        };
        let is_half = is_half && matches!(number, Number::Float | Number::Double);
        Some(Kind { number, channels, is_half })
    }

    /// Bytes of a value that stands alone: never float16.
    pub fn bytes(self) -> usize {
        let number = match self.number {
            Number::Float | Number::Int32 => 4,
            Number::Double | Number::Int64 => 8,
        };
        number * self.channels
    }

    /// Bytes of a value among many.
    fn packed_bytes(self) -> usize {
        if self.is_half { 2 * self.channels } else { self.bytes() }
    }

    /// Decodes many numbers.
    fn decode(self, bytes: &[u8], out: &mut Vec<f32>) {
        if self.is_half {
            return out.extend(bytes.as_chunks().0.iter().map(|&x| float16(u16::from_le_bytes(x))));
        }
        match self.number {
            Number::Float => out.extend(bytes.as_chunks().0.iter().map(|&x| f32::from_le_bytes(x))),
            Number::Double => out.extend(bytes.as_chunks().0.iter().map(|&x| f64::from_le_bytes(x) as f32)),
            Number::Int32 => out.extend(bytes.as_chunks().0.iter().map(|&x| i32::from_le_bytes(x) as f32)),
            Number::Int64 => out.extend(bytes.as_chunks().0.iter().map(|&x| i64::from_le_bytes(x) as f32)),
        }
    }
}

/// Bit `i` of a mask.
pub(super) fn bit(mask: &[u8], i: usize) -> bool {
    mask[i / 8] >> (i % 8) & 1 != 0
}

/// Number of bits of a mask that are set.
fn ones(mask: &[u8]) -> usize {
    mask.iter().map(|byte| byte.count_ones() as usize).sum()
}

/// Reads values, and keeps what it needs for that.
pub(super) struct ValueReader {
    pub kind: Kind,
    flags: u32,
    pub background: [f32; 3],
    decoder: Decoder,
    stored: Vec<u8>,
    raw: Vec<u8>,
    packed: Vec<f32>,
    selection: Vec<u8>,
    /// Values of the node that was read last, with their channels side by side.
    pub values: Vec<f32>,
    /// Numbers that were not finite and whose samples are not active.
    pub mended: u64,
}

impl ValueReader {
    pub fn new(kind: Kind, flags: u32) -> ValueReader {
        ValueReader {
            kind,
            flags,
            background: [0.0; 3],
            decoder: Decoder::new(),
            stored: Vec::new(),
            raw: Vec::new(),
            packed: Vec::new(),
            selection: Vec::new(),
            values: Vec::new(),
            mended: 0,
        }
    }

    /// Most memory that a node of `count` values takes while it is read, bytes.
    pub fn most_bytes(&self, count: u64) -> u64 {
        count * (2 * self.kind.bytes() + 8 * self.kind.channels) as u64 + (64 << 10)
    }

    /// Reads one value, which need not be finite.
    pub fn read_one(&mut self, source: &mut Source) -> Result<[f32; 3]> {
        source.bytes(self.kind.bytes() as u64, &mut self.raw)?;
        self.packed.clear();
        Kind { is_half: false, ..self.kind }.decode(&self.raw, &mut self.packed);
        Ok(std::array::from_fn(|a| self.packed.get(a).copied().unwrap_or(0.0)))
    }

    /// Returns a value that no active sample has, with the background for numbers that are not finite.
    pub fn mended_one(&mut self, value: [f32; 3]) -> [f32; 3] {
        self.mended += value.iter().filter(|x| !x.is_finite()).count() as u64;
        std::array::from_fn(|a| if value[a].is_finite() { value[a] } else { self.background[a] })
    }

    /// Gives those values of the node that was read last the background which are not finite and `is_off`.
    pub fn mend(&mut self, is_off: impl Fn(usize) -> bool) {
        let channels = self.kind.channels;
        for (i, value) in self.values.iter_mut().enumerate() {
            if !value.is_finite() && is_off(i / channels) {
                *value = self.background[i % channels];
                self.mended += 1;
            }
        }
    }

    /// Reads the values of a node, one for each bit of `mask`, to [`ValueReader::values`].
    pub fn read(&mut self, source: &mut Source, mask: &[u8]) -> Result<()> {
        let count = 8 * mask.len();
        let channels = self.kind.channels;
        let at = source.at();
        // 0: what is not active has the background, 1: its negative, 2: another value. 3, 4, 5: a second mask
        // selects between the background and its negative, the background and another, and two others.
        // 6: all values are there.
        let code = source.u8()?;
        if code > 6 {
            return Err(source.fault(at, format!("the values of a node have the code {code}")));
        }
        let negative = self.background.map(|x| 0.0 - x);
        let mut off = if code == 0 { self.background } else { negative };
        let mut selected = self.background;
        if matches!(code, 2 | 4 | 5) {
            off = self.read_one(source)?;
        }
        if code == 5 {
            selected = self.read_one(source)?;
        }
        let is_selected = matches!(code, 3..=5);
        if is_selected {
            source.bytes(mask.len() as u64, &mut self.selection)?;
        }
        let has_all = self.flags & ACTIVE_MASK == 0 || code == 6;
        let stored = if has_all { count } else { ones(mask) };
        self.read_packed(source, stored)?;
        self.values.clear();
        if stored == count {
            std::mem::swap(&mut self.values, &mut self.packed);
            return Ok(());
        }
        if stored == 0 && !is_selected {
            self.values.extend(off[..channels].iter().copied().cycle().take(count * channels));
            return Ok(());
        }
        let mut packed = self.packed.chunks_exact(channels);
        for i in 0..count {
            match bit(mask, i) {
                true => self.values.extend_from_slice(packed.next().unwrap_or(&self.background[..channels])),
                false if is_selected && bit(&self.selection, i) => {
                    self.values.extend_from_slice(&selected[..channels]);
                }
                false => self.values.extend_from_slice(&off[..channels]),
            }
        }
        Ok(())
    }

    /// Reads `count` values to `packed`.
    fn read_packed(&mut self, source: &mut Source, count: usize) -> Result<()> {
        self.packed.clear();
        // A block of float16 is left out where it has no numbers; others have their length at least.
        if count == 0 && self.kind.is_half {
            return Ok(());
        }
        let at = source.at();
        let length = count * self.kind.packed_bytes();
        let mut raw = std::mem::take(&mut self.raw);
        if self.flags & (ZIP | BLOSC) == 0 {
            source.bytes(length as u64, &mut raw)?;
        } else {
            let stored = source.i64()?;
            if stored <= 0 {
                if stored.unsigned_abs() != length as u64 {
                    let why = format!("a block of {} bytes where {length} are due", stored.unsigned_abs());
                    return Err(source.fault(at, why));
                }
                source.bytes(length as u64, &mut raw)?;
            } else {
                // Compression that lengthens is not kept by its writer.
                if stored as u64 > length as u64 + 1024 {
                    let why = format!("a block of {stored} compressed bytes for {length}");
                    return Err(source.fault(at, why));
                }
                source.bytes(stored as u64, &mut self.stored)?;
                raw.resize(length, 0);
                let done = match self.flags & BLOSC {
                    0 => self.decoder.zlib(&self.stored, &mut raw),
                    _ if Decoder::blosc_length(&self.stored) != Some(length as u64) => {
                        Err(format!("its blosc data does not hold {length} bytes"))
                    }
                    _ => self.decoder.blosc(&self.stored, &mut raw),
                };
                done.map_err(|why| source.fault_with(at, why, REWRITE))?;
            }
        }
        self.kind.decode(&raw, &mut self.packed);
        self.raw = raw;
        Ok(())
    }
}

/// Advice on data whose compression is broken or unknown.
const REWRITE: &str = "copy the file again, or write it with blosc, zip or no compression";
/// Advice on numbers that are not finite.
pub(super) const FINITE: &str =
    "set it to 0 in the program that made it; float16 holds numbers up to 65504 only";
