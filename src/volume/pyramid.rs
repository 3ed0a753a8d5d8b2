//! The volume texture prefiltered: levels of half as many cells along each axis, for views that see many
//! cells in one pixel.
//!
//! A coarse cell stands for all cells in its part of the volume (where a number of cells is odd, for parts of
//! them: the copies of the volume still join without a seam):
//!
//! - **ρ covers as much.** Light goes straight through between strands, so that the mean density would hide
//!   too much of what is behind. With T the mean transmittance of the finer cells' columns along z, the
//!   coarse cell has the ρ that lets T pass: −log₂ T over the column's length in [`bits`].
//! - **Directions stay a distribution.** The second moments Σ w·v·vᵀ/Σ w of the unit directions v, w = ρ, are
//!   kept as in SGGX (Heitz, Dupuy, Crassin and Dachsbacher 2015), so that strands that cross do not become
//!   one between them.
//! - k_d and k_s are means weighted by ρ.
//!
//! A level is a volume texture of fewer cells, whose second word holds moments in place of v:
//!
//! | bits | what |
//! |---|---|
//! | 0–6, 7–13 | √xx and √zz in 127ths; yy = 1 − xx − zz |
//! | 14–19, 20–25, 26–31 | xy, xz and yz over the product of the two roots, in 31sts, signed |
//!
//! One direction has correlations of ±1, which have codes of their own: it stays one.

use std::sync::Arc;

use glam::{DVec3, UVec3, Vec3};
use rayon::prelude::*;

use super::{Cell, Cells, VolumeTexture, with_boxes, worth_leaping};

/// Shared levels, as walks read them.
pub type Levels = Arc<Pyramid>;

/// Levels of a volume, the volume itself first.
pub struct Pyramid {
    levels: Vec<VolumeTexture>,
    /// True if empty cells hold boxes of empty cells ([`with_boxes`]) in place of k and v.
    pub leaps: bool,
}

impl std::ops::Deref for Pyramid {
    type Target = [VolumeTexture];

    fn deref(&self) -> &[VolumeTexture] {
        &self.levels
    }
}

/// Choice whether rays leap over empty cells. It changes neither pictures nor cell counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leaps {
    /// Leap in volumes where it pays ([`worth_leaping`]).
    #[default]
    Auto,
    /// Leap in any volume whose cells are all stored.
    Always,
    /// Visit every cell.
    Never,
}

/// Second moments of directions: xx, yy, zz and xy, xz, yz. Their scale cancels in the fibre model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// xx, yy, zz.
    pub diagonal: Vec3,
    /// xy, xz, yz.
    pub mixed: Vec3,
}

impl Moments {
    /// v·vᵀ.
    pub fn of(v: Vec3) -> Self {
        Moments { diagonal: v * v, mixed: Vec3::new(v.x * v.y, v.x * v.z, v.y * v.z) }
    }

    /// S·v.
    pub fn times(&self, v: Vec3) -> Vec3 {
        let (d, m) = (self.diagonal, self.mixed);
        Vec3::new(
            d.x * v.x + m.x * v.y + m.y * v.z,
            m.x * v.x + d.y * v.y + m.z * v.z,
            m.y * v.x + m.z * v.y + d.z * v.z,
        )
    }

    /// Packs moments whose trace is 1 into the word of a coarse cell.
    pub fn packed(&self) -> u32 {
        let root = self.diagonal.max(Vec3::ZERO).map(f32::sqrt);
        let over = |product: f32, a: f32, b: f32| (product / (a * b).max(1e-12)).clamp(-1.0, 1.0);
        let r = [
            over(self.mixed.x, root.x, root.y),
            over(self.mixed.y, root.x, root.z),
            over(self.mixed.z, root.y, root.z),
        ];
        let [xy, xz, yz] = r.map(|r| (r * 31.0).round() as i32 as u32 & 63);
        let share = |x: f32| (x.min(1.0) * 127.0).round() as u32;
        share(root.x) | share(root.z) << 7 | xy << 14 | xz << 20 | yz << 26
    }

    /// Unpacks the word of a coarse cell.
    #[inline]
    pub fn unpacked(word: u32) -> Self {
        let share = |shift: u32| (word >> shift & 127) as f32 * (1.0 / 127.0);
        let (x, z) = (share(0), share(7));
        let yy = (1.0 - x * x - z * z).max(0.0);
        let y = yy.sqrt();
        let r = |shift: u32| ((word << shift) as i32 >> 26) as f32 * (1.0 / 31.0);
        Moments {
            diagonal: Vec3::new(x * x, yy, z * z),
            mixed: Vec3::new(r(12) * (x * y), r(6) * (x * z), r(0) * (y * z)),
        }
    }
}

/// Returns the cells along each axis of level `level` of a volume of `size`.
pub fn level_size(size: [u32; 3], level: u32) -> [u32; 3] {
    size.map(|n| ((n - 1) >> level) + 1)
}

/// Returns the number of levels of a volume of `size` cells, including the volume itself. Levels go down to
/// one cell across the face, as far as they fit side by side in [`LevelAtlas`].
pub fn level_count(size: [u32; 3]) -> u32 {
    let coarse = size[0].max(size[1]).next_power_of_two().trailing_zeros();
    let mut height = 0;
    let fits = |level: &u32| {
        height += level_size(size, *level)[1];
        height <= size[1]
    };
    1 + (1..=coarse).take_while(fits).count() as u32
}

/// Layout of the levels in one texture: the volume itself first, then, after it along z, the coarse levels
/// side by side along y. Twin: `shaders/trace/levels.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelAtlas {
    /// Cells of the volume itself along each axis.
    pub size: [u32; 3],
    /// Number of levels; 1 is the volume alone.
    pub count: u32,
}

impl LevelAtlas {
    /// Returns the layout of `levels`.
    pub fn new(levels: &[VolumeTexture]) -> Self {
        LevelAtlas { size: levels[0].size, count: levels.len() as u32 }
    }

    /// Returns the first cell of a level.
    pub fn place(&self, level: u32) -> [u32; 3] {
        match level {
            0 => [0; 3],
            // A multiple of 4, so that a light volume's word, four codes along z, belongs to one level.
            _ => [0, (1..level).map(|l| level_size(self.size, l)[1]).sum(), self.size[2].next_multiple_of(4)],
        }
    }

    /// Returns the size of the texture, cells.
    pub fn extent(&self) -> [u32; 3] {
        let [nx, ny, nz] = self.size;
        if self.count == 1 {
            self.size
        } else {
            [nx, ny, nz.next_multiple_of(4) + level_size([nx, ny, nz], 1)[2]]
        }
    }
}

/// Parameters of the levels of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PyramidSpec {
    /// Bits of transmittance along the depth of one cell, per unit of its ρ code: coarse levels hide as much
    /// of what is behind as their columns do with these. `None`: there are no coarse levels.
    pub coverage_bits: Option<f32>,
    /// True if walks interpolate between cells.
    pub interpolated: bool,
}

/// Builds the levels of a volume without boxes to leap over, for few rays.
pub fn levels_of(volume: &VolumeTexture, spec: PyramidSpec) -> Levels {
    LevelsCache { leaps: Leaps::Never, kept: None }.get(volume, spec)
}

/// Cache of the levels from frame to frame.
#[derive(Default)]
pub struct LevelsCache {
    /// Choice whether the levels hold boxes for leaps.
    pub leaps: Leaps,
    kept: Option<(Key, Levels)>,
}

/// Inputs of the levels.
struct Key {
    cells: Cells,
    size: [u32; 3],
    spec: PyramidSpec,
    leaps: Leaps,
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.cells.same(&other.cells)
            && (self.size, self.spec, self.leaps) == (other.size, other.spec, other.leaps)
    }
}

impl LevelsCache {
    /// Returns the levels of a volume; builds them unless the inputs equal those of the last call.
    pub fn get(&mut self, volume: &VolumeTexture, spec: PyramidSpec) -> Levels {
        let key = Key { cells: volume.cells.clone(), size: volume.size, spec, leaps: self.leaps };
        if let Some((of, levels)) = &self.kept
            && *of == key
        {
            return levels.clone();
        }
        // Old levels are freed first: both might not fit into memory.
        self.kept = None;
        let mut levels = vec![volume.clone()];
        if let Some(bits) = spec.coverage_bits {
            levels.extend(coarse_levels(volume, bits));
        }
        let leaps = match key.leaps {
            // Cells that are not stored have no room for boxes.
            _ if volume.is_sparse() => false,
            Leaps::Auto => worth_leaping(volume),
            Leaps::Always => true,
            Leaps::Never => false,
        };
        if leaps {
            levels = levels.iter().map(|level| with_boxes(level, spec.interpolated)).collect();
        }
        let levels = Arc::new(Pyramid { levels, leaps });
        self.kept = Some((key, levels.clone()));
        levels
    }
}

/// Builds the levels from 1 on; `bits` is [`PyramidSpec::coverage_bits`].
pub fn coarse_levels(volume: &VolumeTexture, bits: f32) -> Vec<VolumeTexture> {
    let mut levels = Vec::new();
    let mut means: Vec<Mean> = Vec::new();
    for level in 1..level_count(volume.size) {
        let (fine, coarse) = (level_size(volume.size, level - 1), level_size(volume.size, level));
        let depth = f64::from(bits) * f64::from(volume.size[2]) / f64::from(fine[2]);
        means = match level {
            1 => halved(fine, coarse, depth, |i| Mean::of(volume.cells[i])),
            _ => halved(fine, coarse, depth, |i| means[i]),
        };
        let cells: Vec<Cell> = means.iter().map(Mean::packed).collect();
        levels.push(VolumeTexture { size: coarse, alpha: volume.alpha, cells: cells.into() });
    }
    levels
}

/// A cell of any level, before it is packed.
#[derive(Clone, Copy, Default)]
struct Mean {
    /// ρ in codes of the volume's cells.
    rho: f64,
    k: [f64; 2],
    diagonal: DVec3,
    mixed: DVec3,
}

impl Mean {
    fn of(cell: Cell) -> Self {
        let (k_d, k_s) = cell.k_codes();
        let moments = Moments::of(cell.v());
        Mean {
            rho: cell.rho_code().into(),
            k: [k_d.into(), k_s.into()],
            diagonal: moments.diagonal.as_dvec3(),
            mixed: moments.mixed.as_dvec3(),
        }
    }

    fn packed(&self) -> Cell {
        let [k_d, k_s] = self.k.map(|k| (k + 0.5) as u32);
        let rho = ((self.rho + 0.5) as u32).min(0xffff);
        let trace = self.diagonal.element_sum();
        if rho == 0 || trace <= 0.0 {
            return Cell { x: rho | k_d << 16 | k_s << 24, y: 0 };
        }
        let moments =
            Moments { diagonal: (self.diagonal / trace).as_vec3(), mixed: (self.mixed / trace).as_vec3() };
        Cell { x: rho | k_d << 16 | k_s << 24, y: moments.packed() }
    }
}

/// Returns the fine cells that cell `i` of a coarse axis covers: the first one, and the covered fraction of
/// it and of the next two.
fn parts(fine: u32, coarse: u32, i: u32) -> (u32, [f64; 3]) {
    let step = f64::from(fine) / f64::from(coarse);
    let (from, to) = (f64::from(i) * step, f64::from(i + 1) * step);
    let first = from.floor();
    let share = |n: f64| (to.min(first + n + 1.0) - from.max(first + n)).max(0.0);
    (first as u32, [share(0.0), share(1.0), share(2.0)])
}

/// Averages fine cells into coarse ones. `depth`: bits along a fine cell's depth per unit of ρ.
fn halved(fine: [u32; 3], coarse: [u32; 3], depth: f64, of: impl Fn(usize) -> Mean + Sync) -> Vec<Mean> {
    let [nx, ny, nz] = coarse.map(|n| n as usize);
    (0..nx * ny * nz)
        .into_par_iter()
        .map(|i| {
            let at = UVec3::new((i % nx) as u32, (i / nx % ny) as u32, (i / nx / ny) as u32).to_array();
            let [(x0, xs), (y0, ys), (z0, zs)] =
                [0, 1, 2].map(|axis| parts(fine[axis], coarse[axis], at[axis]));
            let (mut sum, mut passed, mut area) = (Mean::default(), 0.0, 0.0);
            for (y, wy) in (y0..).zip(ys).filter(|part| part.1 > 1e-9) {
                for (x, wx) in (x0..).zip(xs).filter(|part| part.1 > 1e-9) {
                    let mut column = 0.0;
                    for (z, wz) in (z0..).zip(zs).filter(|part| part.1 > 1e-9) {
                        let index =
                            (z as usize * fine[1] as usize + y as usize) * fine[0] as usize + x as usize;
                        let cell = of(index);
                        let weight = cell.rho * wx * wy * wz;
                        column += cell.rho * wz;
                        sum.rho += weight;
                        sum.k = [0, 1].map(|c| sum.k[c] + weight * cell.k[c]);
                        sum.diagonal += cell.diagonal * weight;
                        sum.mixed += cell.mixed * weight;
                    }
                    passed += wx * wy * (-column * depth).exp2();
                    area += wx * wy;
                }
            }
            if sum.rho == 0.0 {
                return Mean::default();
            }
            let length = zs.iter().sum::<f64>();
            let mean = sum.rho / (area * length);
            // Without extinction nothing is hidden, whatever the density.
            let rho = if depth > 0.0 { -(passed / area).max(1e-300).log2() / (depth * length) } else { mean };
            Mean {
                rho: rho.min(mean),
                k: sum.k.map(|k| k / sum.rho),
                diagonal: sum.diagonal / sum.rho,
                mixed: sum.mixed / sum.rho,
            }
        })
        .collect()
}
