//! Thumbnail of the environment.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

use glam::{DVec3, Vec3};

use super::{Environment, luminance, uv_of};
use crate::light::Light;

impl Environment {
    /// Mean radiance of the map at a resolution of `columns` × `rows`, row by row, with rotation and factor,
    /// without the sun's disc.
    ///
    /// The result is computed from the cells that lights are chosen from, so it takes the same few
    /// milliseconds for any map. A resolution above that of the cells adds no detail.
    pub fn overview(&self, columns: usize, rows: usize) -> Vec<Vec3> {
        let cells = &self.baked.cells;
        let [across, down] = cells.size;
        let factor = f64::from(self.intensity);
        let turn = (f64::from(self.turn) * across as f64).round() as usize;
        let heights: Vec<f64> = (0..down).map(|y| height(cells.texels[1], down, y)).collect();
        let widths: Vec<f64> = (0..across)
            .map(|x| TAU * texels(cells.texels[0], across, x).len() as f64 / cells.texels[0] as f64)
            .collect();
        let texel = |i: usize| {
            let (mut power, mut solid_angle) = (DVec3::ZERO, 0.0);
            for y in cells_of(down, rows, i / columns) {
                for x in cells_of(across, columns, i % columns) {
                    let x = (x + turn) % across;
                    power += cells.beams[y * across + x].power;
                    solid_angle += heights[y] * widths[x];
                }
            }
            (power * (factor / solid_angle)).as_vec3()
        };
        (0..columns * rows).map(texel).collect()
    }

    /// Position (u, v), each from 0 to 1, of the strongest light in [`Environment::overview`]: the sun, or
    /// else the strongest light that approximates the map.
    pub fn strongest(&self) -> Option<[f32; 2]> {
        let directional = |light: Light| match light {
            Light::Directional { to_light, intensity } => Some((luminance(intensity.as_dvec3()), to_light)),
            _ => None,
        };
        let sun = self.sunlight().and_then(directional);
        let map_lights = || self.volume_lights().into_iter().filter_map(directional);
        let strongest = sun.or_else(|| map_lights().max_by(|a, b| a.0.total_cmp(&b.0)));
        strongest.map(|(_, to_light)| uv_of(to_light, 0.0))
    }
}

/// Range of texels that cell `cell` of `cells` combines, along one axis.
fn texels(texels: usize, cells: usize, cell: usize) -> Range<usize> {
    (cell * texels).div_ceil(cells)..((cell + 1) * texels).div_ceil(cells)
}

/// Integral ∫ cos φ dφ over the rows of a cell.
fn height(map_rows: usize, cells: usize, cell: usize) -> f64 {
    let rows = texels(map_rows, cells, cell);
    let sine = |row: usize| (FRAC_PI_2 - PI * row as f64 / map_rows as f64).sin();
    sine(rows.start) - sine(rows.end)
}

/// Range of cells that texel `texel` of `texels` shows, along one axis; at least one cell.
fn cells_of(cells: usize, texels: usize, texel: usize) -> Range<usize> {
    let start = texel * cells / texels;
    start..((texel + 1) * cells / texels).max(start + 1)
}
