//! One cell of the volume texture, packed to 64 bits as the shader reads them (`rg32uint`).
//!
//! | word | bits | value |
//! |---|---|---|
//! | x | 0–15 | ρ before α, unorm16 |
//! | x | 16–23 | k_d, unorm8 |
//! | x | 24–31 | k_s, unorm8 |
//! | y | 0–9, 10–19, 20–29 | v as three signed 10-bit numbers, largest magnitude 511 |
//! | y | 30–31 | zero, or two bits of the strand's line |
//!
//! v is scaled by its largest component, not by its length, so the direction is code/|code|. The largest
//! angular error is 0.0793° (a test checks it). Decoding needs shifts only, the length cancels in the fibre
//! model, and packing an unpacked direction gives the same code again.
//!
//! # The strand's line
//! Because the length is free, it carries where the strand passes the cell ([`Cell::with_line`]): the
//! largest magnitude is 511 less the six low bits of an 8-bit number, whose two high bits are bits 30–31. Its
//! low four bits are the place along the first of the two other axes, its high four that along the second, in
//! sixteenths of a cell. Whoever reads the direction alone needs to know nothing of it. The largest angular
//! error is then 0.0905°.

use glam::Vec3;

/// Largest magnitude of a component's code in v.
pub const V_SCALE: f32 = 511.0;

/// Steps of a strand's place along one axis of the cell.
pub const LINE_STEPS: f32 = 16.0;

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

    /// Packs `v` and the line of the strand, which passes through `place` in direction `v`. `place` is in
    /// cells from the cell's corner. A line that passes outside the cell is moved to the nearest step inside.
    pub fn with_line(v: Vec3, place: Vec3) -> Self {
        let whole = Cell::from_direction(v);
        if !whole.has_direction() {
            return whole;
        }
        // Rounding can make a component equal to a larger one; the axis is that of the packed direction.
        let axis = main_axis(whole.v_code());
        let (a, b) = other_axes(axis);
        let at = place + v * ((0.5 - place[axis]) / v[axis]);
        let step = |x: f32| ((x * LINE_STEPS) as i32).clamp(0, LINE_STEPS as i32 - 1) as u32;
        let line = step(at[a]) | step(at[b]) << 4;
        let largest = V_SCALE - (line & 63) as f32;
        let mut code = (v * (largest / v[axis].abs())).round();
        for i in 0..3 {
            // No other component may pass the largest, nor an earlier one reach it.
            let most = if i < axis { largest - 1.0 } else { largest };
            code[i] = if i == axis { largest.copysign(v[axis]) } else { code[i].clamp(-most, most) };
        }
        let bits = |c: f32| (c as i32 as u32) & 0x3ff;
        Cell { x: 0, y: bits(code.x) | bits(code.y) << 10 | bits(code.z) << 20 | (line >> 6) << 30 }
    }

    /// Point of the strand's line half way through the cell along the largest component of v, in cells from
    /// the cell's centre, and the axis of that component. Only for cells of [`Cell::with_line`].
    #[inline]
    pub fn line(self) -> (Vec3, usize) {
        let code = self.v_code();
        let axis = main_axis(code);
        let line = (V_SCALE - code[axis].abs()) as u32 | self.y >> 30 << 6;
        let (a, b) = other_axes(axis);
        let mut place = Vec3::ZERO;
        place[a] = ((line & 15) as f32 + 0.5) / LINE_STEPS - 0.5;
        place[b] = ((line >> 4) as f32 + 0.5) / LINE_STEPS - 0.5;
        (place, axis)
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

/// Axis of the component of the largest magnitude, the first of equal ones.
#[inline]
fn main_axis(v: Vec3) -> usize {
    let a = v.abs();
    if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    }
}

/// The two other axes, in order.
#[inline]
fn other_axes(axis: usize) -> (usize, usize) {
    [(1, 2), (0, 2), (0, 1)][axis]
}

/// Rounds `x`, clamped to 0 to 1, to steps of 1/`scale`.
#[inline]
fn unorm(x: f32, scale: f32) -> u32 {
    (x.clamp(0.0, 1.0) * scale + 0.5) as u32
}
