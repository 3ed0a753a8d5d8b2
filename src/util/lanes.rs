//! Vectors of eight lanes, one lane a ray or a point. Functions that take them are inlined into the code of
//! one instruction set; a call would leave its registers.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8, u32x8};
use glam::Vec3;

/// Number of rays or points that are computed side by side.
pub const LANES: usize = 8;

/// One float a lane.
pub type Floats<S> = f32x8<S>;
/// One signed whole number a lane.
pub type Ints<S> = i32x8<S>;
/// One word of bits a lane.
pub type Words<S> = u32x8<S>;
/// One truth value a lane.
pub type Mask<S> = mask32x8<S>;

/// Floats of eight lanes in memory.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Stored(pub [f32; LANES]);

impl Stored {
    /// The value of every lane, given by its number.
    #[inline(always)]
    pub fn from_fn(value: impl Fn(usize) -> f32) -> Self {
        let mut out = Stored::default();
        for lane in 0..LANES {
            out.0[lane] = value(lane);
        }
        out
    }

    /// Loads the lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Floats<S> {
        f32x8::load_array_ref(simd, &self.0)
    }

    /// Stores the lanes.
    #[inline(always)]
    pub fn store<S: Simd>(&mut self, lanes: Floats<S>) {
        lanes.store_array(&mut self.0);
    }
}

/// Vectors of eight lanes in memory.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Stored3(pub [Stored; 3]);

impl Stored3 {
    /// The vector of every lane, given by its number.
    #[inline(always)]
    pub fn from_fn(value: impl Fn(usize) -> Vec3) -> Self {
        let mut out = Stored3::default();
        for lane in 0..LANES {
            out.set(lane, value(lane));
        }
        out
    }

    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.0[0].0[lane], self.0[1].0[lane], self.0[2].0[lane])
    }

    /// Replaces the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.0[0].0[lane], self.0[1].0[lane], self.0[2].0[lane]) = v.into();
    }

    /// Loads the lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Lanes3<S> {
        let [x, y, z] = &self.0;
        Lanes3 { x: x.load(simd), y: y.load(simd), z: z.load(simd) }
    }

    /// Stores the lanes.
    #[inline(always)]
    pub fn store<S: Simd>(&mut self, lanes: Lanes3<S>) {
        self.0[0].store(lanes.x);
        self.0[1].store(lanes.y);
        self.0[2].store(lanes.z);
    }
}

/// One vector a lane. Products have the order of operations of [`Vec3`].
#[derive(Clone, Copy)]
pub struct Lanes3<S: Simd> {
    /// First component.
    pub x: Floats<S>,
    /// Second component.
    pub y: Floats<S>,
    /// Third component.
    pub z: Floats<S>,
}

impl<S: Simd> Lanes3<S> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(simd: S, v: Vec3) -> Lanes3<S> {
        Lanes3 { x: f32x8::splat(simd, v.x), y: f32x8::splat(simd, v.y), z: f32x8::splat(simd, v.z) }
    }

    /// This where `is` holds, or another.
    #[inline(always)]
    pub fn or(self, is: Mask<S>, other: Lanes3<S>) -> Lanes3<S> {
        Lanes3 { x: is.select(self.x, other.x), y: is.select(self.y, other.y), z: is.select(self.z, other.z) }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Lanes3<S>) -> Floats<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, other: Lanes3<S>) -> Lanes3<S> {
        Lanes3 {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// Sum of two vectors.
    #[inline(always)]
    pub fn plus(self, other: Lanes3<S>) -> Lanes3<S> {
        Lanes3 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    /// Difference of two vectors.
    #[inline(always)]
    pub fn minus(self, other: Lanes3<S>) -> Lanes3<S> {
        Lanes3 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    /// Products with the components of a vector.
    #[inline(always)]
    pub fn scaled(self, factors: Vec3) -> Lanes3<S> {
        Lanes3 { x: self.x * factors.x, y: self.y * factors.y, z: self.z * factors.z }
    }

    /// Products of the components.
    #[inline(always)]
    pub fn by(self, other: Lanes3<S>) -> Lanes3<S> {
        Lanes3 { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    /// Quotient by one number a lane.
    #[inline(always)]
    pub fn over(self, divisor: Floats<S>) -> Lanes3<S> {
        Lanes3 { x: self.x / divisor, y: self.y / divisor, z: self.z / divisor }
    }

    /// Product with one number a lane.
    #[inline(always)]
    pub fn times(self, factor: Floats<S>) -> Lanes3<S> {
        Lanes3 { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

/// Signed whole numbers with the same bits.
#[inline(always)]
pub fn signed<S: Simd>(words: Words<S>) -> Ints<S> {
    words.bitcast()
}

/// Words with the same bits.
#[inline(always)]
pub fn unsigned<S: Simd>(ints: Ints<S>) -> Words<S> {
    ints.bitcast()
}

/// Largest whole number that is not above x, |x| < 2^23.
#[inline(always)]
pub fn floor_cell<S: Simd>(simd: S, x: Floats<S>) -> Ints<S> {
    let whole = x.to_int::<i32x8<S>>();
    let above = x.simd_lt(whole.to_float::<f32x8<S>>());
    whole - above.select(i32x8::splat(simd, 1), i32x8::splat(simd, 0))
}

/// Numbers of the lanes whose bits are set.
#[inline(always)]
pub fn lanes_of(bits: u8) -> impl Iterator<Item = usize> {
    let mut bits = bits;
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}
