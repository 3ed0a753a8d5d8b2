//! §2 Builder of skin: an even tissue below a surface of fine lines.
//!
//! Plates of some tenths of a millimetre, with furrows between them, cover skin. They lie on two levels, the
//! finer with half the size and half the depth. ρ of a column is 1 below its furrow; v is the normal of the
//! surface, pointing outwards. A cell's place on the ramp of colours, in the byte of k_s, tells the tissue:
//! 0 freckled epidermis, ⅓ epidermis, ⅔ dermis, 1 flushed dermis.

use glam::Vec2;
use rand::RngExt;
use rayon::prelude::*;

use super::field::{Field, fractal};
use super::{Cell, VolumeTexture};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream};

/// Places on the ramp.
const FRECKLED: f32 = 0.0;
const EPIDERMIS: f32 = 1.0 / 3.0;
const DERMIS: f32 = 2.0 / 3.0;
const FLUSHED: f32 = 1.0;
/// Standard deviation of a furrow's profile, sizes of a plate.
const FURROW: f32 = 0.12;
/// Levels of plates.
const LEVELS: u32 = 2;
/// Size of the largest freckles and of flushed areas, widths nx.
const SPOT: f32 = 0.3;
/// Complexity h of their outlines.
const SPOT_H: f32 = 0.9;
/// Width of a freckle's border, standard deviations of the field that it is cut from.
const BORDER: f32 = 0.4;
/// Bytes that building takes for each column of cells: heights, freckles, blood, and one more meanwhile.
pub(super) const BYTES_PER_COLUMN: usize = 4 * size_of::<f32>();

/// Recipe of a volume of skin. Equal recipes build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Number of plates across the width nx. 0: the surface is smooth.
    pub plates: u32,
    /// Depth of the furrows between plates, cells.
    pub furrow_cells: f32,
    /// Thickness of the epidermis, cells.
    pub epidermis_cells: f32,
    /// Share of the area with freckles.
    pub freckles: f32,
    /// Standard deviation, on the ramp's last third, by which more blood than the mean flows in places.
    pub flush: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
}

impl SkinSpec {
    /// Share of the epidermis in the layer of cells that has most of it.
    pub fn epidermis_share(&self) -> f32 {
        self.epidermis_cells.clamp(0.0, 1.0)
    }

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let [nx, ny, nz] = self.size.map(|n| n as usize);
        let furrows = self.furrows();
        monitor.progress("skin", 1, 3)?;
        let family = |stream| Family::new(self.seed, stream);
        let freckles = fractal([nx, ny], SPOT / 2.0, SPOT_H, family(Stream::Cell)).standard();
        let from = freckles.quantile(self.freckles);
        let freckles = freckles.map(|_, x| if from.is_finite() { (x - from) / BORDER } else { 0.0 });
        let blood = fractal([nx, ny], SPOT, SPOT_H, family(Stream::Bundle)).standard();
        monitor.progress("skin", 2, 3)?;
        let most = self.epidermis_share();
        let mut cells = vec![Cell::default(); nx * ny * nz];
        cells.par_chunks_mut(nx).enumerate().for_each(|(line, cells)| {
            let (y, z) = (line % ny, (line / ny) as f32);
            for (x, cell) in cells.iter_mut().enumerate() {
                let column = y * nx + x;
                let top = furrows.values[column];
                let rho = (z + 1.0 - top).clamp(0.0, 1.0);
                // Less than half a step of ρ.
                if rho < 0.5 / 65535.0 {
                    continue;
                }
                let epidermis = (z + 1.0).min(top + self.epidermis_cells) - z.max(top);
                let share = if most > 0.0 { (epidermis / rho / most).clamp(0.0, 1.0) } else { 0.0 };
                let above = EPIDERMIS + (FRECKLED - EPIDERMIS) * freckles.values[column].clamp(0.0, 1.0);
                let below = DERMIS + (FLUSHED - DERMIS) * (self.flush * blood.values[column]).clamp(0.0, 1.0);
                let place = below + (above - below) * share;
                let normal = furrows.slope(x, y).extend(-1.0);
                *cell = Cell::from_direction(normal).with_density(rho, 1.0, place);
            }
        });
        monitor.progress("skin", 3, 3)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells: cells.into() })
    }

    /// Depth of the surface below the face z = 0 in each column, cells.
    fn furrows(&self) -> Field {
        let cells = [self.size[0] as usize, self.size[1] as usize];
        let levels: Vec<Plates> = (0..LEVELS).filter_map(|level| self.plates_of(level)).collect();
        Field::new(cells, |x, y| {
            let of = |level: &Plates| level.depth * level.furrow(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            // A fine furrow in a coarse one does not add to it.
            levels.iter().map(of).fold(0.0, f32::max)
        })
    }

    /// Plates of a level; `None` where there are none, or they would be finer than four cells.
    fn plates_of(&self, level: u32) -> Option<Plates> {
        let across = self.plates.checked_shl(level)?;
        let [nx, ny] = [self.size[0], self.size[1]];
        if across == 0 || u64::from(nx) < 4 * u64::from(across) || self.furrow_cells <= 0.0 {
            return None;
        }
        let size = nx as f32 / across as f32;
        let counts = [across, ((ny as f32 / size).round() as u32).max(1)];
        let mut rng = Family::new(self.seed, Stream::Stratum).member(u64::from(level));
        let middles = (0..counts[0] * counts[1]).map(|_| Vec2::new(rng.random(), rng.random())).collect();
        Some(Plates {
            counts,
            fields_a_cell: Vec2::new(counts[0] as f32 / nx as f32, counts[1] as f32 / ny as f32),
            middles,
            depth: self.furrow_cells * 0.5f32.powi(level as i32),
        })
    }
}

/// Plates of one level: each holds what is nearest to its middle, one in each field of a grid.
struct Plates {
    counts: [u32; 2],
    fields_a_cell: Vec2,
    /// Middles in their fields, 0 to 1.
    middles: Vec<Vec2>,
    /// Depth of the furrows, cells.
    depth: f32,
}

impl Plates {
    /// Nearness to a furrow, 0 to 1, at a place in cells.
    fn furrow(&self, place: Vec2) -> f32 {
        let place = place * self.fields_a_cell;
        let field = place.floor();
        let (mut nearest, mut second) = (f32::INFINITY, f32::INFINITY);
        for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
            let at = field + Vec2::new(dx as f32, dy as f32);
            let [i, j] = [(at.x, self.counts[0]), (at.y, self.counts[1])]
                .map(|(at, count)| (at as i64).rem_euclid(i64::from(count)) as usize);
            let distance = (at + self.middles[j * self.counts[0] as usize + i]).distance(place);
            second = second.min(distance.max(nearest));
            nearest = nearest.min(distance);
        }
        let gap = (second - nearest) / (2.0 * FURROW);
        (-0.5 * gap * gap).exp()
    }
}
