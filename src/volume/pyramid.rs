//! §4 Prefiltered levels of the volume texture, for views that see many cells in one pixel. Each level has
//! half as many cells along each axis as the one before.
//!
//! A coarse cell stands for the finer cells in its part of the volume. If the number of finer cells along an
//! axis is odd, it stands for parts of them, so that the copies of the volume still join without a seam.
//!
//! - **ρ keeps the coverage.** Light goes straight through between strands, so the mean density would hide
//!   too much of what is behind. Let T be the mean transmittance of the finer cells' columns along z. The
//!   coarse cell has the ρ that lets T pass: −log₂ T divided by the optical depth of a column, in bits per
//!   unit of ρ.
//! - **Directions stay a distribution.** A level keeps the second moments Σ w·v·vᵀ/Σ w of the unit directions
//!   v, w = ρ, as in SGGX (Heitz, Dupuy, Crassin and Dachsbacher 2015). So two strands that cross do not
//!   become one strand between them.
//! - **k_d and k_s** are means weighted by ρ.
//!
//! A level is a volume texture of fewer cells, whose second word holds moments in place of v:
//!
//! | bits | value |
//! |---|---|
//! | 0–6, 7–13 | √xx and √zz in 127ths; yy = 1 − xx − zz |
//! | 14–19, 20–25, 26–31 | xy, xz and yz over the product of the two roots, in 31sts, signed |
//!
//! A single direction has correlations of ±1, which these codes hold exactly, so it stays a single direction.

use std::sync::Arc;

use glam::{DVec3, Mat3, Vec3};
use rayon::prelude::*;

use super::{Cell, Cells, VolumeTexture, with_boxes, worth_leaping};

/// Levels as walks read them. They are shared, as a volume's cells are.
pub type Levels = Arc<Pyramid>;

/// Levels of several volumes, by the numbers of the volumes.
pub type LevelSets = Arc<[Levels]>;

/// Levels of a volume, the volume itself first.
pub struct Pyramid {
    levels: Vec<VolumeTexture>,
    /// Whether empty cells hold boxes to leap over ([`with_boxes`]) in place of k and v.
    pub leaps: bool,
}

impl std::ops::Deref for Pyramid {
    type Target = [VolumeTexture];

    fn deref(&self) -> &[VolumeTexture] {
        &self.levels
    }
}

/// Choice whether rays leap over empty cells. Pictures and numbers of cells do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leaps {
    /// Leaps if all volumes are empty enough ([`worth_leaping`]).
    #[default]
    Auto,
    /// Leaps if all volumes are stored densely.
    Always,
    /// Walks every cell.
    Never,
}

/// Second moments S of directions. Their scale cancels in the fibre model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// xx, yy, zz.
    pub diagonal: Vec3,
    /// xy, xz, yz.
    pub mixed: Vec3,
}

impl Moments {
    /// Moments v·vᵀ of one direction.
    pub fn of(v: Vec3) -> Self {
        Moments { diagonal: v * v, mixed: Vec3::new(v.x * v.y, v.x * v.z, v.y * v.z) }
    }

    /// Moments J·S·Jᵀ of the directions J·v.
    pub fn mapped(&self, j: &Mat3) -> Self {
        let columns = [j.x_axis, j.y_axis, j.z_axis];
        let rows = [0, 1, 2].map(|i| Vec3::from_array(columns.map(|column| column[i])));
        let times = rows.map(|row| self.times(row));
        Moments {
            diagonal: Vec3::new(rows[0].dot(times[0]), rows[1].dot(times[1]), rows[2].dot(times[2])),
            mixed: Vec3::new(rows[0].dot(times[1]), rows[0].dot(times[2]), rows[1].dot(times[2])),
        }
    }

    /// Product S·v.
    pub fn times(&self, v: Vec3) -> Vec3 {
        let (d, m) = (self.diagonal, self.mixed);
        Vec3::new(
            d.x * v.x + m.x * v.y + m.y * v.z,
            m.x * v.x + d.y * v.y + m.z * v.z,
            m.y * v.x + m.z * v.y + d.z * v.z,
        )
    }

    /// Packs moments of trace 1 into the second word of a coarse cell.
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

    /// Unpacks the second word of a coarse cell.
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

/// Size of level `level` of a volume of `size`, cells along each axis.
pub fn level_size(size: [u32; 3], level: u32) -> [u32; 3] {
    size.map(|n| ((n - 1) >> level) + 1)
}

/// Number of levels of a volume of `size` cells, the volume itself included. The levels go down to one cell
/// across the face, as far as they fit side by side into the [`LevelAtlas`].
pub fn level_count(size: [u32; 3]) -> u32 {
    let coarse = size[0].max(size[1]).next_power_of_two().trailing_zeros();
    let mut height = 0;
    let fits = |level: &u32| {
        height += level_size(size, *level)[1];
        height <= size[1]
    };
    1 + (1..=coarse).take_while(fits).count() as u32
}

/// Layout of the levels in one texture. The volume itself comes first; behind it along z lie the coarse
/// levels, one after the other along y. Twin: `shaders/trace/levels.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelAtlas {
    /// Size of the volume itself, cells along each axis.
    pub size: [u32; 3],
    /// Number of levels. With 1 there is the volume alone.
    pub count: u32,
}

impl LevelAtlas {
    /// Layout of `levels`, the volume itself first.
    pub fn new(levels: &[VolumeTexture]) -> Self {
        LevelAtlas { size: levels[0].size, count: levels.len() as u32 }
    }

    /// First cell of a level in the texture.
    pub fn origin(&self, level: u32) -> [u32; 3] {
        match level {
            0 => [0; 3],
            // A word of a light volume holds four codes along z, and all four must belong to one level.
            _ => [0, (1..level).map(|l| level_size(self.size, l)[1]).sum(), self.size[2].next_multiple_of(4)],
        }
    }

    /// Size of the texture, cells along each axis.
    pub fn extent(&self) -> [u32; 3] {
        let [nx, ny, nz] = self.size;
        if self.count == 1 {
            self.size
        } else {
            [nx, ny, nz.next_multiple_of(4) + level_size([nx, ny, nz], 1)[2]]
        }
    }
}

/// Trace settings that the levels of a volume depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PyramidSpec {
    /// Optical depth of one cell along z, in bits (−log₂ of the transmittance) per unit of its ρ code. Coarse
    /// levels hide as much of what is behind as columns of such cells do. `None` means that there are no
    /// coarse levels.
    pub coverage_bits: Option<f32>,
    /// Whether rays interpolate between cells.
    pub interpolated: bool,
}

/// Computes the levels of a volume without boxes to leap over. For a few rays, boxes cost more time than they
/// save.
pub fn levels_of(volume: &VolumeTexture, spec: PyramidSpec) -> Levels {
    pyramid(volume, spec, false)
}

/// Wraps a sparse volume, which has no coarser levels, as the levels of itself.
pub fn stored_levels(volume: VolumeTexture) -> Levels {
    Arc::new(Pyramid { levels: vec![volume], leaps: false })
}

fn pyramid(volume: &VolumeTexture, spec: PyramidSpec, leaps: bool) -> Levels {
    let mut levels = vec![volume.clone()];
    if let Some(bits) = spec.coverage_bits {
        levels.extend(coarse_levels(volume, bits));
    }
    if leaps {
        levels = levels.iter().map(|level| with_boxes(level, spec.interpolated)).collect();
    }
    Arc::new(Pyramid { levels, leaps })
}

/// Cache of the levels from frame to frame.
#[derive(Default)]
pub struct LevelsCache {
    /// Choice whether rays leap.
    pub leaps: Leaps,
    /// The choice, the volumes and the levels of the last call.
    last: Option<(Leaps, Vec<Key>, LevelSets)>,
}

/// Values that the levels of a volume depend on.
struct Key {
    cells: Cells,
    size: [u32; 3],
    spec: PyramidSpec,
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.cells.same(&other.cells) && (self.size, self.spec) == (other.size, other.spec)
    }
}

impl LevelsCache {
    /// Cache that makes its levels for this choice.
    pub fn with_leaps(leaps: Leaps) -> Self {
        LevelsCache { leaps, last: None }
    }

    /// Returns the levels of each volume, by its own spec. Those of a volume of the last call are not
    /// computed again.
    pub fn get(&mut self, volumes: &[VolumeTexture], specs: &[PyramidSpec]) -> LevelSets {
        let key = |(volume, spec): (&VolumeTexture, &PyramidSpec)| Key {
            cells: volume.cells.clone(),
            size: volume.size,
            spec: *spec,
        };
        let keys: Vec<Key> = volumes.iter().zip(specs).map(key).collect();
        if let Some((leaps, known, sets)) = &self.last
            && (*leaps, known) == (self.leaps, &keys)
        {
            return sets.clone();
        }
        let leaps = match self.leaps {
            // Cells that are not stored have no room for boxes.
            _ if volumes.iter().any(VolumeTexture::is_sparse) => false,
            Leaps::Auto => volumes.iter().all(worth_leaping),
            Leaps::Always => true,
            Leaps::Never => false,
        };
        // Levels that do not fit are freed before others are made, because the memory might not hold both.
        let (_, known, sets) = self.last.take().unwrap_or((self.leaps, Vec::new(), Arc::new([])));
        let mut old: Vec<(Key, Levels)> = known.into_iter().zip(sets.iter().cloned()).collect();
        drop(sets);
        old.retain(|(own, levels)| keys.contains(own) && levels.leaps == leaps);
        let levels = |(volume, key): (&VolumeTexture, &Key)| {
            let same = old.iter().find(|(own, _)| own == key);
            same.map_or_else(|| pyramid(volume, key.spec, leaps), |(_, levels)| levels.clone())
        };
        let sets: LevelSets = volumes.iter().zip(&keys).map(levels).collect();
        self.last = Some((self.leaps, keys, sets.clone()));
        sets
    }
}

/// Computes the levels from 1 on. `bits` is [`PyramidSpec::coverage_bits`].
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
        let cells: Vec<Cell> = means.par_iter().map(Mean::packed).collect();
        levels.push(VolumeTexture { size: coarse, alpha: volume.alpha, cells: cells.into() });
    }
    levels
}

/// Cell of any level before it is packed.
#[derive(Clone, Copy, Default)]
struct Mean {
    /// ρ in codes of the volume's cells, 0 to 65535.
    rho: f64,
    /// k_d and k_s in codes, 0 to 255.
    k: [f64; 2],
    diagonal: DVec3,
    mixed: DVec3,
}

impl Mean {
    fn of(cell: Cell) -> Self {
        // An empty cell has no weight, so what it reflects is not decoded.
        if cell.rho_code() == 0 {
            return Mean::default();
        }
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

/// Finer cells along one axis that coarse cell `i` stands for: the first of them, and the lengths that it and
/// the next two contribute, in finer cells. `fine` and `coarse` are the numbers of cells along the axis.
fn parts(fine: u32, coarse: u32, i: u32) -> (u32, [f64; 3]) {
    let step = f64::from(fine) / f64::from(coarse);
    let (from, to) = (f64::from(i) * step, f64::from(i + 1) * step);
    let first = from.floor();
    let share = |n: f64| (to.min(first + n + 1.0) - from.max(first + n)).max(0.0);
    (first as u32, [share(0.0), share(1.0), share(2.0)])
}

/// Computes a level of `coarse` cells from the level of `fine` cells before it. `depth` is the optical depth
/// of a finer cell along z, in bits per unit of its ρ code, and `cell_at` gives a finer cell by its linear
/// index.
fn halved(fine: [u32; 3], coarse: [u32; 3], depth: f64, cell_at: impl Fn(usize) -> Mean + Sync) -> Vec<Mean> {
    let along = [0, 1, 2]
        .map(|axis| (0..coarse[axis]).map(|i| parts(fine[axis], coarse[axis], i)).collect::<Vec<_>>());
    let [nx, ny, nz] = coarse.map(|n| n as usize);
    let mean = |i: usize| {
        let (row, x) = (i / nx, i % nx);
        let (y, z) = (along[1][row % ny], along[2][row / ny]);
        mean_of_parts(fine, [along[0][x], y, z], depth, &cell_at)
    };
    (0..nx * ny * nz).into_par_iter().map(mean).collect()
}

/// Computes one coarse cell from the finer cells that it stands for, given along x, y and z as [`parts`]
/// gives them.
fn mean_of_parts(
    fine: [u32; 3],
    [(x0, xs), (y0, ys), (z0, zs)]: [(u32, [f64; 3]); 3],
    depth: f64,
    cell_at: &impl Fn(usize) -> Mean,
) -> Mean {
    let (mut sum, mut passed, mut area) = (Mean::default(), 0.0, 0.0);
    for (y, wy) in (y0..).zip(ys).filter(|part| part.1 > 1e-9) {
        for (x, wx) in (x0..).zip(xs).filter(|part| part.1 > 1e-9) {
            let mut column = 0.0;
            for (z, wz) in (z0..).zip(zs).filter(|part| part.1 > 1e-9) {
                let index = (z as usize * fine[1] as usize + y as usize) * fine[0] as usize + x as usize;
                let cell = cell_at(index);
                if cell.rho == 0.0 {
                    continue;
                }
                let weight = cell.rho * wx * wy * wz;
                column += cell.rho * wz;
                sum.rho += weight;
                sum.k = [0, 1].map(|c| sum.k[c] + weight * cell.k[c]);
                sum.diagonal += cell.diagonal * weight;
                sum.mixed += cell.mixed * weight;
            }
            let through = if column == 0.0 { 1.0 } else { (-column * depth).exp2() };
            passed += wx * wy * through;
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
}
