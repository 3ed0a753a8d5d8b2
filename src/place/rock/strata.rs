//! Layers of rock: beds of uneven height, broken by joints into blocks that step back or stand out, with
//! ledges where one bed ends and the next begins; in each bed thinner ones.

use glam::Vec3;
use rand::RngExt;

use super::Rock;
use crate::util::random::{Family, Stream};

/// Share of a block's side over which it meets its neighbour: less makes steps finer than a mesh can show.
const JOINT: f32 = 0.2;
/// A block's mean length in bed heights.
const LENGTH: f32 = 3.1;
/// How far the bounds of beds and blocks lie off the even spacing; below ½ they keep their order.
const UNEVEN: f32 = 0.44;
/// Thinner beds in each bed, and how far they step relative to it.
const THIN: (f32, f32) = (3.3, 0.3);

/// The beds of one rock.
pub struct Strata {
    /// Unit, across the beds.
    up: Vec3,
    /// Unit, along them and along the patch.
    along: Vec3,
    height: f32,
    family: Family,
}

/// What a point of a bed has.
pub struct Bed {
    /// How far the rock stands out, in bed heights; the mean is about 0.
    pub out: f32,
    /// The bed's own brightness, −1 to 1.
    pub tone: f32,
}

impl Strata {
    /// The beds of a rock whose patch faces `out`.
    pub fn new(rock: &Rock, out: Vec3) -> Strata {
        let level = Vec3::Y.cross(out).normalize_or(Vec3::X);
        let (sin, cos) = rock.strata_tilt.to_radians().sin_cos();
        Strata {
            up: Vec3::Y * cos + level * sin,
            along: level * cos - Vec3::Y * sin,
            height: rock.strata_height,
            family: Family::new(rock.seed, Stream::Stratum),
        }
    }

    /// The bed at a point, whose bounds bend by `bend` bed heights there.
    pub fn at(&self, point: Vec3, bend: f32) -> Bed {
        let (s, t) = (point.dot(self.up) / self.height + bend, point.dot(self.along) / self.height + bend);
        let thick = self.octave(s, t, 0);
        let thin = self.octave(s * THIN.0, t * THIN.0, 1);
        Bed { out: thick.out + THIN.1 * thin.out, tone: 0.7 * thick.tone + 0.3 * thin.tone }
    }

    /// −1 to 1, of block `j` in bed `i`.
    fn random(&self, octave: i64, i: i64, j: i64) -> f32 {
        let index = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(2 * j as u64 + octave as u64);
        self.family.member(index).random_range(-1.0..1.0)
    }

    /// Beds of height 1, `s` across and `t` along.
    fn octave(&self, s: f32, t: f32, octave: i64) -> Bed {
        const BOUND: i64 = 1 << 40;
        const FACE: i64 = BOUND + 1;
        const TONE: i64 = BOUND + 2;
        const SHIFT: i64 = BOUND + 3;
        let random = |i, j| self.random(octave, i, j);
        let (i, low, high) = cell(s, |i| random(i, BOUND));
        let f = (s - low) / (high - low);
        // Joints do not go through: each bed has its own.
        let t = t / LENGTH + 8.0 * random(i, SHIFT);
        let (j, left, right) = cell(t, |j| random(i, BOUND + 8 + 2 * j));
        let block = |j: i64| 0.5 * random(i, BOUND + 9 + 2 * j);
        let own = block(j);
        // Half of each joint's width lies in either block.
        let width = 0.5 * JOINT;
        let (near_left, near_right) = (1.0 - step((t - left) / width), 1.0 - step((right - t) / width));
        let stands = own + (block(j - 1) - own) * 0.5 * near_left + (block(j + 1) - own) * 0.5 * near_right;
        // A bed weathers back at its foot, and its upper edge is rounded.
        let face = 0.5 * random(i, FACE) + 0.35 * f - 0.15;
        let edge = 0.3 * (1.0 - step(f / JOINT)) + 0.3 * (1.0 - step((1.0 - f) / JOINT));
        Bed { out: stands + face - edge, tone: random(i, TONE) }
    }
}

/// The cell that holds `x`, and its bounds, which lie off whole numbers by random amounts.
fn cell(x: f32, random: impl Fn(i64) -> f32) -> (i64, f32, f32) {
    let bound = |i: i64| i as f32 + UNEVEN * random(i);
    let mut i = x.floor() as i64;
    let (mut low, mut high) = (bound(i), bound(i + 1));
    if x < low {
        (i, high) = (i - 1, low);
        low = bound(i);
    } else if x >= high {
        (i, low) = (i + 1, high);
        high = bound(i + 1);
    }
    (i, low, high)
}

fn step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
