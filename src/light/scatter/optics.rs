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

use glam::{Mat3, Vec3};

use super::Similarity;
use crate::volume::Moments;

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

    /// Albedo ω of fibres by colour, over the cell's colour.
    pub fn whole_albedo(&self) -> Vec3 {
        self.isotropic * (4.0 / (1.0 - self.g))
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
