//! Light that spreads along the surface: the correction δ of the columns' J by diffusion in the whole shell.
//!
//! Columns are solved exactly, as if each were endless. Between them light diffuses with D = 1/(3σ). With C
//! the columns' operator and L ≥ 0 that of diffusion along the surface, (C + L)(J + δ) = C·J. Diffusion
//! stands for C on the left only, where it moves light that has scattered several times:
//!
//! ```text
//! (C_diffusion + L) δ = −L·J
//! ```
//!
//! The unknowns are δ at all depths of all vertices (finite volumes). The matrix is symmetric and has no
//! negative eigenvalue, so conjugate gradients solve it. The preconditioner solves the tridiagonal part below
//! each vertex: shells are thin, so little light goes far along them. The three colours are solved at once,
//! each with coefficients of its own. Sums are made over fixed pieces and in one order, so the bits do not
//! depend on the number of threads.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::core::Core;
use super::graph::{Graph, Way};
use super::pieces::Piece;
use super::{Below, ShellMatter, fresnel_moments};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// Vertices in a piece of work.
const AT_ONCE: usize = 128;
/// Share of the norm of J at which the error of δ is small enough, squared.
const ENOUGH: f64 = 1e-7;
/// Maximum number of steps. Even meshes whose edges are a twentieth of the depth need fewer.
const MOST_STEPS: usize = 200;
/// Least optical depth between two values. Across less they are equal anyway.
const THINNEST: f32 = 1e-3;

/// Diffusion in a shell.
pub struct Sideways<'a> {
    graph: &'a Graph,
    /// Number of values below a vertex.
    count: usize,
    /// Optical depth between two values, per metre of the column.
    between: Vec<Vec3>,
    /// Optical depth of absorption around a value, per metre of the column.
    absorbed: Vec<Vec3>,
    /// D times the share of the column around a value, metres.
    along: Vec<Vec3>,
    /// Net flux H that leaves through the two surfaces, over J there.
    leaves: [Vec3; 2],
    core: Core,
}

impl<'a> Sideways<'a> {
    /// Diffusion in a shell of this matter.
    pub fn new(matter: &ShellMatter, pieces: &[Piece], layers: usize, graph: &'a Graph, core: Core) -> Self {
        let mut between = vec![Vec3::ZERO; layers];
        let (mut absorbed, mut along) = (vec![Vec3::ZERO; layers + 1], vec![Vec3::ZERO; layers + 1]);
        // Light crosses a shell that is thinner than its free path, and goes no farther along it.
        let least = 1.0 / graph.mean_thickness().max(1e-12);
        for piece in pieces {
            let length = piece.ends[1] - piece.ends[0];
            let sigma = matter.extinction[piece.layer];
            between[piece.interval] += sigma * length;
            absorbed[piece.value] += sigma * (Vec3::ONE - matter.albedo[piece.layer]) * length;
            along[piece.value] += length / (3.0 * (sigma * sigma + least * least).powf(0.5));
        }
        let [first, second] = fresnel_moments(matter.eta);
        let above = Vec3::splat(0.5 * (1.0 - first) / (1.0 + second));
        let below = match matter.below {
            Below::Open => Vec3::splat(0.5),
            Below::Opaque { albedo } => 0.5 * (Vec3::ONE - albedo) / (Vec3::ONE + albedo),
            Below::Core => Vec3::ZERO,
        };
        Sideways { graph, count: layers + 1, between, absorbed, along, leaves: [above, below], core }
    }

    /// Conductance between value `i` below a vertex and the next.
    #[inline]
    fn conductance(&self, i: usize, thickness: f32) -> Vec3 {
        ((self.between[i] * thickness).max(Vec3::splat(THINNEST)) * 3.0).recip()
    }

    /// Diagonal of a column's matrix, without what its values pass to one another.
    #[inline]
    fn loss(&self, vertex: usize, i: usize) -> Vec3 {
        let mut loss = self.absorbed[i] * self.graph.thickness[vertex];
        if i == 0 {
            loss += self.leaves[0];
        }
        if i + 1 == self.count {
            loss += self.leaves[1];
            if let Some(lost) = self.core.lost.get(vertex) {
                loss += *lost;
            }
        }
        loss
    }

    /// Net light that value `i` of a vertex passes to those beside it and through the core.
    #[inline]
    fn passed_sideways(&self, values: &[Vec3], vertex: usize, i: usize) -> Vec3 {
        let own = values[vertex * self.count + i];
        let is_last = i + 1 == self.count;
        let along_core = if is_last { self.core.along } else { Vec3::ZERO };
        let mut sum = Vec3::ZERO;
        for way in self.graph.ways(vertex) {
            let other = values[way.to as usize * self.count + i];
            sum += (own - other) * (self.along[i] * way.area + along_core * way.width);
        }
        if is_last && let Some(ways) = self.core.ways.get(vertex) {
            for (to, conductance) in ways {
                sum += (own - values[*to as usize * self.count + i]) * *conductance;
            }
        }
        sum
    }

    /// The matrix times the values of a vertex.
    fn times(&self, values: &[Vec3], vertex: usize, out: &mut [Vec3]) {
        let own = &values[vertex * self.count..][..self.count];
        let (area, thickness) = (self.graph.areas[vertex], self.graph.thickness[vertex]);
        for (i, out) in out.iter_mut().enumerate() {
            let mut sum = own[i] * self.loss(vertex, i);
            if i > 0 {
                sum += (own[i] - own[i - 1]) * self.conductance(i - 1, thickness);
            }
            if i + 1 < self.count {
                sum += (own[i] - own[i + 1]) * self.conductance(i, thickness);
            }
            *out = sum * area + self.passed_sideways(values, vertex, i);
        }
    }

    /// Inverse pivots of the part of the matrix that stands below one vertex, over its area.
    fn pivots(&self, vertex: usize, out: &mut [Vec3]) {
        let (area, thickness) = (self.graph.areas[vertex], self.graph.thickness[vertex]);
        let scale = if area > 0.0 { 1.0 / area } else { 0.0 };
        let ways = self.graph.ways(vertex);
        let [to_others, width] =
            [|way: &Way| way.area, |way: &Way| way.width].map(|of| ways.iter().map(of).sum::<f32>() * scale);
        let mut above = Vec3::ZERO;
        for i in 0..self.count {
            let mut diagonal = self.loss(vertex, i) + self.along[i] * to_others + above;
            if i + 1 == self.count {
                diagonal += self.core.along * width;
                if let Some(ways) = self.core.ways.get(vertex) {
                    diagonal += ways.iter().map(|(_, conductance)| *conductance * scale).sum::<Vec3>();
                }
            }
            if i > 0 {
                diagonal -= above * above * out[i - 1];
            }
            let below = if i + 1 < self.count { self.conductance(i, thickness) } else { Vec3::ZERO };
            diagonal += below;
            out[i] = diagonal.max(Vec3::splat(1e-9)).recip();
            above = below;
        }
    }

    /// Solves that part of the matrix: `values` hold the right side before and the result after.
    fn solve_column(&self, vertex: usize, pivots: &[Vec3], values: &mut [Vec3]) {
        let area = self.graph.areas[vertex];
        let thickness = self.graph.thickness[vertex];
        let scale = if area > 0.0 { 1.0 / area } else { 0.0 };
        for i in 1..self.count {
            let above = values[i - 1] * pivots[i - 1] * self.conductance(i - 1, thickness);
            values[i] += above;
        }
        let mut next = Vec3::ZERO;
        for i in (0..self.count).rev() {
            let below = if i + 1 < self.count { next * self.conductance(i, thickness) } else { Vec3::ZERO };
            next = (values[i] + below) * pivots[i];
            values[i] = next * scale;
        }
    }

    /// Adds δ to J, and returns the number of steps.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub fn spread(&self, values: &mut [Vec3], monitor: &dyn Monitor) -> Result<usize> {
        let chunk = AT_ONCE * self.count;
        let of = |k: usize, i: usize| k * AT_ONCE + i;
        let mut pivots = vec![Vec3::ZERO; values.len()];
        let mut rest = vec![Vec3::ZERO; values.len()];
        pivots.par_chunks_mut(self.count).enumerate().for_each(|(vertex, own)| self.pivots(vertex, own));
        let known: &[Vec3] = values;
        rest.par_chunks_mut(self.count).enumerate().for_each(|(vertex, own)| {
            for (i, rest) in own.iter_mut().enumerate() {
                *rest = -self.passed_sideways(known, vertex, i);
            }
            // The columns' core has no end.
            if let (Some(kept), Some(rest)) = (self.core.kept.get(vertex), own.last_mut()) {
                *rest += *kept * known[vertex * self.count + self.count - 1] + self.core.sources[vertex];
            }
        });
        // ‖J‖² in the norm of the matrix.
        let norm = summed(known.par_chunks(chunk).enumerate().map(|(k, part)| {
            let mut out = vec![Vec3::ZERO; self.count];
            let mut sum = DVec3::ZERO;
            for (i, own) in part.chunks(self.count).enumerate() {
                self.times(known, of(k, i), &mut out);
                sum += dot(own, &out);
            }
            sum
        }));
        let precondition = |rest: &[Vec3], out: &mut Vec<Vec3>| {
            summed(out.par_chunks_mut(chunk).zip(rest.par_chunks(chunk)).enumerate().map(
                |(k, (out, rest))| {
                    out.copy_from_slice(rest);
                    for (i, own) in out.chunks_mut(self.count).enumerate() {
                        let vertex = of(k, i);
                        self.solve_column(vertex, &pivots[vertex * self.count..][..self.count], own);
                    }
                    dot(out, rest)
                },
            ))
        };
        let mut solved = vec![Vec3::ZERO; rest.len()];
        let mut product = vec![Vec3::ZERO; rest.len()];
        let mut left = precondition(&rest, &mut solved);
        let mut way = solved.clone();
        let mut steps = 0;
        while steps < MOST_STEPS && left.cmpgt(norm * ENOUGH).any() {
            monitor.progress("diffuse light in shells", steps as u64, MOST_STEPS as u64)?;
            let curve = summed(product.par_chunks_mut(chunk).enumerate().map(|(k, part)| {
                let mut sum = DVec3::ZERO;
                for (i, out) in part.chunks_mut(self.count).enumerate() {
                    self.times(&way, of(k, i), out);
                    sum += dot(&way[of(k, i) * self.count..][..self.count], out);
                }
                sum
            }));
            let far = ratio(left, curve).as_vec3();
            values
                .par_chunks_mut(chunk)
                .zip(rest.par_chunks_mut(chunk))
                .zip(way.par_chunks(chunk).zip(product.par_chunks(chunk)))
                .for_each(|((value, rest), (way, product))| {
                    value.iter_mut().zip(way).for_each(|(value, way)| *value += *way * far);
                    rest.iter_mut().zip(product).for_each(|(rest, product)| *rest -= *product * far);
                });
            let before = left;
            left = precondition(&rest, &mut solved);
            let share = ratio(left, before).as_vec3();
            way.par_chunks_mut(chunk).zip(solved.par_chunks(chunk)).for_each(|(way, solved)| {
                way.iter_mut().zip(solved).for_each(|(way, solved)| *way = *way * share + *solved);
            });
            steps += 1;
        }
        values.par_iter_mut().for_each(|value| *value = value.max(Vec3::ZERO));
        Ok(steps)
    }
}

fn dot(a: &[Vec3], b: &[Vec3]) -> DVec3 {
    a.iter().zip(b).map(|(a, b)| (*a * *b).as_dvec3()).sum()
}

/// Sum in one order, whatever the number of threads.
fn summed(parts: impl IndexedParallelIterator<Item = DVec3>) -> DVec3 {
    parts.collect::<Vec<_>>().into_iter().sum()
}

/// Quotients of two sums by colour; 0 where a colour has no light.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    let of = |c: usize| if b[c] > 0.0 { a[c] / b[c] } else { 0.0 };
    DVec3::new(of(0), of(1), of(2))
}
