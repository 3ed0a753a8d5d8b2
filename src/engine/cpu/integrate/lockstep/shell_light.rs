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
pub struct Pending {
    count: usize,
    /// Number of each ray's hit.
    hits: [usize; LANES],
    cells: [Cell; LANES],
    weight: Stored,
    d: Stored3,
    point: Stored3,
    /// Columns of J = world_from_cell.
    frame: [Stored3; 3],
    /// V of each light.
    visible: Vec<Stored>,
    /// Colours, and k_s in 255ths, where any volume has colours.
    color: Stored3,
    k_s: Stored,
}

impl Pending {
    /// No cells, under a number of lights.
    pub fn new(lights: usize) -> Self {
        Pending {
            count: 0,
            hits: [0; LANES],
            cells: [Cell::default(); LANES],
            weight: Stored::default(),
            d: Stored3::default(),
            point: Stored3::default(),
            frame: [Stored3::default(); 3],
            visible: vec![Stored::default(); lights],
            color: Stored3::default(),
            k_s: Stored::default(),
        }
    }

    /// Whether the cells must be shaded before another one is added.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a cell of a ray.
    #[inline]
    pub fn push(&mut self, integrator: &Integrator, level: &Level, lit: &LitCell, hit: &mut ShellHit) {
        let (i, place) = (self.count, &lit.place);
        self.hits[i] = lit.hit;
        self.cells[i] = lit.cell;
        self.weight.0[i] = lit.weight;
        self.d.set(i, hit.d);
        self.point.set(i, place.point);
        let frame = integrator.frame(&integrator.scene.shells[place.shell], place);
        self.frame[0].set(i, frame.x_axis);
        self.frame[1].set(i, frame.y_axis);
        self.frame[2].set(i, frame.z_axis);
        let volume = integrator.scene.shells[place.shell].volume as usize;
        if let Some(ink) = integrator.ink(volume, lit.cell.k_codes().1 as f32) {
            self.color.set(i, ink.color);
            self.k_s.0[i] = ink.k_s;
        }
        let visible = &mut self.visible;
        let walked = &mut hit.cells[1];
        integrator.all_arriving(level, place, walked, |light, own| visible[light].0[i] = own.visible());
        self.count += 1;
    }

    /// Adds the light of the cells to that of their rays, as cells of the kind 0 (the volume itself) or 1
    /// (coarser levels), and forgets them.
    #[inline(always)]
    pub fn shade<S: Simd>(&mut self, simd: S, integrator: &Integrator, kind: usize, hits: &mut [ShellHit]) {
        let [first, second] = words(simd, &self.cells);
        let mut k = k_codes(first);
        let ink =
            integrator.is_colored.then(|| Ink { color: self.color.load(simd), k_s: self.k_s.load(simd) });
        if let Some(ink) = &ink {
            k[1] = ink.k_s;
        }
        let d = self.d.load(simd);
        let e = Lanes3 { x: -d.x, y: -d.y, z: -d.z };
        let frame = [self.frame[0].load(simd), self.frame[1].load(simd), self.frame[2].load(simd)];
        let fibres = Fibres::new(simd, kind, second, &frame, e);
        let exponent = Exponent::new(integrator.scene.p);
        let (point, weight) = (self.point.load(simd), self.weight.load(simd));
        let zero = f32x8::splat(simd, 0.0);
        let mut sum = Lanes3 { x: zero, y: zero, z: zero };
        if let Some(ink) = &ink {
            sum = Lanes3::splat(simd, integrator.scene.ambient).by(ink.tint(simd, weight));
        }
        for (light, visible) in integrator.lights.iter().zip(&self.visible) {
            let (l, intensity) = light_at(simd, light, point);
            let l_dot_e = l.dot(e);
            let lit = match &integrator.strand {
                Some(shading) => {
                    let cosines = fibres.cosines(shading, (l, e), &frame);
                    intensity.by(strand::psi(simd, shading, k, cosines, l_dot_e))
                }
                None => {
                    let parts = fibres.psi_parts(simd, k, &exponent, l, e);
                    match &ink {
                        Some(ink) => intensity.by(ink.lit(parts).times(f32x8::splat(simd, 1.0 / 255.0))),
                        None => intensity.times((parts[0] + parts[1]) * (1.0 / 255.0)),
                    }
                }
            };
            sum = sum.plus(lit.times(weight * visible.load(simd)));
        }
        let mut stored = Stored3::default();
        stored.store(sum);
        for i in 0..self.count {
            hits[self.hits[i]].radiance[kind] += stored.get(i);
        }
        self.count = 0;
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
enum Fibres<S: Simd> {
    /// One in each cell, of any length.
    One { t: Lanes3<S>, inverse_q: Floats<S> },
    /// Many in each cell.
    Many(Spread<S>),
}

impl<S: Simd> Fibres<S> {
    #[inline(always)]
    fn new(simd: S, kind: usize, second: Words<S>, frame: &[Lanes3<S>; 3], e: Lanes3<S>) -> Self {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        if kind == 0 {
            let v = v_codes(second);
            let t = frame[0].times(v.x).plus(frame[1].times(v.y)).plus(frame[2].times(v.z));
            return Fibres::One { t, inverse_q: one / t.dot(t).max(f32x8::splat(simd, 1e-30)) };
        }
        let moments = Moments::unpacked(simd, second).mapped(frame);
        Fibres::Many(Spread::new(simd, &Metric([one, zero, one, one]), moments, e))
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
