//! §5 Diffuse light in shells: mean intensity J of light that scattered at least once, at the vertices of a
//! shell's mesh and at several depths below each.
//!
//! Below every vertex J is first that of an endless layered slab, exact (`column`, `table`); then light
//! spreads along the shell and through its core by diffusion (`sideways`, `core`).

mod column;
mod core;
mod graph;
mod matter;
mod pieces;
mod sideways;
mod table;

use glam::Vec3;
use rayon::prelude::*;

use super::optics::Surface;
use crate::light::Light;
use crate::mapping::shell::Shell;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
pub use core::Opposite;
pub use matter::layer_colors;

/// Most intervals between values of J below a vertex. Where a volume has more layers, values between are
/// interpolated.
const MOST_LAYERS: usize = 32;

/// Bytes of a value of J.
pub const DIFFUSE_BYTES: u64 = size_of::<Vec3>() as u64;

/// Bytes that a vertex takes while J is solved for between `layers` layers: six lists of values, the ways
/// to its neighbours, and what sorts them.
pub fn diffuse_work_bytes(layers: usize) -> u64 {
    6 * DIFFUSE_BYTES * (layers.clamp(1, MOST_LAYERS) as u64 + 1) + 400
}

/// Matter of a shell as its diffuse light meets it: a reduced medium, in which scattering is isotropic.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellMatter {
    /// Extinction of each layer of cells by colour, from the outer surface inwards, 1/m.
    pub extinction: Vec<Vec3>,
    /// Albedo ω' of each layer by colour, 0 to 1.
    pub albedo: Vec<Vec3>,
    /// Index of refraction behind the outer surface, at least 1.
    pub eta: f32,
    /// Matter below the inner surface.
    pub below: Below,
}

/// Matter below the inner surface of a shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// Nothing: light enters and leaves there as at the outer surface.
    Open,
    /// A diffuse surface.
    Opaque {
        /// Its albedo by colour.
        albedo: Vec3,
    },
    /// More of the deepest layer's matter.
    Core,
}

/// Light that shines on a shell, and inner surfaces opposite its vertices.
#[derive(Clone, Debug, Default)]
pub struct Surroundings<'a> {
    /// Lights.
    pub lights: &'a [Light],
    /// Share of each light that reaches each vertex past opaque matter, at the outer and at the inner
    /// surface. `None` without such matter.
    pub shares: Option<Vec<&'a [[f32; 2]]>>,
    /// Radiance from everywhere.
    pub ambient: Vec3,
    /// For a core: the inner surface opposite each vertex. May be empty.
    pub opposite: &'a [Option<Opposite>],
}

/// J in one shell, in the unit of lights' intensities (irradiance/π). Light of lights that did not scatter
/// is not in it. The ambient light is, scattered or not.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellDiffuse {
    /// Number of layers between the values below a vertex.
    pub layers: usize,
    /// J by colour: of vertex v at depth i/layers at v·(layers + 1) + i.
    pub values: Vec<Vec3>,
    /// Steps of the solver of light along the shell.
    pub steps: usize,
}

impl ShellDiffuse {
    /// Solves for J between `layers` layers of equal thickness.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn new(
        shell: &Shell,
        layers: usize,
        matter: &ShellMatter,
        surroundings: &Surroundings,
        monitor: &dyn Monitor,
    ) -> Result<ShellDiffuse> {
        let own = layers.clamp(1, MOST_LAYERS);
        let matter = &matter.with_at_most(2 * MOST_LAYERS);
        let pieces = pieces::pieces(own, matter.extinction.len());
        let graph = graph::Graph::new(shell);
        monitor.progress("diffuse light in shells", 0, 1)?;
        let range = [f32::min, f32::max].map(|f| graph.thickness.iter().copied().reduce(f).unwrap_or(0.0));
        let table = table::Table::new(matter, &pieces, own, range);
        let normals = shell.normals();
        let surface = Surface { eta: matter.eta, roughness: 1.0 };
        // Cosine with the normal, intensity behind the surface, and shares of a light at a vertex.
        let arrives = |vertex: usize, number: usize, light: &Light| {
            let (to_light, intensity) = light.at(shell.points[2 * vertex]);
            let shares = surroundings.shares.as_ref().map_or([1.0; 2], |all| all[number][vertex]);
            let mu = normals[vertex].dot(to_light);
            let enters = if mu > 0.0 { (1.0 - surface.fresnel(mu)) * surface.stretch(mu) } else { 1.0 };
            (mu, intensity * enters, shares)
        };
        let mut values = vec![Vec3::ZERO; shell.vertices() * (own + 1)];
        values.par_chunks_mut(own + 1).enumerate().for_each(|(vertex, values)| {
            let thickness = graph.thickness[vertex];
            table.add_ambient(thickness, surroundings.ambient, values);
            for (number, light) in surroundings.lights.iter().enumerate() {
                let (mu, intensity, shares) = arrives(vertex, number, light);
                table.add_beam(thickness, mu, intensity, shares, values);
            }
        });
        let mut core = core::Core::new(matter, &graph, surroundings.opposite);
        let opposite = if matter.below == Below::Core { surroundings.opposite } else { &[] };
        let thin = opposite.iter().enumerate();
        for (vertex, opposite) in thin.filter_map(|(vertex, opposite)| Some((vertex, opposite.as_ref()?))) {
            for (number, light) in surroundings.lights.iter().enumerate() {
                let (mu, intensity, [_, share]) = arrives(vertex, number, light);
                if mu > 0.0 {
                    core.add_beam(&graph, (vertex, opposite), surface.refracted(mu), intensity * share);
                }
            }
        }
        let sideways = sideways::Sideways::new(matter, &pieces, own, &graph, core);
        let steps = sideways.spread(&mut values, monitor)?;
        if own < layers {
            values = resampled(&values, own, layers);
        }
        Ok(ShellDiffuse { layers, values, steps })
    }
}

/// Values of columns with `from` intervals at `to` of them.
fn resampled(values: &[Vec3], from: usize, to: usize) -> Vec<Vec3> {
    let of_column = |own: &[Vec3]| {
        let at = |i: usize| {
            let place = i as f32 * from as f32 / to as f32;
            let first = (place as usize).min(from - 1);
            own[first].lerp(own[first + 1], place - first as f32)
        };
        (0..=to).map(at).collect::<Vec<_>>()
    };
    values.par_chunks(from + 1).flat_map_iter(of_column).collect()
}

/// Moments of Fresnel's reflectance for light that meets a surface from inside: ∫2μR dμ and ∫3μ²R dμ.
fn fresnel_moments(eta: f32) -> [f32; 2] {
    let sums = column::quadrature(eta).into_iter().fold([0.0; 2], |[one, two], [mu, weight, r]| {
        [one + 2.0 * mu * weight * r, two + 3.0 * mu * mu * weight * r]
    });
    sums.map(|sum| sum as f32)
}

/// Reflectance of the surface for light that meets it from inside with the cosine `mu`.
fn from_inside(eta: f64, mu: f64) -> f64 {
    let outside = (1.0 - (1.0 - mu * mu) * eta * eta).max(0.0).sqrt();
    let (across, along) = (
        (eta * mu - outside) / (eta * mu + outside).max(1e-300),
        (mu - eta * outside) / (mu + eta * outside).max(1e-300),
    );
    0.5 * (across * across + along * along)
}
