//! Decompression of blocks whose size is known: zlib and the container of blosc 1.

use flate2::{Decompress, FlushDecompress, Status};

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
    /// What is wrong with the data.
    pub fn zlib(&mut self, data: &[u8], out: &mut [u8]) -> Result<(), String> {
        inflate(&mut self.zlib, data, out)
    }

    /// Decompresses the start of zlib data, as much as `out` takes. Returns how many bytes that are.
    ///
    /// # Errors
    /// What is wrong with the data.
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

    /// Decompresses a container of blosc that must fill `out`. Blocks may be LZ4 or zlib, with or without the
    /// shuffle of bytes.
    ///
    /// # Errors
    /// What is wrong with the data, or which codec it has.
    pub fn blosc(&mut self, data: &[u8], out: &mut [u8]) -> Result<(), String> {
        let broken = || "its blosc data is broken".to_owned();
        let head = data.first_chunk::<HEADER>().ok_or_else(broken)?;
        let number = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| head[at + i])) as usize;
        let (flags, type_size) = (head[2], usize::from(head[3]).max(1));
        let [length, block, compressed] = [number(4), number(8), number(12)];
        let data = data.get(..compressed).ok_or_else(broken)?;
        if length != out.len() {
            return Err(format!("its blosc data holds {length} bytes, not {}", out.len()));
        }
        if flags & 0x02 != 0 {
            let raw = data.get(HEADER..HEADER + length).ok_or_else(broken)?;
            out.copy_from_slice(raw);
            return Ok(());
        }
        if length == 0 {
            return Ok(());
        }
        let codec = match flags >> 5 {
            1 => Codec::Lz4,
            3 => Codec::Zlib,
            other => {
                let names = ["blosclz", "LZ4", "snappy", "zlib", "zstd"];
                let name = names.get(usize::from(other)).unwrap_or(&"an unknown codec");
                return Err(format!("it is compressed by blosc with {name}, where LZ4 and zlib are read"));
            }
        };
        if flags & 0x04 != 0 {
            return Err("it is compressed by blosc with the shuffle of bits, which is not read".into());
        }
        if block == 0 || block > length {
            return Err(broken());
        }
        for (i, part) in out.chunks_mut(block).enumerate() {
            let start = data.get(HEADER + 4 * i..).and_then(|rest| rest.first_chunk()).ok_or_else(broken)?;
            let start = u32::from_le_bytes(*start) as usize;
            let mut rest = data.get(start..).ok_or_else(broken)?;
            let is_split = flags & 0x10 == 0
                && type_size <= MOST_SPLITS
                && block / type_size >= LEAST_SPLIT
                && part.len() == block;
            let splits = if is_split { type_size } else { 1 };
            if part.len() % splits != 0 {
                return Err(broken());
            }
            let is_shuffled = flags & 0x01 != 0 && type_size > 1;
            let target = if is_shuffled {
                self.shuffled.resize(part.len(), 0);
                &mut self.shuffled[..part.len()]
            } else {
                &mut *part
            };
            for piece in target.chunks_mut(part_length(block, splits)) {
                let (size, after) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
                let size = u32::from_le_bytes(*size) as usize;
                let stream = after.get(..size).ok_or_else(broken)?;
                rest = &after[size..];
                match codec {
                    _ if size == piece.len() => piece.copy_from_slice(stream),
                    Codec::Lz4 => {
                        let done = lz4_flex::block::decompress_into(stream, piece);
                        if done.map_err(|e| format!("its LZ4 data is broken ({e})"))? != piece.len() {
                            return Err(broken());
                        }
                    }
                    Codec::Zlib => inflate(&mut self.zlib, stream, piece)?,
                }
            }
            if is_shuffled {
                unshuffle(&self.shuffled[..part.len()], type_size, part);
            }
        }
        Ok(())
    }
}

/// Length of each stream of a block that has `splits` of them. The last block may be shorter.
fn part_length(block: usize, splits: usize) -> usize {
    (block / splits).max(1)
}

enum Codec {
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
/// after the last element stand as they are.
fn unshuffle(shuffled: &[u8], type_size: usize, out: &mut [u8]) {
    let elements = out.len() / type_size;
    let whole = elements * type_size;
    for (b, plane) in shuffled[..whole].chunks_exact(elements.max(1)).enumerate() {
        for (element, byte) in out[..whole].chunks_exact_mut(type_size).zip(plane) {
            element[b] = *byte;
        }
    }
    out[whole..].copy_from_slice(&shuffled[whole..]);
}
