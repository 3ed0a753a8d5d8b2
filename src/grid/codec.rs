//! Decompression of blocks whose size is known: zlib and the container of blosc 1.

use flate2::{Decompress, FlushDecompress, Status};

use super::blosclz;

/// Bytes of a blosc header.
const HEADER: usize = 16;
/// Most streams that a block is split into, and least bytes of each.
const MOST_SPLITS: usize = 16;
const LEAST_SPLIT: usize = 128;

/// Decompresses blocks, and keeps what it needs for that.
pub(super) struct Decoder {
    zlib: Decompress,
    shuffled: Vec<u8>,
}

impl Decoder {
    pub fn new() -> Decoder {
        Decoder { zlib: Decompress::new(true), shuffled: Vec::new() }
    }

    /// Decompresses zlib data that must fill `out`.
    ///
    /// # Errors
    /// Fault of the data.
    pub fn zlib(&mut self, data: &[u8], out: &mut [u8]) -> Result<(), String> {
        inflate(&mut self.zlib, data, out)
    }

    /// Decompresses the start of zlib data, as much as `out` takes. Returns how many bytes that are.
    ///
    /// # Errors
    /// Fault of the data.
    pub fn zlib_start(&mut self, data: &[u8], out: &mut [u8]) -> Result<usize, String> {
        self.zlib.reset(true);
        let status = self.zlib.decompress(data, out, FlushDecompress::None);
        status.map_err(|e| format!("its zlib data is broken ({e})"))?;
        Ok(self.zlib.total_out() as usize)
    }

    /// Length of what a container of blosc holds, as its header says.
    pub fn blosc_length(data: &[u8]) -> Option<u64> {
        data.first_chunk::<HEADER>().map(|head| u32::from_le_bytes([4, 5, 6, 7].map(|i| head[i])).into())
    }

    /// Decompresses a container of blosc, or as much of its start as `out` takes. Blocks may be LZ4, zlib
    /// or BloscLZ, with or without the shuffle of bytes.
    ///
    /// # Errors
    /// Fault of the data, or the codec that is not read.
    pub fn blosc(&mut self, data: &[u8], out: &mut [u8]) -> Result<(), String> {
        let head = data.first_chunk::<HEADER>().ok_or_else(broken)?;
        let number = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| head[at + i])) as usize;
        let flags = head[2];
        let [length, block] = [number(4), number(8)];
        if out.len() > length {
            return Err(format!("its blosc data holds {length} bytes, not {}", out.len()));
        }
        if flags & 0x02 != 0 {
            let raw = data.get(HEADER..HEADER + out.len()).ok_or_else(broken)?;
            out.copy_from_slice(raw);
            return Ok(());
        }
        let streams = Streams::of(flags, usize::from(head[3]).max(1))?;
        if block == 0 || block > length {
            return if length == 0 { Ok(()) } else { Err(broken()) };
        }
        for (i, part) in out.chunks_mut(block).enumerate() {
            let start = data.get(HEADER + 4 * i..).and_then(|rest| rest.first_chunk()).ok_or_else(broken)?;
            let stored = data.get(u32::from_le_bytes(*start) as usize..).ok_or_else(broken)?;
            // The last block is shorter.
            let own = block.min(length - block * i);
            if part.len() == own && !streams.is_shuffled {
                self.block(&streams, block, stored, part)?;
                continue;
            }
            let mut whole = std::mem::take(&mut self.shuffled);
            whole.resize(own, 0);
            self.block(&streams, block, stored, &mut whole)?;
            match streams.is_shuffled {
                true => unshuffle(&whole, streams.type_size, part),
                false => part.copy_from_slice(&whole[..part.len()]),
            }
            self.shuffled = whole;
        }
        Ok(())
    }

    /// Decompresses the streams of one block, whose full length is `block`, to `out`.
    fn block(
        &mut self,
        streams: &Streams,
        block: usize,
        mut rest: &[u8],
        out: &mut [u8],
    ) -> Result<(), String> {
        let is_split = streams.may_split && block / streams.type_size >= LEAST_SPLIT && out.len() == block;
        let splits = if is_split { streams.type_size } else { 1 };
        if !out.len().is_multiple_of(splits) {
            return Err(broken());
        }
        let length = (out.len() / splits).max(1);
        for piece in out.chunks_mut(length) {
            let (size, after) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
            let size = u32::from_le_bytes(*size) as usize;
            let stream = after.get(..size).ok_or_else(broken)?;
            rest = &after[size..];
            match streams.codec {
                _ if size == piece.len() => piece.copy_from_slice(stream),
                Codec::Lz4 => {
                    let done = lz4_flex::block::decompress_into(stream, piece);
                    if done.map_err(|e| format!("its LZ4 data is broken ({e})"))? != piece.len() {
                        return Err(broken());
                    }
                }
                Codec::BloscLz => blosclz::decompress(stream, piece).ok_or_else(broken)?,
                Codec::Zlib => inflate(&mut self.zlib, stream, piece)?,
            }
        }
        Ok(())
    }
}

fn broken() -> String {
    "its blosc data is broken".into()
}

/// How a container of blosc is compressed.
struct Streams {
    codec: Codec,
    type_size: usize,
    is_shuffled: bool,
    /// Whether the bytes of a type have streams of their own in blocks that are long enough.
    may_split: bool,
}

impl Streams {
    fn of(flags: u8, type_size: usize) -> Result<Streams, String> {
        let codec = match flags >> 5 {
            0 => Codec::BloscLz,
            1 => Codec::Lz4,
            3 => Codec::Zlib,
            other => {
                let names = ["BloscLZ", "LZ4", "snappy", "zlib", "zstd"];
                let name = names.get(usize::from(other)).unwrap_or(&"an unknown codec");
                return Err(format!(
                    "it is compressed by blosc with {name}, where LZ4, zlib and BloscLZ are read"
                ));
            }
        };
        if flags & 0x04 != 0 {
            return Err("it is compressed by blosc with the shuffle of bits, which is not read".into());
        }
        let is_shuffled = flags & 0x01 != 0 && type_size > 1;
        let may_split = flags & 0x10 == 0 && type_size <= MOST_SPLITS;
        Ok(Streams { codec, type_size, is_shuffled, may_split })
    }
}

enum Codec {
    BloscLz,
    Lz4,
    Zlib,
}

fn inflate(zlib: &mut Decompress, data: &[u8], out: &mut [u8]) -> Result<(), String> {
    zlib.reset(true);
    let status = zlib.decompress(data, out, FlushDecompress::Finish);
    let status = status.map_err(|e| format!("its zlib data is broken ({e})"))?;
    match status == Status::StreamEnd && zlib.total_out() == out.len() as u64 {
        true => Ok(()),
        false => Err(format!("its zlib data does not hold {} bytes", out.len())),
    }
}

/// Puts byte b of element i, which stands at b · elements + i, beside the other bytes of the element. Bytes
/// after the last element stand as they are. `out` may be shorter.
fn unshuffle(shuffled: &[u8], type_size: usize, out: &mut [u8]) {
    let elements = shuffled.len() / type_size;
    let whole = elements * type_size;
    let (whole_out, rest) = out.split_at_mut(whole.min(out.len()));
    for (b, plane) in shuffled[..whole].chunks_exact(elements.max(1)).enumerate() {
        for (element, byte) in whole_out.chunks_mut(type_size).zip(plane) {
            if let Some(own) = element.get_mut(b) {
                *own = *byte;
            }
        }
    }
    rest.copy_from_slice(&shuffled[whole..whole + rest.len()]);
}
