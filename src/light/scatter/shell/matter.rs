//! Matter of a shell from its volume: means of the layers of cells.

use glam::{DVec3, Vec3};

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
        let sum: DVec3 = codes.iter().zip(&colors).map(|(code, color)| *color * *code as f64).sum();
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
    /// The same matter in at most `most` layers.
    pub(super) fn with_at_most(&self, most: usize) -> ShellMatter {
        let count = self.extinction.len();
        if count <= most {
            return self.clone();
        }
        let mut sums = vec![[DVec3::ZERO; 3]; most];
        for (k, (extinction, albedo)) in self.extinction.iter().zip(&self.albedo).enumerate() {
            // Layer k covers k·most … (k + 1)·most of parts that are `count` long.
            let [start, end] = [k * most, (k + 1) * most];
            for part in start / count..=(end - 1) / count {
                let share = (end.min((part + 1) * count) - start.max(part * count)) as f64 / count as f64;
                let [extinction, albedo] = [extinction, albedo].map(|value| value.as_dvec3());
                let sum = &mut sums[part];
                *sum = [
                    sum[0] + extinction * share,
                    sum[1] + extinction * albedo * share,
                    sum[2] + albedo * share,
                ];
            }
        }
        let albedo = |[extinction, scattering, albedo]: &[DVec3; 3]| {
            let of = |c: usize| if extinction[c] > 0.0 { scattering[c] / extinction[c] } else { albedo[c] };
            DVec3::new(of(0), of(1), of(2)).as_vec3().clamp(Vec3::ZERO, Vec3::ONE)
        };
        ShellMatter {
            extinction: sums.iter().map(|sum| sum[0].as_vec3()).collect(),
            albedo: sums.iter().map(albedo).collect(),
            ..*self
        }
    }
}
