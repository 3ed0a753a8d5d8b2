//! §5 Light volumes on the CPU. Twin: `shaders/visibility.wgsl`.

use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::error::Result;
use crate::job::Monitor;
use crate::visibility::{LightVolumes, Medium};
use crate::volume::{Cell, VolumeTexture};
use crate::walk::Walk;

/// Light volumes that are kept from frame to frame.
#[derive(Default)]
pub struct KeptDepths(Option<Kept>);

struct Kept {
    cells: Arc<Vec<Cell>>,
    size: [u32; 3],
    volumes: LightVolumes,
    depths: Depths,
}

/// All light volumes: number by number as their directions, each in the volume's order of cells.
pub type Depths = Arc<Vec<Vec<f32>>>;

impl KeptDepths {
    /// The depths of `volumes`, walked unless they are those of the last call.
    pub fn get(
        &mut self,
        volumes: &LightVolumes,
        volume: &VolumeTexture,
        monitor: &dyn Monitor,
    ) -> Result<Depths> {
        if let Some(kept) = &self.0
            && Arc::ptr_eq(&kept.cells, &volume.cells)
            && kept.size == volume.size
            && kept.volumes.directions == volumes.directions
            && kept.volumes.medium == volumes.medium
        {
            return Ok(kept.depths.clone());
        }
        // The old ones go first: both might not fit.
        self.0 = None;
        let total = volumes.directions.len() as u64;
        let mut all = Vec::with_capacity(volumes.directions.len());
        for (number, &direction) in volumes.directions.iter().enumerate() {
            monitor.progress("light volumes", number as u64, total)?;
            all.push(light_volume(volume, direction, volumes.medium));
        }
        let (cells, size, depths) = (volume.cells.clone(), volume.size, Arc::new(all));
        self.0 = Some(Kept { cells, size, volumes: volumes.clone(), depths: depths.clone() });
        Ok(depths)
    }
}

fn light_volume(volume: &VolumeTexture, direction: Vec3, medium: Medium) -> Vec<f32> {
    let [nx, ny, nz] = volume.size.map(|n| n as usize);
    let mut depths = vec![0.0; nx * ny * nz];
    depths.par_chunks_mut(nx).enumerate().for_each(|(row, depths)| {
        for (x, depth) in depths.iter_mut().enumerate() {
            if volume.cells[row * nx + x].rho_code() > 0 {
                let cell = IVec3::new(x as i32, (row % ny) as i32, (row / ny) as i32);
                *depth = optical_depth(volume, cell, direction, medium);
            }
        }
    });
    depths
}

/// What a light volume holds for an occupied cell.
pub fn optical_depth(volume: &VolumeTexture, start: IVec3, direction: Vec3, medium: Medium) -> f32 {
    let size = glam::UVec3::from(volume.size).as_ivec3();
    let mut depth = 0.0f32;
    let walk = Walk::new(size, start.as_vec3() + 0.5, direction, f32::INFINITY);
    for (n, crossing) in walk.take(medium.max_cells as usize).enumerate() {
        if crossing.cell.z < 0 || crossing.cell.z >= size.z {
            break;
        }
        let c = crossing.cell.as_uvec3();
        let rho = volume.cells[volume.index(c.x, c.y, c.z)].rho_code() as f32;
        if medium.per_cell {
            // The cell itself does not hide its own light.
            depth += if n == 0 { 0.0 } else { rho };
        } else {
            depth += rho * (crossing.t_exit - crossing.t_enter);
        }
    }
    depth * (1.0 / 65535.0)
}
