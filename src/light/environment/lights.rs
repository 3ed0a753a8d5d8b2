//! Directional lights that approximate a map in the volume, where visibility is walked for each light.
//!
//! The map is cut into rectangles. Each cut is the one that most reduces the variance of direction, weighted
//! by power (Viriyothai and Debevec 2009, "Variance Minimization Light Probe Sampling"; the median cut of
//! Debevec 2005 cuts into equal powers instead). A rectangle becomes one light with all its power, in the
//! direction of the power's centroid.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::moments::{Beam, Cells, luminance};

/// Minimum variance that a cut must remove, as a share of the map's power: the square of a tenth of a texel
/// of the finest map.
const LEAST_GAIN: f64 = 1e-9;

/// Number of normals at which the error is measured.
const NORMALS: usize = 128;
/// Number of columns and rows of cells with which the error is measured. Cells that a normal's horizon cuts
/// change the error by 2e-4 of the mean.
const COARSE: [usize; 2] = [128, 64];

/// Lights that approximate a map without rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSet {
    /// Unit direction towards each light, and the light's irradiance ∫ L dω (linear RGB) on a surface that
    /// faces it.
    pub lights: Vec<(DVec3, DVec3)>,
}

/// Rectangle of cells, as a half-open range of columns and rows.
#[derive(Clone, Copy, Debug)]
struct Region {
    from: [usize; 2],
    to: [usize; 2],
}

/// Region with the best cut through it.
struct Candidate {
    region: Region,
    /// Variance that the cut removes.
    gain: f64,
    halves: [Region; 2],
}

/// Summed-area table of luminous power and its first moments: sums over all cells above and to the left.
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

    /// Variance Σ w·|d − mean|² = w − |Σ w·d|²/w of unit directions d in a region.
    fn variance(&self, Region { from, to }: Region) -> f64 {
        let at = |x: usize, y: usize| &self.sums[y * self.stride + x];
        let [a, b, c, d] = [at(to[0], to[1]), at(from[0], to[1]), at(to[0], from[1]), at(from[0], from[1])];
        let [w, x, y, z] = [0, 1, 2, 3].map(|k| a[k] - b[k] - c[k] + d[k]);
        if w <= 0.0 { 0.0 } else { (w - (x * x + y * y + z * z) / w).max(0.0) }
    }

    /// Finds the cut through a region that removes the most variance.
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
    /// At most `count` lights for a map; fewer if further cuts gain nothing, and none in black regions. Their
    /// irradiances add up to the map's ∫ L dω.
    pub fn new(cells: &Cells, count: u32) -> LightSet {
        let table = Table::new(cells);
        let whole = Region { from: [0, 0], to: cells.size };
        let least = table.sums.last().map_or(0.0, |all| all[0]) * LEAST_GAIN;
        let mut regions = vec![table.candidate(whole)];
        while regions.len() < count as usize {
            // The first of equal regions is cut, so that one map always gives one set.
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
        // The beams are summed from the cells, because differences of the table's sums would lose the digits
        // of faint regions.
        let lights = regions.iter().map(|r| beam(cells, r.region)).filter(|b| luminance(b.power) > 0.0);
        let lights = lights.map(|b| {
            // Uniform light has only a direction of rounding errors, so it is taken to come from above.
            let directed = b.first.length() > 1e-9 * luminance(b.power);
            (if directed { b.first.normalize() } else { DVec3::Y }, b.power)
        });
        let lights = lights.collect();
        LightSet { lights }
    }

    /// Error of the lights' irradiance: the root mean square of its difference to the map's, in luminance,
    /// over normals spread evenly over the sphere, relative to the map's mean irradiance. It is 0 for a black
    /// map.
    pub fn error(&self, cells: &Cells) -> f64 {
        let irradiance = |n: DVec3| {
            self.lights.iter().map(|(to, power)| luminance(*power) * n.dot(*to).max(0.0)).sum::<f64>()
        };
        error_of(cells, irradiance)
    }
}

/// Error, as in [`LightSet::error`], of any function that approximates the map's irradiance E(n) in
/// luminance.
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
            // The map's irradiance is exact except for cells that the horizon of n cuts.
            [firsts.iter().map(|first| first.dot(n).max(0.0)).sum(), irradiance(n)]
        })
        .collect();
    let mean = pairs.iter().map(|[e, _]| e).sum::<f64>() / NORMALS as f64;
    let square = pairs.iter().map(|[e, other]| (e - other).powi(2)).sum::<f64>() / NORMALS as f64;
    if mean > 0.0 { square.sqrt() / mean } else { 0.0 }
}

/// Unit vector i of a golden-angle spiral that covers the sphere with equal areas.
fn normal(i: usize) -> DVec3 {
    let y = 1.0 - (2 * i + 1) as f64 / NORMALS as f64;
    let (sin, cos) = (i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt())).sin_cos();
    let r = (1.0 - y * y).sqrt();
    DVec3::new(r * sin, y, r * cos)
}

/// Sum of the beams in a region.
fn beam(cells: &Cells, Region { from, to }: Region) -> Beam {
    let mut sum = Beam::default();
    for y in from[1]..to[1] {
        cells.beams[y * cells.size[0]..][from[0]..to[0]].iter().for_each(|b| sum += *b);
    }
    sum
}

/// Rotates a direction by `turn` turns about +y, from +z towards +x.
pub fn turned(d: DVec3, turn: f64) -> Vec3 {
    let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
    DVec3::new(d.x * cos + d.z * sin, d.y, d.z * cos - d.x * sin).as_vec3()
}
