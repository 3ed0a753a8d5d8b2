//! §5 Filling of light volumes on the host, for both engines.
//!
//! A light ray from the centre of any cell passes the same cells, relative to its start, over the same
//! lengths, equal to the bit. The reason is that the walk computes every parameter from a difference between
//! a boundary and the origin, and these differences are exact. The ray is therefore walked once, and the
//! depths of neighbouring cells are summed side by side, one cell of the ray at a time. This gives the bits
//! of [`optical_depth`](super::optical_depth::optical_depth) for a small part of the work.

mod row_sums;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use self::row_sums::{Codes, Tap};
use super::optical_depth::light_volume_value;
use super::visibility::{Form, LightVolume, Medium};
use crate::trace::Lookup;
use crate::trace::lookup::Level;
use crate::volume::Pyramid;
use crate::walk::Walk;

/// Values that one light volume stores for a level, in the order of the level's cells.
pub enum Numbers {
    /// Transmittance codes: √T in 255ths.
    Codes(Vec<u8>),
    /// Optical depths, in the unit of [`Form::Depths`].
    Depths(Vec<f32>),
}

impl Numbers {
    /// Value of the cell with this index, as a number.
    pub fn at(&self, index: usize) -> f32 {
        match self {
            Numbers::Codes(codes) => codes[index].into(),
            Numbers::Depths(depths) => depths[index],
        }
    }
}

/// Levels of a volume as rows of ρ codes, from which light volumes are filled.
pub struct Rows<'a> {
    /// Each level with its ρ codes. A sparse level has none, because rows of all its cells would not fit.
    levels: Vec<(Level<'a>, Option<Codes>)>,
    lookup: Lookup,
    simd: fearless_simd::Level,
}

impl<'a> Rows<'a> {
    /// Rows of all levels of a pyramid, summed with the best instruction set of this processor.
    pub fn new(levels: &'a Pyramid, lookup: Lookup) -> Self {
        Rows::summed_with(fearless_simd::Level::new(), levels, lookup)
    }

    /// Rows of all levels of a pyramid, summed with an instruction set. The values do not depend on it.
    pub fn summed_with(simd: fearless_simd::Level, levels: &'a Pyramid, lookup: Lookup) -> Self {
        let rows = |level: Level<'a>| {
            let cells = level.volume.cells.dense();
            (level, cells.map(|cells| Codes::new(level.volume.size, cells)))
        };
        let levels = (0..levels.len() as u32).map(|number| rows(Level::new(levels, number))).collect();
        Rows { levels, lookup, simd }
    }

    /// Values of a light volume, level by level. Empty cells have 0, because no view ray reads them; only
    /// with [`Lookup::Trilinear`] are they computed.
    pub fn fill(&self, light_volume: &LightVolume, medium: Medium, form: Form) -> Vec<Numbers> {
        let fill_level = |(level, codes): &(Level, Option<Codes>)| {
            let Some(codes) = codes else { return self.walked(level, light_volume, medium, form) };
            let taps = taps(level, light_volume.direction, medium);
            let everywhere = self.lookup == Lookup::Trilinear;
            let bits =
                if medium.per_cell { light_volume.bits * level.depth_in_cells() } else { light_volume.bits };
            match form {
                Form::Codes => Numbers::Codes(codes.sums(self.simd, &taps, bits, everywhere)),
                Form::Depths => Numbers::Depths(codes.sums(self.simd, &taps, 1.0, everywhere)),
            }
        };
        self.levels.iter().map(fill_level).collect()
    }

    /// Values of a sparse level, walked from each cell separately.
    fn walked(&self, level: &Level, light_volume: &LightVolume, medium: Medium, form: Form) -> Numbers {
        let value = |cell: IVec3| {
            let is_read = self.lookup == Lookup::Trilinear || level.cell(cell).rho_code() > 0;
            if is_read { light_volume_value(level, cell, light_volume, medium, form) } else { 0.0 }
        };
        match form {
            Form::Codes => Numbers::Codes(in_order(level, |cell| value(cell) as u8)),
            Form::Depths => Numbers::Depths(in_order(level, value)),
        }
    }
}

fn in_order<T: Send>(level: &Level, value: impl Fn(IVec3) -> T + Sync) -> Vec<T> {
    let [nx, ny, nz] = level.volume.size.map(|n| n as usize);
    let cell =
        |index: usize| IVec3::new((index % nx) as i32, (index / nx % ny) as i32, (index / nx / ny) as i32);
    (0..nx * ny * nz).into_par_iter().map(|index| value(cell(index))).collect()
}

/// Cells on the light ray from the centre of any cell of a level, long enough for the cell farthest from the
/// face where the light enters.
fn taps(level: &Level, direction: Vec3, medium: Medium) -> Vec<Tap> {
    // Longer than any ray, so that a cell's offset is unique.
    const TILE: i32 = 1 << 22;
    let size = IVec3::new(TILE, TILE, level.size.z);
    let signed = |c: i32| if c > TILE / 2 { c - TILE } else { c };
    let mut taps = Vec::new();
    for crossing in Walk::new(size, Vec3::splat(0.5), direction * level.scale, f32::INFINITY) {
        let offset = IVec3::new(signed(crossing.cell.x), signed(crossing.cell.y), crossing.cell.z);
        if taps.len() == medium.max_cells as usize || offset.z.abs() >= level.size.z {
            break;
        }
        let weight = match (medium.per_cell, taps.len()) {
            (false, _) => crossing.t_exit - crossing.t_enter,
            // A cell of the volume does not shadow itself. In a coarse cell, half of the other cells do.
            (true, 0) => 0.5 - 0.5 * level.scale.z,
            (true, _) => 1.0,
        };
        taps.push(Tap { offset, weight });
    }
    taps
}
