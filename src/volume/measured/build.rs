//! Builder of measured volumes: every voxel gives its share to the cells that it overlaps.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::field::{Field, Source};
use super::overlap::{Covered, Overlap};
use super::{MeasuredSpec, ReflectBy, VelocityNames, level_set, strands};
use crate::grid::{self, Block, BlockData, Class, Grid};
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use crate::volume::bricks::{BRICK, Packer};
use crate::volume::storage::{check_stored, file_storage};
use crate::volume::{Cell, Cells, Storage, StorageChoice, VolumeTexture};

/// Grids of a measured volume.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Density.
    pub density: Grid,
    /// Velocity: no grid, one of vectors, or one for each component.
    pub velocity: Vec<Grid>,
    /// Grid that k follows, with [`ReflectBy::Grid`], or that of k_d, with [`ReflectBy::Stored`].
    pub second: Option<Grid>,
    /// k_s, with [`ReflectBy::Stored`].
    pub specular: Option<Grid>,
}

/// Reads the grids of a recipe and builds its volume within `budget` bytes. The cells have the same bits on
/// any number of threads.
///
/// # Errors
/// Those of [`grid::read`]; [`Error::Input`] where a grid holds other numbers than it should, and
/// [`Error::Memory`] where grids and cells do not fit; errors of `monitor`.
pub fn build_measured(
    spec: &MeasuredSpec,
    storage: StorageChoice,
    budget: u64,
    monitor: &dyn Monitor,
) -> Result<VolumeTexture> {
    let mut left = budget;
    let mut read = |name: &str, channels: usize| -> Result<Grid> {
        let grid = grid::read(&spec.path, name, left)?;
        left = left.saturating_sub(grid.bytes());
        if let Some(note) = grid.note() {
            monitor.warn(&format!("{}: {note}", spec.path.display()));
        }
        if grid.channels() != channels {
            let [have, need] =
                [grid.channels(), channels].map(|n| if n == 1 { "numbers" } else { "vectors" });
            return Err(Error::input(
                format!("{}: the grid {name:?} holds {have}, not {need}", spec.path.display()),
                "name another grid",
            ));
        }
        Ok(grid)
    };
    let mut density = read(&spec.density, 1)?;
    level_set::to_metres(&mut density, spec.level_set_unit);
    let mut velocity = match &spec.velocity {
        VelocityNames::None => Vec::new(),
        VelocityNames::Vector(name) => vec![read(name, 3)?],
        VelocityNames::Components(names) => names.iter().map(|name| read(name, 1)).collect::<Result<_>>()?,
    };
    velocity.iter_mut().for_each(|grid| grid.scale(spec.velocity_scale));
    let second = spec.second.as_ref().map(|name| read(name, 1)).transpose()?;
    let specular = spec.specular.as_ref().map(|name| read(name, 1)).transpose()?;
    Measured { density, velocity, second, specular }.volume(spec, storage, left, monitor)
}

/// What the voxels of a cell add up to, each weighted by its share of the cell.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Density.
    mass: f64,
    /// Density times velocity.
    flow: Vec3,
    /// Density times what k follows, or times k_d and k_s.
    second: [f32; 2],
}

/// How values of the density's grid are read.
#[derive(Clone, Copy)]
pub(super) struct Density {
    is_level_set: bool,
    /// Width of the surface of a level set, metres.
    band: f64,
}

impl Density {
    /// Density of a grid, of which cells with edges of `share` voxels are made.
    pub fn of(grid: &Grid, share: f64) -> Density {
        let is_level_set = grid.class == Class::LevelSet;
        Density { is_level_set, band: share * grid.to_world.matrix3.determinant().abs().cbrt() }
    }

    /// Density of a value.
    pub fn at(&self, value: f32) -> f64 {
        match self.is_level_set {
            // The share of a cell at this distance that is inside.
            true => (0.5 - f64::from(value) / self.band).clamp(0.0, 1.0),
            false => f64::from(value).max(0.0),
        }
    }

    /// Density of the voxel of an index in a block. Voxels that are not active have none, but for those
    /// inside a level set.
    #[inline]
    pub fn in_block(&self, data: &BlockData, index: [i32; 3]) -> f64 {
        match data {
            BlockData::Tile { value, is_active } if *is_active || self.is_level_set => self.at(value[0]),
            BlockData::Tile { .. } => 0.0,
            BlockData::Leaf { values, active } => {
                let [i, j, k] = index.map(|c| (c & 7) as usize);
                let i = i + 8 * j + 64 * k;
                match self.is_level_set || active[i >> 6] >> (i & 63) & 1 == 1 {
                    true => self.at(values[i]),
                    false => 0.0,
                }
            }
        }
    }
}

/// Parts of the volume on their way to cells.
struct Work<'a> {
    spec: &'a MeasuredSpec,
    grids: &'a Measured,
    /// Blocks with matter, and the voxels that they may cover along z, from the volume's first on.
    blocks: Vec<(Block<'a>, std::ops::Range<i64>)>,
    axes: [Overlap; 3],
    cell_from_world: DMat3,
}

impl Measured {
    /// Builds the volume within `budget` bytes beside the grids.
    ///
    /// # Errors
    /// [`Error::Memory`] where the cells do not fit; [`Error::Input`] where ρ is not finite; errors of
    /// `monitor`.
    pub fn volume(
        &self,
        spec: &MeasuredSpec,
        storage: StorageChoice,
        budget: u64,
        monitor: &dyn Monitor,
    ) -> Result<VolumeTexture> {
        let size = spec.size;
        let storage = file_storage(size, storage, budget).map_err(fewer_cells)?;
        let work = Work::new(spec, self);
        let strands = match &spec.strands {
            Some(own) => Some(strands::cells(spec, own, self, budget, monitor).map_err(fewer_cells)?),
            None => None,
        };
        let most = match &strands {
            Some((_, most)) => *most,
            None => work.largest(monitor)?,
        };
        let largest = spec.rho_of(most);
        if !largest.is_finite() || largest > f64::from(f32::MAX) {
            return Err(Error::input(
                format!("the volume's density reaches {most:e}, and ρ {largest:e}"),
                "lower volume.rho_scale",
            ));
        }
        let alpha = largest as f32 * spec.alpha;
        let area = size[0] as usize * size[1] as usize;
        let slabs = size[2].div_ceil(BRICK);
        let layers = |slab: u32| slab * BRICK..size[2].min((slab + 1) * BRICK);
        let fill = |layers: std::ops::Range<u32>, out: &mut [Cell]| match &strands {
            Some((cells, _)) => out.copy_from_slice(&cells[layers.start as usize * area..][..out.len()]),
            None => work.fill(layers, largest, out),
        };
        let cells: Cells = match storage {
            Storage::Dense => {
                let mut cells = vec![Cell::default(); area * size[2] as usize];
                let slab = |(slab, out): (usize, &mut [Cell])| {
                    monitor.progress("volume", slab as u64, slabs.into())?;
                    fill(layers(slab as u32), out);
                    Ok(())
                };
                let slab_cells = area * BRICK as usize;
                cells.par_chunks_mut(slab_cells).enumerate().try_for_each(slab)?;
                cells.into()
            }
            Storage::Sparse => {
                let mut packer = Packer::new(size);
                let at_once = rayon::current_num_threads().max(1) as u32;
                for first in (0..slabs).step_by(at_once as usize) {
                    monitor.progress("volume", first.into(), slabs.into())?;
                    let made = |slab: u32| {
                        let layers = layers(slab);
                        let mut out = vec![Cell::default(); area * layers.len()];
                        fill(layers, &mut out);
                        out
                    };
                    let slabs: Vec<Vec<Cell>> =
                        (first..slabs.min(first + at_once)).into_par_iter().map(made).collect();
                    for cells in &slabs {
                        packer.push(cells);
                        check_stored(size, packer.count(), 0, budget).map_err(fewer_cells)?;
                    }
                }
                packer.finish().into()
            }
        };
        Ok(VolumeTexture { size, alpha, cells })
    }
}

/// Gives an error about the number of cells the way out that a measured volume has.
fn fewer_cells(error: Error) -> Error {
    match error {
        Error::Memory { what, need, budget, .. } => Error::Memory {
            what,
            need,
            budget,
            fix:
                "lower volume.fine or raise volume.voxels, or raise --memory; volume.storage=sparse (without \
                  trace.filter=pyramid) takes less where most cells are empty"
                    .into(),
        },
        other => other,
    }
}

impl<'a> Work<'a> {
    fn new(spec: &'a MeasuredSpec, grids: &'a Measured) -> Work<'a> {
        let low = i64::from(spec.bounds.min[2]);
        let is_inside = grids.density.class == Class::LevelSet;
        let blocks = grids.density.blocks().filter(|block| is_inside || block.active_count() > 0);
        let blocks = blocks.map(|block| {
            let first = i64::from(block.origin[2]) - low;
            (block, first..first + i64::from(block.side))
        });
        let voxels = spec.bounds.size();
        Work {
            spec,
            grids,
            blocks: blocks.collect(),
            axes: [0, 1, 2].map(|a| Overlap::new(voxels[a], spec.size[a])),
            cell_from_world: spec.world_from_cell().inverse(),
        }
    }

    /// Largest mean density of a cell.
    fn largest(&self, monitor: &dyn Monitor) -> Result<f64> {
        let [nx, ny, nz] = self.spec.size;
        let area = nx as usize * ny as usize;
        let largest = |slab: u32| {
            monitor.progress("density", slab.into(), nz.div_ceil(BRICK).into())?;
            let layers = slab * BRICK..nz.min((slab + 1) * BRICK);
            let mut sums = vec![0.0f64; area * layers.len()];
            self.each(layers, |cells, _, density| {
                cells.each(|i, share| sums[i] += share * density);
            });
            Ok(sums.into_iter().fold(0.0, f64::max))
        };
        let all: Vec<f64> = (0..nz.div_ceil(BRICK)).into_par_iter().map(largest).collect::<Result<_>>()?;
        Ok(all.into_iter().fold(0.0, f64::max))
    }

    /// Fills the cells of some layers. `largest` is the largest ρ.
    fn fill(&self, layers: std::ops::Range<u32>, largest: f64, out: &mut [Cell]) {
        let spec = self.spec;
        let density = spec.to_world;
        let mut field = Field::new(&self.grids.velocity, density, spec.velocity_at);
        let source = |grid: &'a Grid| Source::new(grid, density, DVec3::ZERO);
        let mut second = self.grids.second.as_ref().map(source);
        let mut specular = self.grids.specular.as_ref().map(source);
        let mut sums = vec![Sum::default(); out.len()];
        self.each(layers, |cells, index, mass| {
            let v = field.as_mut().map_or(DVec3::ZERO, |field| field.at(index));
            let of =
                |grid: &mut Option<Source>| grid.as_mut().map_or(0.0, |grid| f64::from(grid.at(index)[0]));
            let values = match spec.reflect {
                ReflectBy::Even => [0.0; 2],
                ReflectBy::Speed => [v.length(), 0.0],
                ReflectBy::Vorticity => {
                    [field.as_mut().map_or(0.0, |field| field.vorticity(index, &density)), 0.0]
                }
                ReflectBy::Grid => [of(&mut second), 0.0],
                ReflectBy::Stored => [of(&mut second), of(&mut specular)],
            };
            cells.each(|i, share| {
                let weight = share * mass;
                let sum = &mut sums[i];
                sum.mass += weight;
                sum.flow += (v * weight).as_vec3();
                (0..2).for_each(|i| sum.second[i] += (values[i] * weight) as f32);
            });
        });
        for (cell, sum) in out.iter_mut().zip(&sums) {
            if sum.mass > 0.0 {
                *cell = self.cell(sum, largest);
            }
        }
    }

    /// The cell of a sum with some mass.
    fn cell(&self, sum: &Sum, largest: f64) -> Cell {
        let spec = self.spec;
        let means = sum.second.map(|sum_of| f64::from(sum_of) / sum.mass);
        let [k_d, k_s] = match spec.reflect {
            ReflectBy::Stored => means.map(|k| k as f32),
            _ => spec.reflected(means[0]),
        };
        let direction = (self.cell_from_world * sum.flow.as_dvec3()).try_normalize().unwrap_or(DVec3::Y);
        let rho = if largest > 0.0 { spec.rho_of(sum.mass) / largest } else { 0.0 };
        let cell = Cell::from_direction(direction.as_vec3()).with_density(rho as f32, k_d, k_s);
        if cell.rho_code() == 0 { Cell::default() } else { cell }
    }

    /// Gives every voxel with matter that covers a part of some layers to `add`: its cells there, its index,
    /// and its density. Voxels come in the same order however the layers are parted.
    fn each(&self, layers: std::ops::Range<u32>, mut add: impl FnMut(&Covered, [i32; 3], f64)) {
        let [nx, ny, _] = self.spec.size.map(|n| n as usize);
        let [x_axis, y_axis, z_axis] = &self.axes;
        let along_z = z_axis.voxels(layers.start, layers.end);
        let [min, voxels] = [self.spec.bounds.min.map(i64::from), self.spec.bounds.size().map(|n| n as i64)];
        let density = Density::of(&self.grids.density, 1.0);
        for (block, own) in &self.blocks {
            let [z0, z1] = [own.start.max(along_z.start as i64), own.end.min(along_z.end as i64)];
            if z0 >= z1 {
                continue;
            }
            let ends = |a: usize| {
                let first = i64::from(block.origin[a]) - min[a];
                [first.max(0), (first + i64::from(block.side)).min(voxels[a])]
            };
            let ([x0, x1], [y0, y1]) = (ends(0), ends(1));
            for z in z0..z1 {
                for y in y0..y1 {
                    for x in x0..x1 {
                        let index = [x + min[0], y + min[1], z + min[2]].map(|c| c as i32);
                        let density = density.in_block(&block.data, index);
                        if density <= 0.0 {
                            continue;
                        }
                        let axes = [x_axis.of(x as usize), y_axis.of(y as usize), z_axis.of(z as usize)];
                        add(&Covered { axes, across: [nx, ny], layers: layers.clone() }, index, density);
                    }
                }
            }
        }
    }
}
