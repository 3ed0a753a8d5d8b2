//! Random numbers that depend on their purpose, never on the order of calls.
//!
//! Each curve, cell and mesh vertex has a generator of its own, seeded by (seed, stream, index): the
//! same volume comes out bit for bit on any number of threads, and a cell keeps its noise when the
//! curves around it change.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Purpose of a generator.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    /// One spatial fractal curve; index: its place in the jitter grid.
    Curve = 1,
    /// ρ and k of one cell; index: linear index of the cell.
    Cell = 2,
    /// Height and albedo of one vertex of a rock mesh; index: its place in the finest grid.
    Rock = 3,
    /// The parent curve of a bundle; index: its number.
    Bundle = 4,
    /// Which bundle a curve belongs to, and where in it; index: as of [`Stream::Curve`].
    Child = 5,
    /// Density along one curve; index: as of [`Stream::Curve`].
    Strand = 6,
    /// Ridges, borders and patches of one vertex of a rock mesh; index: its place in the finest grid.
    RockForm = 7,
    /// One block of a layer of rock; index: layer and place in it.
    Stratum = 8,
    /// One wave of a pool; index: its number.
    Wave = 9,
    /// One arc of a splash; index: its number.
    Splash = 10,
}

/// A family of generators: one seed and one stream.
#[derive(Clone, Copy, Debug)]
pub struct Family(u64);

impl Family {
    /// Returns the generators of `stream` under the user's `seed`.
    pub fn new(seed: u64, stream: Stream) -> Self {
        let mut mixer = Pcg64Mcg::seed_from_u64(seed);
        let mut key = 0;
        for _ in 0..=stream as u64 {
            key = mixer.next_u64();
        }
        Family(key)
    }

    /// Returns the generator of one item.
    #[inline]
    pub fn member(self, index: u64) -> Pcg64Mcg {
        Pcg64Mcg::seed_from_u64(self.0.wrapping_add(index))
    }
}
