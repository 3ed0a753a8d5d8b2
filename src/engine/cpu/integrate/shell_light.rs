//! §5 V_i(k) in shells: walked from every cell, or kept at the vertices of the mesh and interpolated.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::Integrator;
use super::shell::Place;
use crate::engine::cpu::visibility::ShellInputs;
use crate::light::Visibility;
use crate::mapping::shell::Shell;
use crate::trace::lookup::Level;
use crate::util::powers::exp2;

/// V at the vertices of shells: for each shell and light, at every vertex, from the outer to the inner
/// surface. Empty for a shell that keeps none.
#[derive(Debug)]
pub struct ShellLight(Vec<Vec<Vec<f32>>>);

/// Whether V is kept at the vertices of a shell, for a volume of `size` cells.
pub fn is_kept_in(shell: &Shell, size: [u32; 3]) -> bool {
    shell.light_layers(size).is_some()
}

impl Integrator<'_> {
    /// V of light number `i` at a place in a shell.
    pub(super) fn shell_visibility(&self, level: &Level, place: &Place, i: usize, walked: &mut u32) -> f32 {
        match self.scene.visibility {
            Visibility::None => 1.0,
            Visibility::Cached if self.kept_in[place.shell] => {
                let vertices = self.scene.shells[place.shell].prisms[place.tetrahedron[0]].vertices;
                let z = place.depth.clamp(0.0, 1.0) * self.layers(place.shell) as f32;
                let seen = vertices.map(|vertex| self.vertex_visibility(place.shell, vertex as usize, z, i));
                Vec3::from_array(seen).dot(place.shares).clamp(0.0, 1.0)
            }
            Visibility::Cached | Visibility::March => self.walked_visibility(level, place, i, walked),
        }
    }

    fn walked_visibility(&self, level: &Level, place: &Place, i: usize, walked: &mut u32) -> f32 {
        let light = &self.lights[i];
        let to_light = (light.at(place.point).0, light.distance(place.point));
        let extinction = self.volume_of(&self.scene.shells[place.shell]).extinction;
        exp2(-extinction * self.shell_depth(level, place, to_light, walked))
    }

    /// V below a vertex at the depth of `z` layers, interpolated between the two around it.
    fn vertex_visibility(&self, shell: usize, vertex: usize, z: f32, i: usize) -> f32 {
        let layers = self.layers(shell);
        let layer = (z as usize).min(layers - 1);
        let at = |layer: usize| match &self.shell_light {
            Some(kept) => kept.0[shell][i][vertex * (layers + 1) + layer],
            None => self.visibility_below(shell, vertex, layer, i),
        };
        let (near, far) = (at(layer), at(layer + 1));
        near + (far - near) * (z - layer as f32)
    }

    /// V of light number `i` at one of the layers below a vertex.
    fn visibility_below(&self, shell: usize, vertex: usize, layer: usize, i: usize) -> f32 {
        let depth = layer as f32 / self.layers(shell) as f32;
        let (point, tetrahedron) = self.scene.shells[shell].below_vertex(vertex, depth);
        let place = Place { shell, tetrahedron, shares: Vec3::ZERO, depth, point };
        let level = Level::new(&self.volume_of(&self.scene.shells[shell]).levels, 0);
        self.walked_visibility(&level, &place, i, &mut 0)
    }

    /// Number of layers between which V is interpolated in a shell: two cells each.
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
            let of = |i: usize| {
                let at = |k: usize| self.visibility_below(number, k / (layers + 1), k % (layers + 1), i);
                (0..count).into_par_iter().map(at).collect()
            };
            (0..self.lights.len()).map(of).collect()
        };
        ShellLight(self.scene.shells.iter().enumerate().map(kept).collect())
    }
}
