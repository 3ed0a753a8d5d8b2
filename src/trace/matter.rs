//! §4 Density of the cells as one sheet shows it: eroded, or replaced by mist. Twin:
//! `shaders/trace/matter.wgsl`.

use glam::{Vec2, Vec3};

use crate::mapping::Quad;

/// Share of mist's ρ that comes from the cells, as clouds that drift with the flow. The rest is uniform.
pub const MIST_OF_CELLS: f32 = 0.3;
/// ρ of uniform mist, in codes (0 to 65535): the mean of the paper's flow cells.
pub const MIST_RHO: f32 = 32768.0;
/// How much faster than linearly erosion takes the mean ρ: Φ(½) − Φ(−½), as in [`SheetDensity::left`].
pub const MEAN_EROSION: f32 = 0.383;

/// Map from a cell's ρ to the ρ that a sheet shows, constant along one ray. ρ is in codes, 0 to 65535.
///
/// - Erosion subtracts e from every cell's ρ. It does not rescale the rest: 30.85 % of the paper's cells have
///   ρ = 1, and rescaling would keep them whole up to e = 1.
/// - Light rays are eroded as much as the view ray, because they end near it and thin water is thin in every
///   direction.
/// - Light volumes are filled before the erosion is known, so their depth is scaled by the mean loss.
/// - Mist is uniform, except for the share [`MIST_OF_CELLS`] that follows the cells.
#[derive(Clone, Copy)]
pub struct SheetDensity {
    scale: f32,
    shift: f32,
    /// 255·Ψ of mist; 0 on a sheet without mist.
    pub mist: f32,
    /// ρ of uniform mist, in codes; 0 without mist.
    even: f32,
    /// Share of the mean ρ that erosion leaves, 0 to 1.
    pub left: f32,
}

impl SheetDensity {
    /// Density map at the texture coordinates `uv` of a quad, for the volume's own cells. Holes erode the
    /// share `torn` of what else is left.
    #[inline]
    pub fn new(quad: &Quad, uv: Vec2, torn: f32) -> Self {
        let [a, b, c, d] = quad.erosion;
        let near = a + (b - a) * uv.x;
        let far = d + (c - d) * uv.x;
        let e = (near + (far - near) * uv.y).clamp(0.0, 1.0);
        let e = e + (1.0 - e) * torn;
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

    /// Multiplies the density by a factor, as billows of mist do. Light rays see mist without its billows.
    #[inline]
    pub fn billowed(self, factor: f32) -> Self {
        SheetDensity { scale: self.scale * factor, shift: self.shift * factor, ..self }
    }

    /// Density map, as [`SheetDensity::new`], for cells of a coarse level. ρ of a coarse cell belongs to none
    /// of the cells in it, so erosion scales it by the mean loss instead of subtracting e.
    #[inline]
    pub fn of_coarse(quad: &Quad, uv: Vec2, torn: f32) -> Self {
        let matter = SheetDensity::new(quad, uv, torn);
        match quad.mist > 0.0 {
            true => matter,
            false => SheetDensity { scale: matter.left, shift: 0.0, ..matter },
        }
    }

    /// Identity: a sheet without erosion or mist.
    pub const WHOLE: SheetDensity = SheetDensity { scale: 1.0, shift: 0.0, mist: 0.0, even: 0.0, left: 1.0 };

    /// ρ on the sheet, in codes, for a cell's (or an interpolated) ρ code.
    #[inline]
    pub fn rho(&self, code: f32) -> f32 {
        (code * self.scale + self.shift).max(0.0)
    }

    /// Optical depth from the centre of a mist cell in layer `z` of `layers` to the point where the light ray
    /// leaves the slab. The mist is treated as uniform.
    ///
    /// `direction` is in cells per unit of length, and the depth is Σ ρ code × length in that unit; with
    /// `per_cell` it is Σ ρ code.
    pub fn depth(&self, z: i32, direction: Vec3, layers: i32, per_cell: bool) -> f32 {
        let z = z as f32 + 0.5;
        let way = if direction.z < 0.0 { z } else { layers as f32 - z };
        // A light ray parallel to the slab never leaves it.
        let t = way / direction.z.abs().max(1e-6);
        let c = direction.abs();
        let length = if per_cell { t * (c.x + c.y + c.z) } else { t };
        self.even * length.min(1e9)
    }
}

/// Share of the mean ρ that erosion by e leaves, `E[max(ρ − e, 0)]/E[ρ]`.
///
/// The paper's ρ is clamp(N + ½, 0, 1) with N a standard normal variable.
/// The exact value is 2∫_e^1 Φ(½ − x) dx. Φ is linear to within 0.002 from Φ(½) = 0.6915 to Φ(−½) = 0.3085,
/// and the linear Φ gives (1 − e)(1 − [`MEAN_EROSION`] e).
#[inline]
fn mean_left(e: f32) -> f32 {
    (1.0 - e) * (1.0 - MEAN_EROSION * e)
}
