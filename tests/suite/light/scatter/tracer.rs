//! A brute-force path tracer of the tiled volume, for tests. It samples free flights with the exact walk, and
//! adds the light that reaches every collision. It computes in float64, except for the walk's parameters, and
//! uses nothing of `taki::light::scatter`.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, IVec3, Vec3};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use taki::volume::VolumeTexture;
use taki::walk::Walk;

/// A tile of cells, each with an extinction. It repeats endlessly in x and y, and ends at z = 0 and z = nz.
pub struct Medium {
    pub size: IVec3,
    /// Edges of a cell in metres.
    pub edges: DVec3,
    /// Extinction of each cell in 1/m, x fastest.
    pub sigma: Vec<f64>,
    /// Unit direction of each cell's fibres.
    pub t: Vec<Vec3>,
}

/// Phase function Φ in 1/sr.
#[derive(Clone, Copy)]
pub enum Phase {
    /// Function of Henyey and Greenstein with mean cosine g; 0 is isotropic.
    HenyeyGreenstein(f64),
    /// Function of the fibre and of the directions to the light and to the eye. Directions are sampled
    /// uniformly.
    Given(fn(Vec3, DVec3, DVec3) -> f64),
}

/// Means over a pixel's paths, for a light of intensity I = E/π = 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Radiance of light scattered once.
    pub single: f64,
    /// Radiance of light scattered twice or more.
    pub multiple: f64,
    /// Variance of the mean of `multiple`.
    pub variance: f64,
}

impl Medium {
    /// Medium with one extinction everywhere, in cells of 1 m × 1 m × `height`.
    pub fn uniform(layers: i32, height: f64, sigma: f64) -> Medium {
        let cells = 16 * layers as usize;
        Medium {
            size: IVec3::new(4, 4, layers),
            edges: DVec3::new(1.0, 1.0, height),
            sigma: vec![sigma; cells],
            t: vec![Vec3::Y; cells],
        }
    }

    /// Medium of a volume texture in cells of 1 m, with the mean optical depth `depth` across the slab.
    pub fn of_volume(volume: &VolumeTexture, depth: f64) -> Medium {
        let rho = |c: &taki::volume::Cell| c.rho() as f64;
        let mean = volume.cells.iter().map(rho).sum::<f64>() / volume.cells.len() as f64;
        let sigma = depth / (mean * volume.size[2] as f64);
        Medium {
            size: IVec3::from_array(volume.size.map(|n| n as i32)),
            edges: DVec3::ONE,
            sigma: volume.cells.iter().map(|c| rho(c) * sigma).collect(),
            t: volume.cells.iter().map(|c| c.v()).collect(),
        }
    }

    pub fn index(&self, c: IVec3) -> usize {
        ((c.z * self.size.y + c.y) * self.size.x + c.x) as usize
    }

    /// Cells of a ray inside the slab: index and length in metres.
    pub fn cells(&self, p: DVec3, d: DVec3) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (nz, d) = (self.size.z, (d / self.edges).as_vec3());
        Walk::new(self.size, p.as_vec3(), d, f32::INFINITY)
            .take_while(move |c| (0..nz).contains(&c.cell.z))
            .map(|c| (self.index(c.cell), (c.t_exit - c.t_enter) as f64))
    }

    /// Optical depth up to the point where the ray leaves the slab. The sum stops at 60, because nothing
    /// counts beyond.
    pub fn depth(&self, p: DVec3, d: DVec3) -> f64 {
        let mut sum = 0.0;
        for (i, length) in self.cells(p, d) {
            sum += self.sigma[i] * length;
            if sum > 60.0 {
                break;
            }
        }
        sum
    }

    /// Cell and point at which a ray has passed the optical depth `tau`; `None` if it leaves the slab before.
    pub fn flight(&self, p: DVec3, d: DVec3, tau: f64) -> Option<(usize, DVec3)> {
        let (mut left, mut t) = (tau, 0.0);
        for (i, length) in self.cells(p, d) {
            let depth = self.sigma[i] * length;
            if depth > left {
                let mut q = p + d / self.edges * (t + left / self.sigma[i]);
                for axis in 0..2 {
                    q[axis] = q[axis].rem_euclid(self.size[axis] as f64);
                }
                q.z = q.z.clamp(1e-6, self.size.z as f64 - 1e-6);
                return Some((i, q));
            }
            left -= depth;
            t += length;
        }
        None
    }

    fn phi(&self, phase: Phase, cell: usize, l: DVec3, e: DVec3) -> f64 {
        match phase {
            Phase::HenyeyGreenstein(g) => henyey_greenstein(g, -l.dot(e)),
            Phase::Given(phi) => phi(self.t[cell], l, e),
        }
    }

    /// Radiances towards `e` of the pixels of one tile, with `paths` paths each. `l` and `e` are unit vectors
    /// that point outward. −z is the seen side.
    pub fn render(
        &self,
        [e, l]: [DVec3; 2],
        omega: f64,
        phase: Phase,
        pixels: usize,
        paths: u32,
    ) -> Vec<Pixel> {
        let side = |n: i32, i: usize, x: f64| (i as f64 + x) / pixels as f64 * n as f64;
        (0..pixels * pixels)
            .into_par_iter()
            .map(|i| {
                // Pictures from several sides must not share their errors.
                let mut rng =
                    Pcg64Mcg::seed_from_u64(e.x.to_bits() ^ e.z.to_bits().rotate_left(32) ^ i as u64);
                let (mut single, mut sum, mut squares) = (0.0, 0.0, 0.0);
                for _ in 0..paths {
                    let x = side(self.size.x, i % pixels, rng.random());
                    let y = side(self.size.y, i / pixels, rng.random());
                    let z = if e.z < 0.0 { 0.0 } else { self.size.z as f64 };
                    let [one, more] = self.path(DVec3::new(x, y, z), [e, l], omega, phase, &mut rng);
                    single += one;
                    sum += more;
                    squares += more * more;
                }
                let n = paths as f64;
                let multiple = sum / n;
                let variance = (squares / n - multiple * multiple).max(0.0) / n;
                Pixel { single: single / n, multiple, variance }
            })
            .collect()
    }

    /// Radiances of one path from the eye: of light scattered once, and of light scattered more often. The
    /// first flight always collides.
    fn path(
        &self,
        face: DVec3,
        [e, l]: [DVec3; 2],
        omega: f64,
        phase: Phase,
        rng: &mut impl Rng,
    ) -> [f64; 2] {
        let collides = 1.0 - (-self.depth(face, -e)).exp();
        let tau = -(1.0 - rng.random::<f64>() * collides).ln();
        let (mut e, mut weight, mut result) = (e, collides, [0.0; 2]);
        let mut at = self.flight(face, -e, tau);
        let mut order = 0;
        while let Some((cell, p)) = at {
            weight *= omega;
            let seen = (-self.depth(p, l)).exp();
            result[order] += weight * PI * self.phi(phase, cell, l, e) * seen;
            order = 1;
            // Russian roulette ends paths whose light is nearly absorbed.
            if weight < 0.05 {
                if rng.random::<bool>() {
                    break;
                }
                weight *= 2.0;
            }
            let from = match phase {
                Phase::HenyeyGreenstein(g) => sample(g, -e, rng),
                Phase::Given(phi) => {
                    let d = sample(0.0, DVec3::Z, rng);
                    weight *= 4.0 * PI * phi(self.t[cell], d, e);
                    d
                }
            };
            // `from` points to where the light comes from. The path continues along it, away from the eye.
            e = -from;
            at = self.flight(p, from, -(1.0 - rng.random::<f64>()).ln());
        }
        result
    }
}

/// Φ of Henyey and Greenstein 1941 in 1/sr.
pub fn henyey_greenstein(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

/// Samples a direction at a Henyey-Greenstein angle to `d`.
fn sample(g: f64, d: DVec3, rng: &mut impl Rng) -> DVec3 {
    let u: f64 = rng.random();
    let cos = if g == 0.0 {
        1.0 - 2.0 * u
    } else {
        let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
        ((1.0 + g * g - s * s) / (2.0 * g)).clamp(-1.0, 1.0)
    };
    let sin = (1.0 - cos * cos).sqrt();
    let (s, c) = (TAU * rng.random::<f64>()).sin_cos();
    let (x, y) = d.any_orthonormal_pair();
    (d * cos + x * (sin * c) + y * (sin * s)).normalize()
}
