//! §5 Diffuse light in shells: mean intensity J of light that scattered at least once, at the vertices of a
//! shell's mesh and at several depths below each.

mod column;
mod matter;
mod pieces;

use glam::Vec3;
use rayon::prelude::*;

use super::optics::Surface;
use crate::light::Light;
use crate::mapping::shell::Shell;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use column::{Column, Factored};
pub use matter::layer_colors;
use pieces::{Piece, pieces};

/// Vertices between two reports of progress.
const AT_ONCE: usize = 1 << 14;

/// Matter of a shell as its diffuse light meets it: a reduced medium, in which scattering is isotropic.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellMatter {
    /// Extinction of each layer of cells by colour, from the outer surface inwards, 1/m.
    pub extinction: Vec<Vec3>,
    /// Albedo ω' of each layer by colour, 0 to 1.
    pub albedo: Vec<Vec3>,
    /// Index of refraction behind the outer surface, at least 1.
    pub eta: f32,
    /// What lies below the inner surface.
    pub below: Below,
}

/// What lies below the inner surface of a shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// Nothing: light enters and leaves there as at the outer surface.
    Open,
    /// A diffuse surface.
    Opaque {
        /// Its albedo by colour.
        albedo: Vec3,
    },
    /// More of the deepest layer's matter.
    Core,
}

/// What shines on a shell.
pub struct Incoming<'a> {
    /// Lights.
    pub lights: &'a [Light],
    /// Share of each light that reaches each vertex past opaque matter, at the outer and at the inner
    /// surface. `None` without such matter.
    pub shares: Option<Vec<&'a [[f32; 2]]>>,
    /// Radiance from everywhere.
    pub ambient: Vec3,
}

/// J in one shell, in the unit of lights' intensities (irradiance/π). Light of lights that did not scatter
/// is not in it. The ambient light is, scattered or not.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellDiffuse {
    /// Number of layers between the values below a vertex.
    pub layers: usize,
    /// J by colour: of vertex v at depth i/layers at v·(layers + 1) + i.
    pub values: Vec<Vec3>,
}

impl ShellDiffuse {
    /// Solves for J between `layers` layers of equal thickness.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn new(
        shell: &Shell,
        layers: usize,
        matter: &ShellMatter,
        incoming: &Incoming,
        monitor: &dyn Monitor,
    ) -> Result<ShellDiffuse> {
        let pieces = pieces(layers, matter.extinction.len());
        let normals = normals(shell);
        let count = shell.vertices();
        let mut values = vec![Vec3::ZERO; count * (layers + 1)];
        for (k, part) in values.chunks_mut(AT_ONCE * (layers + 1)).enumerate() {
            monitor.progress("diffuse light in shells", (k * AT_ONCE) as u64, count as u64)?;
            part.par_chunks_mut(layers + 1).enumerate().for_each(|(i, own)| {
                let vertex = k * AT_ONCE + i;
                let [outer, inner] = [0, 1].map(|end| shell.points[2 * vertex + end]);
                let column = Column { matter, pieces: &pieces, layers, thickness: outer.distance(inner) };
                own.iter_mut().for_each(|value| *value = Vec3::ZERO);
                column.add_ambient(incoming.ambient, own);
                for (number, light) in incoming.lights.iter().enumerate() {
                    let (to_light, intensity) = light.at(outer);
                    let shares = incoming.shares.as_ref().map_or([1.0; 2], |all| all[number][vertex]);
                    column.add_beam(normals[vertex].dot(to_light), intensity, shares, own);
                }
                Factored::new(&column).solve(own);
            });
        }
        Ok(ShellDiffuse { layers, values })
    }
}

/// Outward unit normals at the vertices: along the thickness, or where there is none, those of the outer
/// surface.
fn normals(shell: &Shell) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; shell.vertices()];
    for face in shell.hull.iter().filter(|face| !face.is_eye() && face.points.iter().all(|p| p % 2 == 0)) {
        let [a, b, c] = shell.corners(face);
        let normal = (b - a).cross(c - a);
        face.points.iter().for_each(|point| sums[*point as usize / 2] += normal);
    }
    let along = |(pair, sum): (&[Vec3; 2], Vec3)| {
        (pair[0] - pair[1]).try_normalize().unwrap_or_else(|| sum.normalize_or_zero())
    };
    shell.points.as_chunks::<2>().0.iter().zip(sums).map(along).collect()
}

/// Moments of Fresnel's reflectance for light that meets a surface from inside: ∫2μR dμ and ∫3μ²R dμ.
fn fresnel_moments(eta: f32) -> [f32; 2] {
    if eta <= 1.0 {
        return [0.0; 2];
    }
    const STEPS: usize = 4096;
    let mut sums = [0.0f64; 2];
    for i in 0..STEPS {
        let mu = (i as f64 + 0.5) / STEPS as f64;
        let reflected = from_inside(eta, mu as f32) as f64;
        sums[0] += 2.0 * mu * reflected / STEPS as f64;
        sums[1] += 3.0 * mu * mu * reflected / STEPS as f64;
    }
    sums.map(|sum| sum as f32)
}

/// Reflectance of the surface for light that meets it from inside with the cosine `mu`.
fn from_inside(eta: f32, mu: f32) -> f32 {
    let outside = 1.0 - (1.0 - mu * mu) * eta * eta;
    if outside <= 0.0 {
        return 1.0;
    }
    // Both ways along a path have the same reflectance.
    Surface { eta, roughness: 1.0 }.fresnel(outside.sqrt())
}
