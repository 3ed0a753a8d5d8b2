//! Opaque parts of a mesh, as triangles with the file's colours and textures.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::build::{Key, Part};
use super::paint::Plan;
use crate::model::{ModelMaterial, Primitive};
use crate::place::{MeshShade, Triangles, Vertex};
use crate::util::error::Result;

/// Triangles that one thread makes at a time.
const AT_ONCE: usize = 4096;

/// Returns the triangles of all opaque parts. Textures are made within `memory` bytes.
pub(super) fn triangles(key: &Key, memory: u64) -> Result<Option<Triangles>> {
    let mut albedos: HashMap<*const Primitive, Vec<Vec3>> = HashMap::new();
    let mut vertices: Vec<Vertex> = Vec::new();
    for part in key.parts().filter(|part| key.is_opaque(part)) {
        let albedos = match albedos.entry(part.primitive) {
            std::collections::hash_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::hash_map::Entry::Vacant(new) => new.insert(albedo(key, part.primitive)),
        };
        let normal_matrix = part.local.matrix3.inverse().transpose();
        let all = &part.primitive.triangles;
        let made = all.par_chunks(AT_ONCE).flat_map_iter(|triangles| {
            triangles.iter().flat_map(|&corners| triangle(&part, corners, &normal_matrix, albedos))
        });
        vertices.par_extend(made);
    }
    if vertices.is_empty() {
        return Ok(None);
    }
    let painting = Plan::new(key).painting(key, memory)?;
    let holdout = key.mesh.holdout;
    let shade = MeshShade::default();
    Ok(Some(Triangles { vertices: Arc::new(vertices), holdout, shade, painting }))
}

/// Returns the vertices of a triangle.
fn triangle(part: &Part, corners: [u32; 3], normals: &DMat3, albedos: &[Vec3]) -> [Vertex; 3] {
    let corners = part.facing(corners);
    let positions = corners.map(|i| part.position(i));
    let [a, b, c] = positions.map(|p| p.as_dvec3());
    let face = (b - a).cross(c - a).normalize_or(DVec3::Y);
    [0, 1, 2].map(|k| {
        let i = corners[k] as usize;
        let normal = match &part.primitive.normals {
            Some(own) => (*normals * Vec3::from(own[i]).as_dvec3()).try_normalize().unwrap_or(face),
            None => face,
        };
        Vertex {
            position: positions[k].to_array(),
            normal: normal.as_vec3().to_array(),
            albedo: albedos[i].to_array(),
            ..Vertex::default()
        }
    })
}

/// Returns the albedo at the vertices of a primitive, by which its texture is multiplied.
fn albedo(key: &Key, primitive: &Primitive) -> Vec<Vec3> {
    let count = primitive.positions.len();
    if let Some(color) = key.mesh.color {
        return vec![color; count];
    }
    let plain = ModelMaterial::default();
    let loaded = &key.mesh.loaded;
    let material = primitive.material.map_or(&plain, |i| &loaded.model.materials[i]);
    let [r, g, b, _] = material.base_color;
    let mut albedos = vec![Vec3::new(r, g, b); count];
    if let Some(colors) = &primitive.colors {
        albedos.iter_mut().zip(colors).for_each(|(albedo, c)| *albedo *= Vec3::new(c[0], c[1], c[2]));
    }
    albedos.iter_mut().for_each(|albedo| *albedo = albedo.clamp(Vec3::ZERO, Vec3::ONE));
    albedos
}
