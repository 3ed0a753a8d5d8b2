//! Visibility between the lights and the cells that eight rays pass. Twin of `visibility_of` in
//! `src/engine/cpu/integrate/light.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::cells::{Row, rho_codes, words};
use super::group::{Group, Steps};
use super::lanes::{Floats, LANES, Lanes3, Stored, Stored3};
use super::powers::{exp2, log2};
use super::walk::{NO_CELL, Passed, ROW, Walk};
use crate::engine::cpu::integrate::light::RayLight;
use crate::light::Visibility;
use crate::light::fill::Numbers;
use crate::light::visibility::{Form, TRANSMITTANCE_OF_CODE};
use crate::walk::NEVER;

/// Terms of one light for eight rays, and what it has sent along them.
#[derive(Default)]
pub struct LaneLight<'a> {
    /// Jᵀl, or J⁻¹l normalised.
    pub l_v: Stored3,
    /// Cosine between light and eye.
    pub l_dot_e: Stored,
    /// J⁻¹l, in the level's cells.
    l_cell: Stored3,
    /// Light volumes at the corners of each ray's patch, if there are any.
    corners: [[Option<&'a Numbers>; LANES]; 4],
    /// Each ray's position in its patch.
    at: [Stored; 2],
    /// Whether each ray interpolates between light volumes, and whether any does.
    between: [bool; LANES],
    is_between: bool,
    /// Rays that walk to the light, one bit each.
    marches: u8,
    /// V of the cells of the row.
    pub visible: [Stored; ROW],
    /// −log₂ V of the cells of the row, 0 if light volumes hold codes.
    pub depth: [Stored; ROW],
    /// Light sent to the eye so far, in 255ths of the light's intensity.
    pub sum: Stored,
    /// Light sent to the eye so far, relative to the light's intensity.
    pub colour: Stored3,
}

impl<'a> LaneLight<'a> {
    /// Forgets the last rays.
    pub fn reset(&mut self) {
        self.sum = Stored::default();
        self.colour = Stored3::default();
        self.marches = 0;
        self.is_between = false;
    }

    /// Takes the terms of ray `lane` of a group.
    #[inline]
    pub fn set(&mut self, group: &Group<'a>, lane: usize, terms: &RayLight) {
        self.l_v.set(lane, terms.l_v);
        self.l_cell.set(lane, terms.l_cell);
        self.l_dot_e.0[lane] = terms.l_dot_e;
        match group.integrator.scene.visibility {
            Visibility::None => (0..ROW).for_each(|j| self.visible[j].0[lane] = 1.0),
            _ if group.is_mist => {}
            Visibility::March => self.marches = u8::MAX,
            Visibility::Cached => {
                let (corners, level) = (&terms.corners, group.level.number as usize);
                self.marches |= u8::from(corners.marched) << lane;
                let Some(filled) = &group.integrator.filled else { return };
                for (corner, number) in corners.numbers.iter().enumerate() {
                    self.corners[corner][lane] = Some(&filled[*number as usize][level]);
                }
                (self.at[0].0[lane], self.at[1].0[lane]) = corners.at.into();
                self.between[lane] = corners.numbers != [corners.numbers[0]; 4];
                self.is_between |= self.between[lane];
            }
        }
    }
}

impl<'a> Group<'a> {
    /// Computes the visibility of every lit cell of the row, from one light. `walked` grows by the number of
    /// cells that light rays pass.
    #[inline(always)]
    pub fn visibility<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        light: &mut LaneLight,
        walked: &mut [u32; LANES],
    ) {
        if self.integrator.scene.visibility == Visibility::None {
            return;
        }
        if self.is_mist {
            return self.through_mist(simd, steps, light);
        }
        if light.marches != u8::MAX {
            self.looked_up(simd, steps, light);
        }
        if light.marches != 0 {
            self.marched(simd, steps, light, walked);
        }
    }

    /// V in mist, which is treated as uniform.
    #[inline(always)]
    fn through_mist<S: Simd>(&self, simd: S, steps: &Steps, light: &mut LaneLight) {
        let layers = self.level.size.z;
        for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
            let mut depth = Stored::default();
            for lane in lanes_of(steps.lit[j]) {
                let z = self.store.coordinates(steps.passed.index[j][lane])[2] as i32;
                let matter = self.matter[lane];
                let [x, y, c] = [0, 1, 2].map(|axis| light.l_cell.0[axis].0[lane]);
                let own = matter.depth(z, glam::Vec3::new(x, y, c), layers, self.integrator.per_cell);
                depth.0[lane] = own * self.extinction;
            }
            light.visible[j].store(exp2(simd, -depth.load(simd)));
            light.depth[j] = depth;
        }
    }

    /// V from light volumes.
    #[inline(always)]
    fn looked_up<S: Simd>(&self, simd: S, steps: &Steps, light: &mut LaneLight) {
        let form = self.integrator.light_volumes.as_ref().map(|volumes| volumes.form);
        let one = f32x8::splat(simd, 1.0);
        let left = self.left.load(simd);
        let is_eroded = left.simd_lt(1.0);
        for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
            let at = steps.passed.index[j].map(|index| self.store.linear(index));
            let value = |corner: usize| {
                Stored::from_fn(|lane| {
                    light.corners[corner][lane].and_then(|numbers| numbers.get(at[lane])).unwrap_or_default()
                })
            };
            let mut values = value(0);
            if light.is_between {
                let (p00, p10) = (values.load(simd), value(1).load(simd));
                let (p01, p11) = (value(2).load(simd), value(3).load(simd));
                let (x, y) = (light.at[0].load(simd), light.at[1].load(simd));
                let mix = |a: Floats<S>, b: Floats<S>, x: Floats<S>| a * (one - x) + b * x;
                let mut mixed = Stored::default();
                mixed.store(mix(mix(p00, p10, x), mix(p01, p11, x), y));
                for lane in (0..LANES).filter(|&lane| light.between[lane]) {
                    values.0[lane] = mixed.0[lane];
                }
            }
            let value = values.load(simd);
            if form == Some(Form::Codes) {
                let transmittance = value * value * TRANSMITTANCE_OF_CODE;
                let visible = if is_eroded.any_true() {
                    let bright = transmittance.max(f32x8::splat(simd, 1e-9));
                    is_eroded.select(exp2(simd, left * log2(simd, bright)), transmittance)
                } else {
                    transmittance
                };
                light.visible[j].store(visible);
                light.depth[j] = Stored::default();
            } else {
                // Light volumes are filled without the sheet's erosion; `left` is the mean share of ρ it
                // leaves.
                let path = if self.integrator.per_cell { one } else { self.cell_depth.load(simd) };
                let depth = value * (f32x8::splat(simd, self.extinction) * left * path);
                light.visible[j].store(exp2(simd, -depth));
                light.depth[j].store(depth);
            }
        }
    }

    /// V by walks to the light, eight cells at a time.
    #[inline(always)]
    fn marched<S: Simd>(&self, simd: S, steps: &Steps, light: &mut LaneLight, walked: &mut [u32; LANES]) {
        let mut cells = [(0, 0); LANES];
        let mut count = 0;
        for j in 0..steps.count {
            for lane in lanes_of(steps.lit[j] & light.marches) {
                cells[count] = (j, lane);
                count += 1;
                if count == LANES {
                    self.march(simd, steps, &cells, light, walked);
                    count = 0;
                }
            }
        }
        if count > 0 {
            self.march(simd, steps, &cells[..count], light, walked);
        }
    }

    /// V by walks to the light from up to eight cells, given by step and ray.
    #[inline(always)]
    fn march<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        cells: &[(usize, usize)],
        light: &mut LaneLight,
        walked: &mut [u32; LANES],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                // Idle lanes repeat the first cell.
                let cell_of = |i: usize| cells.get(i).copied().unwrap_or(cells[0]);
                let start = Stored3::from_fn(|i| {
                    let (j, lane) = cell_of(i);
                    let cell = self.store.coordinates(steps.passed.index[j][lane]);
                    glam::UVec3::from(cell).as_vec3() + 0.5
                });
                let ray = |value: &Stored| Stored::from_fn(|i| value.0[cell_of(i).1]).load(simd);
                let [x, y, z] = &light.l_cell.0;
                let direction = Lanes3 { x: ray(x), y: ray(y), z: ray(z) };
                let line = [ray(&self.line[0]), ray(&self.line[1])];
                let (depth, counts) = self.optical_depth(simd, start.load(simd), direction, line);
                let depth = depth * self.extinction;
                let (mut visible, mut depths) = (Stored::default(), Stored::default());
                visible.store(exp2(simd, -depth));
                depths.store(depth);
                for (i, &(j, lane)) in cells.iter().enumerate() {
                    light.visible[j].0[lane] = visible.0[i];
                    light.depth[j].0[lane] = depths.0[i];
                    walked[lane] += counts[i] as u32;
                }
            },
        );
    }

    /// Optical depths from eight cell centres to the points where the light rays leave the slab, and the
    /// numbers of cells passed. Twin of [`crate::light::optical_depth::optical_depth`].
    #[inline(always)]
    fn optical_depth<S: Simd>(
        &self,
        simd: S,
        start: Lanes3<S>,
        direction: Lanes3<S>,
        [scale, shift]: [Floats<S>; 2],
    ) -> (Floats<S>, [i32; LANES]) {
        let medium = self.integrator.medium;
        let zero = f32x8::splat(simd, 0.0);
        let mut walk = Walk::new(simd, &self.store.units, start, direction);
        let (mut passed, mut row) = (Passed::default(), Row::default());
        let mut depth = zero;
        let mut counts = i32x8::splat(simd, 0);
        let mut n = 0;
        while n < medium.max_cells && walk.inside().any_true() {
            let count = (medium.max_cells - n).min(ROW as u32) as usize;
            walk.row(count, &mut passed);
            self.store.fetch(&passed, count, &mut row);
            for (j, cells) in row.iter().enumerate().take(count) {
                let [first, _] = words(simd, cells);
                let rho = (rho_codes(first) * scale + shift).max(zero);
                let index = i32x8::load_array_ref(simd, &passed.index[j]);
                let goes_on = !index.simd_eq(NO_CELL) & depth.simd_le(NEVER);
                let path = if medium.per_cell {
                    // A cell of the volume does not shadow itself. In a coarse cell, half of the others do.
                    let is_own = n == 0 && j == 0;
                    let own = 0.5 - 0.5 * self.level.scale.z;
                    f32x8::splat(simd, if is_own { own } else { 1.0 })
                } else {
                    passed.length[j].load(simd)
                };
                depth += goes_on.select(rho * path, zero);
                counts += goes_on.select(i32x8::splat(simd, 1), i32x8::splat(simd, 0));
            }
            n += count as u32;
        }
        (depth, *counts)
    }
}

/// Numbers of the lanes whose bits are set.
#[inline(always)]
pub fn lanes_of(bits: u8) -> impl Iterator<Item = usize> {
    let mut bits = bits;
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}
