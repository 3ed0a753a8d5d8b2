//! §5 Light volumes filled on the host, for both engines.
//!
//! Seen from the middle of a cell, the light's way leads through the same cells over the same lengths from
//! all of them, to the bit: what is rounded along it are differences of boundaries and origin, which are
//! exact. So the way is walked once, and the depths of a row of cells are summed side by side, cell of the
//! way by cell of the way: the bits of [`optical_depth`](super::optical_depth::optical_depth) for a twentieth
//! of the work.

use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::optical_depth::light_volume_value;
use super::visibility::{Form, LightVolume, Medium, transmittance_code};
use crate::trace::Lookup;
use crate::trace::lookup::Level;
use crate::volume::{Cell, Pyramid};
use crate::walk::Walk;

/// What one light volume holds of a level, in the order of its cells.
pub enum Numbers {
    /// √T in 255ths.
    Codes(Vec<u8>),
    /// Optical depths.
    Depths(Vec<f32>),
}

impl Numbers {
    /// Of the cell with this index, as a number.
    pub fn at(&self, index: usize) -> f32 {
        match self {
            Numbers::Codes(codes) => codes[index].into(),
            Numbers::Depths(depths) => depths[index],
        }
    }
}

/// The levels that light volumes are of, as rows of ρ codes.
pub struct Rows<'a> {
    /// Rows of sparse volumes would not fit.
    levels: Vec<(Level<'a>, Option<Vec<f32>>)>,
    lookup: Lookup,
}

/// A cell on the light's way.
struct Tap {
    /// From the cell that asks.
    offset: IVec3,
    /// What its ρ counts.
    weight: f32,
}

impl<'a> Rows<'a> {
    /// Of all levels.
    pub fn new(levels: &'a Pyramid, lookup: Lookup) -> Self {
        let rows = |level: Level<'a>| {
            let codes =
                |cells: &Arc<Vec<Cell>>| cells.par_iter().map(|cell| cell.rho_code() as f32).collect();
            (level, level.volume.cells.dense().map(codes))
        };
        let levels = (0..levels.len() as u32).map(|number| rows(Level::of(levels, number))).collect();
        Rows { levels, lookup }
    }

    /// A light volume, level by level. Cells without density, which no view ray asks, have 0, but for rays
    /// that look between cells.
    pub fn fill(&self, light_volume: &LightVolume, medium: Medium, form: Form) -> Vec<Numbers> {
        let of_level = |(level, rho): &(Level, Option<Vec<f32>>)| {
            let Some(rho) = rho else { return self.walked(level, light_volume, medium, form) };
            let taps = taps(level, light_volume.direction, medium);
            let bits = if medium.per_cell { light_volume.bits * level.deep() } else { light_volume.bits };
            match form {
                Form::Codes => {
                    let code = |depth: f32| transmittance_code(depth * bits);
                    Numbers::Codes(self.sums(level, rho, &taps, code))
                }
                Form::Depths => Numbers::Depths(self.sums(level, rho, &taps, |depth| depth)),
            }
        };
        self.levels.iter().map(of_level).collect()
    }

    /// Walked from cell to cell.
    fn walked(&self, level: &Level, light_volume: &LightVolume, medium: Medium, form: Form) -> Numbers {
        let of = |cell: IVec3| {
            let asked = self.lookup == Lookup::Trilinear || level.cell(cell).rho_code() > 0;
            if asked { light_volume_value(level, cell, light_volume, medium, form) } else { 0.0 }
        };
        match form {
            Form::Codes => Numbers::Codes(in_order(level, |cell| of(cell) as u8)),
            Form::Depths => Numbers::Depths(in_order(level, of)),
        }
    }

    fn sums<T: Copy + Default + Send>(
        &self,
        level: &Level,
        rho: &[f32],
        taps: &[Tap],
        of: impl Fn(f32) -> T + Sync,
    ) -> Vec<T> {
        let [nx, ny, nz] = level.volume.size.map(|n| n as usize);
        let mut numbers = vec![T::default(); rho.len()];
        let everywhere = self.lookup == Lookup::Trilinear;
        numbers.par_chunks_mut(nx).enumerate().for_each_init(
            || vec![0.0f32; nx],
            |depths, (row, numbers)| {
                depths.fill(0.0);
                let (y, z) = ((row % ny) as i64, (row / ny) as i64);
                for tap in taps {
                    let z = z + i64::from(tap.offset.z);
                    if !(0..nz as i64).contains(&z) {
                        break;
                    }
                    let y = (y + i64::from(tap.offset.y)).rem_euclid(ny as i64);
                    let first = (z as usize * ny + y as usize) * nx;
                    // The copies of the tile beside it.
                    let shift = i64::from(tap.offset.x).rem_euclid(nx as i64) as usize;
                    let (left, right) = rho[first..first + nx].split_at(shift);
                    let (near, far) = depths.split_at_mut(nx - shift);
                    add(near, right, tap.weight);
                    add(far, left, tap.weight);
                }
                let own = &rho[row * nx..][..nx];
                for ((number, &depth), &rho) in numbers.iter_mut().zip(&*depths).zip(own) {
                    if everywhere || rho > 0.0 {
                        *number = of(depth);
                    }
                }
            },
        );
        numbers
    }
}

fn in_order<T: Send>(level: &Level, of: impl Fn(IVec3) -> T + Sync) -> Vec<T> {
    let [nx, ny, nz] = level.volume.size.map(|n| n as usize);
    let place =
        |index: usize| IVec3::new((index % nx) as i32, (index / nx % ny) as i32, (index / nx / ny) as i32);
    (0..nx * ny * nz).into_par_iter().map(|index| of(place(index))).collect()
}

/// Adds `rho` × `weight` to the depths.
#[inline]
fn add(depths: &mut [f32], rho: &[f32], weight: f32) {
    for (depth, rho) in depths.iter_mut().zip(rho) {
        *depth += rho * weight;
    }
}

/// The way from the middle of any cell of a level to where it leaves the slab from the farthest of them.
fn taps(level: &Level, direction: Vec3, medium: Medium) -> Vec<Tap> {
    // Larger than any way is long.
    const TILE: i32 = 1 << 22;
    let size = IVec3::new(TILE, TILE, level.size.z);
    let apart = |c: i32| if c > TILE / 2 { c - TILE } else { c };
    let mut taps = Vec::new();
    for crossing in Walk::new(size, Vec3::splat(0.5), direction * level.scale, f32::INFINITY) {
        let offset = IVec3::new(apart(crossing.cell.x), apart(crossing.cell.y), crossing.cell.z);
        if taps.len() == medium.max_cells as usize || offset.z.abs() >= level.size.z {
            break;
        }
        let weight = match (medium.per_cell, taps.len()) {
            (false, _) => crossing.t_exit - crossing.t_enter,
            // The cell itself does not hide its own light; half the others that a coarse one stands for do.
            (true, 0) => 0.5 - 0.5 * level.scale.z,
            (true, _) => 1.0,
        };
        taps.push(Tap { offset, weight });
    }
    taps
}
