//! Exact solution of a column: the equation of Schwarzschild and Milne for a slab of layers, each with an
//! extinction and an albedo of its own, in float64.
//!
//! ```text
//! J(τ) = J_source(τ) + ½ ∫ (E₁(|τ − t|) + K(τ + t)) ω(t) J(t) dt + ½ L·B(τ)
//! ```
//!
//! K(x) = ∫ R(μ) e^(−x/μ) dμ/μ is light that the outer surface throws back, with Fresnel's reflectance R from
//! inside. L is the radiance of a diffuse surface below, and B(τ) = E₂(X − τ) + ∫ R e^(−(X + τ)/μ) dμ what
//! arrives of it. As in [`slab`](super::super::slab), Galerkin's method solves for functions that are
//! constant in each of many sublayers, and the double integrals of E₁ are differences of E₃. All integrals
//! of R share one quadrature, so energy is conserved up to rounding.

use super::pieces::Piece;
use super::{Below, ShellMatter, from_inside};
use crate::light::scatter::doubling::gauss;
use crate::light::scatter::slab::exponential_integrals;

/// Rows of a light's cosine μ with the normal: row i has μ = (i/(ROWS − 1))².
pub const ROWS: usize = 16;

/// Optical depth of a sublayer at a surface, its growth with the distance from there, and its maximum. See
/// the constants of [`slab`](super::super::slab).
const THINNEST: f64 = 0.02;
const GROWTH: f64 = 0.2;
const THICKEST: f64 = 0.25;
/// Maximum number of sublayers of the maximum depth; deeper columns have deeper ones.
const MOST: f64 = 120.0;

/// Least optical depth of a sublayer, so that layers without matter have a J too.
const LEAST: f64 = 1e-6;

/// Optical depth of the core's matter that is solved for. Below it, the rest of the core is a diffuse
/// surface with the albedo of a half-space.
const CORE: f64 = 6.0;

/// Weights with which J is fitted by straight lines between the values, besides the share of light that
/// leaves from there: per optical depth and per share of the thickness. They keep values from which no light
/// leaves close to J. With a tenth of them, values swing where the layers are deep.
const BY_DEPTH: f64 = 0.1;
const BY_LENGTH: f64 = 1e-4;
/// Largest value over the largest mean of a sublayer: J at a surface is a little more than near it.
const BEYOND_MEANS: f64 = 1.05;

/// One colour of a column.
pub struct Column {
    /// Sublayers, those of the core last.
    parts: Vec<Part>,
    /// Optical depths of their ends.
    ends: Vec<f64>,
    /// Factors of the matrix, row by row; its last row is that of L.
    matrix: Vec<f64>,
    /// B of each sublayer, integrated over it.
    seen: Vec<f64>,
    /// Albedo of the diffuse surface below.
    albedo_below: f64,
    /// Cosines, weights and R of the quadrature.
    inside: Vec<[f64; 3]>,
    /// Number of sublayers in the shell.
    own: usize,
    /// Number of intervals between values of J.
    layers: usize,
    eta: f64,
    is_open: bool,
}

/// A sublayer.
struct Part {
    /// Depth of its middle, 0 to 1, and its share of the thickness.
    middle: f64,
    length: f64,
    /// Optical depth and albedo.
    depth: f64,
    albedo: f64,
}

/// Light that shines on a column.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// A light of intensity 1 whose direction has the cosine `mu` > 0 with the outward normal, or the inward
    /// one (`from_below`), without what the surface throws back. Its share grows from the first number at the
    /// outer surface to the second at the inner one.
    Beam { mu: f64, from_below: bool, shares: [f64; 2] },
    /// Radiance 1 from everywhere.
    Everywhere,
}

/// Cosine of a row.
pub fn cosine_of_row(row: usize) -> f64 {
    (row as f64 / (ROWS - 1) as f64).powi(2)
}

impl Column {
    /// Column of colour `c`, `thickness` metres long, with values of J between `layers` intervals.
    pub fn new(matter: &ShellMatter, pieces: &[Piece], layers: usize, c: usize, thickness: f64) -> Column {
        let [mut parts, core] = [own_parts(matter, pieces, c, thickness), core_parts(matter, c)];
        let own = parts.len();
        parts.extend(core);
        let mut ends = vec![0.0];
        parts.iter().for_each(|part| ends.push(ends[ends.len() - 1] + part.depth));
        let deepest = matter.albedo.last().map_or(0.0, |albedo| f64::from(albedo[c]));
        let albedo_below = match matter.below {
            Below::Open => 0.0,
            Below::Opaque { albedo } => f64::from(albedo[c]),
            Below::Core if parts.len() > own => half_space(deepest),
            Below::Core => 0.0,
        };
        let mut column = Column {
            parts,
            ends,
            matrix: Vec::new(),
            seen: Vec::new(),
            albedo_below,
            inside: quadrature(matter.eta),
            own,
            layers,
            eta: matter.eta.into(),
            is_open: matter.below == Below::Open,
        };
        column.fill();
        column.factor();
        column
    }

    /// Optical depth down to the end.
    fn total(&self) -> f64 {
        self.ends[self.parts.len()]
    }

    /// ∫ f(μ) R μ (e^(−a/μ) − e^(−b/μ)) dμ over the ends a and b of a sublayer.
    fn thrown_back(&self, i: usize, f: impl Fn(f64) -> f64) -> f64 {
        let [a, b] = [self.ends[i], self.ends[i + 1]];
        let term =
            |&[mu, weight, r]: &[f64; 3]| weight * r * mu * ((-a / mu).exp() - (-b / mu).exp()) * f(mu);
        self.inside.iter().map(term).sum()
    }

    /// Fills the matrix.
    fn fill(&mut self) {
        let n = self.parts.len();
        let e3 = |t: f64| if t > 40.0 { 0.0 } else { exponential_integrals(t)[2] };
        let mut at = vec![0.5; (n + 1) * (n + 1)];
        for p in 0..=n {
            for q in p + 1..=n {
                at[p * (n + 1) + q] = e3(self.ends[q] - self.ends[p]);
            }
        }
        let e3 = |p: usize, q: usize| at[p * (n + 1) + q];
        let x = self.total();
        self.seen =
            (0..n).map(|i| e3(i + 1, n) - e3(i, n) + self.thrown_back(i, |mu| (-x / mu).exp())).collect();
        // e^(−a/μ) − e^(−b/μ) for each cosine and sublayer.
        let steps: Vec<Vec<f64>> = self
            .inside
            .iter()
            .map(|[mu, ..]| self.ends.windows(2).map(|e| (-e[0] / mu).exp() - (-e[1] / mu).exp()).collect())
            .collect();
        let mut matrix = vec![0.0; (n + 1) * (n + 1)];
        for i in 0..n {
            for j in i..n {
                let direct = match i == j {
                    true => 2.0 * self.parts[i].depth - 1.0 + 2.0 * e3(i, i + 1),
                    false => e3(i + 1, j) - e3(i, j) - e3(i + 1, j + 1) + e3(i, j + 1),
                };
                let back: f64 = self
                    .inside
                    .iter()
                    .zip(&steps)
                    .map(|([mu, weight, r], step)| weight * r * mu * step[i] * step[j])
                    .sum();
                for (i, j) in [(i, j), (j, i)] {
                    matrix[i * (n + 1) + j] = -0.5 * self.parts[j].albedo * (direct + back);
                }
            }
            matrix[i * (n + 1) + i] += self.parts[i].depth;
            matrix[i * (n + 1) + n] = -0.5 * self.seen[i];
        }
        for j in 0..n {
            matrix[n * (n + 1) + j] = -2.0 * self.albedo_below * self.parts[j].albedo * self.seen[j];
        }
        let again: f64 =
            self.inside.iter().map(|[mu, weight, r]| weight * r * mu * (-2.0 * x / mu).exp()).sum();
        matrix[n * (n + 1) + n] = 1.0 - 2.0 * self.albedo_below * again;
        self.matrix = matrix;
    }

    /// Factors the matrix. Its diagonal dominates, so there is no pivoting; where no light is lost at all,
    /// the last pivot vanishes.
    fn factor(&mut self) {
        let n = self.parts.len() + 1;
        for k in 0..n {
            let (above, below) = self.matrix.split_at_mut((k + 1) * n);
            let pivot_row = &mut above[k * n..];
            pivot_row[k] = pivot_row[k].max(1e-12);
            for row in below.chunks_exact_mut(n) {
                let factor = row[k] / pivot_row[k];
                row[k] = factor;
                if factor != 0.0 {
                    row[k + 1..].iter_mut().zip(&pivot_row[k + 1..]).for_each(|(a, b)| *a -= factor * b);
                }
            }
        }
    }

    /// J that comes straight from a source, integrated over each sublayer; and for the surface below, the
    /// radiance with which it throws that back.
    fn straight(&self, source: Source) -> Vec<f64> {
        let n = self.parts.len();
        let x = self.total();
        match source {
            Source::Beam { mu, from_below, shares } => {
                let mu = if from_below { mu } else { refracted(self.eta, mu) };
                if mu <= 0.0 {
                    return vec![0.0; n + 1];
                }
                let passed = |depth: f64| (-(if from_below { x - depth } else { depth }) / mu).exp();
                let share = |middle: f64| shares[0] + (shares[1] - shares[0]) * middle.min(1.0);
                let of = |i: usize| {
                    let step = (passed(self.ends[i]) - passed(self.ends[i + 1])).abs();
                    0.25 * mu * step * share(self.parts[i].middle)
                };
                let below = if from_below { 0.0 } else { self.albedo_below * mu * passed(x) * shares[1] };
                (0..n).map(of).chain([below]).collect()
            }
            Source::Everywhere => {
                let e3 = |t: f64| if t > 40.0 { 0.0 } else { exponential_integrals(t)[2] };
                let eta2 = self.eta * self.eta;
                let of = |i: usize| {
                    let above = e3(self.ends[i]) - e3(self.ends[i + 1]) - self.thrown_back(i, |_| 1.0);
                    0.5 * (eta2 * above + if self.is_open { self.seen[i] } else { 0.0 })
                };
                let lost: f64 = self.inside.iter().map(|[mu, w, r]| w * r * mu * (-x / mu).exp()).sum();
                let below = 2.0 * self.albedo_below * eta2 * (e3(x) - lost);
                (0..n).map(of).chain([below]).collect()
            }
        }
    }

    /// Values of J between the intervals, the beam's own part left out.
    pub fn values(&self, source: Source) -> Vec<f64> {
        let straight = self.straight(source);
        let solved = self.solved(straight.clone());
        let without = if matches!(source, Source::Beam { .. }) { 1.0 } else { 0.0 };
        let means: Vec<f64> = (0..self.own)
            .map(|i| (solved[i] - without * straight[i] / self.parts[i].depth).max(0.0))
            .collect();
        self.fitted(&means)
    }

    fn solved(&self, mut rows: Vec<f64>) -> Vec<f64> {
        let n = rows.len();
        for i in 0..n {
            let sum: f64 = self.matrix[i * n..][..i].iter().zip(&rows).map(|(a, b)| a * b).sum();
            rows[i] -= sum;
        }
        for i in (0..n).rev() {
            let row = &self.matrix[i * n..][..n];
            let sum: f64 = row[i + 1..].iter().zip(&rows[i + 1..]).map(|(a, b)| a * b).sum();
            rows[i] = (rows[i] - sum) / row[i];
        }
        rows
    }

    /// Values between which straight lines fit the sublayers' means best. Those at the ends are then moved
    /// so that the flux out of the shell is right although J is bent between two values. An end in empty
    /// layers has no say in the flux, so no value is moved out of the range of J.
    fn fitted(&self, means: &[f64]) -> Vec<f64> {
        let e3 = |t: f64| if t > 40.0 { 0.0 } else { exponential_integrals(t)[2] };
        let own = self.ends[self.own];
        let (mut diagonal, mut beside) = (vec![0.0; self.layers + 1], vec![0.0; self.layers]);
        let mut values = vec![0.0; self.layers + 1];
        // The value above each sublayer, the share of the one below, and what leaves through both surfaces.
        let mut places = Vec::with_capacity(means.len());
        for (i, (part, mean)) in self.parts.iter().zip(means).enumerate() {
            let [a, b] = [self.ends[i], self.ends[i + 1]];
            let below = if self.is_open { e3(own - b) - e3(own - a) } else { 0.0 };
            let leaves = [e3(a) - e3(b), below].map(|share| part.albedo * share);
            let weight = leaves[0] + leaves[1] + BY_DEPTH * part.depth + BY_LENGTH * part.length;
            let at = part.middle * self.layers as f64;
            let first = (at as usize).min(self.layers - 1);
            let share = at - first as f64;
            diagonal[first] += weight * (1.0 - share) * (1.0 - share);
            diagonal[first + 1] += weight * share * share;
            beside[first] += weight * share * (1.0 - share);
            values[first] += weight * (1.0 - share) * mean;
            values[first + 1] += weight * share * mean;
            places.push((first, share, leaves));
        }
        for i in 1..values.len() {
            let factor = beside[i - 1] / diagonal[i - 1];
            diagonal[i] -= factor * beside[i - 1];
            values[i] -= factor * values[i - 1];
        }
        for i in (0..values.len()).rev() {
            let below = if i + 1 < values.len() { beside[i] * values[i + 1] } else { 0.0 };
            values[i] = (values[i] - below) / diagonal[i];
        }
        for (end, own) in [0, self.layers].into_iter().enumerate() {
            let (mut missing, mut seen) = (0.0, 0.0);
            for ((first, share, leaves), mean) in places.iter().zip(means) {
                let line = values[*first] * (1.0 - share) + values[first + 1] * share;
                missing += leaves[end] * (mean - line);
                seen += leaves[end]
                    * if own == *first {
                        1.0 - share
                    } else if own == first + 1 {
                        *share
                    } else {
                        0.0
                    };
            }
            if seen > 0.0 {
                values[own] += missing / seen;
            }
        }
        let largest = means.iter().copied().fold(0.0, f64::max) * BEYOND_MEANS;
        values.iter_mut().for_each(|value| *value = value.clamp(0.0, largest));
        values
    }
}

/// Cosine inside of a direction with the cosine `mu` outside.
fn refracted(eta: f64, mu: f64) -> f64 {
    (1.0 - (1.0 - mu * mu) / (eta * eta)).max(0.0).sqrt()
}

/// Sublayers of the shell.
fn own_parts(matter: &ShellMatter, pieces: &[Piece], c: usize, thickness: f64) -> Vec<Part> {
    let depth_of = |piece: &Piece| {
        let length = f64::from(piece.ends[1]) - f64::from(piece.ends[0]);
        f64::from(matter.extinction[piece.layer][c]) * length * thickness
    };
    let total: f64 = pieces.iter().map(depth_of).sum();
    let thickest = THICKEST.max(total / MOST);
    // Light leaves a core only above.
    let to_end = |above: f64| if matter.below == Below::Core { f64::INFINITY } else { total - above };
    let mut parts = Vec::new();
    let mut above = 0.0;
    for piece in pieces {
        let depth = depth_of(piece);
        let albedo = f64::from(matter.albedo[piece.layer][c]);
        let [start, end] = piece.ends.map(f64::from);
        let (mut done, from) = (0.0, above);
        while done < depth || done == 0.0 {
            let near = (from + done).min(to_end(from + done));
            let mut own = (THINNEST + GROWTH * near.max(0.0)).min(thickest);
            // A sublayer ends at the end of its piece; what would be left of it is shared by two.
            if depth - done < 2.0 * own {
                own = if depth - done <= own { depth - done } else { 0.5 * (depth - done) };
            }
            let share = |d: f64| if depth > 0.0 { d / depth } else { 1.0 };
            let length = (end - start) * share(own);
            let middle = start + (end - start) * if depth > 0.0 { (done + 0.5 * own) / depth } else { 0.5 };
            parts.push(Part { middle, length, depth: own.max(LEAST), albedo });
            done += own.max(LEAST);
        }
        above += depth;
    }
    parts
}

/// Sublayers of the core.
fn core_parts(matter: &ShellMatter, c: usize) -> Vec<Part> {
    let is_full = matter.extinction.last().is_some_and(|extinction| extinction[c] > 0.0);
    if matter.below != Below::Core || !is_full {
        return Vec::new();
    }
    let albedo = matter.albedo.last().map_or(0.0, |albedo| f64::from(albedo[c]));
    let count = (CORE / THICKEST) as usize;
    (0..count).map(|_| Part { middle: 1.0, length: 0.0, depth: THICKEST, albedo }).collect()
}

/// Albedo of a half-space for light from everywhere (van de Hulst 1980, within 0.002).
fn half_space(albedo: f64) -> f64 {
    let s = (1.0 - albedo).max(0.0).sqrt();
    (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
}

/// Cosines inside, their weights, and the reflectance of the surface from inside. All light is thrown back
/// below the critical cosine, where R has a kink; nodes are dense above it.
pub fn quadrature(eta: f32) -> Vec<[f64; 3]> {
    if eta <= 1.0 {
        return Vec::new();
    }
    let critical = (1.0 - 1.0 / f64::from(eta).powi(2)).sqrt();
    let (nodes, weights) = gauss(16);
    let below = nodes.iter().zip(&weights).map(|(x, w)| [critical * x, critical * w, 1.0]);
    let above = nodes.iter().zip(&weights).map(|(x, w)| {
        let mu = critical + (1.0 - critical) * x * x;
        [mu, (1.0 - critical) * 2.0 * x * w, from_inside(f64::from(eta), mu)]
    });
    below.chain(above).collect()
}
