//! Rays through shells, eight side by side. Twin of `src/engine/cpu/integrate/shell.rs`: every ray gets the
//! bits that it gets alone.
//!
//! A ray crosses only a cell or two of a tetrahedron, so most of its time would go into changing from one to
//! the next. Here eight rays do that together. Each lane has a ray, and takes another one as soon as its own
//! ends. Lit cells wait until there are eight of one kind ([`Pending`]).

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8};

use super::cells::{Store, rho_codes, words};
use super::hits::in_tile;
use super::light::lanes_of;
use super::shell_light::{LitCell, Pending};
use super::walk::{LaneUnits, Units, Walk};
use crate::engine::cpu::integrate::shell::{Hull, Place};
use crate::engine::cpu::integrate::{Integrator, RayResult, SheetOrder};
use crate::light::AngleFrame;
use crate::mapping::shell::{Segment, ShellPath};
use crate::trace::lookup::Level;
use crate::trace::{Lookup, Prefilter};
use crate::util::lane_powers::{exp2, log2};
use crate::util::lanes::{Floats, LANES, Lanes3, Mask, Stored, Stored3, floor_cell};
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
    transmittance: f32,
    /// Linear radiance that cells of the volume itself, and coarser ones, have sent to the eye.
    pub radiance: [Vec3; 2],
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
            cells: [0; 2],
        }
    }

    /// The result of a ray that has left the shell.
    pub fn result(&self, integrator: &Integrator) -> RayResult {
        integrator.left_shell(self.order, self.transmittance, self.radiance, self.cells)
    }
}

/// Whether rays through shells may go side by side.
pub fn covers(integrator: &Integrator) -> bool {
    let scene = integrator.scene;
    scene.trace.lookup == Lookup::Nearest && scene.angles == AngleFrame::World
}

/// The ray of a lane.
struct OnWay<'a> {
    /// Number of its hit.
    hit: usize,
    path: ShellPath<'a>,
    /// Distance of the opaque scene from the path's origin, metres.
    t_end: f32,
    /// Prism and tetrahedron.
    tetrahedron: [usize; 2],
}

/// Numbers of the lanes' rays and of their tetrahedra.
#[derive(Default)]
struct Values {
    d: Stored3,
    /// Origin of the path, and its distance from the eye, metres.
    origin: Stored3,
    metres: Stored,
    transmittance: Stored,
    /// Cells walked.
    cells: [i32; LANES],
    /// Number of cells of the volume along x, y and z.
    n: Stored3,
    flow_cells: Stored,
    extinction: Stored,
    /// Number of the coarsest level.
    coarsest: Stored,
    /// Of the segment: see [`Segment`].
    t: [Stored; 2],
    at: [Stored3; 2],
    shares: [Stored3; 2],
    /// Volume of a cell, m³.
    cell: Stored,
}

/// Parts of the rays in their tetrahedra.
struct Way<S: Simd> {
    /// Where they begin, inside the tile, and their directions per metre, in cells.
    start: Lanes3<S>,
    direction: Lanes3<S>,
    /// Metres.
    length: Floats<S>,
    /// Share of the coarser of the two levels.
    share: Floats<S>,
    /// Number of the finer one.
    level: [u32; LANES],
}

/// Eight rays on their way through shells.
pub struct ShellLanes<'a> {
    on_way: [Option<OnWay<'a>>; LANES],
    values: Values,
    pending: [Pending; 2],
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
        ShellLanes { on_way: Default::default(), values: Values::default(), pending: [pending(), pending()] }
    }

    /// Walks all rays through their shells.
    #[inline(always)]
    pub fn walk<S: Simd>(&mut self, simd: S, ground: &Ground<'_, 'a>, hits: &mut [ShellHit<'a>]) {
        let mut next = 0;
        loop {
            let mut bits = 0;
            for lane in 0..LANES {
                let goes_on = self.advance(ground.integrator, lane, hits, &mut next);
                bits |= u32::from(goes_on) << lane;
            }
            if bits == 0 {
                break;
            }
            self.through(simd, ground, bits, hits);
        }
        for (kind, pending) in self.pending.iter_mut().enumerate() {
            pending.shade(simd, ground.integrator, kind, hits);
        }
    }

    /// Leads a lane into the next tetrahedron: of its ray, or of the ray number `next`. Returns whether there
    /// is any.
    #[inline(always)]
    fn advance(
        &mut self,
        integrator: &'a Integrator<'a>,
        lane: usize,
        hits: &mut [ShellHit<'a>],
        next: &mut usize,
    ) -> bool {
        let scene = integrator.scene;
        loop {
            if let Some(OnWay { hit, path, t_end, tetrahedron }) = &mut self.on_way[lane] {
                let hit = &mut hits[*hit];
                let shell = &*scene.shells[hit.hull.shell];
                let transmittance = self.values.transmittance.0[lane];
                while let Some(segment) = path.next() {
                    if segment.t[0] >= *t_end || transmittance < scene.trace.early_end {
                        break;
                    }
                    let segment = segment.until(*t_end);
                    let Some(volumes) = &shell.prisms[segment.prism].volumes else { continue };
                    if segment.t[1] > segment.t[0] {
                        *tetrahedron = [segment.prism, segment.tetrahedron];
                        self.values.set(lane, &segment, volumes[segment.tetrahedron]);
                        return true;
                    }
                }
                hit.transmittance = transmittance;
                hit.cells[0] = self.values.cells[lane] as u32;
                self.on_way[lane] = None;
            }
            let Some(hit) = hits.get(*next) else { return false };
            let shell = &*scene.shells[hit.hull.shell];
            let (origin, t_end) = integrator.shell_start(&hit.hull, hit.d);
            let path = ShellPath::new(shell, hit.hull.face, origin, hit.d);
            self.on_way[lane] = Some(OnWay { hit: *next, path, t_end, tetrahedron: [0; 2] });
            *next += 1;
            let volume = integrator.volume_of(shell);
            let values = &mut self.values;
            values.d.set(lane, hit.d);
            values.origin.set(lane, origin);
            values.metres.0[lane] = hit.hull.metres;
            values.transmittance.0[lane] = hit.order.before;
            values.cells[lane] = 0;
            values.n.set(lane, Vec3::from_array(volume.size.map(|n| n as f32)));
            values.flow_cells.0[lane] = volume.flow_cells;
            values.extinction.0[lane] = volume.extinction;
            values.coarsest.0[lane] = (volume.levels.len() - 1) as f32;
        }
    }

    /// Walks through a tetrahedron in each of the lanes `bits`.
    #[inline(always)]
    fn through<S: Simd>(&mut self, simd: S, ground: &Ground<'_, 'a>, bits: u32, hits: &mut [ShellHit<'a>]) {
        let way = self.values.way(simd, ground.integrator);
        let one = f32x8::splat(simd, 1.0);
        let before = self.values.transmittance.load(simd);
        let all = Mask::from_bitmask(simd, bits.into());
        let fine = self.in_level(simd, ground, (&way, 0), all, one - way.share, hits);
        let shared = all & way.share.simd_gt(0.0);
        if shared.any_true() {
            self.values.transmittance.store(before);
            let coarse = self.in_level(simd, ground, (&way, 1), shared, way.share, hits);
            let mixed = fine * (one - way.share) + coarse * way.share;
            self.values.transmittance.store(shared.select(mixed, fine));
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
        let numbers = self.levels_of(ground, way, which, active.to_bitmask() as u32);
        let own = Levels::new(simd, ground.levels, &numbers);
        let mut walk = Walk::of_lanes(simd, &own.units, way.start.by(own.scale), way.direction.by(own.scale));
        let mut transmittance = self.values.transmittance.load(simd);
        let mut count = i32x8::load_array_ref(simd, &self.values.cells);
        let most = i32x8::splat(simd, trace.max_cells.min(i32::MAX as u32) as i32);
        let extinction = self.values.extinction.load(simd);
        loop {
            let goes_on = walk.inside() & walk.t.simd_lt(way.length);
            active &= goes_on & transmittance.simd_ge(trace.early_end) & count.simd_lt(most);
            let bits = active.to_bitmask() as u8;
            if bits == 0 {
                break;
            }
            count += active.select(one, none);
            let index: [i32; LANES] = walk.index().to_array();
            let mut cells = [Cell::default(); LANES];
            for lane in lanes_of(bits) {
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
            let passed = transmittance * exp2(simd, -(rho * extinction * (leave - enter)));
            let found = Found {
                bits: lit.to_bitmask() as u8,
                cells: &cells,
                weight: (transmittance - passed) * weight,
                middle: (enter + leave) * 0.5,
            };
            self.light(simd, ground, &numbers, way, &found, hits);
            transmittance = lit.select(passed, transmittance);
        }
        count.store_array(&mut self.values.cells);
        self.values.transmittance.store(transmittance);
        transmittance
    }

    /// Numbers of the levels that the lanes `bits` walk through. Other lanes have that of one of these.
    #[inline(always)]
    fn levels_of<S: Simd>(
        &self,
        ground: &Ground<'_, 'a>,
        way: &Way<S>,
        which: usize,
        bits: u32,
    ) -> [usize; LANES] {
        if let [_] = ground.firsts
            && way.level == [way.level[0]; LANES]
            && bits & 1 == 1
        {
            return [way.level[0] as usize + which; LANES];
        }
        let mut numbers = [0; LANES];
        let mut last = 0;
        for lane in 0..LANES {
            if bits >> lane & 1 == 1
                && let Some(OnWay { hit: _, path, .. }) = &self.on_way[lane]
            {
                last = ground.firsts[path.shell().volume as usize] + way.level[lane] as usize + which;
            }
            numbers[lane] = last;
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
        let values = &self.values;
        let along = found.middle / way.length;
        let [from, to] = [&values.shares[0], &values.shares[1]].map(|shares| shares.load(simd));
        let mut shares = Stored3::default();
        shares.store(from.plus(to.minus(from).times(along)));
        let [from, to] = [&values.at[0].0[2], &values.at[1].0[2]].map(|depth| depth.load(simd));
        let mut depth = Stored::default();
        depth.store(from + (to - from) * along);
        let t = values.t[0].load(simd) + found.middle;
        let mut point = Stored3::default();
        point.store(values.origin.load(simd).plus(values.d.load(simd).times(t)));
        let mut weight = Stored::default();
        weight.store(found.weight);
        for lane in lanes_of(found.bits) {
            let Some(OnWay { hit, tetrahedron, .. }) = &self.on_way[lane] else { continue };
            let level = &ground.levels[numbers[lane]].1;
            let place = Place {
                shell: hits[*hit].hull.shell,
                tetrahedron: *tetrahedron,
                shares: shares.get(lane),
                depth: depth.0[lane],
                point: point.get(lane),
            };
            let lit = LitCell { hit: *hit, cell: found.cells[lane], weight: weight.0[lane], place };
            let kind = usize::from(!level.is_whole);
            let pending = &mut self.pending[kind];
            pending.push(ground.integrator, level, &lit, &mut hits[*hit]);
            if pending.is_full() {
                pending.shade(simd, ground.integrator, kind, hits);
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
    /// Parameters in the middle of the cells.
    middle: Floats<S>,
}

impl Values {
    /// Puts a lane into a tetrahedron with the given determinant of its Jacobian.
    #[inline(always)]
    fn set(&mut self, lane: usize, segment: &Segment, determinant: f32) {
        for k in 0..2 {
            self.t[k].0[lane] = segment.t[k];
            self.at[k].set(lane, segment.at[k]);
            self.shares[k].set(lane, segment.shares[k]);
        }
        let n = self.n.get(lane);
        self.cell.0[lane] = determinant / (n.x * n.y * n.z);
    }

    /// Maps the segments to cells.
    #[inline(always)]
    fn way<S: Simd>(&self, simd: S, integrator: &Integrator) -> Way<S> {
        let splat = |x: f32| f32x8::splat(simd, x);
        let n = self.n.load(simd);
        let [from, to] = [self.at[0].load(simd).by(n), self.at[1].load(simd).by(n)];
        let [t_in, t_out] = [self.t[0].load(simd), self.t[1].load(simd)];
        let length = t_out - t_in;
        let direction = to.minus(from).over(length);
        let start = Lanes3 {
            x: in_tile(simd, from.x, n.x),
            y: in_tile(simd, from.y - self.flow_cells.load(simd), n.y),
            z: from.z,
        };
        let mut way = Way { start, direction, length, share: splat(0.0), level: [0; LANES] };
        if integrator.scene.trace.filter != Prefilter::None {
            let forward = Lanes3::splat(simd, integrator.scene.camera.forward.as_vec3());
            let cell_area = self.cell.load(simd) * direction.dot(direction).sqrt();
            let c = self.d.load(simd).dot(forward);
            let t = self.metres.load(simd) + t_in;
            let across = splat(integrator.footprint) * (c * c * c) * (t * t) / cell_area;
            let exact = splat(0.5) * log2(simd, across.max(splat(1e-30)));
            let exact = exact.max(splat(0.0)).min(self.coarsest.load(simd));
            let whole = floor_cell(simd, exact);
            way.share = exact - whole.to_float::<f32x8<S>>();
            way.level = whole.to_array().map(|level| level as u32);
        }
        way
    }
}

/// Levels that the lanes walk through.
struct Levels<S: Simd> {
    units: LaneUnits<S>,
    scale: Lanes3<S>,
}

impl<S: Simd> Levels<S> {
    #[inline(always)]
    fn new(simd: S, levels: &[(usize, Level, Store)], numbers: &[usize; LANES]) -> Self {
        let (_, level, store) = &levels[numbers[0]];
        if *numbers == [numbers[0]; LANES] {
            let units = LaneUnits::splat(simd, &store.units);
            return Levels { units, scale: Lanes3::splat(simd, level.scale) };
        }
        let units: [Units; LANES] = numbers.map(|number| levels[number].2.units);
        let scale = Stored3::from_fn(|lane| levels[numbers[lane]].1.scale);
        Levels { units: LaneUnits::new(simd, &units), scale: scale.load(simd) }
    }
}
