//! The core below a shell's inner surface: light that goes on into it, and through it where it is thin.
//!
//! The core is a slab of the deepest layer's matter between a vertex and the inner surface opposite, d metres
//! away. With κ = σ√(3(1 − ω')), diffusion passes the net flux
//!
//! ```text
//! H = κD·(J_i·coth κd − J_j / sinh κd) = κD·tanh(κd/2)·J_i + κD/sinh(κd)·(J_i − J_j)
//! ```
//!
//! out of a vertex i whose opposite has J_j; where there is no opposite side, κD·J_i. Along the surface, light
//! spreads in the core too, where J falls as e^(−κz): by D/(2κ).

use glam::Vec3;

use super::graph::Graph;
use super::{Below, ShellMatter};

/// The inner surface opposite a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opposite {
    /// Vertices of the triangle there, and their shares at the place.
    pub vertices: [u32; 3],
    /// Shares, which add up to 1.
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
}

impl Core {
    /// Core of a shell. `opposite` has an entry for each vertex, or none at all.
    pub fn new(matter: &ShellMatter, graph: &Graph, opposite: &[Option<Opposite>]) -> Core {
        if matter.below != Below::Core {
            return Core::default();
        }
        let count = graph.areas.len();
        let sigma = matter.extinction.last().copied().unwrap_or_default().max(Vec3::splat(1e-6));
        let absorbed = Vec3::ONE - matter.albedo.last().copied().unwrap_or_default();
        let endless = (absorbed * (1.0 / 3.0)).powf(0.5);
        let kappa = sigma * (absorbed * 3.0).powf(0.5);
        let found = || opposite.iter().flatten();
        let distances: f64 = found().map(|opposite| f64::from(opposite.distance)).sum();
        let half = (0.5 * distances / found().count().max(1) as f64) as f32;
        // White matter without an opposite side: as far as a core is wide.
        let side = graph.areas.iter().map(|area| f64::from(*area)).sum::<f64>().sqrt() as f32;
        let most = if half > 0.0 { half } else { 0.25 * side };
        let mut core = Core {
            along: ((kappa * 2.0).max(Vec3::splat(1.0 / most.max(1e-12))) * sigma * 3.0).recip(),
            ways: vec![Vec::new(); count],
            lost: vec![endless; count],
            kept: vec![Vec3::ZERO; count],
        };
        for (i, opposite) in opposite.iter().enumerate() {
            let Some(Opposite { vertices, shares, distance }) = opposite else { continue };
            let area = graph.areas[i];
            let deep = kappa * distance.max(1e-9);
            let tanh = (deep * 0.5).map(f32::tanh);
            core.lost[i] = endless * tanh;
            core.kept[i] = endless * (Vec3::ONE - tanh) * area;
            // κD/sinh(κd) = D/d · κd/sinh(κd).
            let sinh = deep.map(|x| {
                if x < 1e-3 {
                    1.0
                } else if x > 60.0 {
                    0.0
                } else {
                    x / x.sinh()
                }
            });
            let conductance = sinh / (sigma * (3.0 * distance.max(1e-9)));
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
}
