//! Shading of lit cells in full lanes. Where strands are thin, only one or two rays of eight see matter at a
//! step. Lit cells of several steps are then shaded together, in the order of steps, so every ray adds up
//! its light in the order of its own cells.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use fearless_simd::u8x32;

use super::cells::{k_codes, words};
use super::fibre::Metric;
use super::group::{Group, Light, Steps};
use super::light::LaneLight;
use crate::light::visibility::Form;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3, lanes_of};
use crate::volume::Cell;

/// Lit cells of a step, in the mean, from which steps are shaded as they are.
const MOST_LIT: u32 = 4;

/// Up to eight lit cells, one a lane; missing ones repeat the first.
struct Picks<S: Simd> {
    /// Step and ray of each cell.
    cells: [(usize, usize); LANES],
    count: usize,
    /// The rays as indices of bytes.
    rays: u8x32<S>,
}

impl<S: Simd> Picks<S> {
    #[inline(always)]
    fn new(simd: S, lit: &[(usize, usize)]) -> Self {
        let mut cells = [lit[0]; LANES];
        let mut bytes = [0; 4 * LANES];
        for i in 0..LANES {
            if i < lit.len() {
                cells[i] = lit[i];
            }
            let first = 4 * cells[i].1 as u8;
            for byte in 0..4 {
                bytes[4 * i + byte] = first + byte as u8;
            }
        }
        Picks { cells, count: lit.len(), rays: u8x32::load_array(simd, bytes) }
    }

    /// Numbers of the cells' rays.
    #[inline(always)]
    fn of_rays(&self, simd: S, numbers: &Stored) -> Floats<S> {
        numbers.load(simd).swizzle_dyn(self.rays)
    }

    /// Vectors of the cells' rays.
    #[inline(always)]
    fn vectors(&self, simd: S, vectors: &Stored3) -> Lanes3<S> {
        let [x, y, z] = &vectors.0;
        Lanes3 { x: self.of_rays(simd, x), y: self.of_rays(simd, y), z: self.of_rays(simd, z) }
    }

    /// Adds vectors of the cells to those of their rays, cell by cell.
    #[inline(always)]
    fn add(&self, Lanes3 { x, y, z }: Lanes3<S>, sums: &mut Stored3) {
        let more = [x.to_array(), y.to_array(), z.to_array()];
        for i in 0..self.count {
            for c in 0..3 {
                sums.0[c].0[self.cells[i].1] += more[c][i];
            }
        }
    }

    /// Numbers of the cells.
    #[inline(always)]
    fn of_cells(&self, simd: S, numbers: &[Stored]) -> Floats<S> {
        let mut out = Stored::default();
        for i in 0..LANES {
            let (j, lane) = self.cells[i];
            out.0[i] = numbers[j].0[lane];
        }
        out.load(simd)
    }
}

impl Group<'_, '_> {
    /// Whether lit cells of the batch are packed before they are shaded. To pack them takes about as long as
    /// Kajiya and Kay's model takes for one light.
    #[inline(always)]
    pub fn is_packed(&self, steps: &Steps) -> bool {
        let is_dear = self.integrator.lights.len() > 1 || self.integrator.strand_of(self.volume).is_some();
        if !is_dear || self.is_mist || self.is_between {
            return false;
        }
        let (mut lit, mut lit_steps) = (0, 0);
        for &lanes in &steps.lit[..steps.count] {
            lit += lanes.count_ones();
            lit_steps += u32::from(lanes != 0);
        }
        lit < MOST_LIT * lit_steps
    }

    /// Adds the light of all lit cells of the batch, eight at a time.
    #[inline(always)]
    pub fn shade_packed<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        (lights, tint): (&mut [LaneLight], &mut Stored3),
    ) {
        let mut cells = [(0, 0); LANES];
        let mut count = 0;
        for j in 0..steps.count {
            for lane in lanes_of(steps.lit[j]) {
                cells[count] = (j, lane);
                count += 1;
                if count == LANES {
                    self.shade_cells(simd, steps, &cells, (lights, tint));
                    count = 0;
                }
            }
        }
        if count > 0 {
            self.shade_cells(simd, steps, &cells[..count], (lights, tint));
        }
    }

    /// Adds the light of up to eight cells, given by step and ray.
    #[inline(always)]
    fn shade_cells<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        lit: &[(usize, usize)],
        (lights, tint): (&mut [LaneLight], &mut Stored3),
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let picks = Picks::new(simd, lit);
                let values = &self.hits.values;
                let mut cells = [Cell::default(); LANES];
                let mut index = [0; LANES];
                for i in 0..LANES {
                    let (j, lane) = picks.cells[i];
                    cells[i] = steps.cells[j][lane];
                    index[i] = steps.passed.index[j][lane];
                }
                let [first, second] = words(simd, &cells);
                let mut k = k_codes(first);
                let ink = self.ink(simd, &mut k);
                let weight = picks.of_cells(simd, &steps.weight);
                if let Some(ink) = &ink {
                    picks.add(ink.tint(simd, weight), tint);
                }
                let e_v = picks.vectors(simd, &values.e_v);
                let mut metric = Metric([weight; 4]);
                for i in 0..4 {
                    metric.0[i] = picks.of_rays(simd, &values.metric[i]);
                }
                let angles = self.angles(simd, &metric, second, e_v);
                let form = self.integrator.light_volumes.as_ref().map(|volumes| volumes.form);
                let at = form.map(|_| self.store.linear(&index)).unwrap_or_default();
                for light in lights {
                    let to_light = (picks.vectors(simd, &light.l_v), picks.of_rays(simd, &light.l_dot_e));
                    let visible = match form.filter(|_| light.looks_up()) {
                        Some(form) => self.packed_visibility(simd, &picks, &at, form, light),
                        None => picks.of_cells(simd, &light.visible),
                    };
                    match self.lit(simd, &angles, (k, &ink), to_light, weight, visible) {
                        Light::Grey(lit) => {
                            let lit = weight.simd_gt(0.0).select(lit, f32x8::splat(simd, 0.0)).to_array();
                            for i in 0..picks.count {
                                light.sum.0[picks.cells[i].1] += lit[i];
                            }
                        }
                        Light::Colour(lit) => picks.add(lit, &mut light.colour),
                    }
                }
            },
        );
    }

    /// V of cells from the one light volume of each ray. `at` are their linear indices.
    #[inline(always)]
    fn packed_visibility<S: Simd>(
        &self,
        simd: S,
        picks: &Picks<S>,
        at: &[usize; LANES],
        form: Form,
        light: &LaneLight,
    ) -> Floats<S> {
        let mut value = Stored::default();
        for i in 0..LANES {
            value.0[i] = light.value(form, picks.cells[i].1, at[i]);
        }
        let left = picks.of_rays(simd, &self.hits.values.left);
        let path = match self.integrator.per_cell {
            true => f32x8::splat(simd, 1.0),
            false => picks.of_rays(simd, &self.hits.values.depth),
        };
        self.of_values(simd, form, value.load(simd), left, path).0
    }
}
