//! The points where eight rays meet their sheets, and everything that is constant along the rays behind
//! them. Twin of `SheetHit` in `src/engine/cpu/integrate.rs` and of `SheetDensity` in `src/trace/matter.rs`,
//! with the same bits.

use bytemuck::{Pod, Zeroable};
use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::{Vec2, Vec3};

use super::tear::{self, Places};
use crate::engine::cpu::integrate::{FrameVolume, Integrator};
use crate::light::AngleFrame;
use crate::mapping::Quad;
use crate::trace::lookup::{STRANDS, StrandTurn};
use crate::trace::{MEAN_EROSION, MIST_OF_CELLS, MIST_RHO, Prefilter, billow};
use crate::util::lane_powers::log2;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3, floor_cell};

/// Sheets of eight rays. Names and units are those of `SheetHit`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hits {
    /// Numbers of the quads, and whether they are one.
    pub quads: [usize; LANES],
    is_one_quad: bool,
    pub values: Values,
}

/// Numbers of [`Hits`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Values {
    /// u, v and metres from the eye.
    pub at: Stored3,
    pub d_world: Stored3,
    /// Times of the rays; see [`SampleTimes`](crate::picture::SampleTimes).
    pub time: Stored,
    /// Jacobian: cx and cy, its depth and its determinant.
    pub cx: [Stored; 2],
    pub cy: [Stored; 2],
    pub depth: Stored,
    pub det: Stored,
    /// 1 where the ray runs against the quad's normal, −1 where it runs along it.
    pub side: Stored,
    pub d_cell: Stored3,
    pub origin: Stored3,
    pub point: Stored3,
    pub metric: [Stored; 4],
    pub e_v: Stored3,
    /// Factor and summand of ρ for the volume's own cells, and for those of coarser levels.
    pub lines: [[Stored; 2]; 2],
    /// Share of the mean ρ that erosion leaves.
    pub left: Stored,
    /// 255·Ψ of mist, or 0.
    pub mist: Stored,
    /// ρ of uniform mist, in codes.
    pub even: Stored,
    /// Finer of the two levels that suit the ray ([`STRANDS`] or the number of a level), and the share of the
    /// coarser.
    pub level: Stored,
    pub share: Stored,
}

impl Hits {
    /// Hits of eight rays, each given by its pack and its place there. If they are not one of the packs, they
    /// are put together in `room`.
    pub fn picked<'a>(packs: &'a [Hits], picks: [(usize, usize); LANES], room: &'a mut Hits) -> &'a Self {
        let first = picks[0].0;
        if (0..LANES).all(|lane| picks[lane] == (first, lane)) {
            return &packs[first];
        }
        let out = room;
        for (lane, &(pack, from)) in picks.iter().enumerate() {
            out.quads[lane] = packs[pack].quads[from];
            let values: &[Stored] = bytemuck::cast_slice(std::slice::from_ref(&packs[pack].values));
            let own: &mut [Stored] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut out.values));
            own.iter_mut().zip(values).for_each(|(own, value)| own.0[lane] = value.0[from]);
        }
        out.is_one_quad = out.quads == [out.quads[0]; LANES];
        out
    }

    /// A number of each quad.
    #[inline(always)]
    pub fn of_quads<S: Simd>(&self, simd: S, quads: &[Quad], number: impl Fn(&Quad) -> f32) -> Floats<S> {
        let own = |lane: usize| number(&quads[self.quads[lane]]);
        match self.is_one_quad {
            true => f32x8::splat(simd, own(0)),
            false => Stored::from_fn(own).load(simd),
        }
    }

    /// A number of each quad's volume.
    #[inline(always)]
    fn of_volumes<S: Simd>(
        &self,
        simd: S,
        integrator: &Integrator,
        number: impl Fn(&FrameVolume) -> f32,
    ) -> Floats<S> {
        match &integrator.volumes[..] {
            [only] => f32x8::splat(simd, number(only)),
            all => self
                .of_quads(simd, &integrator.scene.quads, |quad| number(&all[quad.material.volume as usize])),
        }
    }

    /// A vector in the plane of each quad.
    #[inline(always)]
    fn edges_of_quads<S: Simd>(
        &self,
        simd: S,
        quads: &[Quad],
        edge: impl Fn(&Quad) -> Vec2,
    ) -> (Floats<S>, Floats<S>) {
        let x = self.of_quads(simd, quads, |quad| edge(quad).x);
        (x, self.of_quads(simd, quads, |quad| edge(quad).y))
    }

    /// A vector of each quad.
    #[inline(always)]
    pub fn vectors_of_quads<S: Simd>(
        &self,
        simd: S,
        quads: &[Quad],
        vector: impl Fn(&Quad) -> Vec3,
    ) -> Lanes3<S> {
        Lanes3 {
            x: self.of_quads(simd, quads, |quad| vector(quad).x),
            y: self.of_quads(simd, quads, |quad| vector(quad).y),
            z: self.of_quads(simd, quads, |quad| vector(quad).z),
        }
    }

    /// Puts a ray in direction `d_world` in place `lane`, which meets a quad at `at` at this time.
    #[inline]
    pub fn set(&mut self, lane: usize, quad: usize, (d_world, time): (Vec3, f32), at: [f32; 3]) {
        self.quads[lane] = quad;
        self.values.d_world.set(lane, d_world);
        self.values.time.0[lane] = time;
        self.values.at.set(lane, at.into());
    }

    /// Maps the eight rays to the cells of their quads, once all are in place.
    #[inline(always)]
    pub fn map<S: Simd>(&mut self, simd: S, integrator: &Integrator, turn: StrandTurn) {
        self.is_one_quad = self.quads == [self.quads[0]; LANES];
        let scene = integrator.scene;
        let all = &scene.quads;
        let hits = &*self;
        let at = &hits.values.at;
        let splat = |x: f32| f32x8::splat(simd, x);
        let (zero, one) = (splat(0.0), splat(1.0));
        let size_of = |axis: usize| hits.of_volumes(simd, integrator, |volume| volume.size[axis] as f32);
        let (nx, ny, nz) = (size_of(0), size_of(1), size_of(2));
        let (u, v, t) = (at.0[0].load(simd), at.0[1].load(simd), at.0[2].load(simd));

        let (e_x, e_y) = hits.edges_of_quads(simd, all, |quad| quad.map.e);
        let (f_x, f_y) = hits.edges_of_quads(simd, all, |quad| quad.map.f);
        let (g_x, g_y) = hits.edges_of_quads(simd, all, |quad| quad.map.g);
        let repeat_u = hits.of_quads(simd, all, |quad| quad.material.repeat_u);
        let repeat_v = hits.of_quads(simd, all, |quad| quad.material.repeat_v);
        let (cells_u, cells_v) = (repeat_u * nx, repeat_v * ny);
        let (cx_x, cx_y) = ((e_x + g_x * v) / cells_u, (e_y + g_y * v) / cells_u);
        let (cy_x, cy_y) = ((f_x + g_x * u) / cells_v, (f_y + g_y * u) / cells_v);
        let depth = hits.of_quads(simd, all, |quad| quad.material.thickness_m) / nz;
        let det = cx_x * cy_y - cx_y * cy_x;

        let d = hits.values.d_world.load(simd);
        let d_n = d.dot(hits.vectors_of_quads(simd, all, |quad| quad.map.n_world));
        let side = d_n.simd_gt(0.0).select(-one, one);
        let e1 = hits.vectors_of_quads(simd, all, |quad| quad.map.e1_world);
        let e2 = hits.vectors_of_quads(simd, all, |quad| quad.map.e2_world);
        let plane = Lanes3 { x: d.dot(e1), y: d.dot(e2), z: (d_n * side).min(splat(-1e-6)) };
        let frame = Frame { cx: [cx_x, cx_y], cy: [cy_x, cy_y], depth, det };
        let d_cell = frame.cell_from_plane(plane);

        let (metric, e_v) = match scene.angles {
            AngleFrame::World => {
                let e_v = frame.transposed(plane);
                let metric = [
                    cx_x * cx_x + cx_y * cx_y,
                    splat(2.0) * (cx_x * cy_x + cx_y * cy_y),
                    cy_x * cy_x + cy_y * cy_y,
                    depth * depth,
                ];
                (metric, Lanes3 { x: -e_v.x, y: -e_v.y, z: -e_v.z })
            }
            AngleFrame::Texture => {
                let length = d_cell.dot(d_cell).sqrt();
                let e_v = Lanes3 { x: -d_cell.x / length, y: -d_cell.y / length, z: -d_cell.z / length };
                ([one, zero, one, one], e_v)
            }
        };

        let uv = u * v;
        let (p_x, p_y) = (e_x * u + f_x * v + g_x * uv, e_y * u + f_y * v + g_y * uv);
        let a = hits.vectors_of_quads(simd, all, |quad| quad.map.a_world);
        let point = Lanes3 {
            x: a.x + e1.x * p_x + e2.x * p_y,
            y: a.y + e1.y * p_x + e2.y * p_y,
            z: a.z + e1.z * p_x + e2.z * p_y,
        };

        let flow_moves = hits.of_volumes(simd, integrator, |volume| volume.flow_moves);
        let flow_cells = hits.of_volumes(simd, integrator, |volume| volume.flow_cells)
            + hits.values.time.load(simd) * flow_moves;
        let x = (u * repeat_u + hits.of_quads(simd, all, |quad| quad.offset.x)) * nx;
        let y = (v * repeat_v + hits.of_quads(simd, all, |quad| quad.offset.y)) * ny - flow_cells;
        let origin = Lanes3 { x: in_tile(simd, x, nx), y: in_tile(simd, y, ny), z: zero };

        let keep_lines = integrator.volumes.iter().any(|volume| volume.has_lines);
        let is_filtered = scene.trace.filter != Prefilter::None || keep_lines;
        let mut seen = zero;
        if is_filtered {
            let forward = scene.camera.forward.as_vec3();
            let forward = Lanes3 { x: splat(forward.x), y: splat(forward.y), z: splat(forward.z) };
            let c = d.dot(forward);
            let area = splat(integrator.footprint) * (c * c * c) * (t * t);
            let across = area / (det.abs() * depth * d_cell.dot(d_cell).sqrt());
            seen = splat(0.5) * log2(simd, across.max(splat(1e-30)));
        }

        let open_near = hits.of_quads(simd, all, |quad| quad.tear.open[0]);
        let open_far = hits.of_quads(simd, all, |quad| quad.tear.open[1]);
        let open = open_near + (open_far - open_near) * v;
        let mut torn = zero;
        if open.simd_gt(zero).any_true() {
            // Quads without holes have no lattice; theirs is not looked at.
            let across = hits.of_quads(simd, all, |quad| quad.tear.lattice[0].max(1) as f32);
            let along = hits.of_quads(simd, all, |quad| quad.tear.lattice[1].max(1) as f32);
            let place = [origin.x / nx, origin.y / ny];
            let places = Places { open, lattice: [across, along], place, cells: nx, level: seen };
            torn = tear::erosion(simd, &places);
        }

        let ea = hits.of_quads(simd, all, |quad| quad.erosion[0]);
        let eb = hits.of_quads(simd, all, |quad| quad.erosion[1]);
        let ec = hits.of_quads(simd, all, |quad| quad.erosion[2]);
        let ed = hits.of_quads(simd, all, |quad| quad.erosion[3]);
        let (near, far) = (ea + (eb - ea) * u, ed + (ec - ed) * u);
        let e = (near + (far - near) * v).max(zero).min(one);
        let e = e + (one - e) * torn;
        let left = (one - e) * (one - splat(MEAN_EROSION) * e);
        let mist = hits.of_quads(simd, all, |quad| if quad.mist > 0.0 { quad.mist * 255.0 } else { 0.0 });
        let is_mist = mist.simd_gt(0.0);
        let mist_left = one - e;
        let mist_scale = splat(MIST_OF_CELLS) * mist_left;
        let mist_shift = splat((1.0 - MIST_OF_CELLS) * MIST_RHO) * mist_left;
        let even = is_mist.select(splat(MIST_RHO) * mist_left, zero);
        let (mut mist_scale, mut mist_shift) = (mist_scale, mist_shift);
        let strength = hits.of_quads(simd, all, |quad| quad.material.billow.strength);
        if (is_mist & strength.simd_gt(zero)).any_true() {
            let mut points = Stored3::default();
            points.store(point);
            let times = &integrator.billow_times;
            let of =
                |lane: usize| billow::factor(&all[hits.quads[lane]].material.billow, times, points.get(lane));
            let factor = Stored::from_fn(of).load(simd);
            mist_scale *= factor;
            mist_shift *= factor;
        }

        let (mut level, mut share) = (zero, zero);
        if is_filtered {
            let coarsest = hits.of_volumes(simd, integrator, |volume| (volume.levels.len() - 1) as f32);
            let keeps_lines = |volume: &FrameVolume| f32::from(u8::from(volume.has_lines));
            let keeps_lines = hits.of_volumes(simd, integrator, keeps_lines).simd_gt(0.0) & !is_mist;
            let in_turn = seen * turn.scale + turn.shift;
            let walks_strands = keeps_lines & in_turn.simd_lt(zero);
            let exact =
                walks_strands.select(in_turn.max(splat(STRANDS as f32)), seen.max(zero).min(coarsest));
            level = floor_cell(simd, exact).to_float::<f32x8<S>>();
            share = exact - level;
        }

        let values = &mut self.values;
        let [fine, coarse] = &mut values.lines;
        fine[0].store(is_mist.select(mist_scale, one));
        fine[1].store(is_mist.select(mist_shift, e * splat(-65535.0)));
        coarse[0].store(is_mist.select(mist_scale, left));
        coarse[1].store(is_mist.select(mist_shift, zero));
        values.cx[0].store(cx_x);
        values.cx[1].store(cx_y);
        values.cy[0].store(cy_x);
        values.cy[1].store(cy_y);
        values.depth.store(depth);
        values.det.store(det);
        values.side.store(side);
        values.d_cell.store(d_cell);
        values.origin.store(origin);
        values.point.store(point);
        values.metric[0].store(metric[0]);
        values.metric[1].store(metric[1]);
        values.metric[2].store(metric[2]);
        values.metric[3].store(metric[3]);
        values.e_v.store(e_v);
        values.left.store(left);
        values.mist.store(mist);
        values.even.store(even);
        values.level.store(level);
        values.share.store(share);
    }

    /// Frames of the cells.
    #[inline(always)]
    pub fn frame<S: Simd>(&self, simd: S) -> Frame<S> {
        let Values { cx, cy, depth, det, .. } = &self.values;
        Frame {
            cx: [cx[0].load(simd), cx[1].load(simd)],
            cy: [cy[0].load(simd), cy[1].load(simd)],
            depth: depth.load(simd),
            det: det.load(simd),
        }
    }
}

/// Jacobians of eight rays; see [`crate::mapping::CellFrame`].
pub struct Frame<S: Simd> {
    cx: [Floats<S>; 2],
    cy: [Floats<S>; 2],
    depth: Floats<S>,
    det: Floats<S>,
}

impl<S: Simd> Frame<S> {
    /// See [`crate::mapping::CellFrame::cell_from_plane`].
    #[inline(always)]
    pub fn cell_from_plane(&self, d: Lanes3<S>) -> Lanes3<S> {
        Lanes3 {
            x: (d.x * self.cy[1] - d.y * self.cy[0]) / self.det,
            y: (self.cx[0] * d.y - self.cx[1] * d.x) / self.det,
            z: -d.z / self.depth,
        }
    }

    /// See [`crate::mapping::CellFrame::transposed`].
    #[inline(always)]
    pub fn transposed(&self, d: Lanes3<S>) -> Lanes3<S> {
        Lanes3 {
            x: self.cx[0] * d.x + self.cx[1] * d.y,
            y: self.cy[0] * d.x + self.cy[1] * d.y,
            z: -self.depth * d.z,
        }
    }
}

/// Coordinates in cells, moved into tiles of `n` cells.
#[inline(always)]
pub fn in_tile<S: Simd>(simd: S, at: Floats<S>, n: Floats<S>) -> Floats<S> {
    at - n * floor_cell(simd, at / n).to_float::<f32x8<S>>()
}
