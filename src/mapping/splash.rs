//! Splashes: water thrown up where it hits a ledge or a pool.
//!
//! Drops leave the line of impact with a share of the speed that they came with and fly parabolas (Newton; drag is left
//! out: it is little for drops of millimetres at a few m/s). Neighbouring drops of a corona make a sheet, so each
//! parabola is the profile of a short [`Sheet`] across its own plane, whose borders are eroded to single drops.

use glam::{Vec2, Vec3};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::{Ends, GRAVITY, Material, Sheet};
use crate::util::random::{Family, Stream};

/// Points of a parabola: at every time a drop is within 0.6 ‰ of the arc's length from it, and of the steepest, whose turn
/// at the top is sharp, within 2.5 ‰. Half as many: 1.5 %.
const POINTS: usize = 17;
/// Least share of the launch speed that an arc has: drops leave with all speeds up to the largest.
const SLOWEST: f32 = 0.55;
/// Least and largest share of its flight, up and down again, after which an arc has thinned out to nothing. Whole
/// ones would look like the jets of a fountain, and their fold at the top like a petal.
const LASTING: [f32; 2] = [0.35, 0.65];
/// Width at the launch as a share of that at the landing.
const NARROWEST: f32 = 0.35;
/// They come out of the foot of the fall and thin out to single drops: with less `fade` they end in a row, with more
/// nothing is left at the top.
const ENDS: Ends = Ends { edge: 1.0, breakup: 0.3, fade: 0.7, head: 0.08 };
/// Steepest launch, degrees: a plumb parabola has no plane.
const STEEPEST: f32 = 87.0;

/// What a splash is made from.
#[derive(Clone, Debug)]
pub struct Splash {
    /// Ends of the line of impact, metres; may be one point.
    pub line: [Vec3; 2],
    /// Height of the fall that ends here, metres.
    pub drop_m: f32,
    /// Share of the speed of impact that the fastest drops leave with.
    pub restitution: f32,
    /// Mean angle of the launch above the horizon, degrees.
    pub elevation: f32,
    /// Largest difference from it, degrees.
    pub spread: f32,
    /// Horizontal unit direction of the middle of the fan.
    pub toward: Vec3,
    /// Angle of the fan on either side of it, degrees.
    pub fan: f32,
    /// Arcs.
    pub count: u32,
    /// Quads along each.
    pub segments: u32,
    /// Mean width of an arc at its end, metres.
    pub width: f32,
    /// Of the arcs.
    pub seed: u64,
    /// Of the arcs.
    pub material: Material,
    /// Of the material: [`super::Quad::mist`].
    pub mist: f32,
}

impl Splash {
    /// Largest speed of launch, m/s: that of the impact, √(2 g h), times the restitution. The highest drop rises
    /// restitution²·h.
    pub fn speed(&self) -> f32 {
        self.restitution * (2.0 * GRAVITY as f32 * self.drop_m).sqrt()
    }

    /// Its arcs, evenly along the line and around the fan, each moved by up to half a step.
    pub fn arcs(&self) -> Vec<Sheet> {
        let family = Family::new(self.seed, Stream::Splash);
        (0..self.count).map(|i| self.arc(i, &mut family.member(u64::from(i)))).collect()
    }

    fn arc(&self, number: u32, random: &mut Pcg64Mcg) -> Sheet {
        let mut draw = || random.random_range(-1.0f32..1.0);
        let place = (number as f32 + 0.5 + 0.5 * draw()) / self.count as f32;
        // Golden steps: neighbours on the line go apart.
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
        // Flat ones go on for a quarter of the time that a plumb one rises.
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
