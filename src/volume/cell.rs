//! One cell of the volume texture, packed to 64 bits as the shader reads them (`rg32uint`).
//!
//! | word | bits | value |
//! |---|---|---|
//! | x | 0–15 | ρ before α, unorm16 |
//! | x | 16–23 | k_d, unorm8 |
//! | x | 24–31 | k_s, unorm8 |
//! | y | 0–9, 10–19, 20–29 | v as three signed 10-bit numbers, largest magnitude 511 |
//! | y | 30–31 | zero |
//!
//! v is scaled by its largest component, not by its length, so the direction is code/|code|. The largest
//! angular error is 0.0793° (a test checks it). Decoding needs shifts only, the length cancels in the fibre
//! model, and packing an unpacked direction gives the same code again.

use glam::Vec3;

/// Largest magnitude of a component's code in v.
pub const V_SCALE: f32 = 511.0;

/// A packed cell.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Cell {
    /// ρ, k_d and k_s.
    pub x: u32,
    /// v; 0 if the cell has no direction.
    pub y: u32,
}

impl Cell {
    /// Packs `v` alone. A zero vector gives an empty cell.
    pub fn from_direction(v: Vec3) -> Self {
        let largest = v.abs().max_element();
        // The squares of smaller components vanish in f32, so the vector has no direction.
        if largest.is_nan() || largest <= 1e-18 {
            return Cell::default();
        }
        // Rounded by truncation: `f32::round` is a call into the C library.
        let code = v * (V_SCALE / largest);
        let code = (code + Vec3::splat(0.5).copysign(code)).as_ivec3();
        let bits = |c: i32| (c as u32) & 0x3ff;
        Cell { x: 0, y: bits(code.x) | bits(code.y) << 10 | bits(code.z) << 20 }
    }

    /// Returns the cell with other ρ (before α), k_d and k_s. Each is clamped to 0 to 1.
    pub fn with_density(self, rho: f32, k_d: f32, k_s: f32) -> Self {
        Cell { x: unorm(rho, 65535.0), ..self }.with_reflection(k_d, k_s)
    }

    /// Returns the cell with other k_d and k_s. Each is clamped to 0 to 1.
    pub fn with_reflection(self, k_d: f32, k_s: f32) -> Self {
        Cell { x: self.rho_code() | unorm(k_d, 255.0) << 16 | unorm(k_s, 255.0) << 24, ..self }
    }

    /// Whether v is set.
    pub fn has_direction(self) -> bool {
        self.y != 0
    }

    /// Code of ρ before α, 0 to 65535.
    #[inline]
    pub fn rho_code(self) -> u32 {
        self.x & 0xffff
    }

    /// Codes of k_d and k_s, 0 to 255.
    #[inline]
    pub fn k_codes(self) -> (u32, u32) {
        (self.x >> 16 & 0xff, self.x >> 24)
    }

    /// Code of v, a vector parallel to v. Each component is −511 to 511.
    #[inline]
    pub fn v_code(self) -> Vec3 {
        let signed = |shift: u32| ((self.y << shift) as i32 >> 22) as f32;
        Vec3::new(signed(22), signed(12), signed(2))
    }

    /// ρ before α, 0 to 1.
    pub fn rho(self) -> f32 {
        self.rho_code() as f32 / 65535.0
    }

    /// (k_d, k_s), each 0 to 1.
    pub fn k(self) -> (f32, f32) {
        let (d, s) = self.k_codes();
        (d as f32 / 255.0, s as f32 / 255.0)
    }

    /// v as a unit vector, or zero if the cell has no direction.
    pub fn v(self) -> Vec3 {
        self.v_code().normalize_or_zero()
    }
}

/// Rounds `x`, clamped to 0 to 1, to steps of 1/`scale`.
#[inline]
fn unorm(x: f32, scale: f32) -> u32 {
    (x.clamp(0.0, 1.0) * scale + 0.5) as u32
}
