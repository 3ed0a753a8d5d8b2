//! The walk of eight rays through one level, and the light of their cells. Twin of
//! `src/engine/cpu/integrate/walk.rs`: every ray gets the bits that it gets alone.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};
use glam::Vec3;

use super::between::Between;
use super::cells::{Row, Store, k_codes, rho_codes, v_codes, words};
use super::fibre::{Exponent, Metric, Moments, Spread, psi_parts};
use super::hits::Hits;
use super::ink::Ink;
use super::light::LaneLight;
use super::scatter::{Depths, LaneScatter};
use super::strand;
use super::walk::{BATCH, NO_CELL, Passed, ROW, Walk};
use crate::engine::cpu::integrate::Integrator;
use crate::engine::cpu::integrate::walk::Lit;
use crate::light::strand::ROOT_TO_TIP;
use crate::light::strand::table::StrandShading;
use crate::trace::Lookup;
use crate::trace::lookup::Level;
use crate::util::lane_powers::exp2;
use crate::util::lanes::{Floats, LANES, Lanes3, Mask, Stored, Stored3, Words};
use crate::util::powers::log2;
use crate::volume::Cell;

/// Number of lit cells after which they are lit and shaded: walks to a light start from eight at a time.
const PENDING: u32 = 3 * LANES as u32;

/// Up to eight rays in one level of a volume, of sheets that are all mist or all strands.
pub struct Group<'a, 'h> {
    pub integrator: &'a Integrator<'a>,
    /// Number of the volume.
    pub volume: usize,
    pub level: Level<'a>,
    pub store: Store<'a>,
    pub is_mist: bool,
    /// Whether rays interpolate between cells.
    pub is_between: bool,
    /// Extinction in the level's cells.
    pub extinction: f32,
    exponent: Exponent,
    pub hits: &'h Hits,
    /// T before the sheets.
    pub before: Stored,
}

/// A batch of steps: the cells that the rays pass, and what they let through.
pub struct Steps {
    /// Number of steps.
    pub count: usize,
    pub passed: Passed<BATCH>,
    /// Rays that see matter in their cell, one bit each.
    pub lit: [u8; BATCH],
    pub cells: Row<BATCH>,
    between: Between,
    /// Share of T that each cell lets pass.
    share: [Stored; BATCH],
    /// Share of the cells in what the eye sees.
    pub weight: [Stored; BATCH],
    /// Depth of the cells, and before them, in bits.
    pub tau_bits: [Stored; BATCH],
    pub depth: [Stored; BATCH],
}

impl Default for Steps {
    fn default() -> Self {
        Steps {
            count: 0,
            passed: Passed::default(),
            lit: [0; BATCH],
            cells: [[Cell::default(); LANES]; BATCH],
            between: Between::default(),
            share: [Stored::default(); BATCH],
            weight: [Stored::default(); BATCH],
            tau_bits: [Stored::default(); BATCH],
            depth: [Stored::default(); BATCH],
        }
    }
}

/// Results of eight rays at the end of their walk.
#[derive(Default)]
pub struct Ends {
    /// T at the end.
    pub transmittance: [f32; LANES],
    /// Number of cells walked by the view rays, and by their light rays.
    pub cells: [[u32; LANES]; 2],
}

/// Memory that every group uses again.
pub struct Scratch<'a> {
    pub steps: Steps,
    pub lights: Vec<LaneLight<'a>>,
    /// Colour that the cells give to the ambient light, minus that of white ones.
    pub tint: Stored3,
}

impl Scratch<'_> {
    /// Memory for rays of an integrator.
    pub fn new(integrator: &Integrator) -> Self {
        let lights = integrator.lights.iter().map(|_| LaneLight::default()).collect();
        Scratch { steps: Steps::default(), lights, tint: Stored3::default() }
    }

    /// Colour that the cells along ray `lane` give to the ambient light, minus that of white ones.
    pub fn tint(&self, lane: usize) -> Vec3 {
        self.tint.get(lane)
    }

    /// Light that each light sent along ray `lane`.
    pub fn lit(&self, lane: usize) -> impl Iterator<Item = Lit> {
        self.lights.iter().map(move |light| Lit { sum: light.sum.0[lane], colour: light.colour.get(lane) })
    }
}

impl<'a, 'h> Group<'a, 'h> {
    /// Group of rays with the sheets `hits`, and T before each of them.
    pub fn new(
        integrator: &'a Integrator<'a>,
        volume: usize,
        (level, store): (Level<'a>, Store<'a>),
        hits: &'h Hits,
        before: [f32; LANES],
    ) -> Self {
        Group {
            integrator,
            volume,
            level,
            store,
            is_mist: hits.values.mist.0[0] > 0.0,
            is_between: integrator.scene.trace.lookup == Lookup::Trilinear,
            extinction: integrator.extinction_in(volume, &level),
            exponent: Exponent::new(integrator.scene.p),
            hits,
            before: Stored(before),
        }
    }

    /// Factors and summands of ρ in the level.
    #[inline(always)]
    pub fn line(&self) -> &[Stored; 2] {
        &self.hits.values.lines[usize::from(!self.level.is_whole)]
    }

    /// Walks the rays to the end of the slab, or to their own.
    #[inline(always)]
    pub fn walk<S: Simd>(&self, simd: S, scratch: &mut Scratch<'a>) -> Ends {
        let Scratch { steps, lights, tint } = scratch;
        *tint = Stored3::default();
        for (i, light) in lights.iter_mut().enumerate() {
            light.reset(simd, self, i);
        }
        let scatter = LaneScatter::of(self);
        let trace = &self.integrator.scene.trace;
        let mut walk = Walk::new(
            simd,
            &self.store.units,
            self.hits.values.origin.load(simd).scaled(self.level.scale),
            self.hits.values.d_cell.load(simd).scaled(self.level.scale),
        );
        let mut view = View {
            transmittance: self.before.load(simd),
            depth: Stored::from_fn(|lane| -log2(self.before.0[lane].max(1e-30))).load(simd),
            early: i32x8::splat(simd, 0),
        };
        let mut walked = [0; LANES];
        let (mut n, mut pending) = (0, 0);
        steps.count = 0;
        loop {
            let goes_on = walk.inside() & view.transmittance.simd_ge(trace.early_end);
            let ends = n == trace.max_cells || !goes_on.any_true();
            // Cells wait until there are enough of them to keep all lanes of walks to the light busy.
            let is_enough = pending >= PENDING || lights.iter().all(|light| !light.marches());
            if ends || is_enough || steps.count + ROW > BATCH {
                self.light_batch(simd, steps, (lights, tint), scatter.as_ref(), &mut walked);
                (steps.count, pending) = (0, 0);
            }
            if ends {
                break;
            }
            let count = (trace.max_cells - n).min(ROW as u32) as usize;
            let row = steps.count..steps.count + count;
            if self.is_between {
                walk.row_between(row.clone(), &mut steps.passed);
                self.interpolate(simd, &steps.passed, row.clone(), &mut steps.between);
            } else {
                walk.row(row.clone(), &mut steps.passed);
                self.store.fetch(&steps.passed.index[row.clone()], &mut steps.cells[row.clone()]);
            }
            self.attenuate(simd, steps, row.clone(), &mut view);
            pending += steps.lit[row].iter().map(|lit| lit.count_ones()).sum::<u32>();
            steps.count += count;
            n += count as u32;
        }
        let seen = (walk.count - view.early).to_array().map(|count| count as u32);
        Ends { transmittance: view.transmittance.to_array(), cells: [seen, walked] }
    }

    /// Adds the light of the lit cells of the batch.
    #[inline(always)]
    pub fn light_batch<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        (lights, tint): (&mut [LaneLight], &mut Stored3),
        scatter: Option<&LaneScatter>,
        walked: &mut [u32; LANES],
    ) {
        let is_packed = scatter.is_none() && self.is_packed(steps);
        for light in &mut *lights {
            if !(is_packed && light.looks_up()) {
                self.visibility(simd, steps, light, walked);
            }
        }
        if is_packed {
            self.shade_packed(simd, steps, (lights, tint));
        } else {
            for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
                self.shade(simd, steps, j, (lights, tint), scatter);
            }
        }
    }

    /// Follows T through the cells of a row.
    #[inline(always)]
    fn attenuate<S: Simd>(&self, simd: S, steps: &mut Steps, row: Range<usize>, view: &mut View<S>) {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let early_end = f32x8::splat(simd, self.integrator.scene.trace.early_end);
        let (scale, shift) = (self.line()[0].load(simd), self.line()[1].load(simd));
        let before = view.transmittance;
        let mut after = before;
        for j in row.clone() {
            let rho = match self.is_between {
                true => steps.between.rho[j].load(simd),
                false => (rho_codes(words(simd, &steps.cells[j])[0]) * scale + shift).max(zero),
            };
            let mut tau_bits = rho * self.extinction;
            if !self.integrator.per_cell {
                tau_bits *= steps.passed.length[j].load(simd);
            }
            let inside = !i32x8::load_array_ref(simd, &steps.passed.index[j]).simd_eq(NO_CELL);
            let lit = inside & rho.simd_gt(zero);
            let share = lit.select(exp2(simd, -tau_bits), one);
            let passed = after * share;
            steps.lit[j] = lit.to_bitmask() as u8;
            steps.share[j].store(share);
            steps.weight[j].store(after - passed);
            steps.tau_bits[j].store(lit.select(tau_bits, zero));
            after = passed;
        }
        // T never grows, so no ray has ended if none has at the end of the row.
        let ends = after.simd_lt(early_end);
        if ends.any_true() {
            after = before;
            for j in row.clone() {
                let lives = after.simd_ge(early_end);
                let inside = !i32x8::load_array_ref(simd, &steps.passed.index[j]).simd_eq(NO_CELL);
                let passed = lives.select(after * steps.share[j].load(simd), after);
                view.early += (inside & !lives).select(i32x8::splat(simd, 1), i32x8::splat(simd, 0));
                steps.lit[j] &= lives.to_bitmask() as u8;
                steps.weight[j].store(after - passed);
                let tau_bits = steps.tau_bits[j].load(simd);
                steps.tau_bits[j].store(lives.select(tau_bits, zero));
                after = passed;
            }
        }
        view.transmittance = after;
        if self.integrator.media.is_some() {
            for j in row.clone() {
                steps.depth[j].store(view.depth);
                view.depth += steps.tau_bits[j].load(simd);
            }
        }
    }

    /// Adds the light of the cells of step `j`.
    #[inline(always)]
    fn shade<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        j: usize,
        (lights, tint): (&mut [LaneLight], &mut Stored3),
        scatter: Option<&LaneScatter>,
    ) {
        let weight = steps.weight[j].load(simd);
        let [first, second] = words(simd, &steps.cells[j]);
        let mut k = match self.is_between {
            true => [steps.between.k[j][0].load(simd), steps.between.k[j][1].load(simd)],
            false => k_codes(first),
        };
        let ink = self.ink(simd, &mut k);
        if let Some(ink) = &ink {
            let is_lit = Mask::from_bitmask(simd, steps.lit[j].into());
            let before = tint.load(simd);
            tint.store(before.plus(ink.tint(simd, weight)).or(is_lit, before));
        }
        let e_v = self.hits.values.e_v.load(simd);
        let metric = Metric::load(simd, &self.hits.values.metric);
        let angles = match self.is_between {
            _ if self.is_mist => Angles::Mist(self.hits.values.mist.load(simd)),
            true => {
                let moments = Moments::load(simd, &steps.between.moments[j]);
                Angles::Many(Spread::new(simd, &metric, moments, e_v))
            }
            false => self.angles(simd, &metric, second, e_v),
        };
        let layers = scatter.map(|_| self.layers(&steps.passed.layers[j])).unwrap_or_default();
        for (i, light) in lights.iter_mut().enumerate() {
            let to_light = (light.l_v.load(simd), light.l_dot_e.load(simd));
            let visible = light.visible[j].load(simd);
            let mut lit = match self.lit(simd, &angles, (k, &ink), to_light, weight, visible) {
                Light::Grey(lit) => {
                    let sum = light.sum.load(simd);
                    light.sum.store(sum + weight.simd_gt(0.0).select(lit, f32x8::splat(simd, 0.0)));
                    continue;
                }
                Light::Colour(lit) => lit,
            };
            if let Some(scatter) = scatter {
                let depths = Depths {
                    view: steps.depth[j].load(simd),
                    cell: steps.tau_bits[j].load(simd),
                    light: light.depth[j].load(simd),
                };
                lit = lit.plus(scatter.more(simd, i, &layers, &depths, weight));
            }
            let is_lit = Mask::from_bitmask(simd, steps.lit[j].into());
            let colour = light.colour.load(simd);
            let Lanes3 { x, y, z } = colour.plus(lit);
            light.colour.store(Lanes3 {
                x: is_lit.select(x, colour.x),
                y: is_lit.select(y, colour.y),
                z: is_lit.select(z, colour.z),
            });
        }
    }

    /// Light of one light that eight cells send to the eye, scattered once. Given are the direction to the
    /// light and its cosine with that to the eye, the cells' share in what the eye sees, and V.
    #[inline(always)]
    pub fn lit<S: Simd>(
        &self,
        simd: S,
        angles: &Angles<S>,
        (k, ink): ([Floats<S>; 2], &Option<Ink<S>>),
        (l_v, l_dot_e): (Lanes3<S>, Floats<S>),
        weight: Floats<S>,
        visible: Floats<S>,
    ) -> Light<S> {
        if let Some(shading) = self.integrator.strand_of(self.volume).filter(|_| !self.is_mist) {
            let cosines = angles.cosines(simd, shading, l_v);
            return Light::Colour(strand::psi(simd, shading, k, cosines, l_dot_e).times(weight * visible));
        }
        let parts = match angles {
            Angles::Mist(psi) => [*psi, f32x8::splat(simd, 0.0)],
            Angles::Many(spread) => spread.psi_parts(k, &self.exponent, l_v, l_dot_e),
            Angles::One { v, t_dot_e, inverse_q } => {
                psi_parts(simd, k, &self.exponent, v.dot(l_v), *t_dot_e, *inverse_q)
            }
        };
        if let Some(ink) = ink {
            return Light::Colour(ink.lit(parts).times(weight * visible * (1.0 / 255.0)));
        }
        let fibre = parts[0] + parts[1];
        if !self.integrator.in_colour() {
            return Light::Grey(weight * fibre * visible);
        }
        let grey = weight * visible * fibre * (1.0 / 255.0);
        Light::Colour(Lanes3 { x: grey, y: grey, z: grey })
    }

    /// Inks of eight cells of strands, if any volume has colours. Gives the cells the k_s of their ramp.
    #[inline(always)]
    pub fn ink<S: Simd>(&self, simd: S, k: &mut [Floats<S>; 2]) -> Option<Ink<S>> {
        if !self.integrator.is_colored || self.is_mist {
            return None;
        }
        let ink = Ink::of(simd, &self.integrator.volumes[self.volume].ramp, k[1]);
        k[1] = ink.k_s;
        Some(ink)
    }

    /// Directions in eight cells of strands, given by their second words.
    #[inline(always)]
    pub fn angles<S: Simd>(
        &self,
        simd: S,
        metric: &Metric<S>,
        second: Words<S>,
        e_v: Lanes3<S>,
    ) -> Angles<S> {
        if !self.level.is_whole {
            return Angles::Many(Spread::new(simd, metric, Moments::unpacked(simd, second), e_v));
        }
        let v = v_codes(second);
        let least = f32x8::splat(simd, 1e-30);
        let inverse_q = f32x8::splat(simd, 1.0) / metric.squared(v).max(least);
        Angles::One { v, t_dot_e: v.dot(e_v), inverse_q }
    }

    /// Layers of the whole volume, by the layers of the level before the rays leave the slab.
    fn layers(&self, left: &[i32; LANES]) -> [u32; LANES] {
        left.map(|left| self.integrator.layer_in(self.volume, &self.level, self.level.size.z - left))
    }
}

/// View rays on their way.
struct View<S: Simd> {
    transmittance: Floats<S>,
    /// −log₂ T.
    depth: Floats<S>,
    /// Number of cells behind those where T ended the ray.
    early: i32x8<S>,
}

/// Light that eight cells send to the eye.
pub enum Light<S: Simd> {
    /// In 255ths of the light's intensity, where nothing colours it.
    Grey(Floats<S>),
    /// Relative to the light's intensity.
    Colour(Lanes3<S>),
}

/// Directions in eight cells.
pub enum Angles<S: Simd> {
    /// Mist, with 255·Ψ.
    Mist(Floats<S>),
    /// Many in each cell.
    Many(Spread<S>),
    /// One in each cell.
    One { v: Lanes3<S>, t_dot_e: Floats<S>, inverse_q: Floats<S> },
}

impl<S: Simd> Angles<S> {
    /// Cosines of the angles between a single direction and light and eye.
    #[inline(always)]
    fn cosines(&self, simd: S, shading: &StrandShading, l_v: Lanes3<S>) -> [Floats<S>; 2] {
        match self {
            Angles::Mist(psi) => [*psi, *psi],
            Angles::Many(spread) => {
                strand::cosines(shading, spread, l_v, || Lanes3::splat(simd, ROOT_TO_TIP))
            }
            Angles::One { v, t_dot_e, inverse_q } => {
                let root = inverse_q.sqrt();
                [v.dot(l_v) * root, *t_dot_e * root]
            }
        }
    }
}
