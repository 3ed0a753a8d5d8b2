//! Visibility between the lights and the cells that eight rays pass. Twin of `visibility_of` in
//! `src/engine/cpu/integrate/light.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::cells::{Row, rho_codes, words};
use super::group::{Group, Steps};
use super::walk::{BATCH, Passed, ROW, Walk};
use crate::engine::cpu::integrate::light::patch_corners;
use crate::engine::cpu::lights::light_at;
use crate::light::fill::Numbers;
use crate::light::visibility::{Form, TRANSMITTANCE_OF_CODE};
use crate::light::{AngleFrame, Visibility};
use crate::util::lane_powers::{exp2, log2};
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3, lanes_of};

/// Terms of one light for eight rays, and what it has sent along them.
pub struct LaneLight<'a> {
    /// Jᵀl, or J⁻¹l normalised.
    pub l_v: Stored3,
    /// Cosine between light and eye.
    pub l_dot_e: Stored,
    /// J⁻¹l, in the level's cells.
    l_cell: Stored3,
    /// Light volumes at the corners of each ray's patch, if there are any: codes or depths.
    codes: [[&'a [u8]; LANES]; 4],
    depths: [[&'a [f32]; LANES]; 4],
    /// Each ray's position in its patch.
    at: [Stored; 2],
    /// Whether each ray interpolates between light volumes, and whether any does.
    between: [bool; LANES],
    is_between: bool,
    /// Whether there are light volumes.
    is_cached: bool,
    /// Rays that walk to the light, one bit each.
    marches: u8,
    /// V of the cells of the batch.
    pub visible: [Stored; BATCH],
    /// −log₂ V of the cells of the batch, 0 if light volumes hold codes.
    pub depth: [Stored; BATCH],
    /// Light sent to the eye so far, in 255ths of the light's intensity.
    pub sum: Stored,
    /// Light sent to the eye so far, relative to the light's intensity.
    pub colour: Stored3,
}

impl Default for LaneLight<'_> {
    fn default() -> Self {
        LaneLight {
            l_v: Stored3::default(),
            l_dot_e: Stored::default(),
            l_cell: Stored3::default(),
            codes: [[&[]; LANES]; 4],
            depths: [[&[]; LANES]; 4],
            at: [Stored::default(); 2],
            between: [false; LANES],
            is_between: false,
            is_cached: false,
            marches: 0,
            visible: [Stored([1.0; LANES]); BATCH],
            depth: [Stored::default(); BATCH],
            sum: Stored::default(),
            colour: Stored3::default(),
        }
    }
}

impl<'a> LaneLight<'a> {
    /// Takes the terms of light number `i` for the rays of a group, and starts without light. Twin of
    /// `ray_lights` in `src/engine/cpu/integrate/light.rs`.
    #[inline(always)]
    pub fn reset<S: Simd>(&mut self, simd: S, group: &Group<'a, '_>, i: usize) {
        let integrator = group.integrator;
        let (light, quads) = (&integrator.lights[i], &integrator.scene.quads);
        let hits = group.hits;
        let (to_light, _) = light_at(simd, light, hits.values.point.load(simd));
        let frame = hits.frame(simd);
        let e1 = hits.vectors_of_quads(simd, quads, |quad| quad.map.e1_world);
        let e2 = hits.vectors_of_quads(simd, quads, |quad| quad.map.e2_world);
        let n = hits.vectors_of_quads(simd, quads, |quad| quad.map.n_world);
        let l = Lanes3 {
            x: to_light.dot(e1),
            y: to_light.dot(e2),
            z: to_light.dot(n) * hits.values.side.load(simd),
        };
        let l_cell = frame.cell_from_plane(l);
        let (l_v, l_dot_e) = match integrator.scene.angles {
            AngleFrame::World => (frame.transposed(l), -to_light.dot(hits.values.d_world.load(simd))),
            AngleFrame::Texture => {
                let length = l_cell.dot(l_cell).sqrt();
                let l_v = Lanes3 { x: l_cell.x / length, y: l_cell.y / length, z: l_cell.z / length };
                (l_v, l_v.dot(hits.values.e_v.load(simd)))
            }
        };
        self.l_v.store(l_v);
        self.l_dot_e.store(l_dot_e);
        self.l_cell.store(l_cell.scaled(group.level.scale));
        self.sum = Stored::default();
        self.colour = Stored3::default();
        self.marches = 0;
        self.is_between = false;
        self.is_cached = false;
        match integrator.visibility {
            // It stays 1.
            Visibility::None => {}
            _ if group.is_mist => {}
            Visibility::March => self.marches = u8::MAX,
            Visibility::Cached => self.take_volumes(group, i),
        }
    }

    /// Whether cells walk to the light.
    #[inline(always)]
    pub fn marches(&self) -> bool {
        self.marches != 0
    }

    /// Whether V of every cell is one value of a light volume.
    #[inline(always)]
    pub fn looks_up(&self) -> bool {
        self.is_cached && !self.is_between && self.marches == 0
    }

    /// Finds the light volumes of every ray's patch.
    fn take_volumes(&mut self, group: &Group<'a, '_>, i: usize) {
        let integrator = group.integrator;
        let (Some(plan), Some(filled)) = (&integrator.light_volumes, &integrator.filled) else { return };
        self.is_cached = true;
        let mut last = None;
        for lane in 0..LANES {
            let quad = group.hits.quads[lane];
            let patches = &plan.patches[quad * plan.lights + i];
            // Neighbouring rays mostly meet one quad, which mostly has one patch.
            if last == Some(quad) && patches.is_whole() {
                self.codes[0][lane] = self.codes[0][lane - 1];
                self.depths[0][lane] = self.depths[0][lane - 1];
                self.between[lane] = false;
                continue;
            }
            last = Some(quad);
            let corners = patch_corners(plan, quad, i, group.hits.values.at.get(lane).truncate());
            self.marches |= u8::from(corners.marched) << lane;
            // Where a ray walks to the light there are no light volumes, and numbers stand for any others.
            if corners.marched {
                self.codes[0][lane] = &[];
                self.depths[0][lane] = &[];
                self.between[lane] = false;
                continue;
            }
            (self.at[0].0[lane], self.at[1].0[lane]) = corners.at.into();
            self.between[lane] = corners.numbers != [corners.numbers[0]; 4];
            self.is_between |= self.between[lane];
            let used = if self.between[lane] { 4 } else { 1 };
            for (corner, number) in corners.numbers.iter().enumerate().take(used) {
                match &filled[*number as usize][group.level.number as usize] {
                    Numbers::Codes(codes) => self.codes[corner][lane] = codes,
                    Numbers::Depths(depths) => self.depths[corner][lane] = depths,
                }
            }
        }
    }

    /// Value of a cell in the one light volume of ray `lane`; 0 for no cell.
    #[inline(always)]
    pub fn value(&self, form: Form, lane: usize, at: usize) -> f32 {
        match form {
            Form::Codes => self.codes[0][lane].get(at).map_or(0.0, |&code| code.into()),
            Form::Depths => self.depths[0][lane].get(at).copied().unwrap_or_default(),
        }
    }

    /// Values of eight cells in the light volumes at one corner of each ray's patch; 0 for no cell.
    #[inline(always)]
    fn values(&self, form: Form, corner: usize, at: &[usize; LANES]) -> Stored {
        let mut out = Stored::default();
        match form {
            Form::Codes => {
                let volumes = self.codes[corner].iter().zip(at);
                for (out, (codes, &at)) in out.0.iter_mut().zip(volumes) {
                    *out = codes.get(at).map_or(0.0, |&code| code.into());
                }
            }
            Form::Depths => {
                let volumes = self.depths[corner].iter().zip(at);
                for (out, (depths, &at)) in out.0.iter_mut().zip(volumes) {
                    *out = depths.get(at).copied().unwrap_or_default();
                }
            }
        }
        out
    }
}

impl Group<'_, '_> {
    /// Computes the visibility of every lit cell of the batch, from one light. `walked` grows by the number
    /// of cells that light rays pass.
    #[inline(always)]
    pub fn visibility<S: Simd>(
        &self,
        simd: S,
        steps: &Steps,
        light: &mut LaneLight,
        walked: &mut [u32; LANES],
    ) {
        if self.integrator.visibility == Visibility::None {
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

    /// V in mist, which is treated as uniform. Twin of [`crate::trace::SheetDensity::depth`].
    #[inline(always)]
    fn through_mist<S: Simd>(&self, simd: S, steps: &Steps, light: &mut LaneLight) {
        let splat = |x: f32| f32x8::splat(simd, x);
        let layers = splat(self.level.size.z as f32);
        let direction = light.l_cell.load(simd);
        let is_down = direction.z.simd_lt(0.0);
        let (x, y, z) = (direction.x.abs(), direction.y.abs(), direction.z.abs());
        let even = self.hits.values.even.load(simd);
        for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
            // View rays go upwards, through the layers that are left to them.
            let left = i32x8::load_array_ref(simd, &steps.passed.layers[j]).to_float::<f32x8<S>>();
            let height = layers - left + 0.5;
            let t = is_down.select(height, layers - height) / z.max(splat(1e-6));
            let length = if self.integrator.per_cell { t * (x + y + z) } else { t };
            let depth = even * length.min(splat(1e9)) * self.extinction;
            light.visible[j].store(exp2(simd, -depth));
            light.depth[j].store(depth);
        }
    }

    /// Metres of a cell that light passes per unit of depth in a light volume of depths.
    #[inline(always)]
    pub fn path<S: Simd>(&self, simd: S) -> Floats<S> {
        match self.integrator.per_cell {
            true => f32x8::splat(simd, 1.0),
            false => self.hits.values.depth.load(simd),
        }
    }

    /// V from light volumes.
    #[inline(always)]
    fn looked_up<S: Simd>(&self, simd: S, steps: &Steps, light: &mut LaneLight) {
        let Some(form) = self.integrator.light_volumes.as_ref().map(|volumes| volumes.form) else { return };
        let (left, path) = (self.hits.values.left.load(simd), self.path(simd));
        for j in (0..steps.count).filter(|&j| steps.lit[j] != 0) {
            let at = self.store.linear(&steps.passed.index[j]);
            let mut values = light.values(form, 0, &at);
            if light.is_between {
                let (p00, p10) = (values.load(simd), light.values(form, 1, &at).load(simd));
                let p01 = light.values(form, 2, &at).load(simd);
                let p11 = light.values(form, 3, &at).load(simd);
                let (x, y) = (light.at[0].load(simd), light.at[1].load(simd));
                let mut mixed = Stored::default();
                let (near, far) = (mix(simd, p00, p10, x), mix(simd, p01, p11, x));
                mixed.store(mix(simd, near, far, y));
                for lane in (0..LANES).filter(|&lane| light.between[lane]) {
                    values.0[lane] = mixed.0[lane];
                }
            }
            let (visible, depth) = self.of_values(simd, form, values.load(simd), left, path);
            light.visible[j].store(visible);
            light.depth[j].store(depth);
        }
    }

    /// V and its depth in bits from values of light volumes. They are filled without the sheets' erosion, of
    /// whose ρ `left` is the mean share; `path` is the metres in a cell of depth 1.
    #[inline(always)]
    pub fn of_values<S: Simd>(
        &self,
        simd: S,
        form: Form,
        value: Floats<S>,
        left: Floats<S>,
        path: Floats<S>,
    ) -> (Floats<S>, Floats<S>) {
        if form == Form::Depths {
            let depth = value * (f32x8::splat(simd, self.extinction) * left * path);
            return (exp2(simd, -depth), depth);
        }
        let transmittance = value * value * TRANSMITTANCE_OF_CODE;
        let is_eroded = left.simd_lt(1.0);
        let visible = if is_eroded.any_true() {
            let bright = transmittance.max(f32x8::splat(simd, 1e-9));
            is_eroded.select(exp2(simd, left * log2(simd, bright)), transmittance)
        } else {
            transmittance
        };
        (visible, f32x8::splat(simd, 0.0))
    }

    /// V by walks to the light, from eight lit cells at a time in the order of steps.
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
                let (mut start, mut direction) = (Stored3::default(), Stored3::default());
                let mut line = [Stored::default(); 2];
                for i in 0..LANES {
                    // Idle lanes repeat the first cell.
                    let (j, lane) = cells.get(i).copied().unwrap_or(cells[0]);
                    let cell = self.store.coordinates(steps.passed.index[j][lane]);
                    start.set(i, glam::UVec3::from(cell).as_vec3() + 0.5);
                    direction.set(i, light.l_cell.get(lane));
                    line[0].0[i] = self.line()[0].0[lane];
                    line[1].0[i] = self.line()[1].0[lane];
                }
                let (depth, counts) = self.optical_depth(
                    simd,
                    start.load(simd),
                    direction.load(simd),
                    [line[0].load(simd), line[1].load(simd)],
                );
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
        let mut passed = Passed::<ROW>::default();
        let mut row = Row::<ROW>::default();
        let mut depth = zero;
        let mut n = 0;
        while n < medium.max_cells && walk.inside().any_true() {
            let count = (medium.max_cells - n).min(ROW as u32) as usize;
            walk.row(0..count, &mut passed);
            self.store.fetch(&passed.index[..count], &mut row);
            for (j, cells) in row.iter().enumerate().take(count) {
                // Outside the slab ρ is 0.
                let rho = (rho_codes(words(simd, cells)[0]) * scale + shift).max(zero);
                let path = if medium.per_cell {
                    // A cell of the volume does not shadow itself. In a coarse cell, half of the others do.
                    let is_own = n == 0 && j == 0;
                    let own = 0.5 - 0.5 * self.level.scale.z;
                    f32x8::splat(simd, if is_own { own } else { 1.0 })
                } else {
                    passed.length[j].load(simd)
                };
                depth += rho * path;
            }
            n += count as u32;
        }
        (depth, *walk.count)
    }
}

/// Interpolates from a to b.
#[inline(always)]
fn mix<S: Simd>(simd: S, a: Floats<S>, b: Floats<S>, x: Floats<S>) -> Floats<S> {
    a * (f32x8::splat(simd, 1.0) - x) + b * x
}
