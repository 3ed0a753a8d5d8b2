//! §5 V_i(k) in shells: walked from every cell, or kept at the vertices of the mesh and interpolated. It is
//! multiplied by the share of light that opaque matter lets through.

use std::sync::Arc;

use fearless_simd::dispatch;
use glam::Vec3;
use rayon::prelude::*;

use super::lockstep::Fill;
use super::shell::Place;
use super::{Integrator, Lanes};
use crate::engine::cpu::visibility::ShellInputs;
use crate::light::Visibility;
use crate::light::scatter::optics::Arriving;
use crate::mapping::shell::Shell;
use crate::trace::lookup::Level;
use crate::util::powers::exp2;

/// Depth in bits behind which rays to the light go no further: V is less than 1e-7 there. Twin: `ENOUGH_BITS`
/// of `shaders/light/shell_depth.wgsl`.
pub const ENOUGH_BITS: f32 = 24.0;

/// Values of V that a thread fills at a time.
const AT_ONCE: usize = 1 << 12;

/// V at the vertices of shells: for each shell and light, at every vertex, from the outer to the inner
/// surface. Empty for a shell that keeps none.
#[derive(Debug)]
pub struct ShellLight(Vec<Vec<Vec<f32>>>);

/// Whether V is kept at the vertices of a shell, for a volume of `size` cells.
pub fn is_kept_in(shell: &Shell, size: [u32; 3]) -> bool {
    shell.light_layers(size).is_some()
}

/// Where V is kept around a place: below three vertices.
struct KeptPlace {
    /// Number of the value above the place.
    first: [usize; 3],
    /// Shares of the vertices, and of the value below the place.
    shares: Vec3,
    share: f32,
}

impl KeptPlace {
    /// Mean of values, which `of` finds by their numbers.
    #[inline]
    fn mean(&self, of: impl Fn(usize, usize) -> [f32; 2]) -> f32 {
        let seen = self.first.map(|at| {
            let [near, far] = of(at, at + 1);
            near + (far - near) * self.share
        });
        Vec3::from_array(seen).dot(self.shares).clamp(0.0, 1.0)
    }
}

impl Integrator<'_> {
    /// V of light number `i` at a place in a shell.
    pub(super) fn shell_visibility(&self, level: &Level, place: &Place, i: usize, walked: &mut u32) -> f32 {
        self.arriving(level, place, i, walked).visible()
    }

    /// Light of light number `i` that reaches a place in a shell.
    pub(super) fn arriving(&self, level: &Level, place: &Place, i: usize, walked: &mut u32) -> Arriving {
        let through = match self.scene.visibility {
            Visibility::None => 1.0,
            Visibility::Cached if self.kept_in[place.shell] => {
                self.kept_place(place).mean(|at, next| match &self.shell_light {
                    Some(kept) => {
                        let values = &kept.0[place.shell][i];
                        [values[at], values[next]]
                    }
                    None => [at, next].map(|k| self.visibility_below(place.shell, k, i)),
                })
            }
            Visibility::Cached | Visibility::March => self.walked_visibility(level, place, i, walked),
        };
        Arriving { through, open: self.past_opaque_matter(place, i) }
    }

    /// Share of light number `i` that opaque matter lets through to a place in a shell.
    #[inline]
    fn past_opaque_matter(&self, place: &Place, i: usize) -> f32 {
        let Some(shadows) = &self.shell_shadows else { return 1.0 };
        let vertices = self.scene.shells[place.shell].prisms[place.tetrahedron[0]].vertices;
        shadows.at(place.shell, i, vertices, place.shares, place.depth)
    }

    /// Light of all lights that reaches a place in a shell.
    #[inline]
    pub(super) fn all_arriving(
        &self,
        level: &Level,
        place: &Place,
        walked: &mut u32,
        mut arrives: impl FnMut(usize, Arriving),
    ) {
        match &self.shell_light {
            Some(kept) if self.kept_in[place.shell] => {
                let at = self.kept_place(place);
                for (i, values) in kept.0[place.shell].iter().enumerate() {
                    let through = at.mean(|at, next| [values[at], values[next]]);
                    arrives(i, Arriving { through, open: self.past_opaque_matter(place, i) });
                }
            }
            _ => (0..self.lights.len()).for_each(|i| arrives(i, self.arriving(level, place, i, walked))),
        }
    }

    /// J at a place in a shell, as far as it is known.
    #[inline]
    pub(super) fn diffuse_at(&self, place: &Place) -> Vec3 {
        let Some(own) = self.diffuse.as_ref().and_then(|of| of[place.shell].as_ref()) else {
            return Vec3::ZERO;
        };
        let KeptPlace { first, shares, share } = self.kept_place(place);
        let [a, b, c] = first.map(|at| {
            let [near, far] = [own.values[at], own.values[at + 1]];
            near + (far - near) * share
        });
        (a * shares.x + b * shares.y + c * shares.z).max(Vec3::ZERO)
    }

    /// Where V and J are kept around a place in a shell.
    #[inline]
    fn kept_place(&self, place: &Place) -> KeptPlace {
        let layers = self.layers(place.shell);
        let z = place.depth.clamp(0.0, 1.0) * layers as f32;
        let layer = (z as usize).min(layers - 1);
        let vertices = self.scene.shells[place.shell].prisms[place.tetrahedron[0]].vertices;
        KeptPlace {
            first: vertices.map(|vertex| vertex as usize * (layers + 1) + layer),
            shares: place.shares,
            share: z - layer as f32,
        }
    }

    fn walked_visibility(&self, level: &Level, place: &Place, i: usize, walked: &mut u32) -> f32 {
        let light = &self.lights[i];
        let to_light = (light.at(place.point).0, light.distance(place.point));
        let extinction = self.volume_of(&self.scene.shells[place.shell]).extinction;
        let enough = ENOUGH_BITS / extinction;
        exp2(-extinction * self.shell_depth(level, place, to_light, enough, walked))
    }

    /// Value number `k` of V of light number `i`: at one of the layers below a vertex.
    fn visibility_below(&self, shell: usize, k: usize, i: usize) -> f32 {
        let layers = self.layers(shell);
        let (vertex, layer) = (k / (layers + 1), k % (layers + 1));
        let depth = layer as f32 / layers as f32;
        let (point, tetrahedron) = self.scene.shells[shell].below_vertex(vertex, depth);
        let place = Place { shell, tetrahedron, shares: Vec3::ZERO, depth, point, time: 0.0 };
        let level = Level::new(&self.volume_of(&self.scene.shells[shell]).levels, 0);
        self.walked_visibility(&level, &place, i, &mut 0)
    }

    /// Number of layers between which V and J are interpolated in a shell: two cells each.
    fn layers(&self, shell: usize) -> usize {
        self.volume_of(&self.scene.shells[shell]).size[2].div_ceil(2) as usize
    }

    /// Inputs of V at the vertices of shells.
    pub(in crate::engine::cpu) fn shell_inputs(&self) -> ShellInputs {
        ShellInputs {
            levels: self.volumes.iter().map(|volume| volume.levels.clone()).collect(),
            shells: self.scene.shells.clone(),
            lights: self.lights.clone(),
            volumes: self.volumes.iter().map(|volume| [volume.flow_cells, volume.extinction]).collect(),
            max_cells: self.scene.trace.max_cells,
        }
    }

    /// V of every light at the vertices of all shells.
    pub(in crate::engine::cpu) fn shell_light(&self) -> ShellLight {
        let kept = |(number, shell): (usize, &Arc<Shell>)| {
            let layers = self.layers(number);
            let count = if self.kept_in[number] { shell.vertices() * (layers + 1) } else { 0 };
            let of = |i: usize| match (self.lanes, Fill::new(self, number, i, layers)) {
                (Lanes::Lockstep(simd), Some(fill)) => {
                    let part = |k: usize| {
                        let numbers = k * AT_ONCE..count.min((k + 1) * AT_ONCE);
                        dispatch!(simd, simd => fill.values(simd, numbers.clone()))
                    };
                    let parts: Vec<Vec<f32>> =
                        (0..count.div_ceil(AT_ONCE)).into_par_iter().map(part).collect();
                    parts.concat()
                }
                _ => (0..count).into_par_iter().map(|k| self.visibility_below(number, k, i)).collect(),
            };
            (0..self.lights.len()).map(of).collect()
        };
        ShellLight(self.scene.shells.iter().enumerate().map(kept).collect())
    }
}
