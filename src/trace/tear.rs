//! §4 Torn water: holes that open in a falling sheet, grow into gaps between threads, and leave drops. Twins:
//! `shaders/trace/tear.wgsl`, and `src/engine/cpu/integrate/lockstep/tear.rs` for eight rays.
//!
//! A sheet that falls is stretched, so it grows thin, and thin water is torn by every disturbance (Dombrowski
//! and Johns 1963). The holes are places where noise is above a threshold. The noise lies in the volume, so
//! holes fall with the water and loops close. The water before a hole falls ahead of its neighbours in some
//! places and behind them in others, which gives masses their points.

use glam::Vec2;

use super::noise::lattice;
use crate::mapping::Tear;
use crate::util::powers::log2;

/// Finer and finer octaves: their cells in one of the coarsest, across and along, and their weights.
pub const OCTAVES: [(u32, u32, f32); 3] = [(1, 1, 1.0), (2, 2, 0.6), (4, 3, 0.36)];
/// Octaves by which threads run ahead, which vary across the sheet alone: the same numbers, in rows.
pub const LEADS: [(u32, f32); 2] = [(2, 1.5), (4, 0.75)];
/// Reciprocal of the noise's standard deviation, which is √(0.5518/12) for one octave, times the root of the
/// sum of the weights' squares.
pub const INVERSE_DEVIATION: f32 = 3.8215;
/// Share of the sheet between the border of a hole, where erosion begins, and where nothing is left.
pub const SOFT: f32 = 0.6;
/// Levels of a pyramid from where the finest octave is lost to where all are.
pub const LEVELS: f32 = 2.0;

/// Value noise at `p` in cells of a lattice that repeats after `period` cells, 0 to 1.
#[inline]
fn noise(p: Vec2, period: [u32; 2], octave: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (Vec2::splat(3.0) - f * 2.0);
    let [x, y] = [cell.x as u32 % period[0], cell.y as u32 % period[1]];
    let x1 = (x + 1) % period[0];
    let row = |y: u32| {
        let near = lattice(x, y, octave);
        near + (lattice(x1, y, octave) - near) * s.x
    };
    let near = row(y);
    near + (row((y + 1) % period[1]) - near) * s.y
}

/// Rank of a place among all of its volume's, 0 to 1; `place` is in copies of the volume, 0 to 1. Noise is
/// nearly normal; the polynomial is within 0.015 of the normal distribution.
#[inline]
fn rank(lattice: [u32; 2], place: Vec2) -> f32 {
    let [columns, rows] = lattice;
    let x = place.x * columns as f32;
    let mut y = place.y * rows as f32;
    for (octave, (finer, ahead)) in LEADS.iter().enumerate() {
        let at = Vec2::new(x * *finer as f32, 0.0);
        y += ahead * noise(at, [columns * finer, 1], 8 + octave as u32);
    }
    let mut sum = 0.0;
    for (octave, (across, along, weight)) in OCTAVES.iter().enumerate() {
        let at = Vec2::new(x * *across as f32, y * *along as f32);
        sum += weight * (noise(at, [columns * across, rows * along], octave as u32) - 0.5);
    }
    let u = (0.5 + sum * (0.2 * INVERSE_DEVIATION)).clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// Mean erosion of a sheet of which the share `open` is torn.
#[inline]
pub fn mean(open: f32) -> f32 {
    if open < SOFT { open * open / (2.0 * SOFT) } else { open - 0.5 * SOFT }
}

/// Erosion at `v` of a quad, 0 to 1. `place` is the place in the volume, in copies of it, 0 to 1; `level` is
/// the level of the pyramid whose cells a pixel sees, of a volume of `cells` cells across.
#[inline]
pub fn erosion(tear: &Tear, v: f32, place: Vec2, cells: f32, level: f32) -> f32 {
    let open = tear.open[0] + (tear.open[1] - tear.open[0]) * v;
    if open <= 0.0 {
        return 0.0;
    }
    let torn = ((rank(tear.lattice, place) - (1.0 - open)) * (1.0 / SOFT)).clamp(0.0, 1.0);
    // A pixel that sees whole holes sees their mean.
    let hole = log2(cells / tear.lattice[0] as f32);
    let unseen = (1.0 + (level - hole) * (1.0 / LEVELS)).clamp(0.0, 1.0);
    torn + (mean(open) - torn) * unseen
}
