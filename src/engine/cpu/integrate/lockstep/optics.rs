//! Optics of eight cells of shells. Twin of `src/light/scatter/optics.rs`, with the same operations in the
//! same order.

use std::f32::consts::LN_2;

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::fibre::Moments;
use crate::light::scatter::ORDERS;
use crate::light::scatter::optics::{LEAST_UPRIGHT, LEAST_VISIBLE, SURFACE_EXTINCTION};
use crate::util::lane_powers::{exp2, log2};
use crate::util::lanes::{Floats, Lanes3};

/// Powers of two.
#[inline(always)]
fn powers<S: Simd>(simd: S, exponents: Lanes3<S>) -> Lanes3<S> {
    let Lanes3 { x, y, z } = exponents;
    Lanes3 { x: exp2(simd, x), y: exp2(simd, y), z: exp2(simd, z) }
}

/// See [`crate::light::scatter::optics::CellOptics`].
#[derive(Clone, Copy)]
pub struct CellOptics<S: Simd> {
    pub extinction: Lanes3<S>,
    pub albedo: Lanes3<S>,
    pub reduced: Lanes3<S>,
    pub isotropic: Lanes3<S>,
    pub whole: Lanes3<S>,
}

/// See [`crate::light::scatter::optics::Passage`].
#[derive(Clone, Copy)]
pub struct Passage<S: Simd> {
    pub start: Floats<S>,
    pub view: Floats<S>,
    pub cell: Floats<S>,
}

impl<S: Simd> Passage<S> {
    /// w'.
    #[inline(always)]
    pub fn weight(&self, simd: S, extinction: Lanes3<S>) -> Lanes3<S> {
        let passed = powers(simd, extinction.times(-self.view));
        passed.minus(powers(simd, extinction.times(-(self.view + self.cell)))).times(self.start)
    }

    /// Share of the cell in the light that the surface throws back.
    #[inline(always)]
    pub fn surface_weight(&self, simd: S) -> Floats<S> {
        let extinction = f32x8::splat(simd, -SURFACE_EXTINCTION);
        let passed = exp2(simd, extinction * self.view);
        (passed - exp2(simd, extinction * (self.view + self.cell))) * self.start
    }
}

/// See [`crate::light::scatter::optics::Arriving`].
#[derive(Clone, Copy)]
pub struct Arriving<S: Simd> {
    pub through: Floats<S>,
    pub open: Floats<S>,
}

impl<S: Simd> Arriving<S> {
    /// V.
    #[inline(always)]
    pub fn visible(&self) -> Floats<S> {
        self.through * self.open
    }

    /// Optical depth from the cells to the light, bits.
    #[inline(always)]
    pub fn depth(&self, simd: S) -> Floats<S> {
        -log2(simd, self.through.max(f32x8::splat(simd, 1e-30)))
    }

    /// V' in a medium with this extinction.
    #[inline(always)]
    pub fn reduced(&self, simd: S, extinction: Lanes3<S>, depth: Floats<S>) -> Lanes3<S> {
        let is_known = self.through.simd_gt(LEAST_VISIBLE);
        let open = is_known.select(self.open, f32x8::splat(simd, 0.0));
        powers(simd, extinction.times(-depth)).times(open)
    }
}

impl<S: Simd> CellOptics<S> {
    /// Radiance of cells of fibres without the light that scatters once and the diffuse light.
    #[inline(always)]
    pub fn more(
        &self,
        simd: S,
        weight: Lanes3<S>,
        once: Floats<S>,
        peak: &[Floats<S>; ORDERS - 1],
        light: &Arriving<S>,
    ) -> Lanes3<S> {
        let zero = f32x8::splat(simd, 0.0);
        let depth = light.depth(simd);
        let length = depth * LN_2;
        let seen = light.reduced(simd, self.extinction, depth);
        let (w, i) = (self.whole, self.isotropic);
        let forward = Lanes3 {
            x: forward_sum(peak, w.x * length),
            y: forward_sum(peak, w.y * length),
            z: forward_sum(peak, w.z * length),
        };
        let reduced = weight.by(seen.by(self.reduced));
        let sum = reduced.plus(w.by(forward).minus(i).times(once));
        Lanes3 { x: sum.x.max(zero), y: sum.y.max(zero), z: sum.z.max(zero) }
    }
}

/// Light that the forward peaks pass on, by the depth `s` in units of the matter.
#[inline(always)]
fn forward_sum<S: Simd>(peak: &[Floats<S>; ORDERS - 1], s: Floats<S>) -> Floats<S> {
    let mut forward = peak[4] * 0.2;
    forward = (forward * s + peak[3]) * 0.25;
    forward = (forward * s + peak[2]) * (1.0 / 3.0);
    forward = (forward * s + peak[1]) * 0.5;
    (forward * s + peak[0]) * s
}

/// Forward peaks; see [`crate::light::scatter::forward_peak`].
#[inline(always)]
pub fn forward_peak<S: Simd>(simd: S, g: Floats<S>, cos: Floats<S>) -> [Floats<S>; ORDERS - 1] {
    let one = f32x8::splat(simd, 1.0);
    let mut power = g;
    let mut peaks = [one; ORDERS - 1];
    for own in &mut peaks {
        power *= g;
        let s = one + power * power - power * 2.0 * cos;
        let peak = (one - power * power) / (s * s.sqrt()) - (one - power);
        *own = peak * 0.25;
    }
    peaks
}

/// See [`crate::light::scatter::optics::Surface`].
#[derive(Clone, Copy)]
pub struct Surface<S: Simd> {
    pub simd: S,
    pub eta: Floats<S>,
    pub roughness: Floats<S>,
}

impl<S: Simd> Surface<S> {
    #[inline(always)]
    fn splat(&self, x: f32) -> Floats<S> {
        f32x8::splat(self.simd, x)
    }

    #[inline(always)]
    fn refracted(&self, mu: Floats<S>) -> Floats<S> {
        let one = self.splat(1.0);
        (one - (one - mu * mu) / (self.eta * self.eta)).max(self.splat(0.0)).sqrt()
    }

    #[inline(always)]
    fn fresnel(&self, mu: Floats<S>) -> Floats<S> {
        let (inside, least) = (self.refracted(mu), self.splat(1e-6));
        let (eta_mu, eta_inside) = (self.eta * mu, self.eta * inside);
        let across = (mu - eta_inside) / (mu + eta_inside).max(least);
        let along = (eta_mu - inside) / (eta_mu + inside).max(least);
        (across * across + along * along) * 0.5
    }

    #[inline(always)]
    fn stretch(&self, mu: Floats<S>) -> Floats<S> {
        mu / self.refracted(mu).max(self.splat(1e-6))
    }

    /// Share of the radiance inside that leaves, and the factor of the way inside.
    #[inline(always)]
    pub fn leaving(&self, mu: Floats<S>) -> [Floats<S>; 2] {
        [(self.splat(1.0) - self.fresnel(mu)) / (self.eta * self.eta), self.stretch(mu)]
    }

    /// Factor of the radiance of light that scatters once, and of its way inside.
    #[inline(always)]
    pub fn entering(&self, mu: Floats<S>) -> [Floats<S>; 2] {
        let stretch = self.stretch(mu);
        [(self.splat(1.0) - self.fresnel(mu)) * stretch, stretch]
    }

    /// π·f·(m·l).
    #[inline(always)]
    pub fn lobe(&self, m: Lanes3<S>, l: Lanes3<S>, e: Lanes3<S>, alpha2: Floats<S>) -> Floats<S> {
        let (zero, one) = (self.splat(0.0), self.splat(1.0));
        let (m_l, m_e) = (m.dot(l).max(zero), m.dot(e).max(self.splat(1e-4)));
        let sum = l.plus(e);
        let h = sum.times(one / sum.dot(sum).max(self.splat(1e-12)).sqrt());
        let m_h = m.dot(h);
        let s = m_h * m_h * (alpha2 - one) + one;
        let normals = alpha2 / (s * s).max(self.splat(1e-12));
        let smith = m_l * (alpha2 + (one - alpha2) * m_e * m_e).sqrt()
            + m_e * (alpha2 + (one - alpha2) * m_l * m_l).sqrt();
        self.fresnel(e.dot(h).max(zero)) * normals * 0.5 * m_l / smith.max(self.splat(1e-6))
    }
}

/// Outward unit normals of a shell where its Jacobians have this third column.
#[inline(always)]
pub fn normal_of<S: Simd>(simd: S, z: Lanes3<S>) -> Lanes3<S> {
    let splat = |x: f32| f32x8::splat(simd, x);
    z.times(-(splat(1.0) / z.dot(z).max(splat(1e-30)).sqrt()))
}

/// See [`crate::light::scatter::optics::CellNormal`].
pub struct CellNormal<S: Simd> {
    pub m: Lanes3<S>,
    pub variance: Floats<S>,
}

impl<S: Simd> CellNormal<S> {
    /// Normals of cells with these moments of their directions; `j` are the columns of world_from_cell.
    #[inline(always)]
    pub fn new(simd: S, moments: &Moments<S>, [j_x, j_y, j_z]: &[Lanes3<S>; 3]) -> Self {
        let splat = |x: f32| f32x8::splat(simd, x);
        let (Lanes3 { x: xx, y: yy, z: zz }, mixed) = (moments.diagonal, moments.mixed);
        let least = (xx + yy + zz) * LEAST_UPRIGHT;
        let inverse = splat(1.0) / zz.max(least).max(splat(1e-30));
        let (x, y) = (mixed.y * inverse, mixed.z * inverse);
        let (row_x, row_y, row_z) = (j_y.cross(*j_z), j_z.cross(*j_x), j_x.cross(*j_y));
        let inward = row_x.times(x).plus(row_y.times(y)).plus(row_z);
        let squared = inward.dot(inward).max(splat(1e-30));
        let scale = splat(1.0) / squared.sqrt();
        let is_mirrored = j_x.dot(row_x).simd_lt(0.0);
        let sum = row_x.dot(row_x) * (xx * inverse - x * x)
            + row_x.dot(row_y) * ((mixed.x * inverse - x * y) * 2.0)
            + row_y.dot(row_y) * (yy * inverse - y * y);
        CellNormal {
            m: inward.times(is_mirrored.select(scale, -scale)),
            variance: (sum / squared).max(splat(0.0)),
        }
    }
}
