//! The surface of a pool for each pixel: waves, what they mirror, what is seen below, and foam.
//! Each pixel is shaded by `shaders/pool.wgsl` and its twin `src/cpu/pool.rs`.
//!
//! The surface is a sum of waves as in Fournier and Reeves 1986 (Gerstner 1802): at rest at x₀, a point is moved
//! round a circle, by A·sin along the vertical and A·cos along the wave. Amplitudes are centimetres, so the normal
//! of this surface is drawn on the level patch. ω² = g·k of deep water, to the nearest whole number of turns in
//! the pool's period: moving pictures close. Rings run out from where water falls in.

mod around;

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use rand::RngExt;

use crate::mapping::GRAVITY;
use crate::place::{Mesh, Pool};
use crate::scene::Scene;
use crate::util::random::{Family, Stream};

/// Waves along straight lines.
pub const STRAIGHT: usize = 20;
/// Rings: each place where water falls in has two of them.
const RINGS: usize = 12;
/// Waves of a pool.
pub const WAVES: usize = STRAIGHT + RINGS;
/// Cells of what is around a pool: about its vertical, and upwards.
pub const AROUND: [usize; 2] = [64, 12];
/// Shortest straight wave relative to the longest.
const SHORTEST: f32 = 0.09;

/// One wave.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Wave {
    /// Unit direction, or the middle of rings: x and z.
    pub toward: [f32; 2],
    /// Waves in a metre.
    pub k: f32,
    /// Turns at the origin or the middle.
    pub phase: f32,
    /// 2π·k·A: the steepest slope.
    pub slope: f32,
    /// 1: rings.
    pub ring: f32,
    /// Share by which rings fall off, 1/m.
    pub decay: f32,
    /// Nothing.
    pub pad: f32,
}

/// A pool as both engines draw it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Surface {
    /// Albedo of deep water.
    pub color: [f32; 3],
    /// Radius of the ball that what is around lies on; metres.
    pub radius: f32,
    /// Albedo of the ground.
    pub bottom: [f32; 3],
    /// Nothing.
    pub pad_a: f32,
    /// 1/m.
    pub absorption: [f32; 3],
    /// Nothing.
    pub pad_b: f32,
    /// The middle.
    pub middle: [f32; 3],
    /// Nothing.
    pub pad_c: f32,
    /// The waves.
    pub waves: [Wave; WAVES],
    /// Radiance of what is around × its cover, and that cover.
    pub around: [[f32; 4]; AROUND[0] * AROUND[1]],
}

impl Default for Surface {
    fn default() -> Self {
        bytemuck::Zeroable::zeroed()
    }
}

/// The pools of a scene with this mesh.
pub fn surfaces(scene: &Scene, mesh: &Mesh) -> Vec<Surface> {
    scene.pools.iter().map(|pool| Surface::new(scene, mesh, pool)).collect()
}

/// Where a direction lies about the vertical, 0 to 1: of its x and z, x/(|x| + |z|), once forth and once back, which
/// needs no arc tangent.
pub fn turn(d: Vec3) -> f32 {
    let p = d.x / (d.x.abs() + d.z.abs()).max(1e-20);
    if d.z >= 0.0 { 0.25 * (1.0 - p) } else { 0.25 * (3.0 + p) }
}

/// Turns that a wave of length λ metres makes in the pool's period: a whole number, at least one.
pub fn turns(wavelength: f32, period: f32) -> f32 {
    // ω/2π = √(g/(2πλ)).
    (period * (GRAVITY as f32 / (TAU * wavelength)).sqrt()).round().max(1.0)
}

impl Surface {
    /// Of one pool.
    pub fn new(scene: &Scene, mesh: &Mesh, pool: &Pool) -> Surface {
        let middle = pool.corners.iter().sum::<Vec3>() / 4.0;
        let flow = scene.flow.rem_euclid(1.0);
        let mut surface = Surface {
            color: pool.color.to_array(),
            bottom: pool.bottom.to_array(),
            absorption: pool.absorption.to_array(),
            middle: middle.to_array(),
            waves: waves(pool, &scene.falls(), flow),
            ..Surface::default()
        };
        (surface.radius, surface.around) = around::around(scene, mesh, middle);
        surface
    }
}

fn waves(pool: &Pool, falls: &[[Vec3; 4]], flow: f32) -> [Wave; WAVES] {
    let mut waves = [Wave::default(); WAVES];
    let family = Family::new(pool.seed, Stream::Wave);
    // All equally steep: A = λ·a, so that Σ A²/2 is the variance of the height.
    let length = |i: usize| pool.wavelength * SHORTEST.powf(i as f32 / (STRAIGHT - 1) as f32);
    let sum: f32 = (0..STRAIGHT).map(|i| length(i) * length(i) * 0.5).sum();
    let a = pool.height / sum.sqrt();
    for (i, wave) in waves[..STRAIGHT].iter_mut().enumerate() {
        let mut random = family.member(i as u64);
        let (sin, cos) = random.random_range(0.0..TAU).sin_cos();
        let phase: f32 = random.random_range(0.0..1.0);
        *wave = Wave {
            toward: [cos, sin],
            k: 1.0 / length(i),
            phase: (phase - flow * turns(length(i), pool.period)).rem_euclid(1.0),
            slope: TAU * a,
            ..Wave::default()
        };
    }
    let places = places(pool, falls, RINGS / 2);
    for (i, place) in places.iter().enumerate() {
        for (j, wavelength) in [0.45 * pool.wavelength, 0.17 * pool.wavelength].into_iter().enumerate() {
            let mut random = family.member((STRAIGHT + 2 * i + j) as u64);
            let phase: f32 = random.random_range(0.0..1.0);
            waves[STRAIGHT + 2 * i + j] = Wave {
                toward: place.to_array(),
                k: 1.0 / wavelength,
                phase: (phase - flow * turns(wavelength, pool.period)).rem_euclid(1.0),
                slope: TAU * pool.rings / (0.45 * pool.wavelength),
                ring: 1.0,
                decay: 1.0 / (2.0 * pool.foam_reach),
                pad: 0.0,
            };
        }
    }
    waves
}

/// Where water falls in, as at most `most` points: of the nearest two the middle is taken until there are no more.
fn places(pool: &Pool, falls: &[[Vec3; 4]], most: usize) -> Vec<Vec2> {
    let middle = |[a, b]: [Vec3; 2]| Vec2::new(a.x + b.x, a.z + b.z) * 0.5;
    let mut places: Vec<Vec2> = pool.impacts(falls).into_iter().map(middle).take(256).collect();
    while places.len() > most {
        let pairs = (0..places.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let near = |&(i, j): &(usize, usize)| places[i].distance_squared(places[j]);
        let Some((i, j)) = pairs.min_by(|a, b| near(a).total_cmp(&near(b))) else { break };
        let one = places.swap_remove(i);
        places[j] = (places[j] + one) * 0.5;
    }
    places
}
