//! Curves of USD, made into rows of straight pieces.
//!
//! The bases and the ways to wrap are those of [UsdGeomBasisCurves](
//! https://openusd.org/release/api/class_usd_geom_basis_curves.html).

use glam::{Vec3, Vec4, Vec4Swizzles};

/// Straight pieces deviate from the curve by at most this part of the longest side of all curves. The finest
/// volume has 4096 cells on that side, so a bend is right to half a cell there.
pub(super) const DEVIATION: f32 = 1.0 / 8192.0;
/// Most straight pieces of a segment. Only loops with far handles need as many.
const MOST_PIECES: usize = 64;

/// Shape of the pieces between points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Basis {
    Linear,
    Bezier,
    CatmullRom,
    BSpline,
}

/// Ends of curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wrap {
    Nonperiodic,
    Periodic,
    Pinned,
}

/// Where the widths of curves stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    Constant,
    Uniform,
    Varying,
    Vertex,
}

impl Interpolation {
    /// All, the strongest first where several fit.
    pub const ALL: [Interpolation; 4] =
        [Interpolation::Vertex, Interpolation::Varying, Interpolation::Uniform, Interpolation::Constant];

    /// Number of widths of curves with these numbers of points.
    pub fn widths_of(self, shape: Shape, counts: &[usize]) -> usize {
        match self {
            Interpolation::Constant => 1,
            Interpolation::Uniform => counts.len(),
            Interpolation::Varying => counts.iter().map(|count| shape.knots(*count)).sum(),
            Interpolation::Vertex => counts.iter().sum(),
        }
    }
}

/// Basis and wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub basis: Basis,
    pub wrap: Wrap,
}

impl Shape {
    /// Segments of a curve of `points` points; 0 for one that is too short.
    pub fn segments(self, points: usize) -> usize {
        let is_periodic = self.wrap == Wrap::Periodic;
        match self.basis {
            Basis::Linear if is_periodic && points > 2 => points,
            Basis::Linear => points.saturating_sub(1),
            Basis::Bezier if is_periodic => points / 3,
            Basis::Bezier => points.saturating_sub(1) / 3,
            Basis::CatmullRom | Basis::BSpline if is_periodic && points > 2 => points,
            Basis::CatmullRom | Basis::BSpline if self.wrap == Wrap::Pinned => points.saturating_sub(1),
            Basis::CatmullRom | Basis::BSpline => points.saturating_sub(3),
        }
    }

    /// Whether a curve of `points` points has some behind its last segment, which shape nothing. Bézier
    /// segments have three points each, and curves that do not close one more.
    pub fn is_uneven(self, points: usize) -> bool {
        let ends = usize::from(self.wrap != Wrap::Periodic);
        self.basis == Basis::Bezier && self.segments(points) > 0 && !(points - ends).is_multiple_of(3)
    }

    /// Ends of segments, each once: the number of varying values.
    pub fn knots(self, points: usize) -> usize {
        match (self.segments(points), self.wrap) {
            (0, _) => 0,
            (segments, Wrap::Periodic) => segments,
            (segments, _) => segments + 1,
        }
    }

    /// Bézier points of a segment, with the width as fourth coordinate.
    fn segment(self, points: &[Vec4], number: usize) -> [Vec4; 4] {
        let count = points.len() as isize;
        let point = |at: isize| -> Vec4 {
            if self.wrap == Wrap::Periodic {
                return points[at.rem_euclid(count) as usize];
            }
            // Points beside the ends of pinned curves.
            match at {
                -1 => 2.0 * points[0] - points[1],
                at if at == count => 2.0 * points[at as usize - 1] - points[at as usize - 2],
                at => points[at as usize],
            }
        };
        let at = number as isize;
        let four = |first: isize| [0, 1, 2, 3].map(|i| point(first + i));
        let first = if self.wrap == Wrap::Pinned { at - 1 } else { at };
        match self.basis {
            Basis::Linear => {
                let [a, b] = [point(at), point(at + 1)];
                [a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b]
            }
            Basis::Bezier => four(3 * at),
            Basis::CatmullRom => {
                let [a, b, c, d] = four(first);
                [b, b + (c - a) / 6.0, c - (d - b) / 6.0, c]
            }
            Basis::BSpline => {
                let [a, b, c, d] = four(first);
                [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
            }
        }
    }

    /// Points and diameters along a curve that has a segment. `knots` are the widths at the ends of the
    /// segments; without them they are the fourth coordinates of the points.
    pub fn strand(self, points: &[Vec4], knots: Option<&[f32]>, deviation: f32) -> Vec<(Vec3, f32)> {
        let segments = self.segments(points.len());
        let with_knots = |number: usize| {
            let mut four = self.segment(points, number);
            if let Some(knots) = knots {
                let [from, to] = [knots[number], knots[(number + 1) % knots.len()]];
                four.iter_mut().zip(0..).for_each(|(p, i)| p.w = from + (to - from) * (i as f32 / 3.0));
            }
            four
        };
        // All segments have the same number of pieces: the place from root to tip goes by number.
        let pieces = (0..segments).map(|number| pieces(&with_knots(number), deviation)).max().unwrap_or(1);
        let first = with_knots(0)[0];
        let inner = (0..segments).flat_map(|number| {
            let four = with_knots(number);
            (1..=pieces).map(move |piece| bezier(&four, piece as f32 / pieces as f32))
        });
        std::iter::once(first).chain(inner).map(split).collect()
    }
}

/// Parts a point from its width. Curves of widths may fall below 0 between their points.
pub(super) fn split(point: Vec4) -> (Vec3, f32) {
    (point.xyz(), point.w.max(0.0))
}

/// Straight pieces that a segment needs (Wang, Ph.D. thesis, 1984: the second differences of the Bézier
/// points bound the deviation).
fn pieces([a, b, c, d]: &[Vec4; 4], deviation: f32) -> usize {
    let bend = (*a - 2.0 * *b + *c).length().max((*b - 2.0 * *c + *d).length());
    pieces_for(bend, deviation)
}

/// Pieces of a cubic segment whose second differences are `bend`.
pub(super) fn pieces_for(bend: f32, deviation: f32) -> usize {
    // 3 · 2 ÷ 8 for the degree 3. Rounding errors of straight curves are no bend.
    let pieces = (0.75 * bend / deviation.max(f32::MIN_POSITIVE)).sqrt().ceil();
    if pieces.is_finite() { (pieces as usize).clamp(1, MOST_PIECES) } else { MOST_PIECES }
}

/// Point of a Bézier segment, t from 0 to 1.
fn bezier(four: &[Vec4; 4], t: f32) -> Vec4 {
    // The ends are those of the file to the bit.
    if t >= 1.0 {
        return four[3];
    }
    let [a, b, c, d] = *four;
    let s = 1.0 - t;
    s * s * s * a + 3.0 * s * s * t * b + 3.0 * s * t * t * c + t * t * t * d
}
