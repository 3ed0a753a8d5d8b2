//! Waves of a pool that bend round its rocks: the damped Helmholtz equation for a handful of frequencies.
//!
//! A run of the wave equation in time, u_tt + 2γ·u_t = c²·∇²u, is driven at all frequencies at once until it
//! is steady, and the Fourier sums of one common period separate them. Faces between water and rock let
//! nothing through, so waves are mirrored there. Near the grid's border γ grows, so that nothing comes back
//! (Israeli and Orszag 1981). The speed c is arbitrary: a mode has only its wavelength from here, and its
//! frequency from the dispersion of deep water.

use std::f32::consts::TAU;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use glam::{DVec2, DVec3, Vec2};
use rand::RngExt;
use rayon::prelude::*;

use super::field::{Amplitudes, Basin, HARMONICS, LENGTHS, MODES};
use super::{Pool, STRAIGHT_IN_FIELD};
use crate::util::random::{Family, Stream};

/// Most of c·Δt in cells: below 1/√2, beyond which the scheme is unstable.
const COURANT: f32 = 0.7;
/// Wavelengths of the longest mode in which waves fall to 1/e.
const DECAY: f32 = 12.0;
/// Wavelengths of the longest mode that waves travel before the amplitudes are taken.
const TRAVEL: f32 = 20.0;
/// Most steps of a run.
const MOST_STEPS: usize = 6000;
/// Wavelengths over which waves are absorbed at the grid's border, and the largest damping of a step there.
const ABSORBED: (f32, f32) = (1.5, 0.3);
/// Number of straight waves of each mode that come from outside.
const INCIDENT: usize = 3;
/// Length relative to the longest of the waves whose amplitude is `pools.*.rings`.
const RINGS: f32 = 0.4;
/// Modulus of the wave of a point source one wavelength away, ¼·|H₀(2π)| of Green's function.
const AT_ONE_WAVELENGTH: f32 = 0.079_577;

/// One straight wave that comes from outside.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// Number of its mode.
    pub mode: usize,
    /// Unit direction, x and z.
    pub toward: Vec2,
    /// Amplitude, metres.
    pub amplitude: f32,
    /// Phase at the scene's origin, turns.
    pub phase: f32,
}

/// A complex number in each mode.
type Complex = [[f32; 2]; MODES];

fn add(to: &mut [f32; 2], [re, im]: [f32; 2], by: f32) {
    to[0] += re * by;
    to[1] += im * by;
}

/// Returns e^(2πi·turns).
fn unit(turns: f32) -> [f32; 2] {
    let (sin, cos) = (TAU * (turns - turns.floor())).sin_cos();
    [cos, sin]
}

/// Returns the straight waves that come into a pool, fixed to the world. They have the share of the height's
/// variance that the longest waves of a sum have.
pub fn incident(pool: &Pool, longest: f32, origin: DVec3) -> Vec<Incident> {
    let family = Family::new(pool.seed, Stream::Wave);
    // All waves are equally steep, as those of a sum are.
    let steep = super::steepness(pool) * (STRAIGHT_IN_FIELD as f32 / (INCIDENT * MODES) as f32).sqrt();
    let straight = |i: usize| {
        let (mode, mut random) = (i / INCIDENT, family.member(1000 + i as u64));
        let (sin, cos) = random.random_range(0.0..TAU).sin_cos();
        let length = longest * LENGTHS[mode];
        let along = DVec2::new(f64::from(cos), f64::from(sin)).dot(DVec2::new(origin.x, origin.z));
        let before = (along / f64::from(length)).rem_euclid(1.0) as f32;
        let phase = random.random_range(0.0f32..1.0) - before;
        Incident { mode, toward: Vec2::new(cos, sin), amplitude: steep * length, phase }
    };
    (0..INCIDENT * MODES).map(straight).collect()
}

impl Incident {
    /// Returns the complex amplitude at a point, metres.
    pub fn at(&self, p: Vec2, longest: f32) -> [f32; 2] {
        let along = self.toward.dot(p) / (longest * LENGTHS[self.mode]);
        unit(self.phase - along).map(|part| part * self.amplitude)
    }
}

/// Returns the complex amplitudes of a pool's waves in each cell of a basin; those of solid cells are 0.
pub fn amplitudes(pool: &Pool, basin: &Basin, longest: f32, origin: DVec3) -> Vec<Amplitudes> {
    let from_outside = incident(pool, longest, origin);
    let mut run = Run::new(basin, longest);
    run.reflect(&from_outside);
    run.drive(pool);
    let mut out = run.amplitudes();
    out.par_iter_mut().enumerate().filter(|(i, _)| !basin.solid[*i]).for_each(|(i, out)| {
        let p = basin.grid.middle(i);
        from_outside.iter().for_each(|wave| add(&mut out[wave.mode], wave.at(p, longest), 1.0));
    });
    out
}

/// What a step in time reads of three rows of cells, the one before, its own and the one after. Rows have a
/// cell more on both ends.
struct Stencil<'a> {
    /// Heights.
    u: [&'a [f32]; 3],
    /// 1 in water, 0 in rock.
    water: [&'a [f32]; 3],
    /// γ·Δt of the own row.
    damping: &'a [f32],
}

impl Stencil<'_> {
    /// Replaces the heights of a step before by those of a step after. `squared` is (c·Δt)² in cells.
    #[inline(always)]
    fn step(&self, squared: f32, next: &mut [f32]) {
        let nx = next.len() - 2;
        // Slices of one length have no tests of bounds in the loop, so it is compiled to vectors.
        let [low, own, high] = self.u;
        let [low_water, own_water, high_water] = self.water;
        let (west, east, u) = (&own[..nx], &own[2..nx + 2], &own[1..nx + 1]);
        let (low, high) = (&low[1..nx + 1], &high[1..nx + 1]);
        let (west_water, east_water) = (&own_water[..nx], &own_water[2..nx + 2]);
        let water = &own_water[1..nx + 1];
        let (low_water, high_water) = (&low_water[1..nx + 1], &high_water[1..nx + 1]);
        let (damping, next) = (&self.damping[1..nx + 1], &mut next[1..nx + 1]);
        for x in 0..nx {
            let spread = west_water[x] * (west[x] - u[x])
                + east_water[x] * (east[x] - u[x])
                + low_water[x] * (low[x] - u[x])
                + high_water[x] * (high[x] - u[x]);
            let g = damping[x];
            next[x] = water[x] * (2.0 * u[x] - (1.0 - g) * next[x] + squared * spread) / (1.0 + g);
        }
    }
}

/// A run in time.
pub struct Run<'a> {
    basin: &'a Basin,
    longest: f32,
    /// Steps in which all modes repeat, and c·Δt in cells.
    period: usize,
    courant: f32,
    /// Driven cells, and what a step adds there.
    sources: Vec<(usize, Complex)>,
}

impl<'a> Run<'a> {
    /// Prepares a run of waves of which the longest has the length `longest`, metres.
    pub fn new(basin: &'a Basin, longest: f32) -> Run<'a> {
        let cells = 4.0 * longest / basin.grid.cell;
        let period = (cells / COURANT).ceil().max(16.0);
        Run { basin, longest, period: period as usize, courant: cells / period, sources: Vec::new() }
    }

    /// Adds sources that take what straight waves from outside would carry through the faces of rocks.
    pub fn reflect(&mut self, from_outside: &[Incident]) {
        let grid = self.basin.grid;
        for i in (0..grid.cells()).filter(|&i| !self.basin.solid[i]) {
            let mut driven = Complex::default();
            let mut is_beside = false;
            for j in grid.neighbours(i).into_iter().flatten().filter(|&j| self.basin.solid[j]) {
                is_beside = true;
                for wave in from_outside {
                    let by = self.courant * self.courant;
                    add(&mut driven[wave.mode], wave.at(grid.middle(i), self.longest), by);
                    add(&mut driven[wave.mode], wave.at(grid.middle(j), self.longest), -by);
                }
            }
            if is_beside {
                self.sources.push((i, driven));
            }
        }
    }

    /// Adds sources where water falls in, of random phases in every cell: a thin jet makes rings, and a wide
    /// fall waves without a common centre. Those of the length `RINGS` have the amplitude `pools.*.rings`
    /// one longest wavelength away, and all are equally steep there.
    pub fn drive(&mut self, pool: &Pool) {
        let grid = self.basin.grid;
        let reach = (0.25 * self.longest).max(grid.cell);
        let is_driven = |i: &usize| !self.basin.solid[*i] && self.basin.from_impact(grid.middle(*i)) < reach;
        let driven: Vec<usize> = (0..grid.cells()).into_par_iter().filter(is_driven).collect();
        let family = Family::new(pool.seed, Stream::Wave);
        let strength = pool.rings * self.courant * self.courant
            / (AT_ONE_WAVELENGTH * RINGS * (driven.len().max(1) as f32).sqrt());
        for i in driven {
            let mut random = family.member(1 << 32 | i as u64);
            let source = LENGTHS
                .map(|length| unit(random.random_range(0.0..1.0)).map(|part| part * strength * length));
            self.sources.push((i, source));
        }
    }

    /// Runs until the waves are steady and returns their complex amplitudes.
    pub fn amplitudes(&self) -> Vec<Amplitudes> {
        let [nx, nz] = self.basin.grid.size;
        let mut out = vec![Amplitudes::default(); nx * nz];
        if self.sources.iter().all(|(_, source)| source.iter().flatten().all(|part| *part == 0.0)) {
            return out;
        }
        // A border of rock around the grid.
        let (width, padded) = (nx + 2, (nx + 2) * (nz + 2));
        let place = |i: usize| (i / nx + 1) * width + i % nx + 1;
        let mut is_water = vec![0.0f32; padded];
        let mut damping = vec![0.0f32; padded];
        for i in 0..nx * nz {
            is_water[place(i)] = f32::from(u8::from(!self.basin.solid[i]));
            damping[place(i)] = self.damping(i);
        }
        let (mut before, mut now) = (vec![0.0f32; padded], vec![0.0f32; padded]);
        let travel = (TRAVEL * self.longest / (self.courant * self.basin.grid.cell)) as usize;
        let steps = travel.min(MOST_STEPS) + self.period;
        let squared = self.courant * self.courant;
        let simd = Level::new();
        for step in 0..steps {
            let rows = before.par_chunks_mut(width).enumerate().skip(1).take(nz).with_min_len(32);
            rows.for_each(|(z, next)| {
                let at = z * width;
                let stencil = Stencil {
                    u: [z - 1, z, z + 1].map(|z| &now[z * width..][..width]),
                    water: [z - 1, z, z + 1].map(|z| &is_water[z * width..][..width]),
                    damping: &damping[at..at + width],
                };
                dispatch!(simd, simd => simd.vectorize(#[inline(always)] || stencil.step(squared, next)));
            });
            let ramp = (step as f32 / self.period as f32).min(1.0);
            let ramp = ramp * ramp * (3.0 - 2.0 * ramp);
            let turn = self.turn(step);
            for (i, source) in &self.sources {
                let real = |k: usize| source[k][0] * turn[k][0] - source[k][1] * turn[k][1];
                before[place(*i)] += ramp * (0..MODES).map(real).sum::<f32>();
            }
            std::mem::swap(&mut before, &mut now);
            if step >= steps - self.period {
                let share = 2.0 / self.period as f32;
                let turn = self.turn(step + 1).map(|[re, im]| [re, -im]);
                out.par_chunks_mut(nx).with_min_len(32).enumerate().for_each(|(z, out)| {
                    let own = &now[(z + 1) * width + 1..][..nx];
                    for (out, u) in out.iter_mut().zip(own) {
                        let u = u * share;
                        let sums = out.as_flattened_mut().iter_mut();
                        sums.zip(turn.as_flattened()).for_each(|(sum, turn)| *sum += u * turn);
                    }
                });
            }
        }
        out
    }

    /// Returns e^(iωt) of each mode at a step.
    fn turn(&self, step: usize) -> Complex {
        std::array::from_fn(|k| {
            let turns = (HARMONICS[k] as usize * step) % self.period;
            unit(turns as f32 / self.period as f32)
        })
    }

    /// Returns γ·Δt of a cell.
    fn damping(&self, i: usize) -> f32 {
        let grid = self.basin.grid;
        let (x, z) = (i % grid.size[0], i / grid.size[0]);
        let to_border = [x, grid.size[0] - 1 - x, z, grid.size[1] - 1 - z].into_iter().min().unwrap_or(0);
        let shorter = grid.size[0].min(grid.size[1]) as f32;
        let (wide, most) = ABSORBED;
        let wide = (wide * self.longest / grid.cell).min(shorter / 6.0);
        let near = (1.0 - to_border as f32 / wide).max(0.0);
        self.courant * grid.cell / (DECAY * self.longest) + most * near * near
    }
}
