//! The patch of a rock before it is raised, and the fields on it.

use glam::{Vec2, Vec2Swizzles, Vec3};

use super::field::displace;
use super::{MAX_LEVELS, Rock, StoneKind};

/// Roughness that the displacement within the patch of a kind of stone has in addition, because fine
/// displacement would fold the mesh over itself.
const SMOOTHER: f32 = 0.35;
/// Share of that displacement that is left in the patch's middle.
const MIDDLE: f32 = 0.5;
/// Smallest area of a displaced square, relative to the square before.
const LEAST_AREA: f32 = 0.1;
/// One square of so many may be folded before its surroundings are smoothed, and the most passes of that.
const FEW: usize = 25;
const MOST_PASSES: usize = 300;

/// Makes the sides of a dome steeper, the more the rounder its outline is.
pub fn steeper(dome: f32, round: f32) -> f32 {
    if round > 0.0 { dome.max(0.0).powf(1.0 - 0.4 * round) } else { dome }
}

impl Rock {
    /// Returns a fractal field on the points of the patch; see [`displace`].
    ///
    /// On the patch of a kind of stone, forms are as wide as they are high: a patch longer than wide has a
    /// part of a square field of the longer side. On that of plain rock they are stretched with the patch.
    pub(super) fn field(&self, channel: u64, h: f32) -> Vec<f32> {
        let sides = self.sides();
        let ratio = sides.max_element() / sides.min_element().max(1e-6);
        if self.kind == StoneKind::Plain || ratio < 1.2 {
            return displace(self.levels, h, self.seed, channel);
        }
        // Finer points along the longer side keep the detail along the shorter one.
        let finer = (ratio.log2().ceil() as u32).min(MAX_LEVELS - self.levels).min(2);
        let whole = displace(self.levels + finer, h, self.seed, channel);
        let (side, wide) = ((1usize << self.levels) + 1, (1usize << (self.levels + finer)) + 1);
        let step = (1u32 << finer) as f32 * (sides / sides.max_element());
        let at = |x: usize, y: usize| whole[y.min(wide - 1) * wide + x.min(wide - 1)];
        let point = |i: usize| {
            let place = Vec2::new((i % side) as f32, (i / side) as f32) * step;
            let (low, f) = (place.floor(), place.fract());
            let (x, y) = (low.x as usize, low.y as usize);
            let near = at(x, y) + (at(x + 1, y) - at(x, y)) * f.x;
            let far = at(x, y + 1) + (at(x + 1, y + 1) - at(x, y + 1)) * f.x;
            near + (far - near) * f.y
        };
        (0..side * side).map(point).collect()
    }

    /// Returns the mean lengths of the sides along u and along v, metres.
    fn sides(&self) -> Vec2 {
        let [a, b, c, d] = self.corners;
        Vec2::new(a.distance(b) + d.distance(c), a.distance(d) + b.distance(c)) * 0.5
    }

    /// Returns the longer side of a square of the mesh, metres.
    pub(super) fn square(&self) -> f32 {
        self.sides().max_element() / (1u32 << self.levels) as f32
    }

    /// Returns the points of the patch, with its ragged border.
    pub(super) fn base(&self) -> Vec<Vec3> {
        let [a, b, c, d] = self.corners;
        let n = 1usize << self.levels;
        let side = n + 1;
        let uv = |i: usize| Vec2::new((i % side) as f32 / n as f32, (i / side) as f32 / n as f32);
        let flat = |i: usize| {
            let Vec2 { x: u, y: v } = self.rounded(uv(i));
            a.lerp(b, u).lerp(d.lerp(c, u), v)
        };
        let mut base: Vec<Vec3> = (0..side * side).map(flat).collect();
        if self.border == 0.0 {
            return base;
        }
        let along = (b - a + c - d).normalize_or_zero();
        let across = self.out().cross(along);
        if self.kind == StoneKind::Plain {
            let fields = self.field(3, self.h).into_iter().zip(self.field(4, self.h));
            for (p, (x, y)) in base.iter_mut().zip(fields) {
                *p += (along * x + across * y) * self.border;
            }
            return base;
        }
        let h = self.h + SMOOTHER;
        let fields = self.field(3, h).into_iter().zip(self.field(4, h)).enumerate();
        let moves = fields.map(|(i, (x, y))| {
            let from_edge = uv(i).min(Vec2::ONE - uv(i)).min_element();
            let share = 1.0 - (1.0 - MIDDLE) * (4.0 * from_edge).min(1.0);
            (along * x + across * y) * (self.border * share)
        });
        let mut moves: Vec<Vec3> = moves.collect();
        self.unfold(&base, &mut moves);
        for (p, by) in base.iter_mut().zip(moves) {
            *p += by;
        }
        base
    }

    /// Lessens a displacement where it would turn squares of the patch over: everywhere until few are left,
    /// then by the mean around each of those.
    fn unfold(&self, base: &[Vec3], moves: &mut [Vec3]) {
        let side = (1usize << self.levels) + 1;
        let out = self.out();
        let area = |moves: &[Vec3], i: usize| {
            let at = |i: usize| base[i] + moves[i];
            let (right, up) = (at(i + 1) - at(i), at(i + side) - at(i));
            let (left, down) = (at(i + side) - at(i + side + 1), at(i + 1) - at(i + side + 1));
            right.cross(up).dot(out).min(left.cross(down).dot(out))
        };
        let squares: Vec<usize> = (0..side * (side - 1)).filter(|i| i % side + 1 < side).collect();
        let still = vec![Vec3::ZERO; moves.len()];
        let least: Vec<f32> = squares.iter().map(|&i| LEAST_AREA * area(&still, i)).collect();
        let folded = |moves: &[Vec3]| -> Vec<usize> {
            let all = squares.iter().zip(&least);
            all.filter(|&(&i, &least)| area(moves, i) < least).map(|(&i, _)| i).collect()
        };
        while folded(moves).len() > squares.len() / FEW {
            moves.iter_mut().for_each(|by| *by *= 0.9);
        }
        for _ in 0..MOST_PASSES {
            let found = folded(moves);
            if found.is_empty() {
                return;
            }
            let before = moves.to_vec();
            for i in found {
                let (x, y) = (i % side, i / side);
                for (x, y) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
                    let columns = x.saturating_sub(1)..(x + 2).min(side);
                    let rows = y.saturating_sub(1)..(y + 2).min(side);
                    let around = rows.flat_map(|y| columns.clone().map(move |x| y * side + x));
                    let (sum, count) =
                        around.fold((Vec3::ZERO, 0.0), |(sum, count), i| (sum + before[i], count + 1.0));
                    // A little less than the mean, so that wide folds go too.
                    moves[y * side + x] = sum * (0.995 / count);
                }
            }
        }
    }

    /// Moves a point of the unit square towards the ellipse that fits into it, by the map that takes lines
    /// along its sides to arcs of ellipses (Fong 2015, "Analytical Methods for Squaring the Disc").
    fn rounded(&self, uv: Vec2) -> Vec2 {
        if self.round == 0.0 {
            return uv;
        }
        let p = uv * 2.0 - 1.0;
        let disc = p * (Vec2::ONE - p.yx() * p.yx() * 0.5).map(f32::sqrt);
        (p.lerp(disc, self.round) + 1.0) * 0.5
    }
}
