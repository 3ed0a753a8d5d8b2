//! Diffuse light in the shells of a scene, kept until something that it depends on changes.

use std::sync::Arc;

use glam::Vec3;

use super::{ShellShadows, Vertex, shell_core};
use crate::light::Light;
use crate::light::ramp::Ramp;
use crate::light::scatter::optics::ShellOptics;
use crate::light::scatter::shell::{Below, ShellDiffuse, ShellMatter, Surroundings};
use crate::mapping::shell::Shell;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::VolumeTexture;

/// All that the diffuse light in shells depends on.
#[derive(Clone)]
pub struct DiffuseKey {
    /// Shells.
    pub shells: Vec<Arc<Shell>>,
    /// Volumes that they show.
    pub volumes: Vec<VolumeTexture>,
    /// Colours of each volume's cells.
    pub ramps: Vec<Ramp>,
    /// Optics of each volume; `None` where light scatters once.
    pub optics: Vec<Option<ShellOptics>>,
    /// Extinction at ρ = 1 before α, 1/m.
    pub sigma: f32,
    /// Lights.
    pub lights: Vec<Light>,
    /// Radiance from everywhere.
    pub ambient: Vec3,
    /// Shadows of opaque matter.
    pub shadows: Option<Arc<ShellShadows>>,
    /// Opaque vertices, which have the colours below shells.
    pub vertices: Arc<Vec<Vertex>>,
}

/// Diffuse light in each shell; `None` in one whose matter scatters light once.
pub type DiffuseOfShells = Vec<Option<ShellDiffuse>>;

impl DiffuseKey {
    /// Whether both have the same diffuse light.
    pub(super) fn is_same(&self, other: &DiffuseKey) -> bool {
        let same_volume = |a: &VolumeTexture, b: &VolumeTexture| {
            (a.size, a.alpha) == (b.size, b.alpha) && a.cells.same(&b.cells)
        };
        let same_shadows = match (&self.shadows, &other.shadows) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        self.shells.len() == other.shells.len()
            && self.shells.iter().zip(&other.shells).all(|(a, b)| Shell::is_same(a, b))
            && self.volumes.len() == other.volumes.len()
            && self.volumes.iter().zip(&other.volumes).all(|(a, b)| same_volume(a, b))
            && (&self.ramps, &self.optics, self.sigma) == (&other.ramps, &other.optics, other.sigma)
            && (&self.lights, self.ambient) == (&other.lights, other.ambient)
            && same_shadows
            && Arc::ptr_eq(&self.vertices, &other.vertices)
    }

    /// Solves for the diffuse light.
    ///
    /// # Errors
    /// Errors of `monitor`, which may stop the work.
    pub(super) fn solve(&self, monitor: &dyn Monitor) -> Result<DiffuseOfShells> {
        self.shells.iter().enumerate().map(|(number, shell)| self.solve_in(number, shell, monitor)).collect()
    }

    fn solve_in(&self, number: usize, shell: &Shell, monitor: &dyn Monitor) -> Result<Option<ShellDiffuse>> {
        let volume = &self.volumes[shell.volume as usize];
        let Some(optics) = &self.optics[shell.volume as usize] else { return Ok(None) };
        let below = match (optics.surface, shell.skin) {
            (Some(_), _) => Below::Core,
            (None, true) => Below::Opaque { albedo: self.color_below(shell) },
            (None, false) => Below::Open,
        };
        let ramp = &self.ramps[shell.volume as usize];
        let matter = ShellMatter::new(volume, ramp, self.sigma, optics, below);
        let shares = self
            .shadows
            .as_ref()
            .map(|shadows| (0..self.lights.len()).map(|light| shadows.of(number, light)).collect());
        let opposite = if below == Below::Core { shell_core::opposite(shell) } else { Vec::new() };
        let surroundings =
            Surroundings { lights: &self.lights, shares, ambient: self.ambient, opposite: &opposite };
        let layers = volume.size[2].div_ceil(2) as usize;
        ShellDiffuse::new(shell, layers, &matter, &surroundings, monitor).map(Some)
    }

    /// Mean colour of the opaque vertices that lie on the inner surface of a shell.
    fn color_below(&self, shell: &Shell) -> Vec3 {
        let bits = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let inner: std::collections::HashSet<[u32; 3]> =
            shell.points.iter().skip(1).step_by(2).map(|p| bits(*p)).collect();
        let on_it = self.vertices.iter().filter(|v| v.pool == 0 && inner.contains(&bits(v.position.into())));
        let (sum, count) = on_it.fold((glam::DVec3::ZERO, 0.0), |(sum, count), v| {
            (sum + Vec3::from(v.albedo).as_dvec3(), count + 1.0)
        });
        if count > 0.0 { (sum / count).as_vec3().clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
    }
}
