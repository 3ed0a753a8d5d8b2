//! Textures of a pool that has a field: its waves at the frame's time, and its foam.

use std::f32::consts::{PI, TAU};

use rayon::prelude::*;

use super::turns;
use crate::place::pool::field::{Amplitudes, Grid, LENGTHS, MODES};
use crate::place::{Mesh, Pool, PoolField};
use crate::scene::Scene;

/// Turns of a mode, of the real and the imaginary part of the phase factor e^(2πi·n·t), at the frame's time
/// (its mean while the shutter is open) and as the change while the shutter is open.
type Factors = [[[f32; 2]; 2]; MODES];

/// Slopes of a pool's field, as both engines read them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SlopeMap {
    /// Cells along x and z.
    pub size: [usize; 2],
    /// In each cell the slopes along x and z at the frame's time, and their change while the shutter is open.
    pub texels: Vec<[f32; 4]>,
}

/// Returns the slopes of each pool's field, if it has one; `mesh` is the scene's opaque mesh.
pub fn slope_maps(scene: &Scene, mesh: &Mesh) -> Vec<Option<SlopeMap>> {
    let map = |(i, pool): (usize, &Pool)| {
        let field = mesh.field(i)?;
        Some(SlopeMap::new(pool, field, [scene.wave_flow, scene.wave_moves]))
    };
    scene.pools.iter().enumerate().map(map).collect()
}

/// Returns the phase factors of the modes. While the shutter is open for m turns of a mode, its height is
/// drawn as the straight line through time that is nearest to it in the mean square: of the mean sin(πm)/πm,
/// and of a slope that is the derivative for small m and falls to 0 for large ones.
fn factors(pool: &Pool, longest: f32, [flow, moves]: [f32; 2]) -> Factors {
    LENGTHS.map(|length| {
        let n = turns(longest * length, pool.period);
        let (sin, cos) = (TAU * (n * flow.rem_euclid(1.0)).fract()).sin_cos();
        let m = moves * n;
        let mean = if m.abs() < 1e-3 { 1.0 } else { (PI * m).sin() / (PI * m) };
        let change = if m.abs() < 0.05 {
            TAU * m
        } else {
            12.0 * ((PI * m).sin() / (2.0 * PI * PI * m * m) - (PI * m).cos() / (TAU * m))
        };
        [[cos * mean, sin * mean], [-sin * change, cos * change]]
    })
}

impl SlopeMap {
    /// Computes the slopes of a pool at `flow` and for `moves`, the flow while the shutter is open.
    pub fn new(pool: &Pool, field: &PoolField, at: [f32; 2]) -> SlopeMap {
        let factors = factors(pool, field.longest, at);
        let heights: Vec<[f32; 2]> = field.amplitudes.par_iter().map(|a| heights(a, &factors)).collect();
        let Grid { size, cell, .. } = field.grid;
        let [nx, nz] = size;
        let slopes = |i: usize| {
            let (x, z) = (i % nx, i / nx);
            let along = |place: usize, n: usize, step: usize| {
                let at = |offset: isize| {
                    let to = (place as isize + offset).clamp(0, n as isize - 1) as usize;
                    heights[i + to * step - place * step]
                };
                let (near, far) = ([at(1), at(-1)], [at(2), at(-2)]);
                [0, 1].map(|k| (8.0 * (near[0][k] - near[1][k]) - (far[0][k] - far[1][k])) / (12.0 * cell))
            };
            let ([sx, dx], [sz, dz]) = (along(x, nx, 1), along(z, nz, nx));
            [sx, sz, dx, dz]
        };
        SlopeMap { size, texels: (0..nx * nz).into_par_iter().map(slopes).collect() }
    }
}

/// Returns the height of a cell at the frame's time and its change while the shutter is open, metres.
fn heights(amplitudes: &Amplitudes, factors: &Factors) -> [f32; 2] {
    [0, 1].map(|k| {
        let real = |(a, f): (&[f32; 2], &[[f32; 2]; 2])| a[0] * f[k][0] - a[1] * f[k][1];
        amplitudes.iter().zip(factors).map(real).sum()
    })
}
