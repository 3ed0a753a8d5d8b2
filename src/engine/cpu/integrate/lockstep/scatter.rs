//! Multiple scattering in eight cells. Twin of `src/light/scatter/mod.rs`, with the same operations in the
//! same order.

use std::f32::consts::LN_2;

use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::group::Group;
use crate::light::scatter::{ORDERS, Profile, Row};
use crate::util::lane_powers::exp2;
use crate::util::lanes::{Floats, LANES, Lanes3, Stored, Stored3};

/// Multiple scattering of eight rays.
pub struct LaneScatter<'a> {
    profiles: [&'a Profile; LANES],
    /// Constants of each ray's medium; see [`crate::light::scatter::Similarity`].
    extinction: Stored3,
    albedo: Stored3,
    reduced: Stored3,
    isotropic: Stored3,
    lights: Vec<LightScatter>,
}

/// Terms of one light.
#[derive(Clone, Default)]
struct LightScatter {
    /// First values in the two rows of each ray's profile.
    near: [u32; LANES],
    far: [u32; LANES],
    /// Share of the second row.
    share: Stored,
    gain: Stored3,
    fill: Stored,
    peak: [Stored; ORDERS - 1],
}

/// Depths that light has passed before and in eight cells, in bits.
#[derive(Clone, Copy)]
pub struct Depths<S: Simd> {
    /// From the face to the cell.
    pub view: Floats<S>,
    /// In the cell.
    pub cell: Floats<S>,
    /// From the cell to the light.
    pub light: Floats<S>,
}

impl<'a> LaneScatter<'a> {
    /// Terms of a group's rays, if the scene asks for multiple scattering.
    pub fn of(group: &Group<'a, '_>) -> Option<Self> {
        let integrator = group.integrator;
        let values = &group.hits.values;
        let mut scatter = LaneScatter {
            profiles: [&integrator.medium_of(group.hits.quads[0])?.profile; LANES],
            extinction: Stored3::default(),
            albedo: Stored3::default(),
            reduced: Stored3::default(),
            isotropic: Stored3::default(),
            lights: vec![LightScatter::default(); integrator.lights.len()],
        };
        for lane in 0..LANES {
            let quad = group.hits.quads[lane];
            let medium = integrator.medium_of(quad)?;
            scatter.profiles[lane] = &medium.profile;
            scatter.extinction.set(lane, medium.similarity.extinction);
            scatter.albedo.set(lane, medium.similarity.albedo);
            scatter.reduced.set(lane, medium.similarity.reduced);
            scatter.isotropic.set(lane, medium.similarity.isotropic);
            let at = values.at.get(lane).to_array();
            let terms =
                integrator.ray_scatter(&integrator.sheet_hit(quad, values.d_world.get(lane), at, 0.0))?;
            for (light, terms) in scatter.lights.iter_mut().zip(&terms) {
                let Row { near, far, share, .. } = terms.row;
                (light.near[lane], light.far[lane], light.share.0[lane]) = (near, far, share);
                light.gain.set(lane, terms.gain.truncate());
                light.fill.0[lane] = terms.gain.w;
                for (stored, &peak) in light.peak.iter_mut().zip(&terms.peak) {
                    stored.0[lane] = peak;
                }
            }
        }
        Some(scatter)
    }

    /// Light of light number `i`, scattered more than once, that cells in `layers` of the volume send to the
    /// eye. `weight` is the share of the cells in what the eye sees.
    #[inline(always)]
    pub fn more<S: Simd>(
        &self,
        simd: S,
        i: usize,
        layers: &[u32; LANES],
        depths: &Depths<S>,
        weight: Floats<S>,
    ) -> Lanes3<S> {
        let light = &self.lights[i];
        let (mut near, mut far) = (Stored3::default(), Stored3::default());
        for (lane, layer) in layers.iter().enumerate() {
            let values = &self.profiles[lane].values;
            // The layer of an idle lane may be any number.
            let value = |first: u32| values.get(first.wrapping_add(*layer) as usize);
            if let (Some(n), Some(f)) = (value(light.near[lane]), value(light.far[lane])) {
                (near.0[0].0[lane], near.0[1].0[lane], near.0[2].0[lane]) = (n[0], n[1], n[2]);
                (far.0[0].0[lane], far.0[1].0[lane], far.0[2].0[lane]) = (f[0], f[1], f[2]);
            }
        }
        let share = light.share.load(simd);
        let mut peak = [share; ORDERS - 1];
        for (peak, stored) in peak.iter_mut().zip(&light.peak) {
            *peak = stored.load(simd);
        }
        let Depths { view, cell, light: to_light } = *depths;
        let one = f32x8::splat(simd, 1.0);
        let once = exp2(simd, -(view + to_light)) * (one - exp2(simd, -cell));
        let length = to_light * LN_2;
        let fill = light.fill.load(simd) * weight;
        let mut out = [share; 3];
        for (c, out) in out.iter_mut().enumerate() {
            let near = near.0[c].load(simd);
            let diffuse = near + (far.0[c].load(simd) - near) * share;
            let (extinction, albedo) = (self.extinction.0[c].load(simd), self.albedo.0[c].load(simd));
            let passed = exp2(simd, extinction * -view);
            let weight_reduced = passed - exp2(simd, extinction * -(view + cell));
            let seen_reduced = exp2(simd, extinction * -to_light);
            let s = albedo * length;
            let mut forward = peak[4] * 0.2;
            forward = (forward * s + peak[3]) * 0.25;
            forward = (forward * s + peak[2]) * (1.0 / 3.0);
            forward = (forward * s + peak[1]) * 0.5;
            forward = (forward * s + peak[0]) * s;
            let sum = weight_reduced * (diffuse + self.reduced.0[c].load(simd) * seen_reduced)
                + (albedo * forward - self.isotropic.0[c].load(simd)) * once;
            let more = sum.max(f32x8::splat(simd, 0.0));
            *out = light.gain.0[c].load(simd) * more + albedo * fill;
        }
        Lanes3 { x: out[0], y: out[1], z: out[2] }
    }
}
