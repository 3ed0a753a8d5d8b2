//! Splashes: water thrown up where it hits a ledge or a pool.
//!
//! Drops leave the line of impact with a fraction of their impact speed and fly along parabolas. Drag is
//! neglected: it is small for drops of millimetres at a few m/s. Neighbouring drops of a corona form a sheet,
//! so each parabola is the profile of a short [`Sheet`] across its own plane, whose borders are eroded to
//! single drops.

use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::{Ends, GRAVITY, Material, Sheet};
use crate::util::random::{Family, Stream};

/// Points of a parabola. A drop's position deviates by at most 0.6 ‰ of the arc's length, on the steepest
/// arc, which turns sharply at the top, by 2.5 ‰. Half as many points give 1.5 %.
const POINTS: usize = 17;
/// Launch speed of the slowest arc as a fraction of the largest.
const SLOWEST: f32 = 0.55;
/// Least and largest fraction of the flight, up and down again, after which an arc has thinned out to
/// nothing. Whole arcs would look like the jets of a fountain, and their fold at the top like a petal.
const LASTING: [f32; 2] = [0.35, 0.65];
/// Width at the start of an arc as a fraction of the width at its end.
const NARROWEST: f32 = 0.35;
/// Erosion of an arc: it emerges from the foot of the fall and thins out to single drops. With less `fade`
/// the arcs end in a row; with more, nothing is left at the top.
const ENDS: Ends = Ends { edge: 1.0, breakup: 0.3, fade: 0.7, head: 0.08 };
/// Steepest launch, degrees. A vertical parabola would not define a plane.
const STEEPEST: f32 = 87.0;

/// Parameters of a splash.
#[derive(Clone, Debug)]
pub struct Splash {
    /// Ends of the line of impact, metres; may be one point.
    pub line: [Vec3; 2],
    /// Height of the fall that ends here, metres.
    pub drop_m: f32,
    /// Launch speed of the fastest drops as a fraction of the impact speed.
    pub restitution: f32,
    /// Mean angle of the launch above the horizon, degrees.
    pub elevation: f32,
    /// Largest deviation from `elevation`, degrees.
    pub spread: f32,
    /// Horizontal unit direction of the middle of the fan.
    pub toward: Vec3,
    /// Angle of the fan on either side of `toward`, degrees.
    pub fan: f32,
    /// Number of arcs.
    pub count: u32,
    /// Quads along each arc.
    pub segments: u32,
    /// Mean width of an arc at its end, metres.
    pub width: f32,
    /// Seed of the arcs.
    pub seed: u64,
    /// Material of the arcs.
    pub material: Material,
    /// Mist of the material, as [`super::Quad::mist`].
    pub mist: f32,
}

impl Splash {
    /// Largest launch speed, m/s: the impact speed √(2 g h) times the restitution. The highest drop rises
    /// restitution²·h.
    pub fn speed(&self) -> f32 {
        self.restitution * (2.0 * GRAVITY as f32 * self.drop_m).sqrt()
    }

    /// Returns the arcs, spaced evenly along the line and around the fan, each jittered by up to half a step.
    pub fn arcs(&self) -> Vec<Sheet> {
        let family = Family::new(self.seed, Stream::Splash);
        (0..self.count).map(|i| self.arc(i, &mut family.member(u64::from(i)))).collect()
    }

    fn arc(&self, number: u32, random: &mut Pcg64Mcg) -> Sheet {
        let mut draw = || random.random_range(-1.0f32..1.0);
        let place = (number as f32 + 0.5 + 0.5 * draw()) / self.count as f32;
        // Golden-ratio steps: neighbours on the line take different directions.
        let around = (number as f32 * 0.618_034 + 0.5 * draw() / self.count as f32).rem_euclid(1.0);
        let azimuth = (2.0 * around - 1.0) * self.fan.to_radians();
        let elevation = (self.elevation + self.spread * draw()).clamp(0.0, STEEPEST).to_radians();
        let speed = self.speed() * (SLOWEST + (1.0 - SLOWEST) * (0.5 + 0.5 * draw()));
        let width = self.width * (1.0 + 0.3 * draw());
        let lasting = LASTING[0] + (LASTING[1] - LASTING[0]) * (0.5 + 0.5 * draw());
        let offset = Vec2::new(draw(), draw());

        let side = self.toward.cross(Vec3::Y);
        let ahead = self.toward * azimuth.cos() + side * azimuth.sin();
        let launch = (ahead * elevation.cos() + Vec3::Y * elevation.sin()) * speed;
        let from = self.line[0].lerp(self.line[1], place);
        let gravity = Vec3::Y * GRAVITY as f32;
        // Flat launches fly for at least a quarter of the rise time of a vertical one.
        let flight = (2.0 * launch.y).max(0.25 * speed) / GRAVITY as f32 * lasting;
        let at = |i: usize| {
            let t = flight * i as f32 / (POINTS - 1) as f32;
            from + (launch - gravity * (0.5 * t)) * t
        };
        let share = |i: usize| i as f32 / (POINTS - 1) as f32;
        Sheet {
            points: (0..POINTS).map(at).collect(),
            widths: (0..POINTS).map(|i| width * (NARROWEST + (1.0 - NARROWEST) * share(i))).collect(),
            across: ahead.cross(Vec3::Y),
            segments: self.segments,
            columns: 1,
            round: 0.0,
            v0: speed,
            stretch: 1.0,
            offset,
            ends: ENDS,
            material: self.material,
            mist: self.mist,
        }
    }
}
