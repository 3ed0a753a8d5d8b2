//! Surges: thick and thin water that travels down a sheet with its strands.
//!
//! A sheet lets more or less water over its lip as time goes by. What passed the lip at one moment falls
//! together, so flux depends on the place in the moving volume alone. It is value noise on a lattice that
//! repeats with the volume: an animation whose volume returns to its start has returned to its surges too.

use rand::RngExt;

use crate::util::random::{Family, Stream};

/// Cells of the noise across a sheet.
const ACROSS: usize = 3;

/// Surges of a sheet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surges {
    /// Largest share of the water that a lull lacks, 0 to 1.
    strength: f32,
    /// Distance that the volume has moved down the flow, in its lengths, less whole ones.
    flow: f64,
    /// Share of `strength` that lacks at each lattice point, row by row along the volume.
    lattice: Vec<[f32; ACROSS + 1]>,
}

impl Surges {
    /// `count` surges in each length of the volume, which has moved by `flow` lengths. Sheets of one `seed`
    /// have the same. With the strength 0 the water is even.
    pub fn new(strength: f32, count: u32, flow: f64, seed: u64) -> Self {
        // A surge is a maximum of the noise: one of two lattice points is one in the mean.
        let rows = if strength > 0.0 { 2 * count as usize } else { 0 };
        let family = Family::new(seed, Stream::Surge);
        let row = |i: usize| {
            let mut random = family.member(i as u64);
            // Rows of lulls follow rows of surges; without that, noise of few rows would show too few.
            std::array::from_fn(|_| 0.5 * ((i % 2) as f32 + random.random::<f32>()))
        };
        Surges { strength, flow: flow.rem_euclid(1.0), lattice: (0..rows).map(row).collect() }
    }

    /// Share of the water that lacks at `u` across the sheet, 0 to 1, and at the texture position `v`, in
    /// lengths of the volume.
    pub fn lack(&self, u: f32, v: f64) -> f32 {
        if self.lattice.is_empty() {
            return 0.0;
        }
        let rows = self.lattice.len();
        let along = (v - self.flow).rem_euclid(1.0) * rows as f64;
        let across = f64::from(u.clamp(0.0, 1.0)) * ACROSS as f64;
        let (row, column) = ((along as usize).min(rows - 1), (across as usize).min(ACROSS - 1));
        let smooth = |t: f64| (t * t * (3.0 - 2.0 * t)) as f32;
        let (down, right) = (smooth(along - row as f64), smooth(across - column as f64));
        let between = |row: &[f32; ACROSS + 1]| row[column] + (row[column + 1] - row[column]) * right;
        let [before, after] = [row, (row + 1) % rows].map(|row| between(&self.lattice[row]));
        self.strength * (before + (after - before) * down)
    }
}
