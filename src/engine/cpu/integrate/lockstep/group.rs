//! The walk of eight rays through one level, and the light of their cells. Twin of
//! `src/engine/cpu/integrate/walk.rs`: every ray gets the bits that it gets alone.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use glam::Vec3;

use super::cells::{Row, Store, k_codes, rho_codes, v_codes, words};
use super::fibre::{Exponent, Metric, Moments, Spread, fibre_angles};
use super::lanes::{Floats, LANES, Lanes3, Stored, Stored3, Words};
use super::light::{LaneLight, lanes_of};
use super::powers::exp2;
use super::walk::{NO_CELL, Passed, ROW, Walk};
use crate::engine::cpu::integrate::light::RayScatter;
use crate::engine::cpu::integrate::walk::Lit;
use crate::engine::cpu::integrate::{Integrator, SheetHit};
use crate::light::scatter::media::MultipleMedium;
use crate::light::scatter::multiple;
use crate::trace::SheetDensity;
use crate::trace::lookup::Level;
use crate::util::powers::log2;

/// Up to eight rays in one level, of sheets that are all mist or all strands.
pub struct Group<'a> {
    pub integrator: &'a Integrator<'a>,
    pub level: Level<'a>,
    pub store: Store<'a>,
    pub is_mist: bool,
    /// Extinction in the level's cells.
    pub extinction: f32,
    exponent: Exponent,
    rays: [&'a SheetHit<'a>; LANES],
    /// Where each ray meets its sheet, and its direction, in the level's cells.
    origin: Stored3,
    direction: Stored3,
    e_v: Stored3,
    metric: [Stored; 4],
    /// What each ray's sheet makes of ρ.
    pub matter: [SheetDensity; LANES],
    /// Factors and summands of it.
    pub line: [Stored; 2],
    /// Share of the mean ρ that erosion leaves.
    pub left: Stored,
    /// Depth of one of the volume's own cells, metres.
    pub cell_depth: Stored,
    /// T before the sheets.
    before: Stored,
}

/// A row of steps: the cells that the rays pass, and what they let through.
#[derive(Default)]
pub struct Steps {
    /// Number of steps.
    pub count: usize,
    pub passed: Passed,
    /// Rays that see matter in their cell, one bit each.
    pub lit: [u8; ROW],
    cells: Row,
    /// Share of the cells in what the eye sees.
    weight: [Stored; ROW],
    /// Depth of the cells, and before them, in bits.
    tau_bits: [Stored; ROW],
    depth: [Stored; ROW],
}

/// What eight rays have met at the end of their walk.
#[derive(Default)]
pub struct Ends {
    /// T at the end.
    pub transmittance: [f32; LANES],
    /// Number of cells walked by the view rays, and by their light rays.
    pub cells: [[u32; LANES]; 2],
}

/// Memory that is used again by every group of a thread.
#[derive(Default)]
pub struct Scratch<'a> {
    steps: Steps,
    lights: Vec<LaneLight<'a>>,
    /// Terms of multiple scattering of each ray and light.
    scatter: Vec<Option<Vec<RayScatter>>>,
}

impl Scratch<'_> {
    /// Light that each light sent along ray `lane`.
    pub fn lit(&self, lane: usize) -> impl Iterator<Item = Lit> {
        self.lights.iter().map(move |light| Lit { sum: light.sum.0[lane], colour: light.colour.get(lane) })
    }
}

impl<'a> Group<'a> {
    /// Group of rays, and T before each of them. Missing ones are filled up with the first.
    pub fn new(
        integrator: &'a Integrator<'a>,
        level: Level<'a>,
        store: Store<'a>,
        rays: [&'a SheetHit<'a>; LANES],
        before: [f32; LANES],
    ) -> Self {
        let matter = rays.map(|ray| *ray.matter(&level));
        Group {
            integrator,
            level,
            store,
            is_mist: matter[0].mist > 0.0,
            extinction: integrator.extinction_in(&level),
            exponent: Exponent::new(integrator.scene.p),
            rays,
            origin: Stored3::from_fn(|lane| rays[lane].origin * level.scale),
            direction: Stored3::from_fn(|lane| rays[lane].d_cell * level.scale),
            e_v: Stored3::from_fn(|lane| rays[lane].e_v),
            metric: [0, 1, 2, 3].map(|i| Stored::from_fn(|lane| rays[lane].metric.m[i])),
            matter,
            line: [0, 1].map(|i| Stored::from_fn(|lane| matter[lane].line()[i])),
            left: Stored::from_fn(|lane| matter[lane].left),
            cell_depth: Stored::from_fn(|lane| rays[lane].frame.depth),
            before: Stored(before),
        }
    }

    /// Computes the terms of all lights for the rays.
    pub fn prepare(&self, scratch: &mut Scratch<'a>) {
        let Scratch { lights, scatter, .. } = scratch;
        lights.resize_with(self.integrator.lights.len(), LaneLight::default);
        lights.iter_mut().for_each(LaneLight::reset);
        for (lane, ray) in self.rays.iter().enumerate() {
            let terms = self.integrator.ray_lights(ray, &self.level);
            lights.iter_mut().zip(terms).for_each(|(light, terms)| light.set(self, lane, &terms));
        }
        scatter.clear();
        if self.integrator.media.is_some() {
            scatter.extend(self.rays.iter().map(|ray| self.integrator.ray_scatter(ray)));
        }
    }

    /// Walks the rays to the end of the slab, or to their own.
    #[inline(always)]
    pub fn walk<S: Simd>(&self, simd: S, scratch: &mut Scratch<'a>) -> Ends {
        let Scratch { steps, lights, scatter } = scratch;
        let trace = &self.integrator.scene.trace;
        let mut walk = Walk::new(simd, &self.store.units, self.origin.load(simd), self.direction.load(simd));
        let mut view = View {
            transmittance: self.before.load(simd),
            depth: Stored::from_fn(|lane| -log2(self.before.0[lane].max(1e-30))).load(simd),
            counts: i32x8::splat(simd, 0),
        };
        let mut walked = [0; LANES];
        let mut n = 0;
        while n < trace.max_cells {
            let goes_on = walk.inside() & view.transmittance.simd_ge(trace.early_end);
            if !goes_on.any_true() {
                break;
            }
            steps.count = (trace.max_cells - n).min(ROW as u32) as usize;
            walk.row(steps.count, &mut steps.passed);
            self.store.fetch(&steps.passed, steps.count, &mut steps.cells);
            self.attenuate(simd, steps, &mut view);
            for light in &mut *lights {
                self.visibility(simd, steps, light, &mut walked);
            }
            for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
                self.shade(simd, steps, j, lights, scatter);
            }
            n += steps.count as u32;
        }
        let seen = view.counts.to_array().map(|count| count as u32);
        Ends { transmittance: view.transmittance.to_array(), cells: [seen, walked] }
    }

    /// Follows T through the cells of a row.
    #[inline(always)]
    fn attenuate<S: Simd>(&self, simd: S, steps: &mut Steps, view: &mut View<S>) {
        let zero = f32x8::splat(simd, 0.0);
        let early_end = f32x8::splat(simd, self.integrator.scene.trace.early_end);
        let (scale, shift) = (self.line[0].load(simd), self.line[1].load(simd));
        for j in 0..steps.count {
            let [first, _] = words(simd, &steps.cells[j]);
            let rho = (rho_codes(first) * scale + shift).max(zero);
            let mut tau_bits = rho * self.extinction;
            if !self.integrator.per_cell {
                tau_bits *= steps.passed.length[j].load(simd);
            }
            let index = i32x8::load_array_ref(simd, &steps.passed.index[j]);
            let visits = !index.simd_eq(NO_CELL) & view.transmittance.simd_ge(early_end);
            let lit = visits & rho.simd_gt(zero);
            let passes = view.transmittance * exp2(simd, -tau_bits);
            let passed = lit.select(passes, view.transmittance);
            view.counts += visits.select(i32x8::splat(simd, 1), i32x8::splat(simd, 0));
            steps.lit[j] = lit.to_bitmask() as u8;
            steps.weight[j].store(view.transmittance - passed);
            steps.tau_bits[j].store(tau_bits);
            steps.depth[j].store(view.depth);
            view.transmittance = passed;
            view.depth += lit.select(tau_bits, zero);
        }
    }

    /// Adds the light of the cells of step `j`.
    #[inline(always)]
    fn shade<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        j: usize,
        lights: &mut [LaneLight],
        scatter: &[Option<Vec<RayScatter>>],
    ) {
        let integrator = self.integrator;
        let p = &self.exponent;
        let splat = |x: f32| f32x8::splat(simd, x);
        let weight = steps.weight[j].load(simd);
        let [first, second] = words(simd, &steps.cells[j]);
        let k = k_codes(first);
        let e_v = self.e_v.load(simd);
        let metric = Metric::load(simd, &self.metric);
        let angles = Angles::new(simd, self, &metric, second, e_v);
        for (i, light) in lights.iter_mut().enumerate() {
            let l_v = light.l_v.load(simd);
            let visibility = light.visible[j].load(simd);
            let fibre = match &angles {
                Angles::Mist(psi) => *psi,
                Angles::Many(spread) => spread.psi(k, p, l_v, light.l_dot_e.load(simd)),
                Angles::One { v, t_dot_e, inverse_q } => {
                    let [sin_l, base] = fibre_angles(simd, v.dot(l_v), *t_dot_e, *inverse_q);
                    k[0] * sin_l + k[1] * p.power(simd, base.max(splat(0.0)))
                }
            };
            if !integrator.in_colour() {
                let lit = weight * fibre * visibility;
                let sum = light.sum.load(simd) + weight.simd_gt(0.0).select(lit, splat(0.0));
                light.sum.store(sum);
                continue;
            }
            let [t_dot_l, t_dot_e] = match &angles {
                Angles::Mist(psi) => [*psi, *psi],
                Angles::Many(spread) => spread.of_one(l_v),
                Angles::One { v, t_dot_e, inverse_q } => {
                    let root = inverse_q.sqrt();
                    [v.dot(l_v) * root, *t_dot_e * root]
                }
            };
            let mut values = [Stored::default(); 5];
            for (stored, value) in values.iter_mut().zip([k[0], k[1], t_dot_l, t_dot_e, fibre]) {
                stored.store(value);
            }
            self.add_colour(steps, j, &values, light, i, scatter);
        }
    }

    /// Adds the coloured light of the cells of step `j`. `values` are k_d, k_s, t·l, t·e, and Ψ of the fibre
    /// model.
    fn add_colour(
        &self,
        steps: &Steps,
        j: usize,
        values: &[Stored; 5],
        light: &mut LaneLight,
        i: usize,
        scatter: &[Option<Vec<RayScatter>>],
    ) {
        for lane in lanes_of(steps.lit[j]) {
            let [k_d, k_s, t_dot_l, t_dot_e, fibre] = values.map(|value| value.0[lane]);
            let (weight, visibility) = (steps.weight[j].0[lane], light.visible[j].0[lane]);
            let mut lit = match &self.integrator.strand {
                Some(strand) if !self.is_mist => {
                    strand.psi(k_d, k_s, t_dot_l, t_dot_e, light.l_dot_e.0[lane]) * (weight * visibility)
                }
                _ => Vec3::splat(weight * visibility * fibre * (1.0 / 255.0)),
            };
            let medium = self.integrator.medium_of(self.rays[lane].quad);
            let terms = scatter.get(lane).and_then(|scatter| Some(&scatter.as_ref()?[i]));
            if let (Some(MultipleMedium { similarity, profile }), Some(terms)) = (medium, terms) {
                let z = self.store.coordinates(steps.passed.index[j][lane])[2] as i32;
                let diffuse = profile.at(&terms.row, self.integrator.layer_in(&self.level, z));
                let [view, cell, depth] = [&steps.depth[j], &steps.tau_bits[j], &light.depth[j]];
                let more =
                    multiple(similarity, &terms.peak, diffuse, view.0[lane], cell.0[lane], depth.0[lane]);
                lit += terms.gain.truncate() * more + similarity.albedo * (terms.gain.w * weight);
            }
            light.colour.set(lane, light.colour.get(lane) + lit);
        }
    }
}

/// View rays on their way.
struct View<S: Simd> {
    transmittance: Floats<S>,
    /// −log₂ T.
    depth: Floats<S>,
    /// Number of cells visited.
    counts: i32x8<S>,
}

/// Directions in eight cells.
enum Angles<S: Simd> {
    /// Mist, with 255·Ψ.
    Mist(Floats<S>),
    /// Many in each cell.
    Many(Spread<S>),
    /// One in each cell.
    One { v: Lanes3<S>, t_dot_e: Floats<S>, inverse_q: Floats<S> },
}

impl<S: Simd> Angles<S> {
    #[inline(always)]
    fn new(simd: S, group: &Group, metric: &Metric<S>, second: Words<S>, e_v: Lanes3<S>) -> Self {
        if group.is_mist {
            return Angles::Mist(Stored::from_fn(|lane| group.matter[lane].mist).load(simd));
        }
        if !group.level.is_whole {
            return Angles::Many(Spread::new(simd, metric, Moments::unpacked(simd, second), e_v));
        }
        let v = v_codes(second);
        let least = f32x8::splat(simd, 1e-30);
        let inverse_q = f32x8::splat(simd, 1.0) / metric.squared(v).max(least);
        Angles::One { v, t_dot_e: v.dot(e_v), inverse_q }
    }
}
