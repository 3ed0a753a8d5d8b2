//! Splashes: water that is thrown up where a fall hits a ledge or a pool.
//!
//! Drops leave the line of impact with a share of the speed of impact and fly parabolas. Drag is neglected,
//! because it is small for drops of a few millimetres at a few m/s. Neighbouring drops of a corona form a
//! sheet. So each parabola is the profile of a short [`Sheet`] that lies across the parabola's plane, and its
//! borders are eroded to single drops.

use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::{Ends, GRAVITY, Material, Sheet, Surges, Tears};
use crate::util::random::{Family, Stream};

/// Number of points of a parabola. At every time a drop is within 0.6 ‰ of the arc's length from the sheet,
/// and within 2.5 ‰ on the steepest arc, whose turn at the top is sharp. With half as many points it is
/// within 1.5 %.
const POINTS: usize = 17;
/// Smallest launch speed of an arc, as a share of the largest. Drops leave with all speeds between the two.
const MIN_SPEED: f32 = 0.55;
/// Smallest and largest share of the whole flight, up and down again, after which an arc has thinned out to
/// nothing. Whole flights would look like the jets of a fountain, and their fold at the top like a petal.
const FLIGHT_SHARE: [f32; 2] = [0.35, 0.65];
/// Width of an arc at the launch, as a share of the width at its end.
const LAUNCH_WIDTH: f32 = 0.35;
/// Erosion of an arc, which comes out of the foot of the fall and thins out to single drops. With less `fade`
/// the arcs end in a row; with more of it nothing is left at the top.
const ENDS: Ends = Ends { edge: 1.0, breakup: 0.3, fade: 0.7, head: 0.08, is_soft: false };
/// Steepest launch, degrees. A vertical parabola has no plane.
const STEEPEST: f32 = 87.0;

/// Description of a splash.
#[derive(Clone, Debug)]
pub struct Splash {
    /// Ends of the line of impact, metres. They may coincide.
    pub line: [Vec3; 2],
    /// Height of the fall that hits here, metres.
    pub drop_m: f32,
    /// Launch speed of the fastest drops, as a share of the speed of impact.
    pub restitution: f32,
    /// Mean launch angle above the horizon, degrees.
    pub elevation: f32,
    /// Largest difference of a launch angle from `elevation`, degrees.
    pub spread: f32,
    /// Horizontal unit direction of the fan's middle.
    pub toward: Vec3,
    /// Angle of the fan on either side of its middle, degrees.
    pub fan: f32,
    /// Number of arcs.
    pub count: u32,
    /// Number of quads along each arc.
    pub segments: u32,
    /// Mean width of an arc at its end, metres.
    pub width: f32,
    /// Seed of the arcs' randomness.
    pub seed: u64,
    /// Holes that leave the drops.
    pub tears: Tears,
    /// Material of all arcs.
    pub material: Material,
    /// [`super::Quad::mist`] of all quads.
    pub mist: f32,
}

impl Splash {
    /// Largest launch speed, m/s: the speed of impact, √(2 g h), times the restitution. No drop rises higher
    /// than restitution²·h.
    pub fn speed(&self) -> f32 {
        self.restitution * (2.0 * GRAVITY as f32 * self.drop_m).sqrt()
    }

    /// Arcs of the splash, even along the line and around the fan, each moved at random by up to half a step.
    pub fn arcs(&self) -> Vec<Sheet> {
        let family = Family::new(self.seed, Stream::Splash);
        (0..self.count).map(|i| self.arc(i, &mut family.member(u64::from(i)))).collect()
    }

    /// Arc `number`, with the numbers that `random` draws.
    fn arc(&self, number: u32, random: &mut Pcg64Mcg) -> Sheet {
        let mut draw = || random.random_range(-1.0f32..1.0);
        let along = (number as f32 + 0.5 + 0.5 * draw()) / self.count as f32;
        // Steps by the golden ratio send neighbours on the line into different directions.
        let around = (number as f32 * 0.618_034 + 0.5 * draw() / self.count as f32).rem_euclid(1.0);
        let azimuth = (2.0 * around - 1.0) * self.fan.to_radians();
        let elevation = (self.elevation + self.spread * draw()).clamp(0.0, STEEPEST).to_radians();
        let speed = self.speed() * (MIN_SPEED + (1.0 - MIN_SPEED) * (0.5 + 0.5 * draw()));
        let width = self.width * (1.0 + 0.3 * draw());
        let share = FLIGHT_SHARE[0] + (FLIGHT_SHARE[1] - FLIGHT_SHARE[0]) * (0.5 + 0.5 * draw());
        let offset = Vec2::new(draw(), draw());

        let side = self.toward.cross(Vec3::Y);
        let ahead = self.toward * azimuth.cos() + side * azimuth.sin();
        let launch = (ahead * elevation.cos() + Vec3::Y * elevation.sin()) * speed;
        let from = self.line[0].lerp(self.line[1], along);
        let gravity = Vec3::Y * GRAVITY as f32;
        // A flat arc lasts at least a quarter of the time for which a vertical one rises.
        let flight = (2.0 * launch.y).max(0.25 * speed) / GRAVITY as f32 * share;
        let at = |i: usize| {
            let t = flight * i as f32 / (POINTS - 1) as f32;
            from + (launch - gravity * (0.5 * t)) * t
        };
        let part = |i: usize| i as f32 / (POINTS - 1) as f32;
        Sheet {
            points: (0..POINTS).map(at).collect(),
            widths: (0..POINTS).map(|i| width * (LAUNCH_WIDTH + (1.0 - LAUNCH_WIDTH) * part(i))).collect(),
            across: ahead.cross(Vec3::Y),
            segments: self.segments,
            columns: 1,
            round: 0.0,
            v0: speed,
            stretch: 1.0,
            offset,
            ends: ENDS,
            surges: Surges::default(),
            tears: self.tears,
            material: self.material,
            mist: self.mist,
        }
    }
}
