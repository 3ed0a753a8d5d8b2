//! Random numbers that depend on what they are used for, never on the order in which they are drawn.
//!
//! Each curve, cell and mesh vertex has a generator of its own, seeded by (seed, stream, index). So a volume
//! is the same bit for bit on any number of threads, and a cell keeps its noise when the curves around it
//! change.

use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// Purpose of a generator. Each purpose has its own index.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    /// One spatial fractal curve; index: its number in the jitter grid, column + row · columns.
    Curve = 1,
    /// ρ and k of one cell; index: linear index of the cell.
    Cell = 2,
    /// Height and albedo of one vertex of a rock mesh; index: its number in the finest grid.
    Rock = 3,
    /// The parent curve of a bundle; index: number of the bundle.
    Bundle = 4,
    /// The bundle that a curve belongs to, and the curve's offset in it; index: as for [`Stream::Curve`].
    Child = 5,
    /// Density along one curve; index: as for [`Stream::Curve`].
    Strand = 6,
    /// Ridges, borders and patches of one vertex of a rock mesh; index: its number in the finest grid.
    RockForm = 7,
    /// One block of a layer of rock; index: made of the layer and of the block's position in it.
    Stratum = 8,
    /// One wave of a pool; index: number of the wave.
    Wave = 9,
    /// One arc of a splash; index: number of the arc.
    Splash = 10,
    /// One hair; index: number of the hair.
    Hair = 11,
    /// Surges of a sheet; index: row of the lattice.
    Surge = 12,
}

/// The generators of one seed and one stream.
#[derive(Clone, Copy, Debug)]
pub struct Family(u64);

impl Family {
    /// Family of `stream` under the user's `seed`.
    pub fn new(seed: u64, stream: Stream) -> Self {
        let mut mixer = Pcg64Mcg::seed_from_u64(seed);
        let mut key = 0;
        for _ in 0..=stream as u64 {
            key = mixer.next_u64();
        }
        Family(key)
    }

    /// Generator of the item with this `index`.
    #[inline]
    pub fn member(self, index: u64) -> Pcg64Mcg {
        Pcg64Mcg::seed_from_u64(self.0.wrapping_add(index))
    }
}

/// Draws a normal number of mean 0 and variance 1, the paper's normal_rand().
pub fn normal(rng: &mut impl Rng) -> f32 {
    StandardNormal.sample(rng)
}
