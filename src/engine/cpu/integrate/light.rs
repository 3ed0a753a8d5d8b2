//! §5 Per-ray terms of the lights, and the visibility between a light and a cell. Twin:
//! `shaders/engine/integrate_light.wgsl`.

use glam::{IVec3, UVec2, Vec2, Vec3, Vec4};

use super::{Integrator, SheetHit};
use crate::light::optical_depth::{light_volume_value, optical_depth};
use crate::light::scatter::{ORDERS, Row, forward_peak};
use crate::light::visibility::{Form, LightVolumes, TRANSMITTANCE_OF_CODE};
use crate::light::{AngleFrame, Visibility};
use crate::trace::SheetDensity;
use crate::trace::lookup::Level;
use crate::util::powers::{exp2, log2};
use crate::walk::NEVER;

/// Terms of one light that are constant along a ray.
#[derive(Clone, Copy)]
pub struct RayLight {
    /// Jᵀl, or J⁻¹l normalised.
    pub l_v: Vec3,
    /// J⁻¹l, in the level's cells.
    pub l_cell: Vec3,
    pub corners: PatchCorners,
    pub intensity: Vec3,
    /// Cosine between light and eye, in the frame where angles are measured.
    pub l_dot_e: f32,
}

/// Terms of multiple scattering of one light that are constant along a ray.
#[derive(Clone, Copy)]
pub struct RayScatter {
    /// Row of the profile.
    pub row: Row,
    /// Gain and fill.
    pub gain: Vec4,
    /// Forward peaks of the orders.
    pub peak: [f32; ORDERS - 1],
}

/// The light volumes at the corners of a patch, and the ray's position in the patch.
#[derive(Clone, Copy, Default)]
pub struct PatchCorners {
    /// Numbers of the light volumes at (0, 0), (1, 0), (0, 1) and (1, 1) of the patch; all equal if it has
    /// one.
    pub numbers: [u32; 4],
    /// Position in the patch, 0 to 1.
    pub at: Vec2,
    /// Whether rays walk to the light instead, because it is too close.
    pub marched: bool,
}

impl Integrator<'_> {
    /// Computes the terms of all lights for a ray in a level of the volume.
    #[inline]
    pub(super) fn ray_lights(&self, ray: &SheetHit, level: &Level) -> impl Iterator<Item = RayLight> {
        let texture_frame = self.scene.angles == AngleFrame::Texture;
        let left = self.light_left(ray.quad, ray.uv);
        let terms = move |(i, light): (usize, &crate::light::Light)| {
            let (to_light, intensity) = light.at(ray.point);
            let intensity = intensity * left.of(i);
            let l = self.in_plane(ray, to_light);
            let l_cell = ray.frame.cell_from_plane(l);
            let l_v =
                if texture_frame { l_cell / l_cell.dot(l_cell).sqrt() } else { ray.frame.transposed(l) };
            let corners = match &self.light_volumes {
                Some(volumes) => patch_corners(volumes, ray.quad, i, ray.uv),
                None => PatchCorners::default(),
            };
            let l_dot_e = if texture_frame { l_v.dot(ray.e_v) } else { -to_light.dot(ray.d_world) };
            RayLight { l_v, l_cell: l_cell * level.scale, corners, intensity, l_dot_e }
        };
        self.lights.iter().enumerate().map(terms)
    }

    /// Computes the terms of multiple scattering of all lights for a ray.
    pub(super) fn ray_scatter(&self, ray: &SheetHit) -> Option<Vec<RayScatter>> {
        let medium = self.medium_of(ray.quad)?;
        // Cosines with the slab's normal; with per-cell attenuation in the sense of `Row::new`.
        let slab = |in_cells: Vec3, cosine: f32| {
            let c = in_cells.abs();
            if self.per_cell { -in_cells.z / (c.x + c.y + c.z) } else { cosine }
        };
        let e_n = slab(-ray.d_cell, -ray.side * ray.d_world.dot(ray.map.n_world));
        let terms = |light: &crate::light::Light| {
            let (to_light, _) = light.at(ray.point);
            let l = self.in_plane(ray, to_light);
            let layers = self.volumes[ray.volume].size[2];
            let row = Row::new(slab(ray.frame.cell_from_plane(l), l.z), layers);
            let gain = medium.profile.gain(&row, e_n);
            RayScatter { row, gain, peak: forward_peak(medium.similarity.g, to_light.dot(ray.d_world)) }
        };
        Some(self.lights.iter().map(terms).collect())
    }

    /// Direction to a light in the plane's axes e1, e2 and seen normal.
    #[inline]
    fn in_plane(&self, ray: &SheetHit, to_light: Vec3) -> Vec3 {
        let l_n = to_light.dot(ray.map.n_world) * ray.side;
        Vec3::new(to_light.dot(ray.map.e1_world), to_light.dot(ray.map.e2_world), l_n)
    }

    /// Returns V_i(k) of a light and a cell, and −log₂ of it, which is 0 if light volumes hold codes.
    pub(super) fn visibility_of(
        &self,
        ray: &SheetHit,
        level: &Level,
        cell: IVec3,
        light: &RayLight,
        walked: &mut u32,
    ) -> (f32, f32) {
        let matter = &ray.matter(level);
        let extinction = self.extinction_in(ray.volume, level);
        let depth = match self.visibility {
            Visibility::None => 0.0,
            _ if matter.mist > 0.0 => {
                matter.depth(cell.z, light.l_cell, level.size.z, self.per_cell) * extinction
            }
            Visibility::March => self.walked_depth(level, matter, cell, light, walked) * extinction,
            Visibility::Cached if light.corners.marched => {
                self.walked_depth(level, matter, cell, light, walked) * extinction
            }
            Visibility::Cached => {
                let value = self.patch_value(level, cell, &light.corners);
                if self.light_volumes.as_ref().is_some_and(|volumes| volumes.form == Form::Codes) {
                    let transmittance = value * value * TRANSMITTANCE_OF_CODE;
                    if matter.left < 1.0 {
                        return (exp2(matter.left * log2(transmittance.max(1e-9))), 0.0);
                    }
                    return (transmittance, 0.0);
                }
                // Light volumes are filled without the sheet's erosion; `left` is the mean share of ρ it
                // leaves.
                value * (extinction * matter.left * if self.per_cell { 1.0 } else { ray.frame.depth })
            }
        };
        (exp2(-depth), depth)
    }

    /// Optical depth from a cell to the light, in the units of [`optical_depth`]. Inlined at two places, the
    /// walk took 2.8 times as long.
    #[inline(never)]
    fn walked_depth(
        &self,
        level: &Level,
        matter: &SheetDensity,
        cell: IVec3,
        light: &RayLight,
        walked: &mut u32,
    ) -> f32 {
        optical_depth(level, matter, cell, light.l_cell, self.medium, NEVER, walked)
    }

    /// Interpolates a cell's value between the light volumes at the corners of the ray's patch.
    fn patch_value(&self, level: &Level, cell: IVec3, corners: &PatchCorners) -> f32 {
        let value = |number: u32| self.volume_value(level, number as usize, cell);
        let [p00, p10, p01, p11] = corners.numbers;
        if corners.numbers == [p00; 4] {
            return value(p00);
        }
        let mix = |a: f32, b: f32, x: f32| a * (1.0 - x) + b * x;
        let near = mix(value(p00), value(p10), corners.at.x);
        let far = mix(value(p01), value(p11), corners.at.x);
        mix(near, far, corners.at.y)
    }

    /// A cell's value in light volume `i`: looked up if it is filled, otherwise walked.
    fn volume_value(&self, level: &Level, i: usize, cell: IVec3) -> f32 {
        let plan = self.light_volumes.as_ref().expect("visibility is cached");
        let c = cell.as_uvec3();
        match &self.filled {
            Some(filled) => filled[i][level.number as usize].at(level.volume.index(c.x, c.y, c.z)),
            None => light_volume_value(level, cell, &plan.volumes[i], plan.medium, plan.form),
        }
    }
}

/// Returns the light volumes around the point `uv` of a quad.
pub(super) fn patch_corners(volumes: &LightVolumes, quad: usize, light: usize, uv: Vec2) -> PatchCorners {
    let patches = volumes.patches[quad * volumes.lights + light];
    let [nu, nv] = patches.count;
    let at = uv * Vec2::new(nu as f32, nv as f32);
    let patch = at.as_uvec2().min(UVec2::new(nu - 1, nv - 1));
    let number = |x: u32, y: u32, row: u32| volumes.numbers[(patches.first + y * row + x) as usize];
    if !patches.cornered {
        let numbers = [number(patch.x, patch.y, nu); 4];
        return PatchCorners { numbers, at: Vec2::ZERO, marched: false };
    }
    let [x, y] = patch.to_array();
    let numbers = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| number(x, y, nu + 1));
    let marched = volumes.marched[(patches.first + y * (nu + 1) + x) as usize];
    PatchCorners { numbers, at: at - patch.as_vec2(), marched }
}
