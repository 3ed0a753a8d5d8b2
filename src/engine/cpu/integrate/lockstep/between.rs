//! Values interpolated between the eight cell centres around the middle of each ray's segment in a cell. Twin
//! of `Level::sample_trilinear` in `src/trace/lookup.rs`.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::cells::{k_codes, rho_codes, words};
use super::fibre::Moments;
use super::group::Group;
use super::walk::{BATCH, Passed};
use crate::util::lanes::{Floats, Ints, LANES, Stored, Stored3};
use crate::volume::Cell;

/// Interpolated values of a batch of steps.
pub struct Between {
    /// ρ on the sheet, in codes.
    pub rho: [Stored; BATCH],
    /// k_d and k_s, in codes.
    pub k: [[Stored; 2]; BATCH],
    /// Second moments of the directions: xx, yy and zz, and xy, xz and yz.
    pub moments: [[Stored3; 2]; BATCH],
}

impl Default for Between {
    fn default() -> Self {
        Between {
            rho: [Stored::default(); BATCH],
            k: [[Stored::default(); 2]; BATCH],
            moments: [[Stored3::default(); 2]; BATCH],
        }
    }
}

impl Group<'_, '_> {
    /// Interpolates the values of some steps. Outside the slab they have no meaning.
    #[inline(always)]
    pub fn interpolate<S: Simd>(
        &self,
        simd: S,
        passed: &Passed<BATCH>,
        steps: Range<usize>,
        between: &mut Between,
    ) {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let values = &self.hits.values;
        let origin = values.origin.load(simd).scaled(self.level.scale);
        let direction = values.d_cell.load(simd).scaled(self.level.scale);
        let (scale, shift) = (self.line()[0].load(simd), self.line()[1].load(simd));
        let mut indices = [[0; LANES]; 8];
        let mut cells = [[Cell::default(); LANES]; 8];
        for j in steps {
            let middle = passed.middle[j].load(simd);
            let (x, x_share) = self.neighbours(simd, passed, j, 0, origin.x + direction.x * middle);
            let (y, y_share) = self.neighbours(simd, passed, j, 1, origin.y + direction.y * middle);
            let (z, z_share) = self.neighbours(simd, passed, j, 2, origin.z + direction.z * middle);
            for (corner, index) in indices.iter_mut().enumerate() {
                (x[corner & 1] + y[corner >> 1 & 1] + z[corner >> 2]).store_array(index);
            }
            self.store.fetch(&indices, &mut cells);
            let mut rho = zero;
            let mut k = [zero; 2];
            let mut sum = Moments::zero(simd);
            for (corner, cells) in cells.iter().enumerate() {
                let [first, second] = words(simd, cells);
                let share = x_share[corner & 1] * y_share[corner >> 1 & 1] * z_share[corner >> 2];
                let weight = share * rho_codes(first);
                let [k_d, k_s] = k_codes(first);
                rho += weight;
                k[0] += weight * k_d;
                k[1] += weight * k_s;
                let own = match self.level.is_whole {
                    true => Moments::of(second),
                    false => Moments::unpacked(simd, second),
                };
                sum.add(own, weight / own.trace().max(f32x8::splat(simd, 1e-20)));
            }
            let inverse = one / rho.max(f32x8::splat(simd, 1e-20));
            between.rho[j].store((rho * scale + shift).max(zero));
            between.k[j][0].store(k[0] * inverse);
            between.k[j][1].store(k[1] * inverse);
            sum.scaled(inverse).store(&mut between.moments[j]);
        }
    }

    /// Offsets of the ray's cell and of its neighbour along an axis, and their shares in the value at `p`.
    #[inline(always)]
    fn neighbours<S: Simd>(
        &self,
        simd: S,
        passed: &Passed<BATCH>,
        j: usize,
        axis: usize,
        p: Floats<S>,
    ) -> ([Ints<S>; 2], [Floats<S>; 2]) {
        let units = &self.store.units;
        let (none, one) = (i32x8::splat(simd, 0), i32x8::splat(simd, 1));
        let size = i32x8::splat(simd, units.size[axis]);
        let factor = i32x8::splat(simd, units.factors[axis]);
        let inside = p - p.floor() - 0.5;
        let is_below = inside.simd_lt(0.0);
        let share = inside.abs();
        let shares = [f32x8::splat(simd, 1.0) - share, share];
        if axis == 2 {
            // View rays go upwards, through the layers that are left to them.
            let own = size - i32x8::load_array_ref(simd, &passed.layers[j]);
            let next = own + is_below.select(-one, one);
            let clamped = next.max(none).min(size - one);
            return ([own.min(size - one) * factor, clamped * factor], shares);
        }
        let own = i32x8::load_array_ref(simd, &passed.offsets[j][axis]);
        let next = own + is_below.select(-factor, factor);
        let next = next.simd_lt(none).select((size - one) * factor, next);
        ([own, next.simd_ge(size * factor).select(none, next)], shares)
    }
}
