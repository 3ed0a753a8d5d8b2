//! Numbers at the points of a lattice, from which the noise of billows and of torn water is made. Twin:
//! `shaders/trace/noise.wgsl`.

/// Hashes a lattice point to a number from 0 to 1.
#[inline]
pub fn lattice(x: u32, y: u32, z: u32) -> f32 {
    let h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ z.wrapping_mul(0xcb1a_b31f);
    let h = (h ^ (h >> 13)).wrapping_mul(0x9e37_79b1);
    let h = h ^ (h >> 16);
    (h >> 8) as f32 / 16_777_216.0
}
