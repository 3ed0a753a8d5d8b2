//! §2 Builder of fur: hairs that stand on the skin, z = nz, and end above it.
//!
//! Fur is what texels were invented for (Kajiya and Kay 1989). Two kinds of hair make it read as fur: few
//! long guard hairs, and the short, dense undercoat between them. Neighbours gather in clumps, which gives
//! a coat its texture from afar. The spatial fractal curves of the paper bend each hair.

use glam::{Vec2, Vec3};
use rand::{Rng, RngExt};

use super::VolumeTexture;
use super::spots::Spots;
use super::threads::{Look, Thread, Threads, cells_of_threads};
use crate::curve::{CurveShape, levels_for, spatial_fractal_curve};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream, normal};

/// Largest depth of recursion of a hair's curve.
const MOST_LEVELS: u32 = 16;
/// Share of the lean that hairs of the undercoat have.
const LEAN_OF_UNDERCOAT: f32 = 0.5;

/// Recipe of fur. Equal recipes build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FurSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Number of hairs on a copy of the volume.
    pub hairs: u32,
    /// Mean length of guard hairs, depths nz.
    pub length: f32,
    /// Relative standard deviation of the lengths.
    pub spread: f32,
    /// Diameter at the root, cells.
    pub width_cells: f32,
    /// Share of the diameter that is lost up to the tip.
    pub taper: f32,
    /// Share of the hairs that are undercoat.
    pub undercoat: f32,
    /// Length of the undercoat relative to guard hairs.
    pub undercoat_length: f32,
    /// Distance by which a tip leans down the flow, lengths of the hair.
    pub lean: f32,
    /// Roughness h of the hairs' bend.
    pub h: f32,
    /// Standard deviation of the bend, lengths of the hair.
    pub amplitude: f32,
    /// Number of clumps.
    pub clumps: u32,
    /// Share of the way to the middle of its clump that a tip is drawn.
    pub clumping: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d.
    pub k_d: f32,
    /// Relative standard deviation of k_d from hair to hair.
    pub shade: f32,
    /// k_s of all cells. `None`: each cell has its place on a ramp of colours there, 0 for the undercoat, and
    /// for guard hairs the way from root to tip.
    pub k_s: Option<f32>,
}

impl FurSpec {
    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let cells = cells_of_threads(self.size, self.threads(), self.k_s, monitor)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells })
    }

    /// The hairs.
    pub(super) fn threads(&self) -> Threads<impl Fn(usize, &mut Thread) + Sync> {
        let roots = Spots { size: self.face(), count: self.hairs, wraps: true };
        let clumps = Spots { size: self.face(), count: self.clumps, wraps: true };
        let family = Family::new(self.seed, Stream::Bundle);
        let middles: Vec<Vec2> =
            (0..self.clumps).map(|i| clumps.at(i, &mut family.member(u64::from(i)))).collect();
        let draw = move |hair: usize, thread: &mut Thread| {
            let mut rng = Family::new(self.seed, Stream::Hair).member(hair as u64);
            let root = roots.at(hair as u32, &mut rng);
            let away = clumps.nearest(&middles, root).map_or(Vec2::ZERO, |(_, way)| way * self.clumping);
            self.hair(root, away, &mut rng, thread);
        };
        Threads { count: self.hairs as usize, draw }
    }

    /// nx and ny.
    fn face(&self) -> Vec2 {
        Vec2::new(self.size[0] as f32, self.size[1] as f32)
    }

    /// Writes the hair on a root. Its tip is drawn by `away`, cells.
    fn hair(&self, root: Vec2, away: Vec2, rng: &mut impl Rng, thread: &mut Thread) {
        let nz = self.size[2] as f32;
        let is_under = rng.random::<f32>() < self.undercoat;
        let share = if is_under { self.undercoat_length } else { 1.0 };
        let length = (self.length * share * (1.0 + self.spread * normal(rng))).clamp(0.0, 1.0) * nz;
        let k_d = self.k_d * (1.0 + self.shade * normal(rng)).max(0.0);
        if length <= 0.0 {
            return;
        }
        // A fractal curve returns to its line at its end. A tip is free, so the hair is the first half of a
        // curve twice as long.
        let shape = CurveShape {
            h: self.h,
            sigma_g_cells: self.amplitude * length,
            levels: levels_for((2.0 * length).ceil() as u32).min(MOST_LEVELS),
        };
        spatial_fractal_curve(&shape, Vec3::ZERO, Vec3::Y * (2.0 * length), rng, &mut thread.points);
        let steps = thread.points.len() / 2;
        thread.points.truncate(steps + 1);
        let lean = self.lean * if is_under { LEAN_OF_UNDERCOAT } else { 1.0 } * length;
        for (i, point) in thread.points.iter_mut().enumerate() {
            let way = i as f32 / steps as f32;
            let at = root + Vec2::new(point.x, point.z) + (away + Vec2::Y * lean) * (way * way);
            *point = at.extend(nz - point.y);
            thread.looks.push(Look {
                width: self.width_cells * (1.0 - self.taper * way),
                place: if is_under { 0.0 } else { way },
                k_d,
            });
        }
    }
}
