//! §2 Builder of loose grains: particles without strands.
//!
//! Water of particles (Sims 1990) looks like granulated sugar; the paper's curves give it strands. This
//! volume is what they are compared with: each grain is filled or not by chance, and its direction is any.

use glam::Vec3;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal, UnitSphere};
use rayon::prelude::*;

use super::{Cell, Cells, VolumeTexture};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};

/// Recipe of a volume of grains. Equal recipes build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrainsSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Share of the grains that are filled, at the skin.
    pub filled: f32,
    /// Share by which the filled grains become fewer up to the outer face.
    pub settled: f32,
    /// Mean distance from grain to grain, cells. At 1 each cell is a grain.
    pub grain_cells: f32,
    /// Relative standard deviation of k_d and k_s from grain to grain.
    pub shade: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d.
    pub k_d: f32,
    /// Mean k_s. `None`: each grain has a place on a ramp of colours there, evenly from 0 to 1.
    pub k_s: Option<f32>,
}

/// A grain: its middle in its field of the grid, in fields, and its cell.
#[derive(Clone, Copy)]
struct Grain {
    middle: Vec3,
    cell: Cell,
}

impl GrainsSpec {
    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let [nx, ny, nz] = self.size.map(|n| n as usize);
        let counts = self.counts();
        let grains: Vec<Grain> =
            (0..counts.iter().product()).into_par_iter().map(|i| self.grain(i, counts)).collect();
        monitor.progress("grains", 1, 2)?;
        let is_cell = counts == [nx, ny, nz];
        let mut cells = vec![Cell::default(); nx * ny * nz];
        cells.par_chunks_mut(nx).enumerate().for_each(|(line, cells)| {
            let (y, z) = (line % ny, line / ny);
            for (x, cell) in cells.iter_mut().enumerate() {
                *cell = match is_cell {
                    true => grains[line * nx + x].cell,
                    false => nearest(&grains, counts, self.size, [x, y, z]).cell,
                };
            }
        });
        monitor.progress("grains", 2, 2)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells: Cells::from(cells) })
    }

    /// Numbers of grains along x, y and z.
    fn counts(&self) -> [usize; 3] {
        self.size.map(|n| (n as f32 / self.grain_cells).round().clamp(1.0, n as f32) as usize)
    }

    /// Grain number `i`.
    fn grain(&self, i: usize, counts: [usize; 3]) -> Grain {
        let mut rng = Family::new(self.seed, Stream::Cell).member(i as u64);
        let middle = Vec3::from_array(rng.random());
        let height = 1.0 - ((i / (counts[0] * counts[1])) as f32 + 0.5) / counts[2] as f32;
        let is_filled = rng.random::<f32>() < self.filled * (1.0 - self.settled * height);
        if !is_filled {
            return Grain { middle, cell: Cell::default() };
        }
        let v = Vec3::from_array(UnitSphere.sample(&mut rng));
        let mut shade = || {
            let g: f32 = StandardNormal.sample(&mut rng);
            (1.0 + self.shade * g).max(0.0)
        };
        let (k_d, k_s) = (self.k_d * shade(), self.k_s.map(|k_s| k_s * shade()));
        let second = k_s.unwrap_or_else(|| rng.random());
        Grain { middle, cell: Cell::from_direction(v).with_density(1.0, k_d, second) }
    }
}

/// The grain whose middle is nearest to that of a cell. Grains go on across the borders in x and y.
fn nearest(grains: &[Grain], counts: [usize; 3], size: [u32; 3], cell: [usize; 3]) -> &Grain {
    let at = Vec3::from_array(std::array::from_fn(|axis| {
        (cell[axis] as f32 + 0.5) / size[axis] as f32 * counts[axis] as f32
    }));
    let field = at.floor();
    let count = counts.map(|n| n as i64);
    let mut least = (f32::INFINITY, 0);
    for n in 0..27 {
        let step = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        let [i, j, k]: [i64; 3] = std::array::from_fn(|axis| field[axis] as i64 + step[axis]);
        if !(0..count[2]).contains(&k) {
            continue;
        }
        let number = (k * count[1] + j.rem_euclid(count[1])) * count[0] + i.rem_euclid(count[0]);
        let middle = Vec3::from_array(step.map(|s| s as f32)) + field + grains[number as usize].middle;
        let distance = middle.distance_squared(at);
        if distance < least.0 {
            least = (distance, number as usize);
        }
    }
    &grains[least.1]
}
