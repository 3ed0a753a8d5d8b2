//! BloscLZ, the codec that Python's blosc takes where none is named: copies of 3 bytes or more and literals.

/// Distances up to this one have 13 bits.
const NEAR: usize = 8191;

/// Decompresses data that must fill `out`; `None` where it is broken.
pub(super) fn decompress(data: &[u8], out: &mut [u8]) -> Option<()> {
    let mut input = data.iter().map(|&byte| usize::from(byte));
    let mut filled = 0;
    // The first token is always one of literals.
    let mut token = input.next()? & 31;
    loop {
        if token < 32 {
            let target = out.get_mut(filled..=filled + token)?;
            filled += target.len();
            for byte in target {
                *byte = input.next()? as u8;
            }
        } else {
            let mut length = (token >> 5) + 2;
            if token >> 5 == 7 {
                loop {
                    let more = input.next()?;
                    length += more;
                    if more != 255 {
                        break;
                    }
                }
            }
            let (high, low) = (token & 31, input.next()?);
            let distance = match (high, low) {
                (31, 255) => NEAR + (input.next()? << 8) + input.next()?,
                _ => (high << 8) + low,
            };
            let from = filled.checked_sub(distance + 1)?;
            let end = filled.checked_add(length).filter(|&end| end <= out.len())?;
            // A copy may reach into itself, which repeats a pattern.
            for at in 0..end - filled {
                out[filled + at] = out[from + at];
            }
            filled = end;
        }
        match input.next() {
            Some(next) => token = next,
            None => return (filled == out.len()).then_some(()),
        }
    }
}
