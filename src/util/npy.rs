//! Numbers of NumPy's arrays, read as float32.

use std::io::{BufReader, Cursor, Error, Read, Result};

use npyz::{DType, Endianness, NpyHeader, TypeChar};

/// Longest header of an array, bytes. NumPy pads the headers of arrays of numbers to 128 bytes. The bound
/// protects the recursive parser of headers from hostile files.
const MAX_HEADER_BYTES: u64 = 512;

/// Opens an array. Its header is parsed only if it has a sane length.
pub(crate) fn open_array<R: Read>(mut entry: R) -> Result<(NpyHeader, impl Read)> {
    let mut prefix = [0u8; 12];
    entry.read_exact(&mut prefix)?;
    let header_bytes = match prefix[6] {
        1 => u16::from_le_bytes([prefix[8], prefix[9]]) as u64,
        _ => u32::from_le_bytes([prefix[8], prefix[9], prefix[10], prefix[11]]) as u64,
    };
    if &prefix[..6] != b"\x93NUMPY" || header_bytes > MAX_HEADER_BYTES {
        return Err(Error::other("not a NumPy array"));
    }
    let mut bytes = BufReader::with_capacity(1 << 16, Cursor::new(prefix).chain(entry));
    Ok((NpyHeader::from_reader(&mut bytes)?, bytes))
}

/// Type of the numbers in an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Number {
    kind: Kind,
    bytes: usize,
    big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Bool,
    Signed,
    Unsigned,
    Float,
}

impl Number {
    /// Whether a value is a byte with a sign.
    pub(crate) fn is_signed_byte(self) -> bool {
        self.kind == Kind::Signed && self.bytes == 1
    }

    /// The type in which volume files are written.
    pub(crate) const FLOAT32: Number = Number { kind: Kind::Float, bytes: 4, big_endian: false };

    /// Returns the type that NumPy's `dtype` names; `None` if its values are not real numbers of at most 64
    /// bits.
    pub(crate) fn of(dtype: &DType) -> Option<Number> {
        let DType::Plain(name) = dtype else { return None };
        let (kind, sizes): (Kind, &[u64]) = match name.type_char() {
            TypeChar::Bool => (Kind::Bool, &[1]),
            TypeChar::Int => (Kind::Signed, &[1, 2, 4, 8]),
            TypeChar::Uint => (Kind::Unsigned, &[1, 2, 4, 8]),
            TypeChar::Float => (Kind::Float, &[2, 4, 8]),
            _ => return None,
        };
        let (size, big_endian) = (name.size_field(), name.endianness() == Endianness::Big);
        sizes.contains(&size).then_some(Number { kind, bytes: size as usize, big_endian })
    }

    /// Whether this is uint8.
    pub(crate) fn is_uint8(self) -> bool {
        self.kind == Kind::Unsigned && self.bytes == 1
    }

    /// NumPy's name of the type, after its byte order where that is unusual.
    pub(crate) fn words(self) -> String {
        let kind = match self.kind {
            Kind::Bool => return "bool".into(),
            Kind::Signed => "int",
            Kind::Unsigned => "uint",
            Kind::Float => "float",
        };
        let order = if self.big_endian { "big-endian " } else { "" };
        format!("{order}{kind}{}", 8 * self.bytes)
    }

    /// Largest error that rounding to this type makes in a number near `x` between 0 and 1. `codes`: the
    /// number is stored as one of 256 codes.
    pub(crate) fn rounding(self, x: f32, codes: bool) -> f32 {
        match (codes, self.kind, self.bytes) {
            (true, ..) => 0.5 / 255.0,
            // Half a step of normal numbers, and of those below 2⁻¹⁴.
            (_, Kind::Float, 2) => x * 2f32.powi(-11) + 2f32.powi(-25),
            _ => 0.0,
        }
    }

    /// Decodes the bytes of one number.
    fn decode(self, bytes: &[u8]) -> f32 {
        let mut raw = [0; 8];
        raw[..self.bytes].copy_from_slice(bytes);
        if self.big_endian {
            raw[..self.bytes].reverse();
        }
        let bits = u64::from_le_bytes(raw);
        let unused = 64 - 8 * self.bytes as u32;
        match (self.kind, self.bytes) {
            (Kind::Float, 2) => float16(bits as u16),
            (Kind::Float, 4) => f32::from_bits(bits as u32),
            (Kind::Float, _) => f64::from_bits(bits) as f32,
            (Kind::Signed, _) => ((bits << unused) as i64 >> unused) as f32,
            (Kind::Unsigned, _) => bits as f32,
            (Kind::Bool, _) => f32::from(bits != 0),
        }
    }
}

/// Decodes a float16: 1 bit of sign, 5 of exponent, 10 of fraction. Every float16 is a float32.
#[inline]
pub(crate) fn float16(bits: u16) -> f32 {
    let (sign, rest) = (u32::from(bits & 0x8000) << 16, u32::from(bits & 0x7fff));
    match rest >> 10 {
        // A multiple of 2⁻²⁴.
        0 => f32::from_bits((rest as f32 * 2f32.powi(-24)).to_bits() | sign),
        31 => f32::from_bits(sign | 0x7f80_0000 | (rest & 0x3ff) << 13),
        _ => f32::from_bits(sign | ((rest << 13) + (112 << 23))),
    }
}

/// Most numbers that are decoded at once. Decoding them one by one takes twice as long.
const BLOCK: u64 = 4096;

/// Numbers of one array, in the order of the file.
pub(crate) struct Numbers<R> {
    bytes: R,
    number: Number,
    /// Number that is read as 1.
    one: f32,
    /// Numbers of the array, and those of them that were decoded.
    count: u64,
    decoded: u64,
    raw: Vec<u8>,
    block: std::vec::IntoIter<f32>,
}

impl<R: Read> Numbers<R> {
    /// The `count` numbers of `bytes`. With `codes` 255 is read as 1.
    pub(crate) fn new(bytes: R, number: Number, codes: bool, count: u64) -> Self {
        let one = if codes { 255.0 } else { 1.0 };
        Numbers { bytes, number, one, count, decoded: 0, raw: Vec::new(), block: Vec::new().into_iter() }
    }

    /// Reads the next number.
    #[inline]
    pub(crate) fn next(&mut self) -> Result<f32> {
        if let Some(number) = self.block.next() {
            return Ok(number);
        }
        self.fill()?;
        let ended = || Error::other(format!("ends after {} of {} numbers", self.decoded, self.count));
        self.block.next().ok_or_else(ended)
    }

    /// Decodes the next block, of fewer numbers at the end of the array and of none behind it.
    fn fill(&mut self) -> Result<()> {
        let Number { kind, bytes, big_endian } = self.number;
        let wanted = BLOCK.min(self.count - self.decoded) * bytes as u64;
        self.raw.clear();
        (&mut self.bytes).take(wanted).read_to_end(&mut self.raw)?;
        let chunks = self.raw.chunks_exact(bytes);
        let block: Vec<f32> = match (kind, big_endian, self.raw.as_chunks().0) {
            (Kind::Float, false, floats) if bytes == 4 => {
                floats.iter().map(|&bits| f32::from_le_bytes(bits)).collect()
            }
            _ => chunks.map(|chunk| self.number.decode(chunk) / self.one).collect(),
        };
        self.decoded += block.len() as u64;
        self.block = block.into_iter();
        Ok(())
    }

    /// Checks that the array has no more numbers. The archive compares an entry's checksum only when the
    /// entry is read to its end.
    pub(crate) fn finish(mut self) -> Result<()> {
        match self.bytes.read(&mut [0])? {
            0 => Ok(()),
            _ => Err(Error::other(format!("has more than {} numbers", self.count))),
        }
    }
}
