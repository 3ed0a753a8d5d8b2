//! §5 What lies between cells and lights, and light volumes on the CPU. Twins: `shaders/optical_depth.wgsl` and
//! `shaders/visibility.wgsl`.

use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::lookup::Level;
use super::matter::Matter;
use crate::error::Result;
use crate::job::Monitor;
use crate::scene::Lookup;
use crate::visibility::{DARK_BITS, Form, LightVolume, LightVolumes, Medium, transmittance_code};
use crate::volume::{KeptLevels, Levels, large_box};
use crate::walk::{NEVER, Walk};

/// Light volumes that are kept from frame to frame.
#[derive(Default)]
pub struct KeptVolumes {
    /// What they are of.
    pub levels: KeptLevels,
    kept: Option<Kept>,
}

struct Kept {
    levels: Levels,
    lookup: Lookup,
    plan: LightVolumes,
    filled: Filled,
}

/// All light volumes, number by number: of every level, in its order of cells.
pub type Filled = Arc<Vec<Vec<Numbers>>>;

/// What one light volume holds.
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

impl KeptVolumes {
    /// Lets go of the light volumes.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// The light volumes that are planned, walked unless they are those of the last call.
    pub fn get(
        &mut self,
        plan: &LightVolumes,
        levels: &Levels,
        lookup: Lookup,
        monitor: &dyn Monitor,
    ) -> Result<Filled> {
        if let Some(kept) = &self.kept
            && Arc::ptr_eq(&kept.levels, levels)
            && kept.lookup == lookup
            && kept.plan.volumes == plan.volumes
            && (kept.plan.medium, kept.plan.form) == (plan.medium, plan.form)
        {
            return Ok(kept.filled.clone());
        }
        // The old ones go first: both might not fit.
        self.kept = None;
        let total = plan.volumes.len() as u64;
        let mut all = Vec::with_capacity(plan.volumes.len());
        for (number, light_volume) in plan.volumes.iter().enumerate() {
            monitor.progress("light volumes", number as u64, total)?;
            let of_level = |number| {
                let level = Level::of(levels, number);
                let of = |cell| self::number(&level, cell, light_volume, plan.medium, plan.form);
                match plan.form {
                    Form::Codes => Numbers::Codes(filled(&level, lookup, |cell| of(cell) as u8)),
                    Form::Depths => Numbers::Depths(filled(&level, lookup, of)),
                }
            };
            all.push((0..levels.len() as u32).map(of_level).collect());
        }
        let filled = Arc::new(all);
        let (levels, plan) = (levels.clone(), plan.clone());
        self.kept = Some(Kept { levels, lookup, plan, filled: filled.clone() });
        Ok(filled)
    }
}

/// A number for every cell. Those without density, which no view ray asks, have the default, but for rays that look
/// between cells.
fn filled<T: Copy + Default + Send>(level: &Level, lookup: Lookup, of: impl Fn(IVec3) -> T + Sync) -> Vec<T> {
    let [nx, ny, nz] = level.volume.size.map(|n| n as usize);
    let mut numbers = vec![T::default(); nx * ny * nz];
    numbers.par_chunks_mut(nx).enumerate().for_each(|(row, numbers)| {
        for (x, number) in numbers.iter_mut().enumerate() {
            let cell = IVec3::new(x as i32, (row % ny) as i32, (row / ny) as i32);
            if lookup == Lookup::Trilinear || level.cell(cell).rho_code() > 0 {
                *number = of(cell);
            }
        }
    });
    numbers
}

/// What a light volume of a form holds for a cell.
pub fn number(level: &Level, cell: IVec3, light_volume: &LightVolume, medium: Medium, form: Form) -> f32 {
    let depth = |enough: f32| {
        let direction = light_volume.direction * level.scale;
        optical_depth(level, &Matter::WHOLE, cell, direction, medium, enough, &mut 0)
    };
    let bits = if medium.per_cell { light_volume.bits * level.deep() } else { light_volume.bits };
    match form {
        Form::Codes => transmittance_code(depth(DARK_BITS / bits.max(1e-20)) * bits).into(),
        Form::Depths => depth(NEVER),
    }
}

/// From the middle of the cell `start` of a level to where the light ray leaves the slab: Σ ρ code × length, in units of
/// `direction`, or Σ ρ code over the cells but the first, of what a sheet makes of the cells. Ends early where the depth is `enough`. `walked` grows by the cells of the way.
pub fn optical_depth(
    level: &Level,
    matter: &Matter,
    start: IVec3,
    direction: Vec3,
    medium: Medium,
    enough: f32,
    walked: &mut u32,
) -> f32 {
    let mut depth = 0.0f32;
    let mut n = 0;
    let mut walk = Walk::new(level.size, start.as_vec3() + 0.5, direction, f32::INFINITY);
    let octant = walk.octant();
    let leaps = level.leaps && matter.keeps_empty();
    while n < medium.max_cells && (0..level.size.z).contains(&walk.cell().z) {
        let cell = level.cell(walk.cell());
        if leaps
            && cell.rho_code() == 0
            && let Some(exponents) = large_box(cell, octant)
        {
            n += 1 + walk.leap(exponents);
            walk.next();
            continue;
        }
        let Some(crossing) = walk.next() else { break };
        let rho = matter.rho(cell.rho_code() as f32);
        if medium.per_cell {
            // The cell itself does not hide its own light; half the others that a coarse one stands for do.
            let own = 0.5 - 0.5 * level.scale.z;
            depth += rho * if n == 0 { own } else { 1.0 };
        } else {
            depth += rho * (crossing.t_exit - crossing.t_enter);
        }
        n += 1;
        if depth > enough {
            break;
        }
    }
    *walked += n.min(medium.max_cells);
    depth
}
