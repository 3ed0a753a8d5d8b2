//! Sums of ρ along the light's ray from all cells of a level, in SIMD lanes.
//!
//! The sums of a block of neighbouring cells stay in registers while all cells of the ray are added to them.
//! Each sum has the operations of the walk from its own cell, in their order.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, f32x8, i32x8};
use glam::IVec3;
use rayon::prelude::*;

use crate::util::lane_powers::exp2;
use crate::util::lanes::{LANES, Mask};
use crate::volume::Cell;

/// Most vectors in one block. With two more for ρ and the weight they fit into 16 registers.
const MOST_VECTORS: usize = 6;

/// Rows that one thread sums at a time.
const ROWS: usize = 16;

/// Cells of the ray whose places in [`Codes`] are computed together.
const TAPS: usize = 16;

/// A cell on the light ray.
pub struct Tap {
    /// Position relative to the cell where the ray starts.
    pub offset: IVec3,
    /// Factor on the cell's ρ: a length, or with per-cell attenuation a count.
    pub weight: f32,
}

/// Up to [`TAPS`] cells that follow one another on the light ray, as steps in [`Codes`]. Apart from the
/// weights the numbers are those of codes.
#[derive(Clone, Copy, Default)]
struct Steps {
    /// Steps along x and along y, both within one copy of the volume, and along z.
    x: [usize; TAPS],
    y: [usize; TAPS],
    z: [usize; TAPS],
    weight: [f32; TAPS],
}

/// The light ray from every cell.
struct Ray {
    steps: Vec<Steps>,
    /// Number of cells on the ray from a cell of each layer.
    counts: Vec<usize>,
    /// Bits of transmittance per unit of depth.
    bits: f32,
    /// Whether empty cells have values.
    everywhere: bool,
}

/// ρ codes of a level, row by row. Each row goes on into the next copy of the volume, far enough for a block
/// of cells to start anywhere in it.
pub struct Codes {
    codes: Vec<f32>,
    size: [usize; 3],
    /// Codes in a row, with those of the next copy.
    stride: usize,
    /// Vectors in a block.
    vectors: usize,
}

/// A value that a light volume stores.
pub trait Number: Copy + Default + Send {
    /// Values of the cells of a block by their depths. Cells that are not `read` have 0.
    fn of<S: Simd, const N: usize>(
        simd: S,
        depths: &[f32x8<S>; N],
        read: &[Mask<S>; N],
        bits: f32,
        out: &mut [Self],
    );
}

impl Number for f32 {
    #[inline(always)]
    fn of<S: Simd, const N: usize>(
        simd: S,
        depths: &[f32x8<S>; N],
        read: &[Mask<S>; N],
        _: f32,
        out: &mut [f32],
    ) {
        let mut values = [[0.0; LANES]; N];
        for i in 0..N {
            read[i].select(depths[i], f32x8::splat(simd, 0.0)).store_array(&mut values[i]);
        }
        out.copy_from_slice(&values.as_flattened()[..out.len()]);
    }
}

impl Number for u8 {
    /// Twin of [`transmittance_code`](crate::light::visibility::transmittance_code).
    #[inline(always)]
    fn of<S: Simd, const N: usize>(
        simd: S,
        depths: &[f32x8<S>; N],
        read: &[Mask<S>; N],
        bits: f32,
        out: &mut [u8],
    ) {
        let mut values = [[0; LANES]; N];
        for i in 0..N {
            let codes = exp2(simd, (depths[i] * bits) * -0.5) * 255.0 + 0.5;
            let codes = read[i].select(codes, f32x8::splat(simd, 0.0));
            codes.to_int::<i32x8<S>>().store_array(&mut values[i]);
        }
        for (out, &code) in out.iter_mut().zip(values.as_flattened()) {
            *out = code as u8;
        }
    }
}

impl Codes {
    /// Codes of a level's cells.
    pub fn new(size: [u32; 3], cells: &[Cell]) -> Self {
        let size = size.map(|n| n as usize);
        let whole = size[0].div_ceil(LANES);
        // The number of vectors that leaves the fewest idle, and of those the largest.
        let idle = |vectors: &usize| whole.next_multiple_of(*vectors) - whole;
        let vectors = (MOST_VECTORS.div_ceil(2).min(whole)..=MOST_VECTORS.min(whole)).rev().min_by_key(idle);
        let vectors = vectors.unwrap_or(1);
        let stride = size[0] + vectors * LANES - 1;
        let mut codes = vec![0.0; stride * size[1] * size[2]];
        codes.par_chunks_mut(stride).zip(cells.par_chunks(size[0])).for_each(|(row, cells)| {
            for (code, cell) in row.iter_mut().zip(cells.iter().cycle()) {
                *code = cell.rho_code() as f32;
            }
        });
        Codes { codes, size, stride, vectors }
    }

    /// Sums ρ along the ray from every cell, and makes values of the sums. Empty cells have 0, unless values
    /// are asked for `everywhere`.
    pub fn sums<T: Number>(
        &self,
        simd: fearless_simd::Level,
        taps: &[Tap],
        bits: f32,
        everywhere: bool,
    ) -> Vec<T> {
        let [nx, ny, nz] = self.size;
        let within = |offset: i32, n: usize| i64::from(offset).rem_euclid(n as i64) as usize;
        let steps_of = |taps: &[Tap]| {
            let mut steps = Steps::default();
            for (i, Tap { offset, weight }) in taps.iter().enumerate() {
                steps.x[i] = within(offset.x, nx);
                steps.y[i] = within(offset.y, ny) * self.stride;
                steps.z[i] = (offset.z as isize * (ny * self.stride) as isize) as usize;
                steps.weight[i] = *weight;
            }
            steps
        };
        // From a layer, the ray is in the volume for so many cells.
        let inside = |z: usize, tap: &Tap| (0..nz as i64).contains(&(z as i64 + i64::from(tap.offset.z)));
        let count = |z: usize| taps.partition_point(|tap| inside(z, tap));
        let ray = Ray {
            steps: taps.chunks(TAPS).map(steps_of).collect(),
            counts: (0..nz).map(count).collect(),
            bits,
            everywhere,
        };
        let mut numbers = vec![T::default(); nx * ny * nz];
        numbers.par_chunks_mut(nx * ROWS).enumerate().for_each(|(chunk, numbers)| {
            dispatch!(simd, simd => self.rows(simd, chunk * ROWS, &ray, numbers));
        });
        numbers
    }

    /// Values of some rows, beginning with row `first`.
    #[inline(always)]
    fn rows<S: Simd, T: Number>(&self, simd: S, first: usize, ray: &Ray, numbers: &mut [T]) {
        let nx = self.size[0];
        for (row, numbers) in (first..).zip(numbers.chunks_mut(nx)) {
            for (block, numbers) in numbers.chunks_mut(self.vectors * LANES).enumerate() {
                let at = [block * self.vectors * LANES, row];
                match self.vectors {
                    1 => self.block::<S, T, 1>(simd, at, ray, numbers),
                    2 => self.block::<S, T, 2>(simd, at, ray, numbers),
                    3 => self.block::<S, T, 3>(simd, at, ray, numbers),
                    4 => self.block::<S, T, 4>(simd, at, ray, numbers),
                    5 => self.block::<S, T, 5>(simd, at, ray, numbers),
                    _ => self.block::<S, T, MOST_VECTORS>(simd, at, ray, numbers),
                }
            }
        }
    }

    /// Values of a block of `N` vectors, beginning with the cell `x` of a row.
    #[inline(always)]
    fn block<S: Simd, T: Number, const N: usize>(
        &self,
        simd: S,
        [x, row]: [usize; 2],
        ray: &Ray,
        numbers: &mut [T],
    ) {
        let [nx, ny, _] = self.size;
        let (slice, y) = (ny * self.stride, row % ny * self.stride);
        let layer = row * self.stride - y;
        let mut left = ray.counts[row / ny];
        let Some(own) = self.vectors::<N>(row * self.stride + x) else { return };
        let zero = f32x8::splat(simd, 0.0);
        let mut sums = [zero; N];
        for steps in &ray.steps[..left.div_ceil(TAPS)] {
            let mut at = [0; TAPS];
            for (i, at) in at.iter_mut().enumerate() {
                let (x, y) = (x + steps.x[i], y + steps.y[i]);
                // Takes x − nx, or x if that is negative: without a sign, a negative number is a large one.
                let (x, y) = (x.min(x.wrapping_sub(nx)), y.min(y.wrapping_sub(slice)));
                *at = layer.wrapping_add(steps.z[i]).wrapping_add(y).wrapping_add(x);
            }
            for (&at, &weight) in at.iter().zip(&steps.weight).take(left) {
                let Some(codes) = self.vectors::<N>(at) else { return };
                for i in 0..N {
                    sums[i] += f32x8::load_array_ref(simd, &codes[i]) * weight;
                }
            }
            left = left.saturating_sub(TAPS);
        }
        let mut read = [zero.simd_eq(zero); N];
        if !ray.everywhere {
            for i in 0..N {
                read[i] = f32x8::load_array_ref(simd, &own[i]).simd_gt(zero);
            }
        }
        T::of(simd, &sums, &read, ray.bits, numbers);
    }

    /// `N` vectors of codes, beginning with code number `first`.
    #[inline(always)]
    fn vectors<const N: usize>(&self, first: usize) -> Option<&[[f32; LANES]; N]> {
        self.codes.get(first..)?.as_chunks().0.first_chunk()
    }
}
