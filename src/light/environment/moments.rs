//! Integrals of a map's radiance over the sphere, exact for a map with constant texels.
//!
//! The solid angle and every product of the direction's components are integrated over each texel in closed
//! form, row by row and column by column (φ and θ separate). Nothing is sampled at a texel's centre.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::map::Map;

/// Number of polynomials of the direction that irradiance needs up to the second order. Their order is that
/// of [`Irradiance`](super::Irradiance): 1, x, y, z, xy, yz, 3y² − 1, xz, x² − z².
pub const TERMS: usize = 9;

/// Maximum number of columns and rows of cells that lights are chosen from.
///
/// A cell of 0.7° preserves its power and its centroid exactly. With finer cells no boundary between 1024
/// lights would move by more than a twentieth of a light's size.
const CELLS: [usize; 2] = [512, 256];

/// Integrals over the latitudes of one row: cos φ dφ times 1, y, r, y², r² and y·r, with y = sin φ and r =
/// cos φ.
struct Row {
    one: f64,
    y: f64,
    r: f64,
    y2: f64,
    r2: f64,
    yr: f64,
}

/// Integrals over the longitudes of one column: 1, sin θ, cos θ, sin 2θ and cos 2θ, with x = r sin θ and
/// z = −r cos θ.
type Column = [f64; 5];

fn row(j: usize, rows: usize) -> Row {
    let at = |k: usize| {
        let phi = FRAC_PI_2 - PI * k as f64 / rows as f64;
        let (s, c) = phi.sin_cos();
        // Antiderivatives of the six integrands at the row's edge.
        [s, s * s / 2.0, (phi + s * c) / 2.0, s * s * s / 3.0, s - s * s * s / 3.0, -c * c * c / 3.0]
    };
    let (top, bottom) = (at(j), at(j + 1));
    let [one, y, r, y2, r2, yr] = [0, 1, 2, 3, 4, 5].map(|k| top[k] - bottom[k]);
    Row { one, y, r, y2, r2, yr }
}

fn columns(count: usize) -> Vec<Column> {
    let at = |i: usize| {
        let theta = TAU * (i as f64 / count as f64 - 0.5);
        [theta, -theta.cos(), theta.sin(), -(2.0 * theta).cos() / 2.0, (2.0 * theta).sin() / 2.0]
    };
    (0..count)
        .map(|i| {
            let (left, right) = (at(i), at(i + 1));
            [0, 1, 2, 3, 4].map(|k| right[k] - left[k])
        })
        .collect()
}

fn rgb(texel: &[f32; 4]) -> DVec3 {
    DVec3::new(texel[0] as f64, texel[1] as f64, texel[2] as f64)
}

/// Integral ∫ L·b dω for each of the [`TERMS`] polynomials b, linear RGB.
pub fn of_map(map: &Map) -> [DVec3; TERMS] {
    let columns = columns(map.width as usize);
    let rows: Vec<[DVec3; TERMS]> = map
        .texels
        .par_chunks_exact(map.width as usize)
        .enumerate()
        .map(|(j, texels)| {
            let mut sums = [DVec3::ZERO; 5];
            for (texel, column) in texels.iter().zip(&columns) {
                let radiance = rgb(texel);
                for (sum, integral) in sums.iter_mut().zip(column) {
                    *sum += radiance * *integral;
                }
            }
            let [one, sin, cos, sin2, cos2] = sums;
            let row = row(j, map.height as usize);
            [
                one * row.one,
                sin * row.r,
                one * row.y,
                cos * -row.r,
                sin * row.yr,
                cos * -row.yr,
                one * (3.0 * row.y2 - row.one),
                sin2 * (-0.5 * row.r2),
                cos2 * -row.r2,
            ]
        })
        .collect();
    // Summed in the order of the rows, so that the result does not depend on the number of threads.
    rows.into_iter().fold([DVec3::ZERO; TERMS], |mut sum, row| {
        sum.iter_mut().zip(row).for_each(|(s, r)| *s += r);
        sum
    })
}

/// Light from a region of the sphere: its power and its mean direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beam {
    /// Power ∫ L dω, linear RGB.
    pub power: DVec3,
    /// First moment ∫ Y·d dω, with Y the luminance of L and d the direction.
    pub first: DVec3,
}

impl std::ops::AddAssign for Beam {
    fn add_assign(&mut self, other: Beam) {
        self.power += other.power;
        self.first += other.first;
    }
}

/// Luminance of linear RGB with the primaries of Rec. 709 (ITU-R BT.709).
pub fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Map at a coarse resolution.
#[derive(Debug)]
pub struct Cells {
    /// Number of columns and rows of cells.
    pub size: [usize; 2],
    /// Number of columns and rows of the map.
    pub texels: [usize; 2],
    /// Light of each cell, row by row from the top.
    pub beams: Vec<Beam>,
}

impl Cells {
    /// Sums the texels of a map into cells. Each texel belongs to one cell.
    pub fn new(map: &Map) -> Cells {
        let (width, height) = (map.width as usize, map.height as usize);
        let size = [CELLS[0].min(width), CELLS[1].min(height)];
        let columns = columns(width);
        let mut beams = vec![Beam::default(); size[0] * size[1]];
        beams.par_chunks_exact_mut(size[0]).enumerate().for_each(|(y, cells)| {
            // Rows j of texels with ⌊j·cells/texels⌋ = y.
            for j in (y * height).div_ceil(size[1])..((y + 1) * height).div_ceil(size[1]) {
                let row = row(j, height);
                for (i, texel) in map.texels[j * width..][..width].iter().enumerate() {
                    let [one, sin, cos, ..] = columns[i];
                    let radiance = rgb(texel);
                    let direction = DVec3::new(row.r * sin, row.y * one, -row.r * cos);
                    cells[i * size[0] / width] +=
                        Beam { power: radiance * (row.one * one), first: direction * luminance(radiance) };
                }
            }
        });
        Cells { size, texels: [width, height], beams }
    }
}
