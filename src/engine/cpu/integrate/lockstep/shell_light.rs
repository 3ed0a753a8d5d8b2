//! Light of cells in shells, eight cells side by side. Twin of `Integrator::shell_light_of`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::Vec3;

use super::cells::{k_codes, v_codes, words};
use super::fibre::{Exponent, Metric, Moments, Spread, psi_parts};
use super::ink::Ink;
use super::shell::ShellHit;
use super::strand;
use crate::engine::cpu::integrate::Integrator;
use crate::engine::cpu::integrate::shell::Place;
use crate::engine::cpu::lights::light_at;
use crate::light::strand::ROOT_TO_TIP;
use crate::light::strand::table::StrandShading;
use crate::trace::lookup::Level;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3, Words};
use crate::volume::Cell;

/// A lit cell of a ray.
pub struct LitCell {
    /// Number of the ray's hit.
    pub hit: usize,
    pub cell: Cell,
    /// Share of the cell in what the eye sees.
    pub weight: f32,
    pub place: Place,
}

/// Up to eight lit cells, one a lane: all of the volume itself, or all of coarser levels.
#[derive(Default)]
pub struct LitCells {
    count: usize,
    /// Number of each ray's hit.
    hits: [usize; LANES],
    cells: [Cell; LANES],
    weight: Stored,
    d: Stored3,
    point: Stored3,
    /// Columns of J = world_from_cell.
    frame: [Stored3; 3],
    /// Colours, and k_s in 255ths, where any volume has colours.
    color: Stored3,
    k_s: Stored,
}

/// Lit cells in registers.
pub struct Lit<S: Simd> {
    /// k_d and k_s, in 255ths.
    k: [Floats<S>; 2],
    /// Second words of the cells.
    pub second: Words<S>,
    pub ink: Option<Ink<S>>,
    /// Directions to the eye.
    pub e: Lanes3<S>,
    /// Columns of J = world_from_cell.
    pub frame: [Lanes3<S>; 3],
    pub point: Lanes3<S>,
    pub weight: Floats<S>,
}

impl LitCells {
    /// Number of the next cell.
    #[inline]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether the cells must be shaded before another one is added.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a cell of a ray in the direction `d`. Returns its colour, if any volume has colours.
    #[inline]
    pub fn push(&mut self, integrator: &Integrator, lit: &LitCell, d: Vec3) -> Option<Vec3> {
        let (i, place) = (self.count, &lit.place);
        self.hits[i] = lit.hit;
        self.cells[i] = lit.cell;
        self.weight.0[i] = lit.weight;
        self.d.set(i, d);
        self.point.set(i, place.point);
        let frame = integrator.frame(&integrator.scene.shells[place.shell], place);
        self.frame[0].set(i, frame.x_axis);
        self.frame[1].set(i, frame.y_axis);
        self.frame[2].set(i, frame.z_axis);
        self.count += 1;
        let volume = integrator.scene.shells[place.shell].volume as usize;
        let ink = integrator.ink(volume, lit.cell.k_codes().1 as f32)?;
        self.color.set(i, ink.color);
        self.k_s.0[i] = ink.k_s;
        Some(ink.color)
    }

    /// Loads the cells.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S, integrator: &Integrator) -> Lit<S> {
        let [first, second] = words(simd, &self.cells);
        let mut k = k_codes(first);
        let ink =
            integrator.is_colored.then(|| Ink { color: self.color.load(simd), k_s: self.k_s.load(simd) });
        if let Some(ink) = &ink {
            k[1] = ink.k_s;
        }
        let d = self.d.load(simd);
        Lit {
            k,
            second,
            ink,
            e: Lanes3 { x: -d.x, y: -d.y, z: -d.z },
            frame: [self.frame[0].load(simd), self.frame[1].load(simd), self.frame[2].load(simd)],
            point: self.point.load(simd),
            weight: self.weight.load(simd),
        }
    }

    /// Adds the light of the cells to that of their rays, as cells of the kind 0 (the volume itself) or 1
    /// (coarser levels), and forgets them.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, sum: Lanes3<S>, kind: usize, hits: &mut [ShellHit]) {
        let mut stored = Stored3::default();
        stored.store(sum);
        for i in 0..self.count {
            hits[self.hits[i]].radiance[kind] += stored.get(i);
        }
        self.count = 0;
    }
}

impl<S: Simd> Lit<S> {
    /// Light that scatters once in the cells, for a light of `intensity` in the direction `l`, without the
    /// share of the cells and without V.
    #[inline(always)]
    pub fn once(
        &self,
        simd: S,
        integrator: &Integrator,
        (fibres, exponent): (&Fibres<S>, &Exponent),
        (l, intensity): (Lanes3<S>, Lanes3<S>),
    ) -> Lanes3<S> {
        let l_dot_e = l.dot(self.e);
        match integrator.strand.as_ref().filter(|_| integrator.strands_in_shells) {
            Some(shading) => {
                let cosines = fibres.cosines(shading, (l, self.e), &self.frame);
                intensity.by(strand::psi(simd, shading, self.k, cosines, l_dot_e))
            }
            None => {
                let parts = fibres.psi_parts(simd, self.k, exponent, l, self.e);
                match &self.ink {
                    Some(ink) => intensity.by(ink.lit(parts).times(f32x8::splat(simd, 1.0 / 255.0))),
                    None => intensity.times((parts[0] + parts[1]) * (1.0 / 255.0)),
                }
            }
        }
    }
}

/// Lit cells whose matter scatters light once.
pub struct Pending {
    pub cells: LitCells,
    /// V of each light.
    visible: Vec<Stored>,
}

impl Pending {
    /// No cells, under a number of lights.
    pub fn new(lights: usize) -> Self {
        Pending { cells: LitCells::default(), visible: vec![Stored::default(); lights] }
    }

    /// Adds a cell of a ray.
    #[inline]
    pub fn push(&mut self, integrator: &Integrator, level: &Level, lit: &LitCell, hit: &mut ShellHit) {
        let (i, visible) = (self.cells.count(), &mut self.visible);
        self.cells.push(integrator, lit, hit.d);
        let walked = &mut hit.cells[1];
        integrator.all_arriving(level, &lit.place, walked, |light, own| visible[light].0[i] = own.visible());
    }

    /// Adds the light of the cells to that of their rays, as [`LitCells::add`].
    #[inline(always)]
    pub fn shade<S: Simd>(&mut self, simd: S, integrator: &Integrator, kind: usize, hits: &mut [ShellHit]) {
        let lit = self.cells.load(simd, integrator);
        let fibres = Fibres::new(simd, kind, &lit);
        let exponent = Exponent::new(integrator.scene.p);
        let zero = f32x8::splat(simd, 0.0);
        let mut sum = Lanes3 { x: zero, y: zero, z: zero };
        if let Some(ink) = &lit.ink {
            sum = Lanes3::splat(simd, integrator.scene.ambient).by(ink.tint(simd, lit.weight));
        }
        for (light, visible) in integrator.lights.iter().zip(&self.visible) {
            let arrives = light_at(simd, light, lit.point);
            let once = lit.once(simd, integrator, (&fibres, &exponent), arrives);
            sum = sum.plus(once.times(lit.weight * visible.load(simd)));
        }
        self.cells.add(sum, kind, hits);
    }
}

/// Way from root to tip in the world; twin of the function of this name in
/// `src/engine/cpu/integrate/shell.rs`.
#[inline(always)]
fn way_of<S: Simd>([x, y, z]: &[Lanes3<S>; 3]) -> Lanes3<S> {
    let [row_x, row_y, row_z] = [y.cross(*z), z.cross(*x), x.cross(*y)];
    let part = |row: Lanes3<S>, factor: f32| row.scaled(Vec3::splat(factor));
    let way = part(row_x, ROOT_TO_TIP.x).plus(part(row_y, ROOT_TO_TIP.y)).plus(part(row_z, ROOT_TO_TIP.z));
    let is_mirrored = x.dot(row_x).simd_lt(0.0);
    Lanes3 { x: -way.x, y: -way.y, z: -way.z }.or(is_mirrored, way)
}

/// Directions of the fibres in eight cells, in the world.
pub enum Fibres<S: Simd> {
    /// One in each cell, of any length.
    One { t: Lanes3<S>, inverse_q: Floats<S> },
    /// Many in each cell.
    Many(Spread<S>),
}

impl<S: Simd> Fibres<S> {
    /// Directions in cells of the kind 0 (the volume itself) or 1 (coarser levels).
    #[inline(always)]
    pub fn new(simd: S, kind: usize, lit: &Lit<S>) -> Self {
        let Lit { second, e, frame, .. } = lit;
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        if kind == 0 {
            let v = v_codes(*second);
            let t = frame[0].times(v.x).plus(frame[1].times(v.y)).plus(frame[2].times(v.z));
            return Fibres::One { t, inverse_q: one / t.dot(t).max(f32x8::splat(simd, 1e-30)) };
        }
        let moments = Moments::unpacked(simd, *second).mapped(frame);
        Fibres::Many(Spread::new(simd, &Metric([one, zero, one, one]), moments, *e))
    }

    /// Diffuse and specular part of the reflection Ψ of Kajiya and Kay's model, times 255.
    #[inline(always)]
    fn psi_parts(
        &self,
        simd: S,
        k: [Floats<S>; 2],
        exponent: &Exponent,
        l: Lanes3<S>,
        e: Lanes3<S>,
    ) -> [Floats<S>; 2] {
        match self {
            Fibres::One { t, inverse_q } => psi_parts(simd, k, exponent, t.dot(l), t.dot(e), *inverse_q),
            Fibres::Many(spread) => spread.psi_parts(k, exponent, l, l.dot(e)),
        }
    }

    /// Cosines of the angles between a single direction and light and eye.
    #[inline(always)]
    fn cosines(
        &self,
        shading: &StrandShading,
        (l, e): (Lanes3<S>, Lanes3<S>),
        frame: &[Lanes3<S>; 3],
    ) -> [Floats<S>; 2] {
        match self {
            Fibres::One { t, inverse_q } => {
                let root = inverse_q.sqrt();
                [t.dot(l) * root, t.dot(e) * root]
            }
            Fibres::Many(spread) => strand::cosines(shading, spread, l, || way_of(frame)),
        }
    }
}
