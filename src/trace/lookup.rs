//! §4 Values that a ray reads in a cell (its own, or interpolated between eight cell centres), and the level
//! of the volume it reads them from. Twins: `shaders/trace/levels.wgsl`, `shaders/trace/lookup.wgsl` and
//! `level_at` in `shaders/engine/integrate.wgsl`.

use glam::{IVec3, UVec3, Vec3};

use super::matter::SheetDensity;
use crate::util::powers::log2;
use crate::volume::{Cell, Moments, VolumeTexture};
use crate::walk::Crossing;

/// Number of the level that stands for the strands' lines: finer than the volume's cells, which are level 0.
pub const STRANDS: i32 = -1;

/// One level of the volume, with what a walk needs to know about it.
#[derive(Clone, Copy)]
pub struct Level<'a> {
    /// Cells of the level.
    pub volume: &'a VolumeTexture,
    /// Number of the level; 0 is the volume itself.
    pub number: u32,
    /// Whether the level is the volume itself.
    pub is_whole: bool,
    /// Cells of the level per cell of the volume, along x, y and z; at most 1.
    pub scale: Vec3,
    /// Number of cells along x, y and z.
    pub size: IVec3,
}

impl<'a> Level<'a> {
    /// Level `number` of `levels`.
    pub fn new(levels: &'a [VolumeTexture], number: u32) -> Self {
        let volume = &levels[number as usize];
        let [whole, size] = [levels[0].size, volume.size].map(UVec3::from);
        Level {
            volume,
            number,
            is_whole: number == 0,
            scale: size.as_vec3() / whole.as_vec3(),
            size: size.as_ivec3(),
        }
    }

    /// Depth of one cell of the level, in cells of the volume.
    #[inline]
    pub fn depth_in_cells(&self) -> f32 {
        1.0 / self.scale.z
    }

    /// The cell at `c`, which must lie inside the level.
    #[inline(always)]
    pub fn cell(&self, c: IVec3) -> Cell {
        self.volume.cell(c.x as u32, c.y as u32, c.z as u32)
    }

    /// Second moments of a cell's directions.
    pub fn moments(&self, cell: Cell) -> Moments {
        match self.is_whole {
            true => Moments::of(cell.v_code()),
            false => Moments::unpacked(cell.y),
        }
    }

    /// Values of the cell itself; `moments` is `None`.
    #[inline]
    pub fn sample_cell(&self, cell: Cell, matter: &SheetDensity) -> CellSample {
        let (k_d, k_s) = cell.k_codes();
        CellSample { rho: matter.rho(cell.rho_code() as f32), k: [k_d as f32, k_s as f32], moments: None }
    }

    /// Values interpolated between the eight cell centres around the midpoint of the ray's segment in a cell.
    /// The ray starts at `origin` and runs along `direction`, both in the level's cells.
    ///
    /// x and y wrap, except in a volume that is shown once (`is_single`); z is clamped to the slab. k and the
    /// moments are means weighted by ρ.
    pub fn sample_trilinear(
        &self,
        crossing: &Crossing,
        origin: Vec3,
        direction: Vec3,
        matter: &SheetDensity,
        is_single: bool,
    ) -> CellSample {
        let middle = (crossing.t_enter + crossing.t_exit) * 0.5;
        let p = origin + direction * middle;
        let inside = p - p.floor() - 0.5;
        let side = Vec3::select(inside.cmplt(Vec3::ZERO), Vec3::NEG_ONE, Vec3::ONE).as_ivec3();
        let far = inside.abs();
        let mut rho = 0.0;
        let mut k = [0.0; 2];
        let mut moments = Moments::default();
        for corner in 0..8 {
            let away = IVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let shares = Vec3::select(away.cmpeq(IVec3::ZERO), 1.0 - far, far);
            let c = crossing.cell + side * away;
            let inside = c.clamp(IVec3::ZERO, self.size - 1);
            let wrapped = IVec3::new(c.x.rem_euclid(self.size.x), c.y.rem_euclid(self.size.y), inside.z);
            let cell = self.cell(if is_single { inside } else { wrapped });
            let weight = shares.x * shares.y * shares.z * cell.rho_code() as f32;
            let (k_d, k_s) = cell.k_codes();
            rho += weight;
            k[0] += weight * k_d as f32;
            k[1] += weight * k_s as f32;
            // The direction's code is not of unit length; dividing by the trace keeps that from acting as a
            // weight.
            let own = self.moments(cell);
            let share = weight / own.diagonal.element_sum().max(1e-20);
            moments.diagonal += own.diagonal * share;
            moments.mixed += own.mixed * share;
        }
        let inverse = 1.0 / rho.max(1e-20);
        CellSample {
            rho: matter.rho(rho),
            k: k.map(|k| k * inverse),
            moments: Some(Moments { diagonal: moments.diagonal * inverse, mixed: moments.mixed * inverse }),
        }
    }
}

/// Values that a ray reads in one cell.
pub struct CellSample {
    /// ρ on the sheet ([`SheetDensity::rho`]), in codes, 0 to 65535.
    pub rho: f32,
    /// k_d and k_s, in codes, 0 to 255.
    pub k: [f32; 2],
    /// Second moments of the directions of several cells, in any unit. `None` for a single cell: the caller
    /// computes its moments when it needs them, because computing them always would cost a third of the walk.
    pub moments: Option<Moments>,
}

/// Turn of a sample to walk strands. Where strands and cells are blended, the samples of a pixel take turns:
/// the first ones walk the strands, the last ones the cells, and at most one walks both. So the blend costs
/// hardly more than its parts.
///
/// The turn of sample i of n comes in the middle half of the levels from −i/n to −(i + 1)/n. A level is the
/// whole pixel's, so pictures with more samples show the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandTurn {
    /// Factor of the sample's level.
    pub scale: f32,
    /// Summand.
    pub shift: f32,
}

impl StrandTurn {
    /// Turn of a sample of a picture with so many.
    pub fn new(samples: u32, sample: u32) -> Self {
        let n = samples as f32;
        let pixel_levels = 0.5 * n.log2();
        StrandTurn { scale: 2.0 * n, shift: 2.0 * (n * pixel_levels + sample as f32) + 0.5 }
    }

    /// Level that a ray walks, from the one whose cells are as large as its sample's footprint: at least 0
    /// and at most `coarsest`. In a volume that keeps lines, it is less where the whole pixel sees less than
    /// a cell and it is the sample's turn: down to [`STRANDS`].
    #[inline]
    pub fn level(self, level: f32, keeps_lines: bool, coarsest: f32) -> f32 {
        let in_turn = level * self.scale + self.shift;
        match keeps_lines && in_turn < 0.0 {
            true => in_turn.max(STRANDS as f32),
            false => level.clamp(0.0, coarsest),
        }
    }
}

/// Level whose cells are as large as a sample's footprint: the footprint covers 4^level cells across the ray.
/// The fraction is the share of the next coarser level; the result is not clamped to the levels there are.
///
/// `footprint` is the solid angle of one sample at the image centre, in sr; `forward` and `d_world` are unit
/// vectors; `t` is the distance along the ray in metres; `cell_area` is what a cell covers of a plane across
/// the ray, m²: its volume times the number of cells per metre of the ray.
#[inline]
pub fn level_at(footprint: f32, forward: Vec3, d_world: Vec3, t: f32, cell_area: f32) -> f32 {
    let c = d_world.dot(forward);
    let area = footprint * (c * c * c) * (t * t);
    let across = area / cell_area;
    0.5 * log2(across.max(1e-30))
}
