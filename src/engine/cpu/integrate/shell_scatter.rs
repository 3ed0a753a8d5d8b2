//! §5 Light that scatters many times in shells: the light of a cell whose matter has optics. The lanes do the
//! same in `lockstep/shell_scatter.rs`, with the same bits; twin: `shell_scattered` of
//! `shaders/engine/shell_scatter.wgsl`.

use glam::{Mat3, Vec3};

use super::shell::{Fibres, Place};
use super::{Integrator, Observer};
use crate::light::ramp::Ink;
use crate::light::scatter::forward_peak;
use crate::light::scatter::optics::{CellNormal, CellOptics, Passage, ShellOptics, Surface};
use crate::mapping::shell::Shell;
use crate::trace::lookup::Level;
use crate::util::powers::{exp2, log2};
use crate::volume::Moments;

/// An occupied cell of a shell in which light scatters many times.
pub(super) struct ScatterCell<'c> {
    /// Place that stands for the cell, and that for its diffuse light.
    pub place: &'c Place,
    pub deep: &'c Place,
    /// Direction of the view ray.
    pub d: Vec3,
    /// J = world_from_cell.
    pub j: &'c Mat3,
    pub k: [f32; 2],
    pub ink: Option<Ink>,
    pub fibres: &'c Fibres,
    /// Second moments of the cell's directions, in cells.
    pub moments: Moments,
    /// Share of the cell in what the eye sees.
    pub weight: f32,
    pub passage: Passage,
}

/// Optical depth in bits between two places of a ray, by T at both.
#[inline]
pub(super) fn depth_between(start: f32, transmittance: f32) -> f32 {
    -log2((transmittance / start.max(1e-30)).max(1e-30))
}

/// Outward unit normal of a shell where its Jacobian is `j`.
#[inline]
fn normal_of(j: &Mat3) -> Vec3 {
    j.z_axis * -(1.0 / j.z_axis.length_squared().max(1e-30).sqrt())
}

/// Colour of a cell.
#[inline]
pub(super) fn color_of(ink: Option<Ink>) -> Vec3 {
    ink.map_or(Vec3::ONE, |ink| ink.color)
}

impl Integrator<'_> {
    /// Optics of the matter of a shell, if light scatters many times in it.
    #[inline]
    pub(super) fn optics_of(&self, shell: &Shell) -> Option<&ShellOptics> {
        self.optics[shell.volume as usize].as_ref()
    }

    /// Light that a cell sends to the eye.
    pub(super) fn scattered<O: Observer>(
        &self,
        optics: &ShellOptics,
        level: &Level,
        cell: &ScatterCell,
        walked: &mut u32,
        observer: &mut O,
    ) -> Vec3 {
        let own = optics.of_cell(color_of(cell.ink));
        match &optics.surface {
            Some(surface) => self.of_skin((&own, surface), level, cell, walked, observer),
            None => self.of_fibres((&own, optics.g), level, cell, walked, observer),
        }
    }

    /// Light of a cell of fibres.
    fn of_fibres<O: Observer>(
        &self,
        (own, g): (&CellOptics, f32),
        level: &Level,
        cell: &ScatterCell,
        walked: &mut u32,
        observer: &mut O,
    ) -> Vec3 {
        let reduced = cell.passage.weight(own.extinction);
        let mut sum = reduced * (own.albedo * self.diffuse_at(cell.deep));
        observer.ambient(sum);
        for i in 0..self.lights.len() {
            let light = self.arriving(level, cell.place, i, walked);
            let visible = light.visible();
            let weight = cell.weight * visible;
            let (to_light, intensity) = self.lights[i].at(cell.place.point);
            let once = self.shell_light_of(cell.fibres, (cell.k, cell.ink), cell.j, (cell.place, cell.d), i);
            let more = own.more(reduced, weight, &forward_peak(g, to_light.dot(cell.d)), &light);
            let radiance = once * weight + intensity * more;
            observer.light(visible, radiance);
            sum += radiance;
        }
        sum
    }

    /// Light of a cell of skin.
    fn of_skin<O: Observer>(
        &self,
        (own, surface): (&CellOptics, &Surface),
        level: &Level,
        cell: &ScatterCell,
        walked: &mut u32,
        observer: &mut O,
    ) -> Vec3 {
        let n = normal_of(cell.j);
        let e = -cell.d;
        let [leaves, stretch] = surface.leaving(n.dot(e).abs());
        let reduced = cell.passage.weight(own.extinction * stretch) * leaves;
        let on_surface = cell.passage.surface_weight();
        let normal = CellNormal::new(&cell.moments, cell.j);
        let alpha2 = surface.roughness * surface.roughness + normal.variance;
        // Even light that the surface does not let in comes back from it.
        let thrown_back = (1.0 - leaves * (surface.eta * surface.eta)) * on_surface;
        let mut sum = reduced * (own.albedo * self.diffuse_at(cell.deep)) + self.scene.ambient * thrown_back;
        observer.ambient(sum);
        for i in 0..self.lights.len() {
            let light = self.arriving(level, cell.place, i, walked);
            let (l, intensity) = self.lights[i].at(cell.place.point);
            let mu = n.dot(l);
            let (mut once, mut lobe) = (Vec3::ZERO, 0.0);
            if mu > 0.0 {
                let [enters, stretch] = surface.entering(mu);
                let seen = light.reduced(own.extinction * stretch, light.depth());
                once = reduced * (own.reduced * seen) * enters;
                lobe = surface.lobe(normal.m, l, e, alpha2) * (on_surface * light.open);
            }
            let radiance = intensity * (once + Vec3::splat(lobe));
            observer.light(light.visible(), radiance);
            sum += radiance;
        }
        sum
    }

    /// Diffuse light from behind the place where a ray has ended because too little is left of T, from its
    /// `start` at the shell to `transmittance`. In a medium with less extinction more is left. It is as
    /// bright as the last cell, of the colour `color`, whose places are those of its frame and of its J.
    pub(super) fn beyond_end(
        &self,
        [place, deep]: &[Place; 2],
        color: Vec3,
        d: Vec3,
        [start, transmittance]: [f32; 2],
    ) -> Vec3 {
        let shell = &self.scene.shells[place.shell];
        let Some(optics) = self.optics_of(shell) else { return Vec3::ZERO };
        let own = optics.of_cell(color);
        let n = normal_of(&self.frame(shell, place));
        let [leaves, stretch] = match &optics.surface {
            Some(surface) => surface.leaving(n.dot(-d).abs()),
            None => [1.0; 2],
        };
        let depth = depth_between(start, transmittance);
        let left = (own.extinction * (stretch * -depth)).map(exp2) * (start * leaves);
        left * (own.albedo * self.diffuse_at(deep))
    }
}
