//! The current of a pool's surface and the foam that it carries.
//!
//! Water that falls in pushes the surface outwards, and the pool drifts as a whole. Both go round the rocks:
//! the velocity is ∇φ + drift with ∇²φ − φ/L² = source, without flow through rock. The term φ/L² takes the
//! water down again over the length L. Eddies are the curl of noise, which is 0 at rocks (Bridson, Houriham
//! and Nordenstam 2007). Foam floats where water sinks, so it gathers there, and along shores, where waves
//! make more: ∇·(v·f) + f/τ + s·f = D·∇²f + shore, where s is the part of sinking water that takes its foam
//! along, and f is `pools.*.foam` where water falls in.

use std::f32::consts::SQRT_2;

use glam::{IVec2, Vec2};

use super::Pool;
use super::field::Basin;

/// Radius around falling water in which its foam is made, as a share of `pools.*.foam_reach`.
const CHURNED: f32 = 0.35;
/// Relaxations of φ. Each halves errors within some twenty cells.
const RELAXATIONS: usize = 160;
/// Over-relaxation of φ.
const OVER: f32 = 1.85;
/// Sweeps over the foam, each in the four orders of rows and columns.
const SWEEPS: usize = 12;
/// Speed of eddies relative to the current that carries them.
const EDDIES: f32 = 0.7;
/// Mixing of foam by small eddies, as a share of speed times cell, beside what the scheme itself mixes.
const MIXING: f32 = 0.15;
/// Share of sinking water that takes its foam along. With 0, all foam would gather in a ring where the
/// current ends.
const TAKEN_DOWN: f32 = 0.75;
/// Foam that waves leave on the shore, relative to that where water falls in.
const SHORE: f32 = 0.25;

/// Steady current and foam of a basin, cell by cell.
pub struct Current {
    /// Velocity along x and z, metres per second.
    pub velocity: Vec<Vec2>,
    /// Density of the foam, 0 to 1.
    pub foam: Vec<f32>,
}

/// Velocities through the faces of cells, metres per second.
pub struct Faces {
    /// Through the face of each cell towards −x; nx + 1 in a row.
    pub x: Vec<f32>,
    /// Through the face of each cell towards −z; nz + 1 rows.
    pub z: Vec<f32>,
}

/// Returns smooth noise between −1 and 1; a cell of its lattice has the side 1.
pub fn noise(p: Vec2, seed: u64) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (3.0 - 2.0 * f);
    let value = |dx: i32, dz: i32| {
        let at = cell.as_ivec2() + IVec2::new(dx, dz);
        let mut h = seed ^ ((at.x as u32 as u64) << 32 | at.y as u32 as u64);
        h = (h ^ (h >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((h >> 40) as f32) / (1u64 << 23) as f32 - 1.0
    };
    let near = value(0, 0) + (value(1, 0) - value(0, 0)) * s.x;
    let far = value(0, 1) + (value(1, 1) - value(0, 1)) * s.x;
    near + (far - near) * s.y
}

/// Computes current and foam of a pool.
pub fn of(pool: &Pool, basin: &Basin) -> Current {
    let faces = faces(pool, basin);
    let foam = foam(pool, basin, &faces);
    let nx = basin.grid.size[0];
    let velocity = |i: usize| {
        let (x, z) = (i % nx, i / nx);
        let row = z * (nx + 1) + x;
        Vec2::new(faces.x[row] + faces.x[row + 1], faces.z[i] + faces.z[i + nx]) * 0.5
    };
    Current { velocity: (0..foam.len()).map(velocity).collect(), foam }
}

/// Whether foam is made in a cell.
fn is_churned(pool: &Pool, basin: &Basin, i: usize) -> bool {
    let reach = (CHURNED * pool.foam_reach).max(0.75 * basin.grid.cell);
    !basin.solid[i] && basin.from_impact(basin.grid.middle(i)) < reach
}

/// Returns the drift of the whole pool, metres per second: away from the falling water, through the middle.
fn drift(pool: &Pool, basin: &Basin) -> Vec2 {
    let middles = basin.impacts.iter().map(|[a, b]| (*a + *b) * 0.5);
    let middle = pool.corners.iter().map(|c| Vec2::new(c.x, c.z)).sum::<Vec2>() / 4.0;
    let from = middles.sum::<Vec2>() / basin.impacts.len().max(1) as f32;
    if basin.impacts.is_empty() { Vec2::ZERO } else { (middle - from).normalize_or_zero() * pool.drift }
}

/// Computes the velocities through faces.
pub fn faces(pool: &Pool, basin: &Basin) -> Faces {
    let grid = basin.grid;
    let [nx, nz] = grid.size;
    let (h, drift) = (grid.cell, drift(pool, basin));
    // Water pushed out of a band of the half width r with the speed v at its edge has the divergence v/r.
    let radius = (CHURNED * pool.foam_reach).max(0.75 * h);
    let push = pool.current / radius;
    let churned: Vec<f32> =
        (0..grid.cells()).map(|i| if is_churned(pool, basin, i) { push } else { 0.0 }).collect();
    let phi = potential(basin, &churned, drift, pool.foam_reach);
    let at = |x: usize, z: usize| z * nx + x;
    let is_open = |x: usize, z: usize| x < nx && z < nz && !basin.solid[at(x, z)];
    let mut faces = Faces { x: vec![0.0; (nx + 1) * nz], z: vec![0.0; nx * (nz + 1)] };
    // Beyond the border φ is 0, and water flows freely.
    let value = |x: usize, z: usize| if x < nx && z < nz { phi[at(x, z)] } else { 0.0 };
    let through = |from: [usize; 2], to: [usize; 2]| {
        let outside = |[x, z]: [usize; 2]| x >= nx || z >= nz;
        let passes = |p: [usize; 2]| outside(p) || is_open(p[0], p[1]);
        (passes(from) && passes(to)).then(|| (value(to[0], to[1]) - value(from[0], from[1])) / h)
    };
    let eddy = eddies(pool, basin, &phi, push);
    let corner = |x: usize, z: usize| eddy[z * (nx + 1) + x];
    for z in 0..nz {
        for x in 0..=nx {
            if let Some(v) = through([x.wrapping_sub(1), z], [x, z]) {
                faces.x[z * (nx + 1) + x] = v + drift.x + (corner(x, z + 1) - corner(x, z)) / h;
            }
        }
    }
    for z in 0..=nz {
        for x in 0..nx {
            if let Some(v) = through([x, z.wrapping_sub(1)], [x, z]) {
                faces.z[z * nx + x] = v + drift.y - (corner(x + 1, z) - corner(x, z)) / h;
            }
        }
    }
    faces
}

/// Solves ∇²φ − φ/L² = source by successive over-relaxation, where rock takes no part of ∇φ + drift.
fn potential(basin: &Basin, source: &[f32], drift: Vec2, length: f32) -> Vec<f32> {
    let grid = basin.grid;
    let h = grid.cell;
    // Weight of the middle, and the constant part, of each cell.
    let parts: Vec<[f32; 2]> = (0..grid.cells())
        .map(|i| {
            let mut weight = h * h / (length * length);
            let mut constant = h * h * source[i];
            let out = [-drift.x, drift.x, -drift.y, drift.y];
            for (side, neighbour) in grid.neighbours(i).into_iter().enumerate() {
                match neighbour {
                    Some(j) if basin.solid[j] => constant += h * out[side],
                    _ => weight += 1.0,
                }
            }
            [weight, constant]
        })
        .collect();
    // φ is 0 in rock and in a border around the grid, so every cell has four neighbours.
    let [nx, nz] = grid.size;
    let width = nx + 2;
    let mut phi = vec![0.0f32; width * (nz + 2)];
    for half in (0..2 * RELAXATIONS).map(|pass| pass % 2) {
        for z in 0..nz {
            for x in ((z + half) % 2..nx).step_by(2) {
                let i = z * nx + x;
                if !basin.solid[i] {
                    let at = (z + 1) * width + x + 1;
                    let sum = phi[at - 1] + phi[at + 1] + phi[at - width] + phi[at + width];
                    let [weight, constant] = parts[i];
                    phi[at] += OVER * ((sum - constant) / weight - phi[at]);
                }
            }
        }
    }
    (0..nz).flat_map(|z| phi[(z + 1) * width + 1..][..nx].to_vec()).collect()
}

/// Returns the stream function of the eddies at the corners of cells, m²/s: 0 at rock.
fn eddies(pool: &Pool, basin: &Basin, phi: &[f32], push: f32) -> Vec<f32> {
    let grid = basin.grid;
    let [nx, nz] = grid.size;
    let away = from_rock(basin);
    let size = (0.6 * pool.foam_reach).max(4.0 * grid.cell);
    // φ at the edge of churned water, about.
    let strongest = push * (CHURNED * pool.foam_reach) * pool.foam_reach;
    let mut eddies = vec![0.0; (nx + 1) * (nz + 1)];
    for z in 1..nz {
        for x in 1..nx {
            let around = [(x - 1, z - 1), (x, z - 1), (x - 1, z), (x, z)].map(|(x, z)| z * nx + x);
            let metres = around.iter().map(|&i| away[i]).fold(f32::INFINITY, f32::min);
            let mask = (metres / size).min(1.0);
            let carried = around.iter().map(|&i| phi[i].abs()).sum::<f32>() * 0.25;
            let speed = pool.current * (carried / strongest.max(1e-9)).min(1.0) + pool.drift;
            let p = Vec2::new(x as f32, z as f32) * grid.cell + Vec2::from(grid.origin);
            let turning = noise(p / size, pool.seed) + 0.4 * noise(p / (0.4 * size), pool.seed ^ 7);
            eddies[z * (nx + 1) + x] =
                EDDIES * speed * 0.5 * size * turning * mask * mask * (3.0 - 2.0 * mask);
        }
    }
    eddies
}

/// Returns the distance of cells from rock, metres, by two sweeps of a chamfer (Borgefors 1986).
fn from_rock(basin: &Basin) -> Vec<f32> {
    let [nx, nz] = basin.grid.size;
    let mut away: Vec<f32> = basin.solid.iter().map(|solid| if *solid { 0.0 } else { 1e6 }).collect();
    let sweep = |away: &mut Vec<f32>, x: usize, z: usize, sign: isize| {
        for (dx, dz, step) in [(-1, 0, 1.0), (0, -1, 1.0), (-1, -1, SQRT_2), (1, -1, SQRT_2)] {
            let [from_x, from_z] = [x as isize + sign * dx, z as isize + sign * dz];
            if (0..nx as isize).contains(&from_x) && (0..nz as isize).contains(&from_z) {
                let near = away[from_z as usize * nx + from_x as usize] + step;
                away[z * nx + x] = away[z * nx + x].min(near);
            }
        }
    };
    for i in 0..nx * nz {
        sweep(&mut away, i % nx, i / nx, 1);
    }
    for i in (0..nx * nz).rev() {
        sweep(&mut away, i % nx, i / nx, -1);
    }
    away.iter().map(|cells| cells * basin.grid.cell).collect()
}

/// Solves the transport of foam: upwind differences, swept in the four orders of rows and columns until the
/// foam has followed the current to its end (Zhao 2005). Each cell keeps the balance of what flows in, flows
/// out and decays.
pub fn foam(pool: &Pool, basin: &Basin, faces: &Faces) -> Vec<f32> {
    let grid = basin.grid;
    let [nx, nz] = grid.size;
    let mut foam = vec![0.0f32; grid.cells()];
    let is_source: Vec<bool> = (0..foam.len()).map(|i| is_churned(pool, basin, i)).collect();
    let away = from_rock(basin);
    let sweep: Vec<(Vec<usize>, Vec<usize>)> = [(false, false), (true, false), (true, true), (false, true)]
        .map(|(x, z)| {
            let order = |n: usize, back: bool| if back { (0..n).rev().collect() } else { (0..n).collect() };
            (order(nx, x), order(nz, z))
        })
        .to_vec();
    for (columns, rows) in std::iter::repeat_n(&sweep, SWEEPS).flatten() {
        for &z in rows {
            for &x in columns {
                let i = z * nx + x;
                if basin.solid[i] {
                    continue;
                }
                if is_source[i] {
                    foam[i] = pool.foam;
                    continue;
                }
                let Balance { flows_in, leaves } = balance(pool, basin, faces, i, &foam);
                let is_shore = away[i] < 1.2 * grid.cell;
                let washed = if is_shore { SHORE * pool.foam / pool.foam_life * grid.cell } else { 0.0 };
                foam[i] = (flows_in + washed) / leaves;
            }
        }
    }
    foam.iter().map(|f| f.min(1.0)).collect()
}

/// Flows of foam of a cell, metres per second: what its neighbours give it, and by what its own density is
/// multiplied when it leaves or decays.
pub struct Balance {
    /// What flows in.
    pub flows_in: f32,
    /// Share of its own density that flows out, mixes away, sinks and decays.
    pub leaves: f32,
}

/// Returns the balance of a cell.
pub fn balance(pool: &Pool, basin: &Basin, faces: &Faces, i: usize, foam: &[f32]) -> Balance {
    let grid = basin.grid;
    let nx = grid.size[0];
    let row = i / nx * (nx + 1) + i % nx;
    // Outward velocities through the four sides.
    let out = [-faces.x[row], faces.x[row + 1], -faces.z[i], faces.z[i + nx]];
    let sinks = -out.iter().sum::<f32>();
    let mut own = Balance { flows_in: 0.0, leaves: grid.cell / pool.foam_life + TAKEN_DOWN * sinks.max(0.0) };
    for (side, neighbour) in grid.neighbours(i).into_iter().enumerate() {
        let Some(j) = neighbour else {
            own.leaves += out[side].max(0.0);
            continue;
        };
        if !basin.solid[j] {
            let mixed = MIXING * (out[side].abs() + 0.02);
            own.leaves += out[side].max(0.0) + mixed;
            own.flows_in += ((-out[side]).max(0.0) + mixed) * foam[j];
        }
    }
    own
}
