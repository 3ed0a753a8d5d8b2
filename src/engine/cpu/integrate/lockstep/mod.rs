//! The integrate pass with eight rays in lockstep, in the registers of the best instruction set that the
//! processor has. It is chosen when the program runs.
//!
//! A ray has the same bits here as in the scalar walk (`src/engine/cpu/integrate/walk.rs`), which inspectors
//! use and tests compare with, whatever the other lanes do and however wide the registers are: every lane
//! does the operations of the scalar walk in their order, and none of them rounds differently on another
//! machine.
//!
//! - **A row of steps** moves each ray by eight cells and keeps their indices. Then their cells are fetched,
//!   T follows them, light is looked up or walked, and they are shaded. So a processor that waits for one
//!   part of a row works on another.
//! - **Lanes** are rays that meet sheets of one kind (strands or mist) in one level of one volume, of one
//!   stretch of a row of pixels. They may belong to different quads. Through shells each lane goes its own
//!   way ([`shell`]).

mod between;
mod cells;
mod fibre;
mod group;
mod hits;
mod ink;
mod light;
mod optics;
mod packed;
mod rows;
mod scatter;
mod shell;
mod shell_fill;
mod shell_light;
mod shell_scatter;
mod shell_way;
mod strand;
mod strands;
mod tear;
mod walk;

use fearless_simd::{Simd, dispatch};
use glam::{Vec2, Vec3};

use self::cells::Store;
use self::group::{Ends, Group, Scratch};
use self::hits::Hits;
use self::shell::{Ground, ShellHit, ShellLanes};
pub use self::shell_fill::Fill;
use super::walk::Lit;
use super::{Carrier, Integrator, PixelRay, RayResult, SheetOrder, SheetPlace};
use crate::engine::cpu::gbuffer::Gbuffer;
use crate::light::Visibility;
use crate::trace::lookup::{Level, STRANDS, StrandTurn};
use crate::util::lanes::LANES;

/// Registers that rays are walked in.
#[derive(Clone, Copy, Debug)]
pub enum Lanes {
    /// One ray at a time.
    Scalar,
    /// Eight rays in lockstep, with this instruction set.
    Lockstep(fearless_simd::Level),
}

impl Lanes {
    /// Best registers of this processor.
    pub fn best() -> Self {
        Lanes::Lockstep(fearless_simd::Level::new())
    }

    /// All registers of this processor that a program may choose, with the names of their instruction sets.
    pub fn all() -> Vec<(&'static str, Lanes)> {
        let mut all = vec![("scalar", Lanes::Scalar)];
        let level = fearless_simd::Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            use fearless_simd::Level;
            all.extend(level.as_sse2().map(|token| ("SSE2", Lanes::Lockstep(Level::Sse2(token)))));
            all.extend(level.as_sse4_2().map(|token| ("SSE4.2", Lanes::Lockstep(Level::Sse4_2(token)))));
            all.extend(level.as_avx2().map(|token| ("AVX2", Lanes::Lockstep(Level::Avx2(token)))));
            all.extend(level.as_avx512().map(|token| ("AVX-512", Lanes::Lockstep(Level::Avx512(token)))));
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        all.push(("best", Lanes::Lockstep(level)));
        all
    }
}

/// Index of the walks through the strands of a volume's first level, behind those through its cells and mist.
const OF_STRANDS: usize = 2;

/// Pixels whose rays are grouped together.
const STRETCH: usize = 256;

/// Rays of an integrator that walk in lockstep.
pub struct Lockstep<'a> {
    integrator: &'a Integrator<'a>,
    simd: fearless_simd::Level,
    /// Levels of all volumes, with the number of their volume and with their cells.
    levels: Vec<(usize, Level<'a>, Store<'a>)>,
    /// Index of the first level of each volume.
    firsts: Vec<usize>,
    // Memory that every stretch uses again.
    rays: Vec<(usize, PixelRay)>,
    met: Met,
    /// Faces of shells' hulls that the rays meet next.
    shells: Vec<ShellHit<'a>>,
    shell_lanes: Box<ShellLanes<'a>>,
    /// Whether rays through shells go side by side.
    shells_in_lanes: bool,
    scratch: Box<Scratch<'a>>,
}

/// A sheet that a ray of a stretch meets.
struct Sheet {
    /// Number of the ray in the stretch.
    ray: usize,
    order: SheetOrder,
    /// T and numbers of cells at the end of the walk through each of the two levels.
    ends: [(f32, [u32; 2]); 2],
}

/// Sheets that the rays of a stretch meet next.
#[derive(Default)]
struct Met {
    sheets: Vec<Sheet>,
    /// Eight sheets in each pack, in their order.
    packs: Vec<Hits>,
    /// Sheets and which of their two levels is walked, by the index of the level and by cells, mist or
    /// strands.
    walks: Vec<[Vec<(usize, usize)>; 3]>,
    /// Light of each sheet's two levels, light by light.
    lit: Vec<Lit>,
    /// Colour that each sheet's two levels give to the ambient light; see
    /// [`LevelResult`](super::LevelResult).
    tints: Vec<[Vec3; 2]>,
}

impl<'a> Lockstep<'a> {
    /// Returns what walks the rays of `integrator`, if it covers all that the scene asks for.
    pub fn of(integrator: &'a Integrator<'a>) -> Option<Self> {
        let Lanes::Lockstep(simd) = integrator.lanes else { return None };
        // Light volumes that are walked on demand serve a few rays.
        if integrator.visibility == Visibility::Cached && integrator.filled.is_none() {
            return None;
        }
        let (mut levels, mut firsts) = (Vec::new(), Vec::new());
        for (volume, own) in integrator.volumes.iter().enumerate() {
            firsts.push(levels.len());
            for number in 0..own.levels.len() as u32 {
                let level = Level::new(&own.levels, number);
                levels.push((volume, level, Store::new(&level)?));
            }
        }
        let met = Met { walks: levels.iter().map(|_| Default::default()).collect(), ..Default::default() };
        let scratch = Box::new(Scratch::new(integrator));
        Some(Lockstep {
            integrator,
            simd,
            levels,
            firsts,
            rays: Vec::new(),
            met,
            shells: Vec::new(),
            shell_lanes: Box::new(ShellLanes::new(integrator)),
            shells_in_lanes: shell::covers(integrator),
            scratch,
        })
    }

    /// See [`super::Walker::pixels`].
    pub fn pixels(
        &mut self,
        gbuffer: &Gbuffer,
        pixels: &[[u32; 2]],
        sample: u32,
        result: &mut impl FnMut(usize, RayResult),
    ) {
        let integrator = self.integrator;
        let turn = StrandTurn::new(integrator.scene.image.samples, sample);
        for (number, stretch) in pixels.chunks(STRETCH).enumerate() {
            for (i, &pixel) in (number * STRETCH..).zip(stretch) {
                match integrator.pixel_ray(gbuffer, pixel, sample) {
                    Ok(ray) => self.rays.push((i, ray)),
                    Err(dry) => result(i, dry),
                }
            }
            while self.meet(gbuffer, turn) {
                self.walk();
                self.compose();
                self.walk_shells();
            }
            self.rays.drain(..).for_each(|(i, ray)| result(i, integrator.seen(gbuffer, ray)));
        }
    }

    /// Finds the next sheet or shell of every ray. Returns whether there is any.
    fn meet(&mut self, gbuffer: &Gbuffer, turn: StrandTurn) -> bool {
        let Lockstep { rays, met, shells, shells_in_lanes, .. } = self;
        met.sheets.clear();
        met.packs.clear();
        let integrator = self.integrator;
        for (ray, (_, pixel)) in rays.iter_mut().enumerate() {
            let next = loop {
                match pixel.next_sheet(integrator.scene, gbuffer) {
                    Some((Carrier::Hull(hull), order)) if *shells_in_lanes => {
                        shells.push(ShellHit::new(ray, hull, pixel.d, order));
                        break None;
                    }
                    // Others are walked ray by ray, up to the next quad.
                    Some((Carrier::Hull(hull), order)) => {
                        let passed = integrator.shell(&hull, pixel.d, order, &mut ());
                        integrator.add(pixel, passed);
                    }
                    Some((Carrier::Quad(quad, hit), order)) => break Some((quad, hit, order)),
                    None => break None,
                }
            };
            let Some((quad, hit, order)) = next else { continue };
            let lane = met.sheets.len() % LANES;
            if lane == 0 {
                met.packs.push(Hits::default());
            }
            let Some(pack) = met.packs.last_mut() else { continue };
            pack.set(lane, quad, (pixel.d, pixel.time), hit);
            met.sheets.push(Sheet { ray, order, ends: Default::default() });
        }
        // Missing rays are those before them.
        let missing = met.sheets.len().next_multiple_of(LANES) - met.sheets.len();
        if let Some(pack) = met.packs.last_mut() {
            let last = LANES - missing - 1;
            let (quad, values) = (pack.quads[last], &pack.values);
            let (ray, at) = ((values.d_world.get(last), values.time.0[last]), values.at.get(last));
            (last + 1..LANES).for_each(|lane| pack.set(lane, quad, ray, at.into()));
        }
        dispatch!(self.simd, simd => map_all(simd, self.integrator, turn, &mut met.packs));
        !(met.sheets.is_empty() && shells.is_empty())
    }

    /// Walks through the shells, and adds them to their rays.
    fn walk_shells(&mut self) {
        let Lockstep { integrator, simd, levels, firsts, rays, shells, shell_lanes, .. } = self;
        let ground = Ground { integrator, levels, firsts };
        dispatch!(*simd, simd => shell_lanes.walk(simd, &ground, shells));
        for hit in shells.drain(..) {
            integrator.add(&mut rays[hit.ray].1, hit.result(integrator));
        }
    }

    /// Walks the levels of the sheets.
    fn walk(&mut self) {
        let lights = self.integrator.lights.len();
        let Met { sheets, packs, walks, lit, tints } = &mut self.met;
        tints.clear();
        tints.resize(sheets.len(), Default::default());
        lit.clear();
        lit.resize(2 * lights * sheets.len(), Lit::default());
        let mut room = Hits::default();
        walks.iter_mut().flatten().for_each(Vec::clear);
        for i in 0..sheets.len() {
            let (values, lane) = (&packs[i / LANES].values, i % LANES);
            let volume = self.integrator.scene.quads[packs[i / LANES].quads[lane]].material.volume;
            let kind = usize::from(values.mist.0[lane] > 0.0);
            let (finer, share) = (values.level.0[lane] as i32, values.share.0[lane]);
            for (which, level) in [finer, finer + 1].into_iter().enumerate() {
                if which == 1 && share == 0.0 {
                    break;
                }
                let (level, kind) = if level == STRANDS { (0, OF_STRANDS) } else { (level as usize, kind) };
                walks[self.firsts[volume as usize] + level][kind].push((i, which));
            }
        }
        for (&(volume, level, store), kinds) in self.levels.iter().zip(&*walks) {
            for (kind, walks) in kinds.iter().enumerate() {
                for walks in walks.chunks(LANES) {
                    // Missing rays are filled up with the first.
                    let of = |lane: usize| walks[if lane < walks.len() { lane } else { 0 }].0;
                    let picks = std::array::from_fn(|lane| (of(lane) / LANES, of(lane) % LANES));
                    let before = std::array::from_fn(|lane| sheets[of(lane)].order.before);
                    let hits = Hits::picked(packs, picks, &mut room);
                    let group = Group::new(self.integrator, volume, (level, store), hits, before);
                    let Ends { transmittance, cells } = match kind {
                        OF_STRANDS => {
                            dispatch!(self.simd, simd => group.walk_strands(simd, &mut self.scratch))
                        }
                        _ => dispatch!(self.simd, simd => group.walk(simd, &mut self.scratch)),
                    };
                    for (lane, &(i, which)) in walks.iter().enumerate() {
                        tints[i][which] = self.scratch.tint(lane);
                        sheets[i].ends[which] = (transmittance[lane], cells.map(|cells| cells[lane]));
                        let own = &mut lit[(2 * i + which) * lights..][..lights];
                        own.iter_mut().zip(self.scratch.lit(lane)).for_each(|(own, lit)| *own = lit);
                    }
                }
            }
        }
    }

    /// Adds the sheets to their rays.
    fn compose(&mut self) {
        let Lockstep { integrator, rays, met, .. } = self;
        let lights = integrator.lights.len();
        for (i, sheet) in met.sheets.iter().enumerate() {
            let values = &met.packs[i / LANES].values;
            let share = values.share.0[i % LANES];
            let (own, next) = met.lit[2 * i * lights..][..2 * lights].split_at_mut(lights);
            let [(mut transmittance, mut cells), (other, more)] = sheet.ends;
            let [mut tint, other_tint] = met.tints[i];
            if share > 0.0 {
                transmittance = transmittance * (1.0 - share) + other * share;
                cells = [0, 1].map(|c| cells[c] + more[c]);
                own.iter_mut().zip(&*next).for_each(|(lit, next)| *lit = lit.mixed(next, share));
                tint = tint * (1.0 - share) + other_tint * share;
            }
            let [u, v, _] = values.at.get(i % LANES).to_array();
            let place = SheetPlace {
                quad: met.packs[i / LANES].quads[i % LANES],
                uv: Vec2::new(u, v),
                point: values.point.get(i % LANES),
            };
            let passed = integrator.composed(&place, transmittance, cells, (own, tint), sheet.order);
            integrator.add(&mut rays[sheet.ray].1, passed);
        }
    }
}

/// Maps the rays of all packs to their cells.
#[inline(always)]
fn map_all<S: Simd>(simd: S, integrator: &Integrator, turn: StrandTurn, packs: &mut [Hits]) {
    // A closure might not be inlined here, and would lose the instruction set.
    for pack in packs {
        pack.map(simd, integrator, turn);
    }
}
