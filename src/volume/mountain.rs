//! §2 Builder of a near mountain face: rock that fills the volume from the skin, z = nz, up to a fractal
//! height, stones in its hollows, moss on what is flat, and grass where soil gathers.
//!
//! Everything but grass is a height field, so the ρ of a column sums up to its height. Grass are threads.
//! +y leads down the slope.

mod ground;

use glam::Vec2;
use rand::{Rng, RngExt};
use rayon::prelude::*;

use super::threads::{Look, Thread, Threads, cells_of_threads};
use super::{Cell, VolumeTexture};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream, normal};
use ground::{Column, Ground};

/// Places on the ramp of the roots of grass and of its tips. Moss has the third of four colours.
const ROOT: f32 = 0.64;
const TIP: f32 = 1.0;
/// Relative standard deviations of a blade's length and k_d, and of its place on the ramp.
const LENGTH_SPREAD: f32 = 0.3;
const SHADE_SPREAD: f32 = 0.16;
const PLACE_SPREAD: f32 = 0.08;
/// Mean number of blades in a tuft, the share of blades in tufts, and the radius of a tuft, lengths of a
/// blade.
const BLADES_A_TUFT: u32 = 40;
const IN_TUFTS: f32 = 0.75;
const TUFT_RADIUS: f32 = 0.13;
/// Standard deviation of the lean to any side, and lean away from the middle of a tuft at its radius, heights
/// of a blade.
const STRAY_LEAN: f32 = 0.3;
const TUFT_LEAN: f32 = 0.3;
/// Share of its width that a blade loses up to its tip.
const TAPER: f32 = 0.85;
/// Straight pieces of a blade.
const PIECES: usize = 8;
/// ρ of moss.
const MOSS_RHO: f32 = 0.8;
/// Lean of the fuzz of moss from upright: short fibres stand on it, not along it.
const MOSS_LEAN: f32 = 0.7;
/// Cells below the surface that have a direction of their own. No light reaches deeper ones.
const LIT_CELLS: f32 = 4.0;
/// Bytes that building takes for each column of cells.
pub(super) const BYTES_PER_COLUMN: usize = size_of::<Column>() + 20 * size_of::<f32>();

/// Recipe of a mountain face. Equal recipes build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountainSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Standard deviation of the rock's height, depths nz. Its mean is [`MountainSpec::MEAN`] times as much.
    pub relief: f32,
    /// Complexity h of the rock's surface.
    pub h: f32,
    /// Size of the largest forms, widths nx.
    pub block: f32,
    /// Share of broken blocks in the relief; the rest is smooth.
    pub fracture: f32,
    /// Share by which blocks lie in beds, whose edges are ledges.
    pub beds: f32,
    /// Share of the area that stones cover.
    pub scree: f32,
    /// Radius of the largest stones, cells.
    pub stone_cells: f32,
    /// Share of the area without soil that moss covers.
    pub moss: f32,
    /// Share of the area with soil, in which grass grows.
    pub soil: f32,
    /// Number of blades on a copy of the volume.
    pub blades: u32,
    /// Mean length of a blade, depths nz.
    pub blade_length: f32,
    /// Width of a blade at its root, cells.
    pub blade_width_cells: f32,
    /// Distance by which a tip leans down the slope, +y, in heights of the blade.
    pub blade_lean: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d of clean rock and of the mean blade.
    pub k_d: f32,
    /// k_s of the grass; rock and moss have none. `None`: each cell has its place on a ramp of four colours
    /// there: light rock, dark rock and soil, moss and roots, tips of grass.
    pub k_s: Option<f32>,
}

impl MountainSpec {
    /// Mean height of the rock in its standard deviations. Deeper hollows than this, 1 % of the area, are cut
    /// off by the skin.
    pub const MEAN: f32 = 2.4;

    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let ground = Ground::new(self, monitor)?;
        let family = Family::new(self.seed, Stream::Hair);
        let draw = |blade: usize, thread: &mut Thread| {
            self.blade(&ground, &mut family.member(blade as u64), thread);
        };
        // Without soil there is no grass.
        let count = if ground.soil.is_empty() { 0 } else { self.blades as usize };
        let grass = cells_of_threads(self.size, Threads { count, draw }, None, monitor)?;
        let grass = grass.stored();
        let [nx, ny, nz] = self.size.map(|n| n as usize);
        let family = Family::new(self.seed, Stream::Cell);
        let mut cells = vec![Cell::default(); nx * ny * nz];
        cells.par_chunks_mut(nx).enumerate().for_each(|(line, cells)| {
            let (y, z) = (line % ny, line / ny);
            for (x, cell) in cells.iter_mut().enumerate() {
                let (index, column) = (line * nx + x, y * nx + x);
                let above = (nz - 1 - z) as f32;
                *cell = self.cell(&ground, column, above, grass[index], || family.member(index as u64));
            }
        });
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells: cells.into() })
    }

    /// The cell of a column whose lower face lies `above` cells above the skin, with the grass in it.
    fn cell<R: Rng>(
        &self,
        ground: &Ground,
        column: usize,
        above: f32,
        grass: Cell,
        rng: impl Fn() -> R,
    ) -> Cell {
        let own = &ground.columns[column];
        let rock = (own.height - above).clamp(0.0, 1.0);
        let moss = MOSS_RHO * ((own.height + own.moss - above).clamp(0.0, 1.0) - rock);
        let solid = rock + moss;
        let seen = grass.rho() * (1.0 - solid);
        // Less than half a step of ρ.
        if solid + seen < 0.5 / 65535.0 {
            return Cell::default();
        }
        let (k_d, place) = grass.k();
        let of_solid = |rock_has: f32, moss_has: f32| rock * rock_has + moss * moss_has;
        let mean = |solid: f32, of_grass: f32| (solid + seen * of_grass) / (rock + moss + seen);
        let k_d = mean(self.k_d * of_solid(own.shade, own.moss_shade), k_d);
        let second = match self.k_s {
            None => mean(of_solid(own.place, ground::MOSS), place),
            Some(k_s) => mean(0.0, k_s),
        };
        let v = if seen > solid {
            grass.v_code()
        } else if own.height - above > LIT_CELLS {
            own.tangent(Vec2::X)
        } else {
            let mut rng = rng();
            let side = Vec2::from_angle(rng.random::<f32>() * std::f32::consts::TAU);
            if moss > rock { (side * MOSS_LEAN).extend(-1.0) } else { own.tangent(side) }
        };
        Cell::from_direction(v).with_density(solid + seen, k_d, second)
    }

    /// Writes a blade of grass.
    fn blade(&self, ground: &Ground, rng: &mut impl Rng, thread: &mut Thread) {
        let [nx, ny, nz] = self.size.map(|n| n as f32);
        let spot = |rng: &mut dyn FnMut() -> f32| {
            let column =
                ground.soil[((rng() * ground.soil.len() as f32) as usize).min(ground.soil.len() - 1)];
            let [x, y] = [column % self.size[0], column / self.size[0]].map(|i| i as f32);
            Vec2::new(x + rng(), y + rng())
        };
        let tufts = (self.blades / BLADES_A_TUFT).max(1);
        let tuft = rng.random_range(0..tufts);
        let mut own = Family::new(self.seed, Stream::Bundle).member(u64::from(tuft));
        let middle = spot(&mut || own.random());
        let vigour = (1.0 + LENGTH_SPREAD * normal(&mut own)).clamp(0.3, 1.6);
        // Green tufts stand beside dry ones.
        let dry = 1.5 * PLACE_SPREAD * normal(&mut own);
        let is_single = rng.random::<f32>() >= IN_TUFTS;
        let length = (self.blade_length * (1.0 + LENGTH_SPREAD * normal(rng)).clamp(0.2, 1.8))
            * nz
            * if is_single { 0.6 } else { vigour };
        let away = Vec2::new(normal(rng), normal(rng));
        let root = match is_single {
            true => spot(&mut || rng.random()),
            false => middle + away * (TUFT_RADIUS * self.blade_length * nz),
        };
        let column = |x: f32, n: f32| (x.rem_euclid(n) as usize).min(n as usize - 1);
        let height = ground.columns[column(root.y, ny) * nx as usize + column(root.x, nx)].height;
        let stray =
            if is_single { Vec2::new(normal(rng), normal(rng)) * STRAY_LEAN } else { away * TUFT_LEAN };
        let lean =
            Vec2::Y * self.blade_lean + stray + Vec2::new(normal(rng), normal(rng)) * (0.5 * STRAY_LEAN);
        let k_d = self.k_d * (1.0 + SHADE_SPREAD * normal(rng)).max(0.0);
        let dry = dry + PLACE_SPREAD * normal(rng);
        // A parabola whose arc is as long as the blade.
        let at = |way: f32| (lean * (way * way)).extend(-way);
        let steps = || (0..=PIECES).map(|i| i as f32 / PIECES as f32);
        let arc: f32 = steps().zip(steps().skip(1)).map(|(a, b)| (at(b) - at(a)).length()).sum();
        let foot = root.extend(nz - height);
        for way in steps() {
            thread.points.push(foot + at(way) * (length / arc));
            thread.looks.push(Look {
                width: self.blade_width_cells * (1.0 - TAPER * way),
                place: (ROOT + (TIP - ROOT) * way + dry).clamp(0.0, 1.0),
                k_d,
            });
        }
    }
}
