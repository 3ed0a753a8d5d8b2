//! Light in columns of any length below a surface: values of J for every way in which light arrives.
//!
//! J is linear in the light that arrives. So columns are solved exactly for one light of each cosine, with a
//! share that is full at the outer and none at the inner surface, or the reverse. Values of the vertices lie
//! between those of the nearest lengths and cosines.

use glam::Vec3;
use rayon::prelude::*;

use super::column::{Column, ROWS, Source, cosine_of_row};
use super::pieces::Piece;
use super::{Below, ShellMatter};

/// Number of lengths where the thickness varies. They are denser near 0, as (i/(LENGTHS − 1))².
const LENGTHS: usize = 32;

/// Relative difference of thicknesses that counts as none.
const EVEN: f32 = 1e-3;

/// Shares at the outer and the inner surface for which columns are solved.
const SHARES: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

/// Values of J in columns.
pub struct Table {
    /// Length of the longest column, metres.
    longest: f32,
    /// Number of lengths: one where all columns are equally long.
    lengths: usize,
    /// Number of sources: of both shares in each row, from above and from below; and everywhere.
    sources: usize,
    /// Number of values of a column.
    count: usize,
    /// J, length by length, source by source.
    values: Vec<Vec3>,
}

impl Table {
    /// Solves columns of matter between the lengths `range`, metres.
    pub fn new(matter: &ShellMatter, pieces: &[Piece], layers: usize, range: [f32; 2]) -> Table {
        let [shortest, longest] = range;
        let lengths = if longest - shortest <= EVEN * longest { 1 } else { LENGTHS };
        let faces = if matter.below == Below::Open { 2 } else { 1 };
        let mut sources = Vec::new();
        for face in 0..faces {
            for row in 0..ROWS {
                let beam = |shares| Source::Beam { mu: cosine_of_row(row), from_below: face == 1, shares };
                sources.extend(SHARES.map(beam));
            }
        }
        sources.push(Source::Everywhere);
        let length = |i: usize| match lengths {
            1 => f64::from(0.5 * (shortest + longest)),
            _ => f64::from(longest) * (i as f64 / (LENGTHS - 1) as f64).powi(2),
        };
        let columns: Vec<Vec<f64>> = (0..3 * lengths)
            .into_par_iter()
            .map(|k| {
                let (i, c) = (k / 3, k % 3);
                let is_twin = |d: usize| {
                    let same = |list: &[Vec3]| list.iter().all(|value| value[c] == value[d]);
                    let below = match matter.below {
                        Below::Opaque { albedo } => albedo[c] == albedo[d],
                        _ => true,
                    };
                    below && same(&matter.extinction) && same(&matter.albedo)
                };
                // Equal colours share one solution.
                if (0..c).any(is_twin) {
                    return Vec::new();
                }
                let column = Column::new(matter, pieces, layers, c, length(i));
                sources.iter().flat_map(|source| column.values(*source)).collect()
            })
            .collect();
        let of = |i: usize, c: usize| -> &[f64] {
            (0..=c).rev().map(|d| &columns[3 * i + d]).find(|own| !own.is_empty()).map_or(&[], |own| own)
        };
        let count = layers + 1;
        let mut values = Vec::with_capacity(lengths * sources.len() * count);
        for i in 0..lengths {
            let [r, g, b] = [0, 1, 2].map(|c| of(i, c));
            values.extend((0..r.len()).map(|k| Vec3::new(r[k] as f32, g[k] as f32, b[k] as f32)));
        }
        Table { longest, lengths, sources: sources.len(), count, values }
    }

    /// The two lengths around a column's, and the share of the longer.
    fn around(&self, thickness: f32) -> [(usize, f32); 2] {
        if self.lengths == 1 {
            return [(0, 1.0), (0, 0.0)];
        }
        let at = (thickness / self.longest).clamp(0.0, 1.0).sqrt() * (LENGTHS - 1) as f32;
        let first = (at as usize).min(LENGTHS - 2);
        let share = at - first as f32;
        [(first, 1.0 - share), (first + 1, share)]
    }

    /// Adds a source's values times `factor`.
    fn add(&self, thickness: f32, source: usize, factor: Vec3, values: &mut [Vec3]) {
        for (length, share) in self.around(thickness) {
            if share > 0.0 {
                let own = &self.values[(length * self.sources + source) * self.count..][..self.count];
                values.iter_mut().zip(own).for_each(|(value, own)| *value += factor * *own * share);
            }
        }
    }

    /// Adds J of light from everywhere.
    pub fn add_ambient(&self, thickness: f32, ambient: Vec3, values: &mut [Vec3]) {
        if ambient != Vec3::ZERO {
            self.add(thickness, self.sources - 1, ambient, values);
        }
    }

    /// Adds J of a light of this intensity behind the surface, whose direction has the cosine `mu` with the
    /// outward normal. `shares` of it reach the outer and the inner surface.
    pub fn add_beam(&self, thickness: f32, mu: f32, intensity: Vec3, shares: [f32; 2], values: &mut [Vec3]) {
        let face = usize::from(mu < 0.0);
        let first = face * ROWS * SHARES.len();
        if mu == 0.0 || intensity == Vec3::ZERO || first + 1 >= self.sources {
            return;
        }
        let at = mu.abs().min(1.0).sqrt() * (ROWS - 1) as f32;
        let row = (at as usize).min(ROWS - 2);
        let far = at - row as f32;
        for (row, weight) in [(row, 1.0 - far), (row + 1, far)] {
            for (k, share) in shares.into_iter().enumerate() {
                let factor = intensity * (weight * share);
                if factor != Vec3::ZERO {
                    self.add(thickness, first + row * SHARES.len() + k, factor, values);
                }
            }
        }
    }
}
