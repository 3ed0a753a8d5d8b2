//! Diffuse light in shells against exact slabs, published values, random walks and conservation laws.

mod columns;
mod fibres;
mod sideways;

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use taki::light::Light;
use taki::light::scatter::shell::{Below, Opposite, ShellDiffuse, ShellMatter, Surroundings};
use taki::light::scatter::slab::exponential_integrals;
use taki::mapping::shell::{Shell, Side, SurfaceMesh};
use taki::util::monitor::Unwatched;

/// A flat shell of `nx` × `ny` squares of side `step`, `thickness` metres below z = 0. Vertex x + y·(nx + 1)
/// lies at x·step, y·step.
fn flat([nx, ny]: [u32; 2], step: f32, thickness: impl Fn(usize) -> f32) -> Shell {
    let mut mesh = SurfaceMesh::default();
    for y in 0..=ny {
        for x in 0..=nx {
            mesh.thickness.push(thickness(mesh.positions.len()));
            mesh.positions.push(Vec3::new(x as f32, y as f32, 0.0) * step);
            mesh.uv.push(Vec2::new(x as f32, y as f32));
        }
    }
    for y in 0..ny {
        for x in 0..nx {
            let at = |dx: u32, dy: u32| (y + dy) * (nx + 1) + x + dx;
            // Diagonals in turn, so that neither direction is preferred.
            match (x + y) % 2 {
                0 => mesh.triangles.extend([[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]),
                _ => mesh.triangles.extend([[at(0, 0), at(1, 0), at(0, 1)], [at(1, 0), at(1, 1), at(0, 1)]]),
            }
        }
    }
    Shell::new(&mesh, Side::Inward).expect("a flat shell")
}

/// Even matter in `cells` layers, with an extinction of 1/m.
fn even(cells: usize, omega: f32, below: Below) -> ShellMatter {
    ShellMatter {
        extinction: vec![Vec3::ONE; cells],
        albedo: vec![Vec3::splat(omega); cells],
        eta: 1.0,
        below,
    }
}

/// A light of intensity 1 whose direction has the cosine `mu` with +z.
fn light(mu: f64) -> Light {
    let to_light = Vec3::new((1.0 - mu * mu).sqrt() as f32, 0.0, mu as f32);
    Light::Directional { to_light, intensity: Vec3::ONE }
}

fn solve(shell: &Shell, layers: usize, matter: &ShellMatter, surroundings: &Surroundings) -> ShellDiffuse {
    ShellDiffuse::new(shell, layers, matter, surroundings, &Unwatched).expect("nobody stops it")
}

/// J of the first colour below a vertex.
fn column(solved: &ShellDiffuse, vertex: usize) -> Vec<f64> {
    let own = &solved.values[vertex * (solved.layers + 1)..][..solved.layers + 1];
    own.iter().map(|value| f64::from(value.x)).collect()
}

/// J between its values, at a depth from 0 to 1.
fn between(values: &[f64], depth: f64) -> f64 {
    let at = depth.clamp(0.0, 1.0) * (values.len() - 1) as f64;
    let first = (at as usize).min(values.len() - 2);
    values[first] + (values[first + 1] - values[first]) * (at - first as f64)
}

/// J in the middle of a flat shell of even matter.
fn in_slab(x: f64, omega: f64, layers: usize, below: Below, surroundings: &Surroundings) -> Vec<f64> {
    let shell = flat([2, 2], x as f32, |_| x as f32);
    column(&solve(&shell, layers, &even(2 * layers, omega as f32, below), surroundings), 4)
}

/// Shares of a beam's light that leave a slab of even matter above and below, without the beam: light that
/// scattered once, exactly, and light of J.
fn fluxes(values: &[f64], x: f64, omega: f64, mu: f64) -> [f64; 2] {
    let from_below = mu < 0.0;
    let mu = mu.abs();
    const STEPS: usize = 4000;
    let mut sums = [0.0; 2];
    for i in 0..STEPS {
        // Dense near both ends.
        let end = |i: usize| 0.5 - 0.5 * (PI * i as f64 / STEPS as f64).cos();
        let [a, b] = [end(i), end(i + 1)];
        let tau = 0.5 * (a + b) * x;
        let passed = if from_below { x - tau } else { tau };
        let j = between(values, 0.5 * (a + b)) + 0.25 * (-passed / mu).exp();
        let e2 = |t: f64| exponential_integrals(t)[1];
        for (sum, way) in sums.iter_mut().zip([tau, x - tau]) {
            *sum += 2.0 * omega * j * e2(way) * (b - a) * x / mu;
        }
    }
    sums
}
