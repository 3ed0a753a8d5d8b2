//! What a ray finds in a cell: the cell's own, or what lies between eight cells' centres; and which level of
//! the volume it looks into. Twins: `shaders/trace/levels.wgsl` and `shaders/trace/lookup.wgsl`.

use glam::{IVec3, UVec3, Vec3};

use super::matter::SheetDensity;
use crate::mapping::CellFrame;
use crate::volume::{Cell, Moments, Pyramid, VolumeTexture};
use crate::walk::Crossing;

/// One level as walks see it.
#[derive(Clone, Copy)]
pub struct Level<'a> {
    /// Its cells.
    pub volume: &'a VolumeTexture,
    /// 0 is the volume itself.
    pub number: u32,
    /// Whether it is that.
    pub is_whole: bool,
    /// Its cells per cell of the volume, along x, y and z.
    pub scale: Vec3,
    /// Its number of cells.
    pub size: IVec3,
    /// Whether its empty cells hold boxes to leap over.
    pub leaps: bool,
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
            leaps: false,
        }
    }

    /// Level `number` of levels that are made for walks.
    pub fn of(levels: &'a Pyramid, number: u32) -> Self {
        Level { leaps: levels.leaps, ..Level::new(levels, number) }
    }

    /// Cells of the volume in the depth of one of its.
    pub fn deep(&self) -> f32 {
        1.0 / self.scale.z
    }

    /// The cell of the level.
    #[inline]
    pub fn cell(&self, c: IVec3) -> Cell {
        self.volume.cell(c.x as u32, c.y as u32, c.z as u32)
    }

    /// Of a cell's directions.
    pub fn moments(&self, cell: Cell) -> Moments {
        match self.is_whole {
            true => Moments::of(cell.v_code()),
            false => Moments::unpacked(cell.y),
        }
    }

    /// The cell's own.
    pub fn found(&self, cell: Cell, matter: &SheetDensity) -> CellSample {
        let (k_d, k_s) = cell.k_codes();
        CellSample { rho: matter.rho(cell.rho_code() as f32), k: [k_d as f32, k_s as f32], moments: None }
    }

    /// Between the centres of the eight cells around the point in the middle of a ray's way through a cell;
    /// the ray starts at `origin` and goes along `direction`, in the level's cells.
    pub fn between(
        &self,
        crossing: &Crossing,
        origin: Vec3,
        direction: Vec3,
        matter: &SheetDensity,
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
            let at = IVec3::new(
                c.x.rem_euclid(self.size.x),
                c.y.rem_euclid(self.size.y),
                c.z.clamp(0, self.size.z - 1),
            );
            let cell = self.cell(at);
            let weight = shares.x * shares.y * shares.z * cell.rho_code() as f32;
            let (k_d, k_s) = cell.k_codes();
            rho += weight;
            k[0] += weight * k_d as f32;
            k[1] += weight * k_s as f32;
            // The length of a direction's code is no weight of it.
            let of = self.moments(cell);
            let share = weight / of.diagonal.element_sum().max(1e-20);
            moments.diagonal += of.diagonal * share;
            moments.mixed += of.mixed * share;
        }
        let inverse = 1.0 / rho.max(1e-20);
        CellSample {
            rho: matter.rho(rho),
            k: k.map(|k| k * inverse),
            moments: Some(Moments { diagonal: moments.diagonal * inverse, mixed: moments.mixed * inverse }),
        }
    }
}

/// What a ray finds.
pub struct CellSample {
    /// In codes, of what the sheet leaves.
    pub rho: f32,
    /// k_d and k_s, in codes.
    pub k: [f32; 2],
    /// Of the directions, in any unit, where they are of several cells. Those of one are worked out where
    /// they are asked for: it would be a third of the walk.
    pub moments: Option<Moments>,
}

/// Which level's cells are as large as a sample's footprint, and the share of the next: 4^level cells lie
/// across the ray in it. The ray goes along the unit vector `d_world` for `t` metres.
pub fn level_at(
    footprint: f32,
    forward: Vec3,
    d_world: Vec3,
    t: f32,
    frame: &CellFrame,
    d_cell: Vec3,
) -> f32 {
    let c = d_world.dot(forward);
    let area = footprint * (c * c * c) * (t * t);
    let across = area / (frame.det.abs() * frame.depth * d_cell.length());
    0.5 * across.max(1e-30).log2()
}
