//! NURBS curves of USD, made into rows of straight pieces.

use glam::{Vec3, Vec4};

use super::curves::{pieces_for, split};

/// A NURBS curve: its degree plus one, knots, and points with their widths and weights.
pub(super) struct Nurbs<'a> {
    pub order: usize,
    /// As many as points, and `order` more.
    pub knots: &'a [f64],
    pub points: &'a [Vec4],
    /// None for weights of 1.
    pub weights: Option<&'a [f64]>,
}

impl Nurbs<'_> {
    /// Whether the numbers fit together, and the knots do not fall.
    pub fn is_whole(&self) -> bool {
        let fits = self.order >= 2 && self.points.len() >= self.order;
        let rises =
            self.knots.windows(2).all(|pair| pair[0] <= pair[1]) && self.knots.iter().all(|k| k.is_finite());
        let weighs =
            self.weights.is_none_or(|own| own.len() == self.points.len() && own.iter().all(|w| *w > 0.0));
        fits && rises && weighs && self.knots.len() == self.points.len() + self.order
    }

    /// Points and diameters along the curve. Empty where all knots are equal.
    pub fn strand(&self, deviation: f32) -> Vec<(Vec3, f32)> {
        let (first, last) = (self.order - 1, self.points.len());
        let bend = self.points.windows(3).map(|p| (p[0] - 2.0 * p[1] + p[2]).length()).fold(0.0, f32::max);
        let pieces = if self.order == 2 { 1 } else { pieces_for(bend, deviation) };
        let spans: Vec<usize> = (first..last).filter(|i| self.knots[*i] < self.knots[i + 1]).collect();
        let inner = spans.iter().flat_map(|span| {
            let [from, to] = [self.knots[*span], self.knots[span + 1]];
            (1..=pieces).map(move |piece| self.at(*span, from + (to - from) * piece as f64 / pieces as f64))
        });
        let start = spans.first().map(|span| self.at(*span, self.knots[*span]));
        start.into_iter().chain(inner).map(split).collect()
    }

    /// Point in a span of knots (de Boor's algorithm on points times weights).
    fn at(&self, span: usize, t: f64) -> Vec4 {
        let degree = self.order - 1;
        let weight = |i: usize| self.weights.map_or(1.0, |weights| weights[i]);
        let mut row: Vec<_> =
            (span - degree..=span).map(|i| (self.points[i].as_dvec4() * weight(i), weight(i))).collect();
        for level in 1..=degree {
            for j in (level..=degree).rev() {
                let i = span - degree + j;
                let [from, to] = [self.knots[i], self.knots[i + self.order - level]];
                let share = if to > from { (t - from) / (to - from) } else { 0.0 };
                let before = row[j - 1];
                row[j].0 = before.0 + (row[j].0 - before.0) * share;
                row[j].1 = before.1 + (row[j].1 - before.1) * share;
            }
        }
        (row[degree].0 / row[degree].1).as_vec4()
    }
}
