//! Leaves of OpenVDB and NanoVDB, which have z fastest.

use super::{Builder, Misplaced};

/// Adds a leaf with 2^`log` samples along each axis to a grid, as one leaf of 8³ samples or several. Sample
/// (x, y, z) has the number z + 2^log (y + 2^log x), in `mask` and in `values`.
pub(super) fn spread_leaf(
    builder: &mut Builder,
    origin: [i32; 3],
    log: u32,
    mask: &[u8],
    values: &[f32],
    channels: usize,
) -> Result<(), Misplaced> {
    let parts = 1usize << (log - 3);
    for part in 0..parts * parts * parts {
        let part = [part % parts, part / parts % parts, part / parts / parts];
        let number = |i: usize| {
            let [x, y, z] = [i & 7, i >> 3 & 7, i >> 6];
            let [x, y, z] = [x + 8 * part[0], y + 8 * part[1], z + 8 * part[2]];
            z + (y << log) + (x << (2 * log))
        };
        let mut active = [0u64; 8];
        for i in 0..512 {
            let n = number(i);
            active[i >> 6] |= u64::from(mask[n / 8] >> (n % 8) & 1) << (i & 63);
        }
        let origin = std::array::from_fn(|a| origin[a] + 8 * part[a] as i32);
        builder.leaf(origin, active, |into| {
            for (i, value) in into.chunks_exact_mut(channels).enumerate() {
                value.copy_from_slice(&values[channels * number(i)..][..channels]);
            }
        })?;
    }
    Ok(())
}
