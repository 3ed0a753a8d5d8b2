//! Beds of rock. They have uneven heights, are broken by joints into blocks that step back or stand out, have
//! ledges between them, and contain thinner beds.

use glam::{DVec3, Vec3};
use rand::RngExt;

use super::{Rock, StoneKind};
use crate::util::random::{Family, Stream};

/// Share of a block's side over which it blends into its neighbour. A smaller share makes steps finer than
/// the mesh can show.
const JOINT: f32 = 0.2;
/// Mean length of a block, in bed heights.
const LENGTH: f32 = 3.1;
/// Largest offset of the bounds of beds and blocks from even spacing. Below ½ the bounds keep their order.
const UNEVEN: f32 = 0.44;
/// Number of thinner beds in each bed, and the size of their steps relative to those of the bed.
const THIN: (f32, f32) = (3.3, 0.3);

/// Mean height of a group of beds of a kind of stone, in mean bed heights, and the numbers of beds that a
/// group may have.
const GROUP: f32 = 3.0;
const COUNTS: [f32; 6] = [1.0, 1.0, 2.0, 3.0, 5.0, 9.0];
/// Mean width of a broken column, in bed heights, and how much higher or lower it stands at most.
const COLUMN: f64 = 1.7;
const BROKEN: f32 = 0.22;
/// Height of a ledge, in squares of the mesh.
const LEDGE: f32 = 2.5;

/// The beds of one rock.
pub struct Strata {
    /// Unit vector across the beds.
    up: Vec3,
    /// Unit vector along the beds and along the patch.
    along: Vec3,
    /// Mean height of a bed, metres.
    height: f32,
    family: Family,
    /// Beds and blocks between the world's origin and that of the scene, across and along, for each octave.
    before: [[Lattice; 2]; 2],
    /// Groups of beds and columns before the scene's origin, of a kind of stone.
    uneven: Option<[Lattice; 2]>,
    /// Height over which a bed of a kind of stone blends into the next, in bed heights.
    ledge: f32,
}

/// A number that is too large for float32: whole cells, and the rest, 0 to 1.
#[derive(Clone, Copy)]
struct Lattice {
    cells: i64,
    rest: f32,
}

impl Lattice {
    fn new(x: f64) -> Lattice {
        Lattice { cells: x.floor() as i64, rest: (x - x.floor()) as f32 }
    }
}

/// The place of a point in the beds of a kind of stone.
struct UnevenBed {
    /// Number of the bed.
    number: i64,
    /// Height of the point in the bed, 0 to 1.
    f: f32,
    /// Height of the bed, in mean heights.
    thickness: f32,
    /// Upper bound of the bed, in groups.
    top: f32,
}

/// Properties of a bed at a point.
pub struct Bed {
    /// Distance by which the rock stands out, in bed heights; the mean is about 0.
    pub out: f32,
    /// Brightness of the bed, −1 to 1.
    pub tone: f32,
}

impl Strata {
    /// Makes the beds of a rock. Beds are fixed to the world; `origin` is the place from which points are
    /// measured.
    pub fn new(rock: &Rock, origin: DVec3) -> Strata {
        let (up, along) = rock.bed_axes();
        let beds = |axis: Vec3| origin.dot(axis.as_dvec3()) / f64::from(rock.strata_height);
        let octave = |thin: f64| {
            let (s, t) = (beds(up) * thin, beds(along) * thin / f64::from(LENGTH));
            [Lattice::new(s), Lattice::new(t)]
        };
        let groups = || [Lattice::new(beds(up) / f64::from(GROUP)), Lattice::new(beds(along) / COLUMN)];
        Strata {
            uneven: (rock.kind != StoneKind::Plain).then(groups),
            ledge: (LEDGE * rock.square() / rock.strata_height).min(0.4),
            up,
            along,
            height: rock.strata_height,
            before: [octave(1.0), octave(f64::from(THIN.0))],
            family: Family::new(rock.seed, Stream::Stratum),
        }
    }

    /// Returns the bed at a point. Its bounds bend by `bend` bed heights there.
    pub fn at(&self, point: Vec3, bend: f32) -> Bed {
        let (s, t) = (point.dot(self.up) / self.height + bend, point.dot(self.along) / self.height + bend);
        let thick = match self.uneven {
            None => self.octave(s, t, 0),
            Some([groups, columns]) => self.uneven_bed(s, t, groups, columns),
        };
        let thin = self.octave(s * THIN.0, t * THIN.0, 1);
        Bed { out: thick.out + THIN.1 * thin.out, tone: 0.7 * thick.tone + 0.3 * thin.tone }
    }

    /// Returns a random number of block `j` in bed `i`, −1 to 1.
    fn random(&self, octave: i64, i: i64, j: i64) -> f32 {
        let index = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(2 * j as u64 + octave as u64);
        self.family.member(index).random_range(-1.0..1.0)
    }

    /// Returns the bed at a point of a kind of stone. It blends into the bed above it over the width of a
    /// ledge, because a mesh would show a step as teeth.
    fn uneven_bed(&self, s: f32, t: f32, groups: Lattice, columns: Lattice) -> Bed {
        let at = (s + BROKEN * self.broken(t, columns)) / GROUP + groups.rest;
        let found = self.find(groups, at);
        let bed = self.bed(&found, t);
        let to_top = (found.top - at) * GROUP;
        if to_top >= self.ledge {
            return bed;
        }
        let next = self.find(groups, found.top + 1e-4);
        let above = self.bed(&UnevenBed { f: 0.0, ..next }, t);
        Bed { out: bed.out + (above.out - bed.out) * (1.0 - step(to_top / self.ledge)), tone: bed.tone }
    }

    /// Returns how far the broken column at `t` stands out of its place, −1 to 1.
    fn broken(&self, t: f32, columns: Lattice) -> f32 {
        const COLUMN_AT: i64 = 1 << 42;
        const RISE: i64 = COLUMN_AT + 1;
        let t = t / COLUMN as f32 + columns.rest;
        let random = |i: i64, j: i64| self.random(0, columns.cells + i, j);
        let (column, left, right) = cell(t, |i| random(i, COLUMN_AT));
        let x = (t - left) / (right - left);
        let (own, next) = (random(column, RISE), random(column + 1, RISE));
        own + (next - own) * step((x - 0.8) / 0.2)
    }

    /// Finds the bed at a height among groups of beds, in groups. Groups are split into one to nine beds, so
    /// that beds are thick in one place and thin in another.
    fn find(&self, groups: Lattice, at: f32) -> UnevenBed {
        const COUNT: i64 = (1 << 42) + 2;
        const BOUND: i64 = COUNT + 1;
        const INNER: i64 = COUNT + 2;
        let (group, low, high) = cell(at, |i| self.random(0, groups.cells + i, BOUND));
        let number = groups.cells + group;
        let pick = (0.5 + 0.5 * self.random(0, number, COUNT)) * COUNTS.len() as f32;
        let count = COUNTS[(pick as usize).min(COUNTS.len() - 1)];
        let height = (high - low) / count;
        let own = number * 16;
        let bound = |k: i64| {
            // The group's own bounds are not moved.
            let is_inside = k > 0 && (k as f32) < count;
            if is_inside { UNEVEN * self.random(0, own + k, INNER) } else { 0.0 }
        };
        let (k, first, last) = cell((at - low) / height, bound);
        UnevenBed {
            number: own + k,
            f: ((at - low) / height - first) / (last - first),
            thickness: (last - first) * height * GROUP,
            top: low + last * height,
        }
    }

    /// Returns a bed of a kind of stone at `t` along it.
    fn bed(&self, found: &UnevenBed, t: f32) -> Bed {
        let UnevenBed { number: i, f, thickness, .. } = *found;
        const FACE: i64 = 1 << 43;
        const TONE: i64 = FACE + 1;
        const SHIFT: i64 = FACE + 2;
        let random = |j: i64| self.random(1, i, j);
        let along = self.before[0][1];
        // Thick beds break into long blocks.
        let blocks = t / (LENGTH * (0.4 + 0.6 * thickness)) + 8.0 * random(SHIFT) + along.rest;
        let (j, left, right) = cell(blocks, |j| random(FACE + 8 + 2 * (along.cells + j)));
        let block = |j: i64| 0.5 * random(FACE + 9 + 2 * (along.cells + j));
        let own = block(j);
        let width = 0.5 * JOINT;
        let (near_left, near_right) =
            (1.0 - step((blocks - left) / width), 1.0 - step((right - blocks) / width));
        let stands = own + (block(j - 1) - own) * 0.5 * near_left + (block(j + 1) - own) * 0.5 * near_right;
        let face = 0.5 * random(FACE) + 0.35 * f - 0.15;
        // Edges are as wide in thick beds as in thin ones.
        let edge = (JOINT / thickness.max(0.3)).min(0.5);
        let rounding = 0.3 * (1.0 - step(f / edge)) + 0.3 * (1.0 - step((1.0 - f) / edge));
        // Thin beds stand out less.
        let size = thickness.sqrt().min(1.3);
        Bed { out: (stands + face - rounding) * size, tone: random(TONE) }
    }

    /// Returns the bed at a point of one octave. Beds have height 1; the point lies at `s` across and `t`
    /// along them, measured from the scene's origin.
    fn octave(&self, s: f32, t: f32, octave: i64) -> Bed {
        let [across, along] = self.before[octave as usize];
        let s = s + across.rest;
        const BOUND: i64 = 1 << 40;
        const FACE: i64 = BOUND + 1;
        const TONE: i64 = BOUND + 2;
        const SHIFT: i64 = BOUND + 3;
        let random = |i: i64, j| self.random(octave, across.cells + i, j);
        let (i, low, high) = cell(s, |i| random(i, BOUND));
        let f = (s - low) / (high - low);
        // Each bed has its own joints: none runs through several beds.
        let t = t / LENGTH + along.rest + 8.0 * random(i, SHIFT);
        let (j, left, right) = cell(t, |j| random(i, BOUND + 8 + 2 * (along.cells + j)));
        let block = |j: i64| 0.5 * random(i, BOUND + 9 + 2 * (along.cells + j));
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

/// Returns the cell that contains `x`, and its bounds. Bounds differ from whole numbers by random amounts.
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

/// Smoothstep from 0 at x = 0 to 1 at x = 1.
fn step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
