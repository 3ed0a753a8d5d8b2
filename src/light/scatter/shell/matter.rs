//! Matter of a shell from its volume: means of the layers of cells.

use glam::Vec3;

use super::{Below, ShellMatter};
use crate::light::ramp::Ramp;
use crate::light::scatter::layer_means;
use crate::light::scatter::optics::ShellOptics;
use crate::volume::VolumeTexture;

/// Mean colour of each layer's cells, weighted by ρ, from z = 0 on. Layers without matter are white.
pub fn layer_colors(volume: &VolumeTexture, ramp: &Ramp) -> Vec<Vec3> {
    let nz = volume.size[2] as usize;
    if ramp.count == 0.0 {
        return vec![ramp.first; nz];
    }
    let colors: Vec<_> = (0..256).map(|code| ramp.ink(code as f32).color.as_dvec3()).collect();
    let mean = |codes: [u64; 256]| {
        let all: u64 = codes.iter().sum();
        let sum: glam::DVec3 = codes.iter().zip(&colors).map(|(code, color)| *color * *code as f64).sum();
        if all == 0 { Vec3::ONE } else { (sum / all as f64).as_vec3() }
    };
    volume.layer_codes_by_k_s().into_iter().map(mean).collect()
}

impl ShellMatter {
    /// Matter of a volume in which a cell of ρ = 1 has the extinction `sigma`, 1/m, before α.
    pub fn new(
        volume: &VolumeTexture,
        ramp: &Ramp,
        sigma: f32,
        optics: &ShellOptics,
        below: Below,
    ) -> ShellMatter {
        let full = optics.extinction * (sigma * volume.alpha);
        let extinction = layer_means(volume).into_iter().map(|rho| full * rho as f32).collect();
        let albedo = |color: Vec3| (optics.albedo * color).clamp(Vec3::ZERO, Vec3::ONE);
        let eta = optics.surface.map_or(1.0, |surface| surface.eta.max(1.0));
        let albedo = layer_colors(volume, ramp).into_iter().map(albedo).collect();
        ShellMatter { extinction, albedo, eta, below }
    }
}
