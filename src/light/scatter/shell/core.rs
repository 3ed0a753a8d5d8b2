//! The core below a shell's inner surface: light that goes on into it, and through it where it is thin.
//!
//! The core is a slab of the deepest layer's matter between a vertex and the inner surface opposite, d metres
//! away. With κ = σ√(3(1 − ω')), diffusion passes the net flux
//!
//! ```text
//! H = κD·(J_i·coth κd − J_j / sinh κd) = κD·tanh(κd/2)·J_i + κD/sinh(κd)·(J_i − J_j)
//! ```
//!
//! out of a vertex i whose opposite has J_j; where there is no opposite side, κD·J_i. A beam that reaches the
//! core scatters there: a source s(z) = ω'·σ·J_beam·e^(−az) with a = σ/μ' sends ∫ s·sinh κ(d − z)/sinh κd dz
//! back to i and ∫ s·sinh κz/sinh κd dz on to j, in place of the ∫ s·e^(−κz) dz that an endless core sends
//! back. Along the surface, light spreads in the core too, where J falls as e^(−κz): by D/(2κ).

use glam::Vec3;

use super::graph::Graph;
use super::{Below, ShellMatter};

/// The inner surface opposite a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opposite {
    /// Vertices of the triangle there.
    pub vertices: [u32; 3],
    /// Their shares at the place, which add up to 1.
    pub shares: Vec3,
    /// Distance of the two inner surfaces along the normal, metres.
    pub distance: f32,
}

/// Core below a shell; empty for other shells.
#[derive(Clone, Debug, Default)]
pub struct Core {
    /// D along it times its depth, m².
    pub along: Vec3,
    /// Ways through it from each vertex: to which, and the conductance, m².
    pub ways: Vec<Vec<(u32, Vec3)>>,
    /// Net flux over J that it absorbs below each vertex.
    pub lost: Vec<Vec3>,
    /// Net flux over J that an endless core would absorb besides, times the area, m².
    pub kept: Vec<Vec3>,
    /// Net flux into each vertex that beams in thin parts of the core send, more than in an endless one, m².
    pub sources: Vec<Vec3>,
    /// Extinction and albedo of its matter, and κ.
    sigma: Vec3,
    albedo: Vec3,
    kappa: Vec3,
    /// Optical depth of the shell per metre of its thickness.
    above: Vec3,
}

impl Core {
    /// Core of a shell. `opposite` has an entry for each vertex, or none at all.
    pub fn new(matter: &ShellMatter, graph: &Graph, opposite: &[Option<Opposite>]) -> Core {
        if matter.below != Below::Core {
            return Core::default();
        }
        let count = graph.areas.len();
        let sigma = matter.extinction.last().copied().unwrap_or_default().max(Vec3::splat(1e-6));
        let albedo = matter.albedo.last().copied().unwrap_or_default();
        let endless = ((Vec3::ONE - albedo) * (1.0 / 3.0)).powf(0.5);
        let kappa = sigma * endless * 3.0;
        let found = || opposite.iter().flatten();
        let distances: f64 = found().map(|opposite| f64::from(opposite.distance)).sum();
        let half = (0.5 * distances / found().count().max(1) as f64) as f32;
        // White matter without an opposite side: as far as a core is wide.
        let side = graph.areas.iter().map(|area| f64::from(*area)).sum::<f64>().sqrt() as f32;
        let most = if found().count() > 0 { half } else { 0.25 * side };
        let mut core = Core {
            along: ((kappa * 2.0).max(Vec3::splat(1.0 / most.max(1e-12))) * sigma * 3.0).recip(),
            ways: vec![Vec::new(); count],
            lost: vec![endless; count],
            kept: vec![Vec3::ZERO; count],
            sources: vec![Vec3::ZERO; count],
            sigma,
            albedo,
            kappa,
            above: matter.extinction.iter().sum::<Vec3>() / matter.extinction.len().max(1) as f32,
        };
        for (i, opposite) in opposite.iter().enumerate() {
            let Some(Opposite { vertices, shares, distance }) = opposite else { continue };
            let area = graph.areas[i];
            let deep = kappa * least(*distance);
            let tanh = (deep * 0.5).map(f32::tanh);
            core.lost[i] = endless * tanh;
            core.kept[i] = endless * (Vec3::ONE - tanh) * area;
            // κD/sinh(κd) = D/d · κd/sinh(κd).
            let conductance = deep.map(over_sinh) / (sigma * (3.0 * least(*distance)));
            for (vertex, share) in vertices.iter().zip(shares.to_array()) {
                // Rays from either side find a way, each for half of it.
                let own = conductance * (0.5 * area * share);
                if *vertex as usize != i && own != Vec3::ZERO {
                    core.ways[i].push((*vertex, own));
                    core.ways[*vertex as usize].push((i as u32, own));
                }
            }
        }
        core
    }

    /// Adds what a beam scatters in the thin core below vertex `i`. `mu` > 0 is its cosine inside, and
    /// `intensity` what passed the outer surface.
    pub fn add_beam(&mut self, graph: &Graph, (i, opposite): (usize, &Opposite), mu: f32, intensity: Vec3) {
        let d = least(opposite.distance);
        let passed = (self.above * (-graph.thickness[i] / mu.max(1e-3))).exp();
        let strength = intensity * passed * self.sigma * self.albedo * (0.25 * graph.areas[i]);
        let (mut back, mut on) = (Vec3::ZERO, Vec3::ZERO);
        for c in 0..3 {
            let kappa = self.kappa[c];
            let mut a = self.sigma[c] / mu.max(1e-3);
            // The quotient below has a limit where both are equal.
            if (a - kappa).abs() < 2e-2 * a {
                a = 1.02 * kappa.max(a);
            }
            let sinh = over_sinh(kappa * d) / d;
            let coth = if kappa * d < 1e-3 { 1.0 / d } else { kappa / (kappa * d).tanh() };
            let (left, scale) = ((-a * d).exp(), 1.0 / (a * a - kappa * kappa));
            back[c] = ((a - coth + sinh * left) * scale).max(0.0) - 1.0 / (a + kappa);
            on[c] = ((sinh - left * (a + coth)) * scale).max(0.0);
            // What is left of the beam scatters in the shell there.
            let shell = 1.0 - (-self.above[c] * graph.thickness[i] / mu.max(1e-3)).exp();
            on[c] += left * shell * mu / self.sigma[c];
        }
        self.sources[i] += strength * back;
        for (vertex, share) in opposite.vertices.iter().zip(opposite.shares.to_array()) {
            self.sources[*vertex as usize] += strength * on * share;
        }
    }
}

/// A distance that is not 0, metres.
fn least(distance: f32) -> f32 {
    distance.max(1e-7)
}

/// x/sinh(x).
fn over_sinh(x: f32) -> f32 {
    match x {
        x if x < 1e-3 => 1.0,
        x if x > 60.0 => 0.0,
        x => x / x.sinh(),
    }
}
