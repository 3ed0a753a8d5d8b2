//! §4 and §5: the walk of a ray through the cells of one level, and the light of each cell. Twins:
//! `walk_level` and `visit` of `shaders/engine/integrate.wgsl`, and `lit` and `lit_in_colour` of
//! `shaders/engine/integrate_light.wgsl`.

use glam::Vec3;

use super::light::{RayLight, RayScatter};
use super::{Integrator, Observer, SheetHit};
use crate::light::fibre::{Spread, psi_parts};
use crate::light::scatter::media::MultipleMedium;
use crate::light::scatter::multiple;
use crate::light::strand::ROOT_TO_TIP;
use crate::trace::Lookup;
use crate::trace::lookup::{CellSample, Level};
use crate::util::powers::{exp2, log2};
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

impl Integrator<'_> {
    /// Walks one level of the volume to the end of the slab or of the ray. T before the sheet is `before`.
    pub(super) fn walk<O: Observer>(
        &self,
        ray: &SheetHit,
        level: &Level,
        before: f32,
        observer: &mut O,
    ) -> LevelResult {
        let scene = self.scene;
        let lights: Vec<RayLight> = self.ray_lights(ray, level).collect();
        let scatter = self.ray_scatter(ray);
        let mut lit_by = vec![Lit::default(); lights.len()];
        let matter = ray.matter(level);
        let medium = self.medium_of(ray.quad);
        let extinction = self.extinction_in(ray.volume, level);
        let (origin, d_cell) = (ray.origin * level.scale, ray.d_cell * level.scale);
        let filtered = !level.is_whole || scene.trace.lookup == Lookup::Trilinear;
        let (mut transmittance, mut tint) = (before, Vec3::ZERO);
        let mut depth = -log2(before.max(1e-30));
        let mut walked = [0u32; 2];
        let mut walk = Walk::new(level.size, origin, d_cell, f32::INFINITY);
        let most = scene.trace.max_cells;
        while walked[0] < most && walk.cell().z < level.size.z && transmittance >= scene.trace.early_end {
            let cell = level.cell(walk.cell());
            let Some(crossing) = walk.next() else { break };
            walked[0] += 1;
            let CellSample { rho, k: [k_d, k_s], moments } = match scene.trace.lookup {
                Lookup::Trilinear => level.sample_trilinear(&crossing, origin, d_cell, matter, false),
                Lookup::Nearest => level.sample_cell(cell, matter),
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
            let ink = self.ink(ray.volume, k_s).filter(|_| matter.mist == 0.0);
            let k = [k_d, ink.map_or(k_s, |ink| ink.k_s)];
            let more = ink.map_or(Vec3::ZERO, |ink| (ink.color - Vec3::ONE) * weight);
            tint += more;
            observer.ambient(self.ambient_of(ray.volume, matter.mist > 0.0) * (Vec3::splat(weight) + more));

            let v = cell.v_code();
            let inverse_q = 1.0 / ray.metric.squared(v).max(1e-30);
            let t_dot_e = v.dot(ray.e_v);
            let root = inverse_q.sqrt();
            let spread = filtered.then(|| {
                let moments = moments.unwrap_or_else(|| level.moments(cell));
                Spread::new(&ray.metric, moments, ray.e_v)
            });
            for (i, (light, total)) in lights.iter().zip(&mut lit_by).enumerate() {
                let (visibility, light_depth) =
                    self.visibility_of(ray, level, crossing.cell, light, &mut walked[1]);
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
                if let (Some(MultipleMedium { similarity, profile }), Some(scatter)) = (medium, &scatter) {
                    let RayScatter { row, gain, peak } = &scatter[i];
                    let diffuse = profile.at(row, self.layer_in(ray.volume, level, crossing.cell.z));
                    let more = multiple(similarity, peak, diffuse, depth, tau_bits, light_depth);
                    lit += gain.truncate() * more + similarity.albedo * (gain.w * weight);
                }
                total.colour += lit;
                observer.light(visibility, light.intensity * lit);
            }
            transmittance = passed;
            depth += tau_bits;
        }
        LevelResult { transmittance, lit: lit_by, tint, cells: walked }
    }

    /// Returns the own layer of volume `volume` at the middle of layer `z` of a level.
    pub(super) fn layer_in(&self, volume: usize, level: &Level, z: i32) -> u32 {
        if level.is_whole {
            return z as u32;
        }
        (((z as f32 + 0.5) * level.depth_in_cells()) as u32).min(self.volumes[volume].size[2] - 1)
    }
}
