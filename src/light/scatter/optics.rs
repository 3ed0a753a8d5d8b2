//! §5 Light that scatters many times in shells: how the matter scatters, and its surface.
//!
//! A shell is no slab: it is bent, it ends, and other parts of its mesh shade it. So the tables of slabs do
//! not serve it, and the mean intensity of the diffuse light is solved for at the vertices of its mesh. The
//! rest is as in slabs ([`super`]): a reduced medium with isotropic scattering, and what the light that has
//! scattered once has beyond it.
//!
//! Skin has a rough dielectric surface. What passes it obeys Fresnel's equations at the smooth mean surface;
//! what it throws back has the distribution of normals of Trowbridge and Reitz (GGX; Walter, Marschner, Li
//! and Torrance 2007) with Smith's shadowing of both directions (Heitz 2014, equation 99). The normals of
//! cells come from the second moments of their directions, as slopes come from those of a normal map (Olano
//! and Baker, "LEAN Mapping", 2010).
//!
//! `shaders/light/optics.wgsl` is the twin.

use std::f32::consts::LN_2;

use glam::{Mat3, Vec3};

use super::{ORDERS, Similarity};
use crate::util::powers::{exp2, log2};
use crate::volume::Moments;

/// Extinction of the surface's lobe, relative to the walk's: the first occupied cells have it, however deep
/// they are.
pub const SURFACE_EXTINCTION: f32 = 24.0;

/// V below which nothing is known of the depth, 2⁻²⁴.
pub const LEAST_VISIBLE: f32 = 1.0 / 16_777_216.0;

/// Least share of the directions' squares along z with which slopes are measured, so that walls have some.
/// Slopes reach 1/√this = 10 in cells.
pub const LEAST_UPRIGHT: f32 = 0.01;

/// How light scatters many times in the matter of a shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellOptics {
    /// Extinction of the reduced medium by colour, relative to the walk's.
    pub extinction: Vec3,
    /// Albedo ω' of the reduced medium by colour. Where cells have a colour, it is multiplied by it.
    pub albedo: Vec3,
    /// b: isotropic part of Ψ, which light that has scattered once has already, over the cell's colour. 0
    /// for skin.
    pub isotropic: Vec3,
    /// Mean cosine g ≥ 0 of scattering by fibres, for the forward peak. 0 for skin.
    pub g: f32,
    /// Rough dielectric outer surface of skin.
    pub surface: Option<Surface>,
}

impl ShellOptics {
    /// Optics of fibres whose reduced medium has these constants.
    pub fn of_fibres(similarity: &Similarity) -> ShellOptics {
        ShellOptics {
            extinction: similarity.extinction,
            albedo: similarity.reduced * 4.0,
            isotropic: similarity.isotropic,
            g: similarity.g,
            surface: None,
        }
    }

    /// Optics of a cell of this colour, as the engines compute with them.
    #[inline]
    pub fn of_cell(&self, color: Vec3) -> CellOptics {
        let albedo = self.albedo * color;
        let isotropic = self.isotropic * color;
        CellOptics {
            extinction: self.extinction,
            albedo,
            reduced: albedo * 0.25,
            isotropic,
            whole: isotropic * (4.0 / (1.0 - self.g)),
        }
    }
}

/// Optics of a cell, per colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellOptics {
    /// a: extinction of the reduced medium.
    pub extinction: Vec3,
    /// ω'.
    pub albedo: Vec3,
    /// b' = ω'/4.
    pub reduced: Vec3,
    /// b.
    pub isotropic: Vec3,
    /// Albedo ω of fibres.
    pub whole: Vec3,
}

/// Way of a view ray through a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// T at the shell's start, times the share that the cell's level counts by.
    pub start: f32,
    /// Optical depth from the shell's start to the cell, bits.
    pub view: f32,
    /// Optical depth in the cell, bits.
    pub cell: f32,
}

impl Passage {
    /// w': share of the cell in what the eye sees, in a medium with this extinction.
    #[inline]
    pub fn weight(&self, extinction: Vec3) -> Vec3 {
        let passed = (extinction * -self.view).map(exp2);
        (passed - (extinction * -(self.view + self.cell)).map(exp2)) * self.start
    }

    /// Share of the cell in the light that the surface throws back.
    #[inline]
    pub fn surface_weight(&self) -> f32 {
        let passed = exp2(-SURFACE_EXTINCTION * self.view);
        (passed - exp2(-SURFACE_EXTINCTION * (self.view + self.cell))) * self.start
    }
}

/// Positions that stand for a cell of so many bits, 0 to 1 from where the ray enters it: one of light that
/// comes from a light, and one of diffuse light.
///
/// In a thick cell the eye sees only what lies in front. The first position has the mean of e^(−2x) over what
/// is seen, as if light came as deep as the eye looks, and the second is the mean of what is seen, because
/// diffuse light is interpolated linearly. So light does not depend on where boundaries cut a ray. The
/// middles of coarse cells were too dark, by a pattern of their boundaries.
#[inline]
pub fn within(bits: f32) -> [f32; 2] {
    let tau = bits * LN_2;
    if bits < 0.1 {
        return [0.5 - tau * (1.0 / 8.0), 0.5 - tau * (1.0 / 12.0)];
    }
    let passed = exp2(-bits);
    [(1.0 - log2(1.0 + passed)) / bits, 1.0 / tau - passed / (1.0 - passed)]
}

/// Light of one light at a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// V in the shell.
    pub through: f32,
    /// Share that opaque matter lets through.
    pub open: f32,
}

impl Arriving {
    /// V.
    #[inline]
    pub fn visible(&self) -> f32 {
        self.through * self.open
    }

    /// Optical depth from the cell to the light, bits.
    #[inline]
    pub fn depth(&self) -> f32 {
        -log2(self.through.max(1e-30))
    }

    /// V' in a medium with this extinction, `depth` bits from the light. Rays to the light go no further
    /// than 24 bits, so what is behind is dark, however small the extinction is.
    #[inline]
    pub fn reduced(&self, extinction: Vec3, depth: f32) -> Vec3 {
        let open = if self.through > LEAST_VISIBLE { self.open } else { 0.0 };
        (extinction * -depth).map(exp2) * open
    }
}

impl CellOptics {
    /// Radiance that a cell of fibres sends to the eye for a light of intensity 1, without the single
    /// scattering w·V·Ψ and the diffuse light w'·ω'·J.
    ///
    /// `weight` is w', `once` is w·V, and `peak` the forward peak.
    #[inline]
    pub fn more(&self, weight: Vec3, once: f32, peak: &[f32; ORDERS - 1], light: &Arriving) -> Vec3 {
        let depth = light.depth();
        let s = self.whole * (depth * LN_2);
        // Σ h_n s^(n−1)/(n−1)! by Horner's rule.
        let mut forward = Vec3::splat(peak[4] * 0.2);
        forward = (forward * s + peak[3]) * 0.25;
        forward = (forward * s + peak[2]) * (1.0 / 3.0);
        forward = (forward * s + peak[1]) * 0.5;
        forward = (forward * s + peak[0]) * s;
        let sum = weight * (self.reduced * light.reduced(self.extinction, depth))
            + (self.whole * forward - self.isotropic) * once;
        sum.max(Vec3::ZERO)
    }
}

/// Rough dielectric surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Index of refraction relative to the air, at least 1. With 1 there is no surface.
    pub eta: f32,
    /// α of the distribution of Trowbridge and Reitz, above 0.
    pub roughness: f32,
}

impl Surface {
    /// Cosine inside the matter of a direction with the cosine `mu` ≥ 0 outside, both with the normal.
    #[inline]
    pub fn refracted(&self, mu: f32) -> f32 {
        (1.0 - (1.0 - mu * mu) / (self.eta * self.eta)).max(0.0).sqrt()
    }

    /// Fresnel's reflectance of unpolarised light that arrives from outside with the cosine `mu` ≥ 0.
    #[inline]
    pub fn fresnel(&self, mu: f32) -> f32 {
        let inside = self.refracted(mu);
        let (eta_mu, eta_inside) = (self.eta * mu, self.eta * inside);
        let across = (mu - eta_inside) / (mu + eta_inside).max(1e-6);
        let along = (eta_mu - inside) / (eta_mu + inside).max(1e-6);
        0.5 * (across * across + along * along)
    }

    /// Ratio μ/μ' of the cosines outside and inside. It is 1 without a surface.
    #[inline]
    pub fn stretch(&self, mu: f32) -> f32 {
        mu / self.refracted(mu).max(1e-6)
    }

    /// Share of the radiance inside that leaves towards the eye, and the factor of the way inside. `mu` ≥ 0
    /// is the eye's cosine with the normal.
    #[inline]
    pub fn leaving(&self, mu: f32) -> [f32; 2] {
        [(1.0 - self.fresnel(mu)) / (self.eta * self.eta), self.stretch(mu)]
    }

    /// Factor of the radiance of light that scatters once below the surface, and of its way inside. `mu` ≥ 0
    /// is the light's cosine with the normal.
    #[inline]
    pub fn entering(&self, mu: f32) -> [f32; 2] {
        let stretch = self.stretch(mu);
        [(1.0 - self.fresnel(mu)) * stretch, stretch]
    }

    /// π·f·(m·l): radiance that the surface throws back to the unit vector `e` from a light of intensity 1
    /// (irradiance/π) along the unit vector `l`. `m` is the mean normal and `alpha2` is α² there.
    #[inline]
    pub fn lobe(&self, m: Vec3, l: Vec3, e: Vec3, alpha2: f32) -> f32 {
        let (m_l, m_e) = (m.dot(l).max(0.0), m.dot(e).max(1e-4));
        let sum = l + e;
        let h = sum * (1.0 / sum.length_squared().max(1e-12).sqrt());
        let m_h = m.dot(h);
        let s = m_h * m_h * (alpha2 - 1.0) + 1.0;
        // π times the distribution; Smith's factor has the 4·(m·l)·(m·e) in it.
        let normals = alpha2 / (s * s).max(1e-12);
        let smith = m_l * (alpha2 + (1.0 - alpha2) * m_e * m_e).sqrt()
            + m_e * (alpha2 + (1.0 - alpha2) * m_l * m_l).sqrt();
        self.fresnel(e.dot(h).max(0.0)) * normals * 0.5 * m_l / smith.max(1e-6)
    }
}

/// Mean normal of a cell, and how far its normals spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellNormal {
    /// Unit vector in the world, outward.
    pub m: Vec3,
    /// Sum of the variances of the slopes along both directions of the surface. α² grows by it: α² of a
    /// distribution of slopes is twice the variance along one direction.
    pub variance: f32,
}

impl CellNormal {
    /// Normal of a cell whose directions have these second moments, in cells, with the Jacobian `j`
    /// = world_from_cell.
    #[inline]
    pub fn new(moments: &Moments, j: &Mat3) -> CellNormal {
        let (Vec3 { x: xx, y: yy, z: zz }, mixed) = (moments.diagonal, moments.mixed);
        let inverse = 1.0 / zz.max(LEAST_UPRIGHT * (xx + yy + zz)).max(1e-30);
        // Slopes.
        let (x, y) = (mixed.y * inverse, mixed.z * inverse);
        // Rows of J⁻¹ times the determinant: a normal is a covector.
        let (row_x, row_y, row_z) =
            (j.y_axis.cross(j.z_axis), j.z_axis.cross(j.x_axis), j.x_axis.cross(j.y_axis));
        // Cells are numbered from the outer surface inwards, so z grows inwards.
        let inward = row_x * x + row_y * y + row_z;
        let squared = inward.length_squared().max(1e-30);
        let scale = 1.0 / squared.sqrt();
        let is_mirrored = j.x_axis.dot(row_x) < 0.0;
        let sum = row_x.length_squared() * (xx * inverse - x * x)
            + row_x.dot(row_y) * (2.0 * (mixed.x * inverse - x * y))
            + row_y.length_squared() * (yy * inverse - y * y);
        CellNormal {
            m: inward * if is_mirrored { scale } else { -scale },
            variance: (sum / squared).max(0.0),
        }
    }
}
