//! §5 What lies between cells and lights, and light volumes on the CPU. Twins: `shaders/optical_depth.wgsl` and
//! `shaders/visibility.wgsl`.

use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use super::matter::Matter;
use crate::error::Result;
use crate::job::Monitor;
use crate::visibility::{DARK_BITS, Form, LightVolume, LightVolumes, Medium, transmittance_code};
use crate::volume::{Cell, VolumeTexture};
use crate::walk::{NEVER, Walk};

/// Light volumes that are kept from frame to frame.
#[derive(Default)]
pub struct KeptVolumes(Option<Kept>);

struct Kept {
    cells: Arc<Vec<Cell>>,
    size: [u32; 3],
    plan: LightVolumes,
    filled: Filled,
}

/// All light volumes: number by number, each in the volume's order of cells.
pub type Filled = Arc<Vec<Numbers>>;

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
    /// The light volumes that are planned, walked unless they are those of the last call.
    pub fn get(
        &mut self,
        plan: &LightVolumes,
        volume: &VolumeTexture,
        monitor: &dyn Monitor,
    ) -> Result<Filled> {
        if let Some(kept) = &self.0
            && Arc::ptr_eq(&kept.cells, &volume.cells)
            && kept.size == volume.size
            && kept.plan.volumes == plan.volumes
            && (kept.plan.medium, kept.plan.form) == (plan.medium, plan.form)
        {
            return Ok(kept.filled.clone());
        }
        // The old ones go first: both might not fit.
        self.0 = None;
        let total = plan.volumes.len() as u64;
        let mut all = Vec::with_capacity(plan.volumes.len());
        for (number, light_volume) in plan.volumes.iter().enumerate() {
            monitor.progress("light volumes", number as u64, total)?;
            all.push(match plan.form {
                Form::Codes => {
                    Numbers::Codes(filled(volume, |cell| code(volume, cell, light_volume, plan.medium)))
                }
                Form::Depths => Numbers::Depths(filled(volume, |cell| {
                    optical_depth(
                        volume,
                        &Matter::WHOLE,
                        cell,
                        light_volume.direction,
                        plan.medium,
                        NEVER,
                        &mut 0,
                    )
                })),
            });
        }
        let (cells, size, filled) = (volume.cells.clone(), volume.size, Arc::new(all));
        self.0 = Some(Kept { cells, size, plan: plan.clone(), filled: filled.clone() });
        Ok(filled)
    }
}

/// A number for every cell; for those without density the default.
fn filled<T: Copy + Default + Send>(volume: &VolumeTexture, of: impl Fn(IVec3) -> T + Sync) -> Vec<T> {
    let [nx, ny, nz] = volume.size.map(|n| n as usize);
    let mut numbers = vec![T::default(); nx * ny * nz];
    numbers.par_chunks_mut(nx).enumerate().for_each(|(row, numbers)| {
        for (x, number) in numbers.iter_mut().enumerate() {
            if volume.cells[row * nx + x].rho_code() > 0 {
                *number = of(IVec3::new(x as i32, (row % ny) as i32, (row / ny) as i32));
            }
        }
    });
    numbers
}

fn code(volume: &VolumeTexture, cell: IVec3, light_volume: &LightVolume, medium: Medium) -> u8 {
    let depth = optical_depth(
        volume,
        &Matter::WHOLE,
        cell,
        light_volume.direction,
        medium,
        DARK_BITS / light_volume.bits.max(1e-20),
        &mut 0,
    );
    transmittance_code(depth * light_volume.bits)
}

/// What a light volume of a form holds for an occupied cell.
pub fn number(
    volume: &VolumeTexture,
    cell: IVec3,
    light_volume: &LightVolume,
    medium: Medium,
    form: Form,
) -> f32 {
    match form {
        Form::Codes => code(volume, cell, light_volume, medium).into(),
        Form::Depths => {
            optical_depth(volume, &Matter::WHOLE, cell, light_volume.direction, medium, NEVER, &mut 0)
        }
    }
}

/// From the middle of `start` to where the light ray leaves the slab: Σ ρ code × length, in units of
/// `direction`, or Σ ρ code over the cells but the first, of what a sheet makes of the cells. Ends early where the depth is `enough`. `walked` grows by the cells of the way.
pub fn optical_depth(
    volume: &VolumeTexture,
    matter: &Matter,
    start: IVec3,
    direction: Vec3,
    medium: Medium,
    enough: f32,
    walked: &mut u32,
) -> f32 {
    let size = glam::UVec3::from(volume.size).as_ivec3();
    let mut depth = 0.0f32;
    let walk = Walk::new(size, start.as_vec3() + 0.5, direction, f32::INFINITY);
    for (n, crossing) in walk.take(medium.max_cells as usize).enumerate() {
        if crossing.cell.z < 0 || crossing.cell.z >= size.z {
            break;
        }
        *walked += 1;
        let c = crossing.cell.as_uvec3();
        let rho = matter.rho(volume.cells[volume.index(c.x, c.y, c.z)].rho_code());
        if medium.per_cell {
            // The cell itself does not hide its own light.
            depth += if n == 0 { 0.0 } else { rho };
        } else {
            depth += rho * (crossing.t_exit - crossing.t_enter);
        }
        if depth > enough {
            break;
        }
    }
    depth
}
