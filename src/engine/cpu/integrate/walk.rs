//! §4 and §5: the walk of a ray through the cells of one level, and the light of each cell. Twins:
//! `walk_level` and `visit` of `shaders/engine/integrate.wgsl`, and `lit` and `lit_in_colour` of
//! `shaders/engine/integrate_light.wgsl`.

use glam::{IVec3, Vec3};

use super::light::{RayLight, RayScatter};
use super::{Integrator, Observer, SheetHit};
use crate::light::fibre::{Spread, psi_parts};
use crate::light::scatter::media::MultipleMedium;
use crate::light::scatter::multiple;
use crate::light::strand::ROOT_TO_TIP;
use crate::trace::Lookup;
use crate::trace::lines::Segment;
use crate::trace::lookup::{CellSample, Level};
use crate::util::powers::{exp2, log2};
use crate::volume::{Cell, Moments};
use crate::walk::Walk;

/// The result of walking one level.
pub struct LevelResult {
    /// T at the end of the walk.
    pub transmittance: f32,
    /// Light that each of the scene's lights sent to the eye.
    pub lit: Vec<Lit>,
    /// Colour that the cells give to the ambient light, minus that of white ones.
    pub tint: Vec3,
    /// Number of cells walked by the view ray, and by its light rays.
    pub cells: [u32; 2],
}

impl LevelResult {
    /// Interpolates between two levels; `share` is that of `other`.
    pub fn mixed(mut self, other: LevelResult, share: f32) -> LevelResult {
        self.transmittance = self.transmittance * (1.0 - share) + other.transmittance * share;
        self.lit.iter_mut().zip(&other.lit).for_each(|(lit, next)| *lit = lit.mixed(next, share));
        self.tint = self.tint * (1.0 - share) + other.tint * share;
        self.cells = [0, 1].map(|c| self.cells[c] + other.cells[c]);
        self
    }
}

/// Light that a ray's cells sent to the eye from one light.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lit {
    /// In 255ths of the light's intensity; for cells without a colour of their own.
    pub sum: f32,
    /// Relative to the light's intensity; for cells with a colour of their own.
    pub colour: Vec3,
}

impl Lit {
    /// Interpolates between two levels; `share` is that of `other`.
    pub fn mixed(&self, other: &Lit, share: f32) -> Lit {
        let own = 1.0 - share;
        Lit { sum: self.sum * own + other.sum * share, colour: self.colour * own + other.colour * share }
    }
}

/// Values of a cell that a ray sees, which all lights share.
struct Seen {
    /// Position in the level.
    at: IVec3,
    cell: Cell,
    /// k_d and k_s, in codes.
    k: [f32; 2],
    /// Second moments of the directions, if there is more than one.
    moments: Option<Moments>,
    /// T before the cell minus T behind it.
    weight: f32,
    /// Optical depth of the cell, and of all before it, bits.
    tau_bits: f32,
    depth: f32,
}

/// Terms of a ray that are constant through one level, and its light so far.
struct Walked<'a> {
    ray: &'a SheetHit<'a>,
    level: &'a Level<'a>,
    lights: Vec<RayLight>,
    scatter: Option<Vec<RayScatter>>,
    /// Share of the surroundings' light that shade leaves.
    sky_left: f32,
    result: LevelResult,
}

impl Integrator<'_> {
    /// A ray at the face of a sheet, with the transmittance `before`.
    fn walked<'a>(&self, ray: &'a SheetHit, level: &'a Level, before: f32) -> Walked<'a> {
        let lights: Vec<RayLight> = self.ray_lights(ray, level).collect();
        let lit = vec![Lit::default(); lights.len()];
        let result = LevelResult { transmittance: before, lit, tint: Vec3::ZERO, cells: [0; 2] };
        let sky_left = self.light_left(ray.quad, ray.uv).sky;
        Walked { ray, level, lights, scatter: self.ray_scatter(ray), sky_left, result }
    }

    /// Walks one level of the volume to the end of the slab or of the ray. T before the sheet is `before`.
    pub(super) fn walk<O: Observer>(
        &self,
        ray: &SheetHit,
        level: &Level,
        before: f32,
        observer: &mut O,
    ) -> LevelResult {
        let trace = &self.scene.trace;
        let mut walked = self.walked(ray, level, before);
        let matter = ray.matter(level);
        let extinction = self.extinction_in(ray.volume, level);
        let (origin, d_cell) = (ray.origin * level.scale, ray.d_cell * level.scale);
        let is_between = trace.lookup == Lookup::Trilinear;
        let mut transmittance = before;
        let mut depth = -log2(before.max(1e-30));
        let mut cells = 0;
        let mut walk = Walk::new(level.size, origin, d_cell, f32::INFINITY);
        while cells < trace.max_cells && walk.cell().z < level.size.z && transmittance >= trace.early_end {
            let cell = level.cell(walk.cell());
            let Some(crossing) = walk.next() else { break };
            cells += 1;
            let CellSample { rho, k, moments } = match is_between {
                true => level.sample_trilinear(&crossing, origin, d_cell, matter, false),
                false => level.sample_cell(cell, matter),
            };
            observer.enter(&crossing, cell, rho / 65535.0, transmittance);
            if rho <= 0.0 {
                continue;
            }
            let mut tau_bits = rho * extinction;
            if !self.per_cell {
                tau_bits *= crossing.t_exit - crossing.t_enter;
            }
            let passed = transmittance * exp2(-tau_bits);
            let weight = transmittance - passed;
            let moments = moments.or_else(|| (!level.is_whole).then(|| level.moments(cell)));
            let seen = Seen { at: crossing.cell, cell, k, moments, weight, tau_bits, depth };
            self.light_cell(&mut walked, seen, observer);
            transmittance = passed;
            depth += tau_bits;
        }
        walked.result.transmittance = transmittance;
        walked.result.cells[0] = cells;
        walked.result
    }

    /// Walks the strands of the volume to the end of the slab or of the ray, between the centres of the cells
    /// of its finest level. T before the sheet is `before`. Twin: `walk_strands` of
    /// `shaders/engine/integrate_strands.wgsl`.
    pub(super) fn walk_strands<O: Observer>(
        &self,
        ray: &SheetHit,
        level: &Level,
        before: f32,
        observer: &mut O,
    ) -> LevelResult {
        let trace = &self.scene.trace;
        let mut walked = self.walked(ray, level, before);
        let matter = ray.matter(level);
        let extinction = self.extinction_in(ray.volume, level);
        // Cells that a ray passes in one unit of t.
        let speed = if self.per_cell { ray.d_cell.abs().element_sum() } else { 1.0 };
        let origin = ray.origin + 0.5;
        let back = level.size.z as f32 / ray.d_cell.z;
        let mut transmittance = before;
        let mut depth = -log2(before.max(1e-30));
        let mut cells = 0;
        let mut walk = Walk::new(level.size + IVec3::Z, origin, ray.d_cell, back);
        while cells < trace.max_cells && transmittance >= trace.early_end {
            let Some(crossing) = walk.next() else { break };
            cells += 1;
            let middle = origin + ray.d_cell * ((crossing.t_enter + crossing.t_exit) * 0.5);
            let segment = Segment {
                middle: middle - middle.floor(),
                direction: ray.d_cell,
                half: (crossing.t_exit - crossing.t_enter) * 0.5,
            };
            let mut met = [(0.0, IVec3::ZERO, Cell::default()); 8];
            let mut tau_bits = 0.0;
            let upper = crossing.cell;
            let wrapped = IVec3::select(upper.cmpeq(IVec3::ZERO), level.size, upper) - 1;
            let lower = wrapped.with_z(upper.z - 1);
            for (corner, met) in met.iter_mut().enumerate() {
                let away = IVec3::new((corner & 1) as i32, (corner >> 1 & 1) as i32, (corner >> 2) as i32);
                let at = IVec3::select(away.cmpeq(IVec3::ZERO), lower, upper);
                if at.z < 0 || at.z >= level.size.z {
                    continue;
                }
                let cell = level.cell(at);
                let rho = matter.rho(cell.rho_code() as f32);
                if cell.rho_code() == 0 || rho <= 0.0 {
                    continue;
                }
                let own = rho * extinction * segment.through(cell, away.as_vec3()) * speed;
                *met = (own, at, cell);
                tau_bits += own;
            }
            if tau_bits <= 0.0 {
                continue;
            }
            // The strands lie side by side: each has its share of what all of them hide.
            let passed = transmittance * exp2(-tau_bits);
            let each = (transmittance - passed) / tau_bits;
            for (own, at, cell) in met.into_iter().filter(|met| met.0 > 0.0) {
                let (k_d, k_s) = cell.k_codes();
                let k = [k_d as f32, k_s as f32];
                let weight = own * each;
                let seen = Seen { at, cell, k, moments: None, weight, tau_bits: own, depth };
                self.light_cell(&mut walked, seen, observer);
            }
            transmittance = passed;
            depth += tau_bits;
        }
        walked.result.transmittance = transmittance;
        walked.result.cells[0] = cells;
        walked.result
    }

    /// Adds the light of a cell that a ray sees.
    #[inline(always)]
    fn light_cell<O: Observer>(&self, walked: &mut Walked, seen: Seen, observer: &mut O) {
        let Walked { ray, level, lights, scatter, sky_left, result } = walked;
        let Seen { at, cell, k: [k_d, k_s], moments, weight, tau_bits, depth } = seen;
        let scene = self.scene;
        let matter = ray.matter(level);
        let ink = self.ink(ray.volume, k_s).filter(|_| matter.mist == 0.0);
        let k = [k_d, ink.map_or(k_s, |ink| ink.k_s)];
        let more = ink.map_or(Vec3::ZERO, |ink| (ink.color - Vec3::ONE) * weight);
        result.tint += more;
        let ambient = self.ambient_of(ray.volume, matter.mist > 0.0) * *sky_left;
        observer.ambient(ambient * (Vec3::splat(weight) + more));

        let v = cell.v_code();
        let inverse_q = 1.0 / ray.metric.squared(v).max(1e-30);
        let t_dot_e = v.dot(ray.e_v);
        let root = inverse_q.sqrt();
        let spread = moments.map(|moments| Spread::new(&ray.metric, moments, ray.e_v));
        for (i, (light, total)) in lights.iter().zip(&mut result.lit).enumerate() {
            let (visibility, light_depth) = self.visibility_of(ray, level, at, light, &mut result.cells[1]);
            let fibre = || {
                if matter.mist > 0.0 {
                    return [matter.mist, 0.0];
                }
                match &spread {
                    Some(spread) => spread.psi_parts(k, scene.p, light.l_v, light.l_dot_e),
                    None => psi_parts(k, scene.p, v.dot(light.l_v), t_dot_e, inverse_q),
                }
            };
            let grey = || {
                let [diffuse, specular] = fibre();
                diffuse + specular
            };
            if !self.in_colour() {
                let lit = weight * grey() * visibility;
                total.sum += lit;
                observer.light(visibility, light.intensity * (lit * (1.0 / 255.0)));
                continue;
            }
            let mut lit = match self.strand_of(ray.volume) {
                Some(strand) if matter.mist == 0.0 => {
                    let [t_dot_l, t_dot_e] = match &spread {
                        Some(spread) => strand.cosines(spread, light.l_v, ROOT_TO_TIP),
                        None => [v.dot(light.l_v) * root, t_dot_e * root],
                    };
                    strand.psi(k_d, k_s, t_dot_l, t_dot_e, light.l_dot_e) * (weight * visibility)
                }
                _ => match &ink {
                    Some(ink) => ink.lit(fibre()) * (weight * visibility * (1.0 / 255.0)),
                    None => Vec3::splat(weight * visibility * grey() * (1.0 / 255.0)),
                },
            };
            if let (Some(MultipleMedium { similarity, profile }), Some(scatter)) =
                (self.medium_of(ray.quad), &scatter)
            {
                let RayScatter { row, gain, peak } = &scatter[i];
                let diffuse = profile.at(row, self.layer_in(ray.volume, level, at.z));
                let more = multiple(similarity, peak, diffuse, depth, tau_bits, light_depth);
                lit += gain.truncate() * more + similarity.albedo * (gain.w * weight);
            }
            total.colour += lit;
            observer.light(visibility, light.intensity * lit);
        }
    }

    /// Returns the own layer of volume `volume` at the middle of layer `z` of a level.
    pub(super) fn layer_in(&self, volume: usize, level: &Level, z: i32) -> u32 {
        if level.is_whole {
            return z as u32;
        }
        (((z as f32 + 0.5) * level.depth_in_cells()) as u32).min(self.volumes[volume].size[2] - 1)
    }
}
