//! Light of cells in shells in which light scatters many times, eight cells side by side. Twin of
//! `src/engine/cpu/integrate/shell_scatter.rs`.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::fibre::{Exponent, Moments};
use super::optics::{Arriving, CellNormal, CellOptics, Passage, Surface, forward_peak, normal_of};
use super::shell::ShellHit;
use super::shell_light::{Fibres, Lit, LitCell, LitCells};
use crate::engine::cpu::integrate::Integrator;
use crate::engine::cpu::integrate::shell::Place;
use crate::engine::cpu::lights::light_at;
use crate::light::scatter::optics;
use crate::trace::lookup::Level;
use crate::util::lanes::{LANES, Lanes3, Stored, Stored3};

use glam::Vec3;

/// Number of the cells of fibres, and of skin.
const FIBRES: usize = 0;
const SKIN: usize = 1;

/// Lit cells in which light scatters many times.
pub struct Scattered {
    /// Lists of fibres and of skin: of the volume itself, and of coarser levels. There are none where light
    /// scatters once everywhere.
    lists: Vec<[PendingScatter; 2]>,
    /// Last cells of the lanes' rays and their colours.
    last: [Option<([Place; 2], Vec3)>; LANES],
}

impl Scattered {
    /// No cells.
    pub fn new(integrator: &Integrator) -> Self {
        let pending = || PendingScatter::new(integrator.lights.len());
        let kinds = if integrator.optics.iter().any(Option::is_some) { SKIN + 1 } else { 0 };
        Scattered { lists: (0..kinds).map(|_| [pending(), pending()]).collect(), last: [None; LANES] }
    }

    /// Whether there are never any.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.lists.is_empty()
    }

    /// Adds a cell of the ray in a lane, and shades it when there are eight of its kind.
    #[inline(always)]
    pub fn push<S: Simd>(
        &mut self,
        simd: S,
        integrator: &Integrator,
        level: &Level,
        (lit, deep, lane): (&LitCell, &Place, usize),
        passage: &optics::Passage,
        hits: &mut [ShellHit],
    ) {
        let Some(optics) = integrator.optics_of(&integrator.scene.shells[lit.place.shell]) else { return };
        let kinds = [if optics.surface.is_some() { SKIN } else { FIBRES }, usize::from(!level.is_whole)];
        let pending = &mut self.lists[kinds[0]][kinds[1]];
        let color = pending.push(integrator, level, (lit, deep), passage, &mut hits[lit.hit], optics);
        self.last[lane] = Some(([lit.place, *deep], color));
        if pending.cells.is_full() {
            pending.shade(simd, integrator, kinds, hits);
        }
    }

    /// Shades all cells.
    #[inline(always)]
    pub fn shade<S: Simd>(&mut self, simd: S, integrator: &Integrator, hits: &mut [ShellHit]) {
        for (of, lists) in self.lists.iter_mut().enumerate() {
            for (kind, pending) in lists.iter_mut().enumerate() {
                pending.shade(simd, integrator, [of, kind], hits);
            }
        }
    }

    /// Ends the ray in a lane.
    #[inline]
    pub fn end(&mut self, integrator: &Integrator, lane: usize, hit: &mut ShellHit) {
        if let Some((places, color)) = self.last[lane].take()
            && hit.transmittance < integrator.scene.trace.early_end
        {
            let ends = [hit.order.before, hit.transmittance];
            hit.beyond = integrator.beyond_end(&places, color, hit.d, ends);
        }
    }
}

/// Lit cells whose matter scatters light many times: all of fibres, or all of skin.
struct PendingScatter {
    cells: LitCells,
    /// Light of each light that reaches the cells: in the shell, and past opaque matter.
    through: Vec<Stored>,
    open: Vec<Stored>,
    /// See [`optics::Passage`].
    start: Stored,
    view: Stored,
    bits: Stored,
    /// See [`optics::CellOptics`].
    extinction: Stored3,
    albedo: Stored3,
    reduced: Stored3,
    isotropic: Stored3,
    whole: Stored3,
    g: Stored,
    /// See [`optics::Surface`].
    eta: Stored,
    roughness: Stored,
    /// J.
    diffuse: Stored3,
}

impl PendingScatter {
    /// No cells, under a number of lights.
    fn new(lights: usize) -> Self {
        let one = || Stored([1.0; 8]);
        PendingScatter {
            cells: LitCells::default(),
            through: vec![Stored::default(); lights],
            open: vec![Stored::default(); lights],
            start: Stored::default(),
            view: Stored::default(),
            bits: Stored::default(),
            extinction: Stored3::default(),
            albedo: Stored3::default(),
            reduced: Stored3::default(),
            isotropic: Stored3::default(),
            whole: Stored3::default(),
            g: Stored::default(),
            eta: one(),
            roughness: one(),
            diffuse: Stored3::default(),
        }
    }

    /// Adds a cell of a ray. Returns its colour.
    #[inline]
    fn push(
        &mut self,
        integrator: &Integrator,
        level: &Level,
        (lit, deep): (&LitCell, &Place),
        passage: &optics::Passage,
        hit: &mut ShellHit,
        own: &optics::ShellOptics,
    ) -> Vec3 {
        let i = self.cells.count();
        let color = self.cells.push(integrator, lit, hit.d).unwrap_or(Vec3::ONE);
        let (through, open) = (&mut self.through, &mut self.open);
        integrator.all_arriving(level, &lit.place, &mut hit.cells[1], |light, arriving| {
            (through[light].0[i], open[light].0[i]) = (arriving.through, arriving.open);
        });
        (self.start.0[i], self.view.0[i], self.bits.0[i]) = (passage.start, passage.view, passage.cell);
        let cell = own.of_cell(color);
        self.extinction.set(i, cell.extinction);
        self.albedo.set(i, cell.albedo);
        self.reduced.set(i, cell.reduced);
        self.isotropic.set(i, cell.isotropic);
        self.whole.set(i, cell.whole);
        self.g.0[i] = own.g;
        if let Some(surface) = &own.surface {
            (self.eta.0[i], self.roughness.0[i]) = (surface.eta, surface.roughness);
        }
        self.diffuse.set(i, integrator.diffuse_at(deep));
        color
    }

    #[inline(always)]
    fn passage<S: Simd>(&self, simd: S) -> Passage<S> {
        Passage { start: self.start.load(simd), view: self.view.load(simd), cell: self.bits.load(simd) }
    }

    #[inline(always)]
    fn optics<S: Simd>(&self, simd: S) -> CellOptics<S> {
        CellOptics {
            extinction: self.extinction.load(simd),
            albedo: self.albedo.load(simd),
            reduced: self.reduced.load(simd),
            isotropic: self.isotropic.load(simd),
            whole: self.whole.load(simd),
        }
    }

    #[inline(always)]
    fn arriving<S: Simd>(&self, simd: S, light: usize) -> Arriving<S> {
        Arriving { through: self.through[light].load(simd), open: self.open[light].load(simd) }
    }

    /// Adds the light of the cells to that of their rays: of fibres or of skin, and of one kind of level.
    #[inline(always)]
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        integrator: &Integrator,
        [of, kind]: [usize; 2],
        hits: &mut [ShellHit],
    ) {
        match of {
            SKIN => self.shade_skin(simd, integrator, kind, hits),
            _ => self.shade_fibres(simd, integrator, kind, hits),
        }
    }

    /// Adds the light of cells of fibres to that of their rays, as [`LitCells::add`].
    #[inline(always)]
    fn shade_fibres<S: Simd>(
        &mut self,
        simd: S,
        integrator: &Integrator,
        kind: usize,
        hits: &mut [ShellHit],
    ) {
        let lit = self.cells.load(simd, integrator);
        let (fibres, exponent) = (Fibres::new(simd, kind, &lit), Exponent::new(integrator.scene.p));
        let (own, g) = (self.optics(simd), self.g.load(simd));
        let reduced = self.passage(simd).weight(simd, own.extinction);
        let mut sum = reduced.by(own.albedo.by(self.diffuse.load(simd)));
        for (i, light) in integrator.lights.iter().enumerate() {
            let arriving = self.arriving(simd, i);
            let weight = lit.weight * arriving.visible();
            let (l, intensity) = light_at(simd, light, lit.point);
            let once = lit.once(simd, integrator, (&fibres, &exponent), (l, intensity));
            let peak = forward_peak(simd, g, -l.dot(lit.e));
            let more = own.more(simd, reduced, weight, &peak, &arriving);
            sum = sum.plus(once.times(weight).plus(intensity.by(more)));
        }
        self.cells.add(sum, kind, hits);
    }

    /// Adds the light of cells of skin to that of their rays, as [`LitCells::add`].
    #[inline(always)]
    fn shade_skin<S: Simd>(&mut self, simd: S, integrator: &Integrator, kind: usize, hits: &mut [ShellHit]) {
        let Lit { second, e, frame, point, .. } = self.cells.load(simd, integrator);
        let surface = Surface { simd, eta: self.eta.load(simd), roughness: self.roughness.load(simd) };
        let (own, passage) = (self.optics(simd), self.passage(simd));
        let n = normal_of(simd, frame[2]);
        let [leaves, stretch] = surface.leaving(n.dot(e).abs());
        let reduced = passage.weight(simd, own.extinction.times(stretch)).times(leaves);
        let on_surface = passage.surface_weight(simd);
        let moments = if kind == 0 { Moments::of(second) } else { Moments::unpacked(simd, second) };
        let normal = CellNormal::new(simd, &moments, &frame);
        let alpha2 = surface.roughness * surface.roughness + normal.variance;
        let thrown_back = (f32x8::splat(simd, 1.0) - leaves * (surface.eta * surface.eta)) * on_surface;
        let ambient = Lanes3::splat(simd, integrator.scene.ambient);
        let diffuse = reduced.by(own.albedo.by(self.diffuse.load(simd)));
        let mut sum = diffuse.plus(ambient.times(thrown_back));
        let zero = f32x8::splat(simd, 0.0);
        for (i, light) in integrator.lights.iter().enumerate() {
            let arriving = self.arriving(simd, i);
            let (l, intensity) = light_at(simd, light, point);
            let mu = n.dot(l).max(zero);
            let [enters, stretch] = surface.entering(mu);
            let depth = arriving.depth(simd);
            let seen = arriving.reduced(simd, own.extinction.times(stretch), depth);
            let once = reduced.by(own.reduced.by(seen)).times(enters);
            let lobe = surface.lobe(normal.m, l, e, alpha2) * (on_surface * arriving.open);
            let both = Lanes3 { x: once.x + lobe, y: once.y + lobe, z: once.z + lobe };
            let is_lit = mu.simd_gt(0.0);
            sum = sum.plus(intensity.by(both.or(is_lit, Lanes3 { x: zero, y: zero, z: zero })));
        }
        self.cells.add(sum, kind, hits);
    }
}
