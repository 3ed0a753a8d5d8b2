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
//! - **Lanes** are rays that meet sheets of one kind (strands or mist) in one level, of one stretch of a row
//!   of pixels. They may belong to different quads.

mod cells;
mod fibre;
mod group;
mod lanes;
mod light;
mod powers;
mod walk;

use fearless_simd::dispatch;

use self::cells::Store;
use self::group::{Ends, Group, Scratch};
use self::lanes::LANES;
use super::walk::Lit;
use super::{Integrator, PixelRay, RayResult, SheetHit, SheetOrder};
use crate::engine::cpu::gbuffer::Gbuffer;
use crate::light::Visibility;
use crate::trace::Lookup;
use crate::trace::lookup::Level;

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

/// Pixels whose rays are grouped together.
const STRETCH: usize = 256;

/// Rays of an integrator that walk in lockstep.
pub struct Lockstep<'a> {
    integrator: &'a Integrator<'a>,
    simd: fearless_simd::Level,
    /// Levels of the volume, with their cells.
    levels: Vec<(Level<'a>, Store<'a>)>,
}

/// A sheet that a ray of a stretch meets.
struct Sheet<'a> {
    /// Number of the ray in the stretch.
    ray: usize,
    hit: SheetHit<'a>,
    order: SheetOrder,
    /// Finer of its two levels, and the share of the coarser.
    level: u32,
    share: f32,
    /// T and numbers of cells at the end of the walk through each level.
    ends: [(f32, [u32; 2]); 2],
}

impl<'a> Lockstep<'a> {
    /// Returns what walks the rays of `integrator`, if it covers all that the scene asks for.
    pub fn of(integrator: &'a Integrator<'a>) -> Option<Self> {
        let Lanes::Lockstep(simd) = integrator.lanes else { return None };
        let scene = integrator.scene;
        let is_filled = scene.visibility != Visibility::Cached || integrator.filled.is_some();
        if scene.trace.lookup != Lookup::Nearest || !is_filled {
            return None;
        }
        let levels = (0..integrator.levels.len() as u32).map(|number| {
            let level = Level::in_pyramid(&integrator.levels, number);
            Some((level, Store::new(&level)?))
        });
        Some(Lockstep { integrator, simd, levels: levels.collect::<Option<_>>()? })
    }

    /// See [`Integrator::pixels`].
    pub fn pixels(
        &mut self,
        gbuffer: &Gbuffer,
        pixels: &[[u32; 2]],
        sample: u32,
        result: &mut impl FnMut(usize, RayResult),
    ) {
        let integrator = self.integrator;
        let mut rays: Vec<(usize, PixelRay)> = Vec::with_capacity(STRETCH);
        let mut sheets = Vec::with_capacity(STRETCH);
        let mut lit = Vec::new();
        for (number, stretch) in pixels.chunks(STRETCH).enumerate() {
            rays.clear();
            for (i, &pixel) in (number * STRETCH..).zip(stretch) {
                match integrator.pixel_ray(gbuffer, pixel, sample) {
                    Ok(ray) => rays.push((i, ray)),
                    Err(dry) => result(i, dry),
                }
            }
            while self.meet(gbuffer, &rays, &mut sheets) {
                self.walk(&mut sheets, &mut lit);
                let lights = integrator.lights.len();
                for (i, sheet) in sheets.iter().enumerate() {
                    let (own, next) = lit[2 * i * lights..][..2 * lights].split_at_mut(lights);
                    let [(mut transmittance, mut cells), (other, more)] = sheet.ends;
                    if sheet.share > 0.0 {
                        transmittance = transmittance * (1.0 - sheet.share) + other * sheet.share;
                        cells = [0, 1].map(|c| cells[c] + more[c]);
                        own.iter_mut()
                            .zip(&*next)
                            .for_each(|(lit, next)| *lit = lit.mixed(next, sheet.share));
                    }
                    let passed = integrator.composed(&sheet.hit, transmittance, cells, own, sheet.order);
                    integrator.add(&mut rays[sheet.ray].1, passed);
                }
            }
            rays.drain(..).for_each(|(i, ray)| result(i, integrator.seen(gbuffer, ray)));
        }
    }

    /// Finds the next sheet of every ray. Returns whether there is any.
    fn meet(&self, gbuffer: &Gbuffer, rays: &[(usize, PixelRay)], sheets: &mut Vec<Sheet<'a>>) -> bool {
        sheets.clear();
        sheets.extend(rays.iter().enumerate().filter_map(|(ray, (_, pixel))| {
            let (quad, at, order) = pixel.next_sheet(gbuffer)?;
            let hit = self.integrator.sheet_hit(quad, pixel.d, at);
            let (level, share) = self.integrator.level_of(&hit, at[2]);
            Some(Sheet { ray, hit, order, level, share, ends: Default::default() })
        }));
        !sheets.is_empty()
    }

    /// Walks the sheets' levels. `lit` gets the light of each sheet's two levels, light by light.
    fn walk(&self, sheets: &mut [Sheet<'a>], lit: &mut Vec<Lit>) {
        let lights = self.integrator.lights.len();
        lit.clear();
        lit.resize(2 * lights * sheets.len(), Lit::default());
        let mut ends = Vec::with_capacity(2 * sheets.len());
        let mut scratch = Scratch::default();
        for (number, &(level, store)) in (0u32..).zip(&self.levels) {
            for mist in [false, true] {
                let walks = sheets.iter().enumerate().flat_map(|(i, sheet)| {
                    let levels = if sheet.share > 0.0 { 2 } else { 1 };
                    let which = number.wrapping_sub(sheet.level);
                    let is_mist = sheet.hit.matter[0].mist > 0.0;
                    (which < levels && is_mist == mist).then_some((i, which as usize))
                });
                let walks: Vec<(usize, usize)> = walks.collect();
                for walks in walks.chunks(LANES) {
                    let of = |lane: usize| &sheets[walks[if lane < walks.len() { lane } else { 0 }].0];
                    let hits = std::array::from_fn(|lane| &of(lane).hit);
                    let before = std::array::from_fn(|lane| of(lane).order.before);
                    let group = Group::new(self.integrator, level, store, hits, before);
                    group.prepare(&mut scratch);
                    let Ends { transmittance, cells } =
                        dispatch!(self.simd, simd => group.walk(simd, &mut scratch));
                    for (lane, &(i, which)) in walks.iter().enumerate() {
                        ends.push((i, which, transmittance[lane], cells.map(|cells| cells[lane])));
                        let own = &mut lit[(2 * i + which) * lights..][..lights];
                        own.iter_mut().zip(scratch.lit(lane)).for_each(|(own, lit)| *own = lit);
                    }
                }
            }
        }
        for (i, which, transmittance, cells) in ends {
            sheets[i].ends[which] = (transmittance, cells);
        }
    }
}
