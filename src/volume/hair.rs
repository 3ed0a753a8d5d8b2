//! §2 Builder of long hair: strands along y, from the root to the tip.
//!
//! Long hair lies along the skin instead of standing on it. So it fills a volume as water does, and its
//! strands are the spatial fractal curves of the paper. Neighbours gather in locks on their way to the tip,
//! and a lock waves as one. The strands of a lock end at lengths of their own, which makes a tip pointed and
//! a hem ragged.

use glam::{Vec2, Vec3};
use rand::{Rng, RngExt};

use super::VolumeTexture;
use super::spots::Spots;
use super::threads::{Look, Thread, Threads, cells_of_threads};
use crate::curve::{CurveShape, levels_for, spatial_fractal_curve};
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::util::random::{Family, Stream, normal};

/// Largest depth of recursion of a strand's curve.
const MOST_LEVELS: u32 = 16;
/// Share of the flow length over which a strand rises from the skin to its place in the depth.
const RISE: f32 = 0.06;
/// Relative standard deviation of the amplitude of waves from lock to lock.
const SPREAD_OF_WAVES: f32 = 0.3;

/// Recipe of long hair. Equal recipes build equal bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairSpec {
    /// nx, ny, nz, cells.
    pub size: [u32; 3],
    /// Number of strands on a copy of the volume.
    pub strands: u32,
    /// Mean way from root to tip along y, flow lengths ny.
    pub reach: f32,
    /// Relative standard deviation of the reach.
    pub spread: f32,
    /// Diameter at the root, cells.
    pub width_cells: f32,
    /// Share of the diameter that is lost up to the tip.
    pub thinning: f32,
    /// Number of locks.
    pub locks: u32,
    /// Share of the way to the middle of its lock that the tip of a strand is drawn.
    pub gathering: f32,
    /// Share of the strands that belong to no lock.
    pub stray: f32,
    /// Amplitude of a lock's waves across the flow, cells; half of it in the depth.
    pub wave_cells: f32,
    /// Number of waves along the flow length.
    pub waves: f32,
    /// Roughness h of the strands' bend.
    pub h: f32,
    /// Standard deviation of the bend, cells.
    pub amplitude_cells: f32,
    /// Seed of all randomness in the volume.
    pub seed: u64,
    /// Scale α of the density, kept beside the cells and not in them.
    pub alpha: f32,
    /// k_d.
    pub k_d: f32,
    /// Relative standard deviation of k_d from strand to strand.
    pub shade: f32,
    /// k_s of all cells. `None`: each cell has its place on a ramp of colours there, the way from root to
    /// tip.
    pub k_s: Option<f32>,
}

/// A lock of hair.
struct Lock {
    /// Place of its middle in x and z, cells.
    middle: Vec2,
    /// Amplitude of its waves, cells.
    wave: f32,
    /// Phase of its waves, turns.
    phase: f32,
    /// Factor of the number of its waves.
    pace: f32,
}

impl HairSpec {
    /// Builds the volume texture in dense storage.
    ///
    /// # Errors
    /// Returns an error if `monitor` ends the work.
    pub fn build(&self, monitor: &dyn Monitor) -> Result<VolumeTexture> {
        let cells = cells_of_threads(self.size, self.threads(), self.k_s, monitor)?;
        Ok(VolumeTexture { size: self.size, alpha: self.alpha, cells })
    }

    /// The strands.
    pub(super) fn threads(&self) -> Threads<impl Fn(usize, &mut Thread) + Sync> {
        let face = Vec2::new(self.size[0] as f32, self.size[2] as f32);
        let places = Spots { size: face, count: self.strands, wraps: false };
        let spots = Spots { size: face, count: self.locks, wraps: false };
        let family = Family::new(self.seed, Stream::Bundle);
        let locks: Vec<Lock> = (0..self.locks)
            .map(|i| {
                let rng = &mut family.member(u64::from(i));
                Lock {
                    middle: spots.at(i, rng),
                    wave: self.wave_cells * (1.0 + SPREAD_OF_WAVES * normal(rng)),
                    phase: rng.random(),
                    pace: 1.0 + 0.5 * SPREAD_OF_WAVES * normal(rng),
                }
            })
            .collect();
        let middles: Vec<Vec2> = locks.iter().map(|lock| lock.middle).collect();
        let draw = move |strand: usize, thread: &mut Thread| {
            let mut rng = Family::new(self.seed, Stream::Hair).member(strand as u64);
            let place = places.at(strand as u32, &mut rng);
            let nearest = spots.nearest(&middles, place);
            let away = nearest.map_or(Vec2::ZERO, |(_, away)| away);
            self.strand(place, nearest.map(|(lock, _)| &locks[lock]), away, &mut rng, thread);
        };
        Threads { count: self.strands as usize, draw }
    }

    /// Writes the strand at a place in x and z, `away` cells from the middle of its lock.
    fn strand(&self, place: Vec2, lock: Option<&Lock>, away: Vec2, rng: &mut impl Rng, thread: &mut Thread) {
        let [ny, nz] = [self.size[1] as f32, self.size[2] as f32];
        let reach = (self.reach * (1.0 + self.spread * normal(rng))).clamp(0.0, 1.0);
        let k_d = self.k_d * (1.0 + self.shade * normal(rng)).max(0.0);
        let is_stray = rng.random::<f32>() < self.stray;
        let lock = lock.filter(|_| !is_stray);
        if reach <= 0.0 {
            return;
        }
        let shape = CurveShape {
            h: self.h,
            sigma_g_cells: self.amplitude_cells,
            levels: levels_for(self.size[1]).min(MOST_LEVELS),
        };
        spatial_fractal_curve(&shape, Vec3::ZERO, Vec3::Y * ny, rng, &mut thread.points);
        let steps = thread.points.len() - 1;
        let last = ((steps as f32 * reach).ceil() as usize).clamp(1, steps);
        thread.points.truncate(last + 1);
        for (i, point) in thread.points.iter_mut().enumerate() {
            let along = i as f32 / steps as f32;
            let way = i as f32 / last as f32;
            let mut at = place + Vec2::new(point.x, point.z);
            if let Some(lock) = lock {
                let drawn = 1.0 - (1.0 - way) * (1.0 - way);
                let (sin, cos) =
                    ((lock.phase + self.waves * lock.pace * along) * std::f32::consts::TAU).sin_cos();
                // Waves begin at the root, where hair lies flat.
                let wave = Vec2::new(sin, 0.5 * cos) * (lock.wave * (along / RISE).min(1.0));
                at += away * (self.gathering * drawn) + wave;
            }
            let risen = smooth((along / RISE).min(1.0));
            let z = nz + (at.y - nz) * risen;
            *point = Vec3::new(at.x, point.y, z);
            thread.looks.push(Look {
                width: self.width_cells * (1.0 - self.thinning * way),
                place: way,
                k_d,
            });
        }
    }
}

/// Rises smoothly from 0 to 1.
fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}
