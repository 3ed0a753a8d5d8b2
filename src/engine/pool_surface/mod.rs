//! The surface of a pool: its waves, the surroundings it mirrors, and its colours. This is computed once per
//! picture; `shaders/engine/pool.wgsl` and its twin `src/engine/cpu/pool.rs` shade the pixels.
//!
//! The surface is a sum of waves as in Fournier and Reeves 1986 (Gerstner 1802): a point that rests at x₀
//! moves on a circle, by A·sin along the vertical and by A·cos along the wave. Amplitudes are centimetres, so
//! the level patch is drawn with the normal of this surface. The dispersion ω² = g·k of deep water is rounded
//! to a whole number of turns in the pool's period, so that moving pictures loop. Rings spread from the
//! points where water falls in.

mod around;
mod maps;

use std::f32::consts::TAU;

use glam::{DVec3, Vec2, Vec3};
use rand::RngExt;

use crate::mapping::{GRAVITY, PlaneView};
use crate::place::pool::{STRAIGHT_IN_FIELD, straight_slope};
use crate::place::{Mesh, Pool, PoolField};
use crate::scene::{Parts, Scene};
use crate::util::random::{Family, Stream};

pub use crate::place::pool::STRAIGHT;
pub use maps::{SlopeMap, slope_maps};

/// Number of ring waves: two for each point where water falls in.
const RINGS: usize = 12;
/// Number of waves of a pool.
pub const WAVES: usize = STRAIGHT + RINGS;
/// Cells of the surroundings' map: columns about the vertical, and rows upwards.
pub const AROUND: [usize; 2] = [64, 12];
/// Length of the longest and the shortest fine wave relative to the longest of a field.
const FINE: [f32; 2] = [0.4, 0.06];
/// Metres by which noise moves fine waves, relative to the longest wave of a field: crests turn by some 20°.
const BEND: f32 = 0.3;
/// Time after which a pattern of foam is taken up anew, about, seconds. The current would draw it out for
/// longer.
const PATTERN: f32 = 1.2;

/// One wave, straight or ring-shaped.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Wave {
    /// x and z of a straight wave's unit direction, or of a ring's centre in metres.
    pub toward: [f32; 2],
    /// Waves per metre.
    pub k: f32,
    /// Phase in turns, at the scene's origin or at the ring's centre.
    pub phase: f32,
    /// Steepest slope, 2π·k·A.
    pub slope: f32,
    /// 1 for a ring, 0 for a straight wave.
    pub ring: f32,
    /// Decay of a ring with the distance r from its centre, 1/m: the slope is divided by (1 + r·decay)².
    pub decay: f32,
    /// Turns of the phase while the shutter is open.
    pub moves: f32,
}

/// Cells per metre of the lattices of the foam's noise. Twin: `foam_noise` of `shaders/engine/pool.wgsl`.
pub const FOAM: [f32; 4] = [2.3, 5.1, 11.0, 23.0];

/// Place of the scene's origin in a lattice that is fixed to the world.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Foam {
    /// Whole cells along x and z.
    pub cells: [i32; 2],
    /// The rest, 0 to 1.
    pub rest: [f32; 2],
    /// Cells per metre along x: cosine and sine of the lattice's turn times its scale. Used by fields.
    pub axis: [f32; 2],
    /// Padding.
    pub pad: [f32; 2],
}

impl Foam {
    /// Returns the place of `origin` in a lattice of `scale` cells per metre, which is turned by `angle`.
    fn new(origin: DVec3, scale: f32, angle: f32) -> Foam {
        let (sin, cos) = angle.sin_cos();
        let axis = [cos * scale, sin * scale];
        let [c, s] = axis.map(f64::from);
        let at = match angle {
            0.0 => [origin.x, origin.z].map(|x| x * f64::from(scale)),
            _ => [origin.x * c - origin.z * s, origin.x * s + origin.z * c],
        };
        let cells = at.map(|x| x.floor() as i32);
        Foam { cells, rest: at.map(|x| (x - x.floor()) as f32), axis, pad: [0.0; 2] }
    }
}

/// A pool's surface as both engines read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Surface {
    /// Linear albedo of deep water.
    pub color: [f32; 3],
    /// Radius in metres of the sphere that the surroundings are projected on.
    pub radius: f32,
    /// Linear albedo of the ground.
    pub bottom: [f32; 3],
    /// 1: a hole in a picture with alpha. 0: none.
    pub holdout: f32,
    /// Absorption of the water, 1/m.
    pub absorption: [f32; 3],
    /// Scale of the foam's pattern, relative to that of a pool without a field.
    pub foam_scale: f32,
    /// Centre of the pool, metres.
    pub middle: [f32; 3],
    /// Metres along a view ray beyond which points of the pool's plane are not used.
    pub far: f32,
    /// The plane as the eye sees it, with the axes x and z: see [`PlaneView`].
    pub across: [f32; 3],
    /// Height of the eye over the plane, metres.
    pub height: f32,
    /// See `across`.
    pub along: [f32; 3],
    /// Metres by which noise moves fine waves.
    pub bend: f32,
    /// See `across`.
    pub normal: [f32; 3],
    /// Turns per metre at which the field's waves fade as a pixel grows.
    pub field_blur: f32,
    /// x and z of the corner of the field's grid, metres.
    pub field_origin: [f32; 2],
    /// Cells of that grid per metre; 0 without a field.
    pub field_scale: f32,
    /// Padding.
    pub pad: f32,
    /// Seconds by which both patterns of foam are carried, and their shares.
    pub carry: [f32; 4],
    /// The foam's lattices.
    pub foam: [Foam; FOAM.len()],
    /// The straight waves, then the rings; unused rings have slope 0.
    pub waves: [Wave; WAVES],
    /// Map of the surroundings, row by row upwards: linear radiance × cover, and the cover (0 to 1).
    pub around: [[f32; 4]; AROUND[0] * AROUND[1]],
}

impl Default for Surface {
    fn default() -> Self {
        bytemuck::Zeroable::zeroed()
    }
}

/// Returns the surface of each pool of a scene; `mesh` is the scene's opaque mesh.
pub fn surfaces(scene: &Scene, mesh: &Mesh) -> Vec<Surface> {
    let surface = |(i, pool)| Surface::new(scene, mesh, pool, mesh.field(i));
    scene.pools.iter().enumerate().map(surface).collect()
}

/// Returns the position of a direction about the vertical, 0 to 1. It rises with x/(|x| + |z|) of the
/// direction, once forth and once back, and so needs no arc tangent. Twin: `turn` of
/// `shaders/engine/pool.wgsl`.
pub fn turn(d: Vec3) -> f32 {
    let p = d.x / (d.x.abs() + d.z.abs()).max(1e-20);
    if d.z >= 0.0 { 0.25 * (1.0 - p) } else { 0.25 * (3.0 + p) }
}

/// Returns the turns that a wave of length λ (metres) makes in the pool's period (seconds): a whole number,
/// at least one.
pub fn turns(wavelength: f32, period: f32) -> f32 {
    // ω/2π = √(g/(2πλ)).
    (period * (GRAVITY as f32 / (TAU * wavelength)).sqrt()).round().max(1.0)
}

impl Surface {
    /// Computes the surface of one pool of a scene; `mesh` is the scene's opaque mesh, and `field` the
    /// pool's.
    pub fn new(scene: &Scene, mesh: &Mesh, pool: &Pool, field: Option<&PoolField>) -> Surface {
        let middle = pool.corners.iter().sum::<Vec3>() / 4.0;
        let flow = scene.wave_flow.rem_euclid(1.0);
        let mut surface = Surface {
            color: pool.color.to_array(),
            bottom: pool.bottom.to_array(),
            holdout: f32::from(u8::from(pool.holdout)),
            absorption: pool.absorption.to_array(),
            middle: middle.to_array(),
            foam_scale: 1.0,
            ..Surface::default()
        };
        let origin = scene.camera.origin;
        match field {
            None => surface.waves = waves(pool, &scene.falls(), [flow, scene.wave_moves], origin),
            Some(field) => surface.add_field(pool, field, [flow, scene.wave_moves], origin),
        }
        surface.foam = std::array::from_fn(|i| {
            // Lattices that are turned against each other show none of their axes.
            let angle = if field.is_some() { 0.5 + 0.9 * i as f32 } else { 0.0 };
            Foam::new(origin, FOAM[i] * surface.foam_scale, angle)
        });
        let Parts { camera, image, .. } = &**scene;
        let eye = camera.eye_local() - middle.as_dvec3();
        let plane = PlaneView::new([Vec3::X, Vec3::Z, Vec3::Y], eye, camera.rays(image.width, image.height));
        surface.across = plane.across.to_array();
        surface.along = plane.along.to_array();
        surface.normal = plane.normal.to_array();
        surface.height = plane.height;
        surface.far = 1e6f32.max(2.0 * eye.length() as f32);
        (surface.radius, surface.around) = around::around(scene, mesh, middle);
        surface
    }
}

impl Surface {
    /// Adds what a pool with a field needs beside its textures, at the flow `at`, which goes on while the
    /// shutter is open.
    fn add_field(&mut self, pool: &Pool, field: &PoolField, at: [f32; 2], origin: DVec3) {
        self.waves = fine_waves(pool, field.longest, at, origin);
        self.foam_scale = 1.6 / field.longest;
        self.bend = BEND * field.longest;
        // Three times the waves per metre of the modes' middle, as for a wave of a sum.
        self.field_blur = 3.0 / (0.75 * field.longest);
        self.field_origin = field.grid.origin;
        self.field_scale = 1.0 / field.grid.cell;
        // Two patterns follow one another half a time apart. Each is taken up anew where its share is 0.
        let times = (pool.period / PATTERN).round().max(1.0);
        let lasts = pool.period / times;
        let carried = |phase: f32| (at[0] * times + phase).fract() - 0.5;
        let both = [carried(0.0), carried(0.5)];
        let [a, b] = both.map(|part| 1.0 - 2.0 * part.abs());
        self.carry = [both[0] * lasts, both[1] * lasts, a, b];
    }
}

/// Returns the fine waves beside a field, which are shorter than those of its grid. Waves of similar lengths
/// run in directions far from each other, a golden angle apart, so that no two make stripes together.
fn fine_waves(pool: &Pool, longest: f32, [flow, moves]: [f32; 2], origin: DVec3) -> [Wave; WAVES] {
    let mut waves = [Wave::default(); WAVES];
    let family = Family::new(pool.seed, Stream::Wave);
    let slope = straight_slope(pool) * (1.0 - STRAIGHT_IN_FIELD as f32 / STRAIGHT as f32).sqrt();
    for (i, wave) in waves[..STRAIGHT].iter_mut().enumerate() {
        let mut random = family.member(2000 + i as u64);
        let golden = TAU * 0.381_966 * i as f32;
        let (sin, cos) = (golden + random.random_range(-0.5f32..0.5)).sin_cos();
        let length = longest * FINE[0] * (FINE[1] / FINE[0]).powf(i as f32 / (STRAIGHT - 1) as f32);
        let phase: f32 = random.random_range(0.0..1.0);
        let k = 1.0 / length;
        let along = f64::from(k) * (f64::from(cos) * origin.x + f64::from(sin) * origin.z);
        *wave = Wave {
            toward: [cos, sin],
            k,
            phase: (phase - flow * turns(length, pool.period) + along.rem_euclid(1.0) as f32).rem_euclid(1.0),
            slope,
            moves: -moves * turns(length, pool.period),
            ..Wave::default()
        };
    }
    waves
}

/// Returns the waves of a pool, which have moved by `flow` and go on by `moves` while the shutter is open,
/// both in lengths of the volume that they move with.
fn waves(pool: &Pool, falls: &[[Vec3; 4]], [flow, moves]: [f32; 2], origin: DVec3) -> [Wave; WAVES] {
    let mut waves = [Wave::default(); WAVES];
    let family = Family::new(pool.seed, Stream::Wave);
    let length = |i: usize| pool.straight_length(i);
    let slope = straight_slope(pool);
    for (i, wave) in waves[..STRAIGHT].iter_mut().enumerate() {
        let mut random = family.member(i as u64);
        let (sin, cos) = random.random_range(0.0..TAU).sin_cos();
        let phase: f32 = random.random_range(0.0..1.0);
        // Waves are fixed to the world: the phase is that at the scene's origin.
        let k = 1.0 / length(i);
        let turns_before = f64::from(k) * (f64::from(cos) * origin.x + f64::from(sin) * origin.z);
        let before = turns_before.rem_euclid(1.0) as f32;
        *wave = Wave {
            toward: [cos, sin],
            k,
            phase: (phase - flow * turns(length(i), pool.period) + before).rem_euclid(1.0),
            slope,
            moves: -moves * turns(length(i), pool.period),
            ..Wave::default()
        };
    }
    for (i, centre) in ring_centres(pool, falls, RINGS / 2).iter().enumerate() {
        for (j, wavelength) in [0.45 * pool.wavelength, 0.17 * pool.wavelength].into_iter().enumerate() {
            let mut random = family.member((STRAIGHT + 2 * i + j) as u64);
            let phase: f32 = random.random_range(0.0..1.0);
            waves[STRAIGHT + 2 * i + j] = Wave {
                toward: centre.to_array(),
                k: 1.0 / wavelength,
                phase: (phase - flow * turns(wavelength, pool.period)).rem_euclid(1.0),
                slope: TAU * pool.rings / (0.45 * pool.wavelength),
                ring: 1.0,
                decay: 1.0 / (2.0 * pool.foam_reach),
                moves: -moves * turns(wavelength, pool.period),
            };
        }
    }
    waves
}

/// Returns the points where water falls in. While there are more than `most`, the nearest two are merged into
/// their midpoint.
fn ring_centres(pool: &Pool, falls: &[[Vec3; 4]], most: usize) -> Vec<Vec2> {
    let middle = |[a, b]: [Vec3; 2]| Vec2::new(a.x + b.x, a.z + b.z) * 0.5;
    let mut centres: Vec<Vec2> = pool.impacts(falls).into_iter().map(middle).take(256).collect();
    while centres.len() > most {
        let pairs = (0..centres.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let distance = |&(i, j): &(usize, usize)| centres[i].distance_squared(centres[j]);
        let Some((i, j)) = pairs.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { break };
        let removed = centres.swap_remove(i);
        centres[j] = (centres[j] + removed) * 0.5;
    }
    centres
}
