//! Directional lights that stand for a map where every light is walked to: the volume.
//!
//! The map is cut into rectangles, each time where the cut takes most of the variance of direction in them,
//! weighted by power (Viriyothai and Debevec 2009, "Variance Minimization Light Probe Sampling"; the median
//! cut of Debevec 2005 cuts into equal powers instead). A rectangle becomes one light with all its power from
//! its power's centroid.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::moments::{Beam, Cells, luminance};

/// Variance that is not worth a cut, of the map's power: a tenth of a texel of the finest map, squared.
const LEAST_GAIN: f64 = 1e-9;

/// Normals that the error is measured on.
const NORMALS: usize = 128;
/// Cells that it is measured with, columns and rows: those that a horizon cuts change it by 2e-4 of the mean.
const COARSE: [usize; 2] = [128, 64];

/// The lights of an unturned map.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSet {
    /// Unit direction towards each light, and its irradiance ∫ L dω on a surface that faces it.
    pub lights: Vec<(DVec3, DVec3)>,
}

/// A rectangle of cells: columns and rows, half open.
#[derive(Clone, Copy, Debug)]
struct Region {
    from: [usize; 2],
    to: [usize; 2],
}

/// A region with the best cut through it.
struct Candidate {
    region: Region,
    /// Variance that the cut takes away.
    gain: f64,
    halves: [Region; 2],
}

/// Sums over all cells above and to the left: luminous power, and its first moments.
struct Table {
    stride: usize,
    sums: Vec<[f64; 4]>,
}

impl Table {
    fn new(cells: &Cells) -> Table {
        let [columns, rows] = cells.size;
        let stride = columns + 1;
        let mut sums = vec![[0.0; 4]; stride * (rows + 1)];
        for y in 0..rows {
            let mut row = [0.0; 4];
            for x in 0..columns {
                let Beam { power, first } = cells.beams[y * columns + x];
                let more = [luminance(power), first.x, first.y, first.z];
                for k in 0..4 {
                    row[k] += more[k];
                    sums[(y + 1) * stride + x + 1][k] = sums[y * stride + x + 1][k] + row[k];
                }
            }
        }
        Table { stride, sums }
    }

    /// Σ w·|d − mean|² = w − |Σ w·d|²/w, for |d| = 1.
    fn variance(&self, Region { from, to }: Region) -> f64 {
        let at = |x: usize, y: usize| &self.sums[y * self.stride + x];
        let [a, b, c, d] = [at(to[0], to[1]), at(from[0], to[1]), at(to[0], from[1]), at(from[0], from[1])];
        let [w, x, y, z] = [0, 1, 2, 3].map(|k| a[k] - b[k] - c[k] + d[k]);
        if w <= 0.0 { 0.0 } else { (w - (x * x + y * y + z * z) / w).max(0.0) }
    }

    fn candidate(&self, region: Region) -> Candidate {
        let whole = self.variance(region);
        let mut best = Candidate { region, gain: 0.0, halves: [region; 2] };
        for axis in [0, 1] {
            for cut in region.from[axis] + 1..region.to[axis] {
                let (mut first, mut second) = (region, region);
                first.to[axis] = cut;
                second.from[axis] = cut;
                let gain = whole - self.variance(first) - self.variance(second);
                if gain > best.gain {
                    best = Candidate { gain, halves: [first, second], ..best };
                }
            }
        }
        best
    }
}

impl LightSet {
    /// At most `count` lights for a map; fewer where more would gain nothing, none where no light comes from.
    /// Their irradiances sum up to the map's ∫ L dω.
    pub fn new(cells: &Cells, count: u32) -> LightSet {
        let table = Table::new(cells);
        let whole = Region { from: [0, 0], to: cells.size };
        let least = table.sums.last().map_or(0.0, |all| all[0]) * LEAST_GAIN;
        let mut regions = vec![table.candidate(whole)];
        while regions.len() < count as usize {
            // The first of equals: one map, one set.
            let mut best = 0;
            for (i, region) in regions.iter().enumerate() {
                if region.gain > regions[best].gain {
                    best = i;
                }
            }
            if regions[best].gain <= least {
                break;
            }
            let [first, second] = regions[best].halves;
            regions[best] = table.candidate(first);
            regions.push(table.candidate(second));
        }
        // Of the cells again: differences of the table's sums would lose the digits of faint regions.
        let lights = regions.iter().map(|r| beam(cells, r.region)).filter(|b| luminance(b.power) > 0.0);
        let lights = lights.map(|b| {
            // Light from everywhere alike has no direction but that of its rounding: it comes from above.
            let directed = b.first.length() > 1e-9 * luminance(b.power);
            (if directed { b.first.normalize() } else { DVec3::Y }, b.power)
        });
        let lights = lights.collect();
        LightSet { lights }
    }

    /// How far the irradiance of the lights is from that of the map: the root of the mean square over normals
    /// spread evenly over the sphere, in luminance, relative to the map's mean irradiance. 0 for a black map.
    pub fn error(&self, cells: &Cells) -> f64 {
        let of_lights = |n: DVec3| {
            self.lights.iter().map(|(to, power)| luminance(*power) * n.dot(*to).max(0.0)).sum::<f64>()
        };
        error_of(cells, of_lights)
    }
}

/// As [`LightSet::error`], for any other stand-in: E(n) in luminance.
pub fn error_of(cells: &Cells, irradiance: impl Fn(DVec3) -> f64 + Sync) -> f64 {
    let [columns, rows] = cells.size;
    let step = [columns.div_ceil(COARSE[0]), rows.div_ceil(COARSE[1])];
    let coarse_columns = columns.div_ceil(step[0]);
    let mut firsts = vec![DVec3::ZERO; coarse_columns * rows.div_ceil(step[1])];
    for (i, beam) in cells.beams.iter().enumerate() {
        firsts[i / columns / step[1] * coarse_columns + i % columns / step[0]] += beam.first;
    }
    let pairs: Vec<[f64; 2]> = (0..NORMALS)
        .into_par_iter()
        .map(|i| {
            let n = normal(i);
            // Exact but for cells that the horizon of n cuts.
            [firsts.iter().map(|first| first.dot(n).max(0.0)).sum(), irradiance(n)]
        })
        .collect();
    let mean = pairs.iter().map(|[e, _]| e).sum::<f64>() / NORMALS as f64;
    let square = pairs.iter().map(|[e, other]| (e - other).powi(2)).sum::<f64>() / NORMALS as f64;
    if mean > 0.0 { square.sqrt() / mean } else { 0.0 }
}

/// Point i of a spiral with equal areas and the golden angle.
fn normal(i: usize) -> DVec3 {
    let y = 1.0 - (2 * i + 1) as f64 / NORMALS as f64;
    let (sin, cos) = (i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt())).sin_cos();
    let r = (1.0 - y * y).sqrt();
    DVec3::new(r * sin, y, r * cos)
}

fn beam(cells: &Cells, Region { from, to }: Region) -> Beam {
    let mut sum = Beam::default();
    for y in from[1]..to[1] {
        cells.beams[y * cells.size[0]..][from[0]..to[0]].iter().for_each(|b| sum += *b);
    }
    sum
}

/// A direction turned by `turn` (1: once round) about +y, from +z towards +x.
pub fn turned(d: DVec3, turn: f64) -> Vec3 {
    let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
    DVec3::new(d.x * cos + d.z * sin, d.y, d.z * cos - d.x * sin).as_vec3()
}
