//! Numbers at the points of a lattice, from which the noise of billows and of torn water is made. Twin:
//! `shaders/trace/noise.wgsl`.

/// Factors of a lattice point's coordinates in its hash.
pub const HASH: [u32; 3] = [0x8da6_b343, 0xd816_3841, 0xcb1a_b31f];

/// Hashes a lattice point to a number from 0 to 1.
#[inline]
pub fn lattice(x: u32, y: u32, z: u32) -> f32 {
    let h = x.wrapping_mul(HASH[0]) ^ y.wrapping_mul(HASH[1]) ^ z.wrapping_mul(HASH[2]);
    let h = (h ^ (h >> 13)).wrapping_mul(0x9e37_79b1);
    let h = h ^ (h >> 16);
    (h >> 8) as f32 / 16_777_216.0
}
