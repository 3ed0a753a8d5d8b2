//! Irradiance of a map on a surface of any direction, from nine coefficients per colour: the spherical
//! harmonics of the map up to the second order, multiplied by those of the clamped cosine (Ramamoorthi and
//! Hanrahan 2001, "An Efficient Representation for Irradiance Environment Maps", eqs. 5 to 10).

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::moments::TERMS;

/// E(n)/π, the radiance of a white diffuse surface with normal n, in the unit of the map. The nine
/// coefficients belong to 1, x, y, z, xy, yz, 3y² − 1, xz and x² − z².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiance(pub [Vec3; TERMS]);

/// A_l·N² of each term, with Y = N·term the real harmonic and A_l = π, 2π/3, π/4 the clamped cosine's
/// coefficients.
const COSINE: [f64; TERMS] = [
    1.0 / 4.0,
    1.0 / 2.0,
    1.0 / 2.0,
    1.0 / 2.0,
    15.0 / 16.0,
    15.0 / 16.0,
    5.0 / 64.0,
    15.0 / 16.0,
    15.0 / 64.0,
];

impl Irradiance {
    /// Irradiance from a map's moments ([`moments_of_map`](super::moments_of_map)), scaled by `factor` and
    /// rotated by `turn` turns about +y, from +z towards +x.
    pub fn new(moments: &[DVec3; TERMS], turn: f64, factor: f64) -> Irradiance {
        let [one, x, y, z, xy, yz, yy, xz, xx_zz] = *moments;
        let (sin, cos) = (turn * 2.0 * PI).sin_cos();
        let (sin2, cos2) = (turn * 4.0 * PI).sin_cos();
        // The pairs z, x and yz, xy rotate by the angle of the map, the pair x² − z², 2xz by twice that
        // angle.
        let turned = [
            one,
            x * cos + z * sin,
            y,
            z * cos - x * sin,
            xy * cos + yz * sin,
            yz * cos - xy * sin,
            yy,
            xz * cos2 - xx_zz * (0.5 * sin2),
            xx_zz * cos2 + xz * (2.0 * sin2),
        ];
        let mut terms = [Vec3::ZERO; TERMS];
        for i in 0..TERMS {
            terms[i] = (turned[i] * (COSINE[i] * factor / PI)).as_vec3();
        }
        Irradiance(terms)
    }

    /// E(n)/π for the unit normal `n`, never negative. Twin: `environment_irradiance` in
    /// `shaders/light/environment.wgsl`.
    pub fn at(&self, n: Vec3) -> Vec3 {
        let c = &self.0;
        let mut sum = c[0];
        sum += c[1] * n.x;
        sum += c[2] * n.y;
        sum += c[3] * n.z;
        sum += c[4] * (n.x * n.y);
        sum += c[5] * (n.y * n.z);
        sum += c[6] * (3.0 * n.y * n.y - 1.0);
        sum += c[7] * (n.x * n.z);
        sum += c[8] * (n.x * n.x - n.z * n.z);
        sum.max(Vec3::ZERO)
    }
}
