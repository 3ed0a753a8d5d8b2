//! Rays through shells, eight side by side. Twin of `src/engine/cpu/integrate/shell.rs`: every ray gets the
//! bits that it gets alone.
//!
//! A ray crosses only a cell or two of a tetrahedron, so most of its time would go into changing from one to
//! the next. Here eight rays do that together. Each lane has a ray, and takes another one as soon as its own
//! ends. Lit cells wait until there are eight of one kind ([`Pending`]).

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::cells::{Store, rho_codes, words};
use super::shell_light::{LitCell, Pending};
use super::shell_scatter::Scattered;
use super::shell_way::{Levels, Rays, Way};
use super::walk::Walk;
use crate::engine::cpu::integrate::shell::{Hull, Place};
use crate::engine::cpu::integrate::shell_scatter::depth_between;
use crate::engine::cpu::integrate::{Integrator, RayResult, SheetOrder};
use crate::light::AngleFrame;
use crate::light::scatter::optics::{Passage, within};
use crate::mapping::shell::{LanePaths, LaneSegments};
use crate::trace::Lookup;
use crate::trace::lookup::Level;
use crate::util::lane_powers::exp2;
use crate::util::lanes::{Floats, LANES, Mask, Stored, Stored3, lanes_of};
use crate::volume::Cell;

use glam::Vec3;

/// A ray at a face of a shell's hull.
pub struct ShellHit<'a> {
    /// Number of the ray in its stretch.
    pub ray: usize,
    pub hull: Hull<'a>,
    pub d: Vec3,
    pub order: SheetOrder,
    /// T at the end.
    pub transmittance: f32,
    /// Linear radiance that cells of the volume itself, and coarser ones, have sent to the eye.
    pub radiance: [Vec3; 2],
    /// Diffuse light from behind the ray's end.
    pub beyond: Vec3,
    /// Cells walked by the view ray, and by its light rays.
    pub cells: [u32; 2],
}

impl<'a> ShellHit<'a> {
    /// A ray in the direction `d`.
    pub fn new(ray: usize, hull: Hull<'a>, d: Vec3, order: SheetOrder) -> Self {
        ShellHit {
            ray,
            hull,
            d,
            order,
            transmittance: order.before,
            radiance: [Vec3::ZERO; 2],
            beyond: Vec3::ZERO,
            cells: [0; 2],
        }
    }

    /// The result of a ray that has left the shell.
    pub fn result(&self, integrator: &Integrator) -> RayResult {
        let shell = &integrator.scene.shells[self.hull.shell];
        let radiance = (self.radiance, self.beyond);
        integrator.left_shell(shell, self.order, self.transmittance, radiance, self.cells)
    }
}

/// Whether rays through shells may go side by side: all cells of fibres have one model.
pub fn covers(integrator: &Integrator) -> bool {
    let scene = integrator.scene;
    scene.trace.lookup != Lookup::Trilinear
        && scene.angles == AngleFrame::World
        && integrator.models_in_shells() != [true; 2]
}

/// Eight rays on their way through shells.
pub struct ShellLanes<'a> {
    /// Numbers of the rays' hits.
    hits: [usize; LANES],
    paths: LanePaths<'a>,
    segments: LaneSegments,
    rays: Rays,
    pending: [Pending; 2],
    scattered: Scattered,
}

/// What the lanes walk through.
#[derive(Clone, Copy)]
pub struct Ground<'i, 'a> {
    pub integrator: &'a Integrator<'a>,
    /// See [`super::Lockstep`].
    pub levels: &'i [(usize, Level<'a>, Store<'a>)],
    pub firsts: &'i [usize],
}

impl<'a> ShellLanes<'a> {
    /// Lanes without rays.
    pub fn new(integrator: &Integrator) -> Self {
        let pending = || Pending::new(integrator.lights.len());
        ShellLanes {
            hits: [0; LANES],
            paths: LanePaths::default(),
            segments: LaneSegments::default(),
            rays: Rays::default(),
            pending: [pending(), pending()],
            scattered: Scattered::new(integrator),
        }
    }

    /// Walks all rays through their shells.
    #[inline(always)]
    pub fn walk<S: Simd>(&mut self, simd: S, ground: &Ground<'_, 'a>, hits: &mut [ShellHit<'a>]) {
        let (mut next, mut on_way) = (0, 0u8);
        loop {
            for lane in lanes_of(!on_way) {
                on_way |= u8::from(self.start(ground.integrator, lane, hits, &mut next)) << lane;
            }
            if on_way == 0 {
                break;
            }
            let goes_on = self.paths.next(simd, on_way, &mut self.segments);
            let (enters, walks) = self.enter(ground.integrator, on_way, hits);
            if walks != 0 {
                self.segments.begin_at(simd, self.rays.t_begin.load(simd));
                self.segments.end_at(simd, self.rays.t_end.load(simd));
                self.through(simd, ground, walks, hits);
            }
            for lane in lanes_of(on_way & !(goes_on & enters)) {
                let hit = &mut hits[self.hits[lane]];
                hit.transmittance = self.rays.transmittance.0[lane];
                hit.cells[0] = self.rays.cells[lane] as u32;
                self.scattered.end(ground.integrator, lane, hit);
            }
            on_way &= goes_on & enters;
        }
        for (kind, pending) in self.pending.iter_mut().enumerate() {
            pending.shade(simd, ground.integrator, kind, hits);
        }
        self.scattered.shade(simd, ground.integrator, hits);
    }

    /// Gives a lane the ray number `next`, or a later one that has a way through its shell. Returns whether
    /// there is any.
    fn start(
        &mut self,
        integrator: &'a Integrator<'a>,
        lane: usize,
        hits: &[ShellHit<'a>],
        next: &mut usize,
    ) -> bool {
        while let Some(hit) = hits.get(*next) {
            let shell = &*integrator.scene.shells[hit.hull.shell];
            let start = integrator.shell_start(&hit.hull, hit.d);
            self.hits[lane] = *next;
            *next += 1;
            if !start.path.is_some_and(|path| self.paths.start(lane, &path)) {
                continue;
            }
            let volume = integrator.volume_of(shell);
            let rays = &mut self.rays;
            rays.d.set(lane, hit.d);
            rays.origin.set(lane, start.origin);
            rays.metres.0[lane] = start.metres;
            rays.t_end.0[lane] = start.t_end;
            rays.t_begin.0[lane] = start.t_begin;
            rays.transmittance.0[lane] = hit.order.before;
            rays.cells[lane] = 0;
            rays.n.set(lane, Vec3::from_array(volume.size.map(|n| n as f32)));
            rays.flow_cells.0[lane] = volume.flow_at(hit.order.time);
            rays.extinction.0[lane] = volume.extinction;
            rays.coarsest.0[lane] = (volume.levels.len() - 1) as f32;
            return true;
        }
        false
    }

    /// Looks which of the lanes `bits` have not ended before their tetrahedron, and which of these have cells
    /// there.
    #[inline(always)]
    fn enter(&mut self, integrator: &Integrator, bits: u8, hits: &[ShellHit<'a>]) -> (u8, u8) {
        let scene = integrator.scene;
        let LaneSegments { prism, tetrahedron, t: [t_in, t_out], .. } = &self.segments;
        let (mut enters, mut walks) = (0, 0);
        for lane in lanes_of(bits) {
            let is_dark = self.rays.transmittance.0[lane] < scene.trace.early_end;
            if t_in.0[lane] >= self.rays.t_end.0[lane] || is_dark {
                continue;
            }
            enters |= 1 << lane;
            let shell = &scene.shells[hits[self.hits[lane]].hull.shell];
            if let Some(volumes) = &shell.prisms[prism[lane]].volumes
                && t_out.0[lane] > t_in.0[lane]
            {
                walks |= 1 << lane;
                let n = self.rays.n.get(lane);
                self.rays.cell.0[lane] = volumes[tetrahedron[lane]] / (n.x * n.y * n.z);
            }
        }
        (enters, walks)
    }

    /// Walks through a tetrahedron in each of the lanes `bits`.
    #[inline(always)]
    fn through<S: Simd>(&mut self, simd: S, ground: &Ground<'_, 'a>, bits: u8, hits: &mut [ShellHit<'a>]) {
        let way = self.rays.way(simd, &self.segments, ground.integrator);
        let one = f32x8::splat(simd, 1.0);
        let before = self.rays.transmittance.load(simd);
        let all = Mask::from_bitmask(simd, bits.into());
        let fine = self.in_level(simd, ground, (&way, 0), all, one - way.share, hits);
        let shared = all & way.share.simd_gt(0.0);
        if shared.any_true() {
            self.rays.transmittance.store(before);
            let coarse = self.in_level(simd, ground, (&way, 1), shared, way.share, hits);
            let mixed = fine * (one - way.share) + coarse * way.share;
            self.rays.transmittance.store(shared.select(mixed, fine));
        }
    }

    /// Walks through the cells of the finer level (0) or the coarser one (1). Their light counts by `weight`.
    /// Returns T, which is also kept.
    #[inline(always)]
    fn in_level<S: Simd>(
        &mut self,
        simd: S,
        ground: &Ground<'_, 'a>,
        (way, which): (&Way<S>, usize),
        mut active: Mask<S>,
        weight: Floats<S>,
        hits: &mut [ShellHit<'a>],
    ) -> Floats<S> {
        let (none, one) = (i32x8::splat(simd, 0), i32x8::splat(simd, 1));
        let trace = &ground.integrator.scene.trace;
        let numbers = self.levels_of(ground, way, which, active.to_bitmask() as u8, hits);
        let own = Levels::new(simd, ground.levels, &numbers);
        let mut walk = Walk::of_lanes(simd, &own.units, way.start.by(own.scale), way.direction.by(own.scale));
        let mut transmittance = self.rays.transmittance.load(simd);
        let mut count = i32x8::load_array_ref(simd, &self.rays.cells);
        let most = i32x8::splat(simd, trace.max_cells.min(i32::MAX as u32) as i32);
        let extinction = self.rays.extinction.load(simd);
        loop {
            let goes_on = walk.inside() & walk.t.simd_lt(way.length);
            active &= goes_on & transmittance.simd_ge(trace.early_end) & count.simd_lt(most);
            let lanes = active.to_bitmask() as u8;
            if lanes == 0 {
                break;
            }
            count += active.select(one, none);
            let index: [i32; LANES] = walk.index().to_array();
            let mut cells = [Cell::default(); LANES];
            for lane in lanes_of(lanes) {
                cells[lane] = ground.levels[numbers[lane]].2.cell(index[lane]);
            }
            let enter = walk.t;
            walk.advance();
            let rho = rho_codes(words(simd, &cells)[0]);
            let lit = active & rho.simd_gt(0.0);
            if !lit.any_true() {
                continue;
            }
            let leave = walk.t.simd_lt(way.length).select(walk.t, way.length);
            let bits = rho * extinction * (leave - enter);
            let passed = transmittance * exp2(simd, -bits);
            let found = Found {
                bits: lit.to_bitmask() as u8,
                cells: &cells,
                weight: (transmittance - passed) * weight,
                share: weight,
                before: transmittance,
                bits_in_cell: bits,
                ends: [enter, leave],
                middle: (enter + leave) * 0.5,
            };
            self.light(simd, ground, &numbers, way, &found, hits);
            transmittance = lit.select(passed, transmittance);
        }
        count.store_array(&mut self.rays.cells);
        self.rays.transmittance.store(transmittance);
        transmittance
    }

    /// Numbers of the levels that the lanes `bits` walk through. Others have any number.
    #[inline(always)]
    fn levels_of<S: Simd>(
        &self,
        ground: &Ground<'_, 'a>,
        way: &Way<S>,
        which: usize,
        bits: u8,
        hits: &[ShellHit<'a>],
    ) -> [usize; LANES] {
        if let [_] = ground.firsts
            && way.level == [way.level[0]; LANES]
            && bits & 1 == 1
        {
            return [way.level[0] as usize + which; LANES];
        }
        let mut numbers = [ground.firsts[0]; LANES];
        for lane in lanes_of(bits) {
            let shell = &ground.integrator.scene.shells[hits[self.hits[lane]].hull.shell];
            numbers[lane] = ground.firsts[shell.volume as usize] + way.level[lane] as usize + which;
        }
        numbers
    }

    /// Keeps lit cells until eight of a kind can be shaded.
    #[inline(always)]
    fn light<S: Simd>(
        &mut self,
        simd: S,
        ground: &Ground<'_, 'a>,
        numbers: &[usize; LANES],
        way: &Way<S>,
        found: &Found<S>,
        hits: &mut [ShellHit<'a>],
    ) {
        let integrator = ground.integrator;
        let (rays, segments) = (&self.rays, &self.segments);
        let along = found.middle / way.length;
        let rest = f32x8::splat(simd, 1.0) - along;
        let [from, to] = [segments.shares[0].load(simd), segments.shares[1].load(simd)];
        let mut shares = Stored3::default();
        shares.store(from.times(rest).plus(to.times(along)));
        let [from, to] = [segments.at[0].0[2].load(simd), segments.at[1].0[2].load(simd)];
        let mut depth = Stored::default();
        depth.store(from + (to - from) * along);
        let t = segments.t[0].load(simd) + found.middle;
        let mut point = Stored3::default();
        point.store(rays.origin.load(simd).plus(rays.d.load(simd).times(t)));
        let mut weight = Stored::default();
        weight.store(found.weight);
        let [mut share, mut before, mut bits, mut enter, mut leave] = [Stored::default(); 5];
        if !self.scattered.is_empty() {
            enter.store(found.ends[0]);
            leave.store(found.ends[1]);
            share.store(found.share);
            before.store(found.before);
            bits.store(found.bits_in_cell);
        }
        for lane in lanes_of(found.bits) {
            let hit = self.hits[lane];
            let level = &ground.levels[numbers[lane]].1;
            let place = Place {
                shell: hits[hit].hull.shell,
                tetrahedron: [segments.prism[lane], segments.tetrahedron[lane]],
                shares: shares.get(lane),
                depth: depth.0[lane],
                point: point.get(lane),
                time: hits[hit].order.time,
            };
            let lit = LitCell { hit, cell: found.cells[lane], weight: weight.0[lane], place };
            let kind = usize::from(!level.is_whole);
            if !self.scattered.is_empty()
                && integrator.optics_of(&integrator.scene.shells[lit.place.shell]).is_some()
            {
                let start = hits[hit].order.before;
                let view = depth_between(start, before.0[lane]);
                let passage = Passage { start: start * share.0[lane], view, cell: bits.0[lane] };
                let ray = (rays.origin.get(lane), rays.d.get(lane), hits[hit].order.time);
                let segment = segments.get(lane);
                let length = segment.t[1] - segment.t[0];
                let [own, deep] = within(bits.0[lane]).map(|at| {
                    let t = enter.0[lane] + (leave.0[lane] - enter.0[lane]) * at;
                    Place::on_ray(lit.place.shell, &segment, ray, t, length)
                });
                let lit = LitCell { place: own, ..lit };
                self.scattered.push(simd, integrator, level, (&lit, &deep, lane), &passage, hits);
                continue;
            }
            let pending = &mut self.pending[kind];
            pending.push(integrator, level, &lit, &mut hits[hit]);
            if pending.cells.is_full() {
                pending.shade(simd, integrator, kind, hits);
            }
        }
    }
}

/// Lit cells of the lanes `bits`.
struct Found<'c, S: Simd> {
    bits: u8,
    cells: &'c [Cell; LANES],
    /// Share of the cells in what the eye sees.
    weight: Floats<S>,
    /// Share that the level counts by.
    share: Floats<S>,
    /// T in front of the cells.
    before: Floats<S>,
    /// Optical depth in the cells, bits.
    bits_in_cell: Floats<S>,
    /// Parameters where the rays enter the cells, and where they leave them.
    ends: [Floats<S>; 2],
    /// Parameters in the middle of the cells.
    middle: Floats<S>,
}
