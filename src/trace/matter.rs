//! What a sheet makes of the cells: eroded ρ, and mist. Twin: `shaders/trace/matter.wgsl`.

use glam::{Vec2, Vec3};

use crate::mapping::Quad;

/// Share of mist's ρ that is the cells': clouds of it drift with the flow.
pub const MIST_OF_CELLS: f32 = 0.3;
/// ρ of even mist, in codes: the mean of the paper's flow cells.
pub const MIST_RHO: f32 = 32768.0;

/// What a sheet makes of the cells' ρ, constant along one ray; ρ in its codes, 0 to 65535.
///
/// Erosion takes e away from every cell. It does not scale what is left up again: 30.85 % of the paper's
/// cells have ρ = 1, and would stay whole up to e = 1. Light rays lose as much as the view ray: they end near
/// it, and thin water is thin in every direction. What was walked before, for light volumes, is lessened in
/// the mean. Mist is even, but for what it has of the cells.
#[derive(Clone, Copy)]
pub struct SheetDensity {
    scale: f32,
    shift: f32,
    /// 255·Ψ of mist; 0 where there is none.
    pub mist: f32,
    /// ρ of even mist.
    even: f32,
    /// Share of the mean ρ that is left.
    pub left: f32,
}

impl SheetDensity {
    /// At texture coordinates of a quad.
    pub fn new(quad: &Quad, uv: Vec2) -> Self {
        let [a, b, c, d] = quad.erosion;
        let near = a + (b - a) * uv.x;
        let far = d + (c - d) * uv.x;
        let e = (near + (far - near) * uv.y).clamp(0.0, 1.0);
        let mut matter =
            SheetDensity { scale: 1.0, shift: e * -65535.0, mist: 0.0, even: 0.0, left: mean_left(e) };
        if quad.mist > 0.0 {
            let left = 1.0 - e;
            matter.scale = MIST_OF_CELLS * left;
            matter.shift = (1.0 - MIST_OF_CELLS) * MIST_RHO * left;
            matter.mist = quad.mist * 255.0;
            matter.even = MIST_RHO * left;
        }
        matter
    }

    /// The same of cells that stand for many: taken away in the mean, for ρ of a coarse cell is not that of
    /// any in it.
    pub fn of_coarse(quad: &Quad, uv: Vec2) -> Self {
        let matter = SheetDensity::new(quad, uv);
        match quad.mist > 0.0 {
            true => matter,
            false => SheetDensity { scale: matter.left, shift: 0.0, ..matter },
        }
    }

    /// Whether it leaves empty cells empty; mist does not.
    pub fn keeps_empty(&self) -> bool {
        self.shift <= 0.0
    }

    /// That leaves the cells as they are.
    pub const WHOLE: SheetDensity = SheetDensity { scale: 1.0, shift: 0.0, mist: 0.0, even: 0.0, left: 1.0 };

    /// ρ of a cell with this code, or of what lies between several.
    #[inline]
    pub fn rho(&self, code: f32) -> f32 {
        (code * self.scale + self.shift).max(0.0)
    }

    /// From the middle of a cell of mist in layer `z` of `layers` to where the light ray leaves the slab, as
    /// through even mist.
    pub fn depth(&self, z: i32, direction: Vec3, layers: i32, per_cell: bool) -> f32 {
        let z = z as f32 + 0.5;
        let way = if direction.z < 0.0 { z } else { layers as f32 - z };
        // Along the slab a light ray would never end.
        let t = way / direction.z.abs().max(1e-6);
        let c = direction.abs();
        let length = if per_cell { t * (c.x + c.y + c.z) } else { t };
        self.even * length.min(1e9)
    }
}

/// E[max(ρ − e, 0)]/E[ρ] of the paper's ρ = clamp(N + ½, 0, 1). It is 2∫_e^1 Φ(½ − x) dx; with Φ taken as
/// straight from Φ(½) = 0.6915 to Φ(−½) = 0.3085, which it is to 0.002 there, (1 − e)(1 − 0.383 e).
fn mean_left(e: f32) -> f32 {
    (1.0 - e) * (1.0 - 0.383 * e)
}
