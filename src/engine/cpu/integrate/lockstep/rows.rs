//! Cells that eight rays pass in a tetrahedron each. Where the cells are does not depend on what is in them:
//! the rays are walked first, then the cells are fetched, so that the processor waits for none of them.

use fearless_simd::i32x8;
use fearless_simd::prelude::*;

use super::cells::Store;
use super::walk::Walk;
use crate::util::lanes::{Floats, Ints, LANES, Mask, Stored};
use crate::volume::Cell;

/// Most cells of a ray between two looks at them.
pub const ROWS: usize = 32;

/// Cells that eight rays pass, one of each ray in a row. A ray passes cells in the first rows only.
pub struct Rows {
    index: [[i32; LANES]; ROWS],
    /// Parameters where the rays enter the cells, and one row more, where they leave the last ones.
    t: [Stored; ROWS + 1],
    /// Number of cells that each ray passes.
    pub count: [i32; LANES],
}

impl Default for Rows {
    fn default() -> Self {
        Rows { index: [[0; LANES]; ROWS], t: [Stored::default(); ROWS + 1], count: [0; LANES] }
    }
}

impl Rows {
    /// Walks the rays `active` up to the parameters `end`, through `most` cells, or until the rows are full.
    /// Returns the rays that go on after that.
    #[inline(always)]
    pub fn walk<S: Simd>(
        &mut self,
        simd: S,
        walk: &mut Walk<S>,
        mut active: Mask<S>,
        end: Floats<S>,
        most: Ints<S>,
    ) -> Mask<S> {
        let (none, one) = (i32x8::splat(simd, 0), i32x8::splat(simd, 1));
        let mut count = none;
        let mut row = 0;
        loop {
            active &= walk.inside() & walk.t.simd_lt(end) & count.simd_lt(most);
            self.t[row].store(walk.t);
            if row == ROWS || !active.any_true() {
                break;
            }
            walk.index().store_array(&mut self.index[row]);
            count += active.select(one, none);
            walk.advance();
            row += 1;
        }
        count.store_array(&mut self.count);
        active
    }

    /// Shows the cells of a ray and their rows, in the order of the ray.
    #[inline(always)]
    pub fn cells(&self, lane: usize, store: &Store, show: impl FnMut(usize, Cell)) {
        store.lane(&self.index[..self.count[lane] as usize], lane, show);
    }

    /// Parameters where a ray that ends at `end` enters and leaves the cell of a row.
    #[inline(always)]
    pub fn crossing(&self, lane: usize, row: usize, end: f32) -> [f32; 2] {
        let [enter, next] = [self.t[row].0[lane], self.t[row + 1].0[lane]];
        [enter, if next < end { next } else { end }]
    }
}
