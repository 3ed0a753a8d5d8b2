//! Numbers, compressed blocks and rows of integers in a binary file of USD.

/// Most bytes that a byte of an LZ4 block can become.
const LZ4_MOST: usize = 255;
/// Most integers that a byte of the decompressed code can stand for: two bits each.
const INTS_PER_BYTE: usize = 4;

/// Bytes of a file, and a place in them. Every reading is checked.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    all: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    /// Begins at a place of a file; `None` behind its end.
    pub fn at(all: &'a [u8], at: u64) -> Option<Bytes<'a>> {
        let at = usize::try_from(at).ok().filter(|at| *at <= all.len())?;
        Some(Bytes { all, at })
    }

    /// Bytes up to the end of the file.
    pub fn left(&self) -> usize {
        self.all.len() - self.at
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.all.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn word<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    /// The next byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.word().map(|[byte]| byte)
    }

    /// The next 4 bytes.
    pub fn u32(&mut self) -> Option<u32> {
        self.word().map(u32::from_le_bytes)
    }

    /// The next 8 bytes.
    pub fn u64(&mut self) -> Option<u64> {
        self.word().map(u64::from_le_bytes)
    }

    /// The next number of things, which `usize` can hold.
    pub fn count(&mut self) -> Option<usize> {
        usize::try_from(self.u64()?).ok()
    }

    /// The place that the next 8 bytes lead to, counted from their own.
    pub fn jump(&mut self) -> Option<Bytes<'a>> {
        let (own, offset) = (self.at as u64, self.u64()?.cast_signed());
        Bytes::at(self.all, own.checked_add_signed(offset)?)
    }

    /// Block of LZ4 with its length before it.
    pub fn block(&mut self) -> Option<&'a [u8]> {
        let length = self.count()?;
        self.take(length)
    }
}

/// Whether a block can hold this many integers.
pub(super) fn may_hold_ints(block: &[u8], count: usize) -> bool {
    count <= LZ4_MOST.saturating_mul(INTS_PER_BYTE).saturating_mul(block.len())
}

/// Decompresses a block to at most `most` bytes. The first byte counts its parts; 0 means one, and others are
/// only for blocks above 2 GiB.
pub(super) fn decompressed(block: &[u8], most: usize) -> Option<Vec<u8>> {
    let (parts, block) = block.split_first()?;
    if *parts != 0 || most > LZ4_MOST.saturating_mul(block.len()).saturating_add(LZ4_MOST) {
        return None;
    }
    let mut out = vec![0; most];
    let length = lz4_flex::block::decompress_into(block, &mut out).ok()?;
    out.truncate(length);
    Some(out)
}

/// Bytes that the code of `count` integers takes at most.
fn longest_code(count: usize) -> usize {
    4 + count.div_ceil(INTS_PER_BYTE) + 4 * count
}

/// Decodes integers: a common difference, two bits for each that choose it or the bytes of an own one, and
/// these bytes. `None` where the code ends early.
pub(super) fn ints(block: &[u8], count: usize) -> Option<Vec<u32>> {
    if !may_hold_ints(block, count) {
        return None;
    }
    // Blocks of a few integers may be shorter than the longest code.
    let most = longest_code(count).min(LZ4_MOST.saturating_mul(block.len()));
    let code = decompressed(block, most)?;
    let mut words = Bytes::at(&code, 0)?;
    let common = words.u32()?;
    let kinds = words.take(count.div_ceil(INTS_PER_BYTE))?;
    let mut sum = 0u32;
    let mut all = Vec::with_capacity(count);
    for i in 0..count {
        let difference = match kinds[i / INTS_PER_BYTE] >> (2 * (i % INTS_PER_BYTE)) & 3 {
            0 => common,
            1 => i32::from(words.u8()?.cast_signed()).cast_unsigned(),
            2 => i32::from(words.word().map(i16::from_le_bytes)?).cast_unsigned(),
            _ => words.u32()?,
        };
        sum = sum.wrapping_add(difference);
        all.push(sum);
    }
    Some(all)
}
