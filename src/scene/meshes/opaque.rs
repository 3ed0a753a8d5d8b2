//! Opaque parts of a mesh, as triangles with the file's colours.

use std::collections::HashMap;
use std::sync::{Arc, LazyLock};

use glam::{DMat3, DVec3, IVec2, Vec2, Vec3};
use image::RgbImage;
use rayon::prelude::*;

use super::build::{Key, Part};
use crate::model::{ModelMaterial, Primitive, TextureRef, Wrap};
use crate::place::{MeshShade, Triangles, Vertex};
use crate::util::error::Result;

/// Triangles that one thread makes at a time.
const AT_ONCE: usize = 4096;

/// Returns the triangles of all opaque parts. Images are decoded within `memory` bytes.
pub(super) fn triangles(key: &Key, memory: u64) -> Result<Option<Triangles>> {
    let mut albedos: HashMap<*const Primitive, Vec<Vec3>> = HashMap::new();
    let mut vertices: Vec<Vertex> = Vec::new();
    for part in key.parts().filter(|part| key.is_opaque(part)) {
        let albedos = match albedos.entry(part.primitive) {
            std::collections::hash_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::hash_map::Entry::Vacant(new) => {
                new.insert(albedo(key, part.primitive, memory)?)
            }
        };
        let normal_matrix = part.local.matrix3.inverse().transpose();
        let all = &part.primitive.triangles;
        let made = all.par_chunks(AT_ONCE).flat_map_iter(|triangles| {
            triangles.iter().flat_map(|&corners| triangle(&part, corners, &normal_matrix, albedos))
        });
        vertices.par_extend(made);
    }
    let holdout = key.mesh.holdout;
    let shade = MeshShade::default();
    Ok((!vertices.is_empty()).then(|| Triangles { vertices: Arc::new(vertices), holdout, shade }))
}

/// Returns the vertices of a triangle.
fn triangle(part: &Part, mut corners: [u32; 3], normals: &DMat3, albedos: &[Vec3]) -> [Vertex; 3] {
    if part.flipped {
        corners.swap(1, 2);
    }
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

/// Returns the albedo at the vertices of a primitive.
fn albedo(key: &Key, primitive: &Primitive, memory: u64) -> Result<Vec<Vec3>> {
    let count = primitive.positions.len();
    if let Some(color) = key.mesh.color {
        return Ok(vec![color; count]);
    }
    let plain = ModelMaterial::default();
    let loaded = &key.mesh.loaded;
    let material = primitive.material.map_or(&plain, |i| &loaded.model.materials[i]);
    let [r, g, b, _] = material.base_color;
    let mut albedos = vec![Vec3::new(r, g, b); count];
    let texture = material.base_color_texture.as_ref();
    if let Some(texture) = texture
        && let Some(uvs) = primitive.uvs.get(texture.set as usize)
    {
        let image = loaded.image(texture.image, memory)?;
        albedos.par_iter_mut().zip(uvs).for_each(|(albedo, uv)| *albedo *= texel(&image, texture, *uv));
    }
    if let Some(colors) = &primitive.colors {
        albedos.iter_mut().zip(colors).for_each(|(albedo, c)| *albedo *= Vec3::new(c[0], c[1], c[2]));
    }
    albedos.iter_mut().for_each(|albedo| *albedo = albedo.clamp(Vec3::ZERO, Vec3::ONE));
    Ok(albedos)
}

/// Linear colour of a texture at coordinates of the file.
pub(super) fn texel(image: &RgbImage, texture: &TextureRef, uv: [f32; 2]) -> Vec3 {
    let uv = Vec2::from(texture.transform.apply(uv));
    let size = IVec2::new(image.width() as i32, image.height() as i32);
    // Beyond this a float32 has no fraction left, and its texel no meaning.
    let at = (uv * size.as_vec2()).clamp(Vec2::splat(-1e9), Vec2::splat(1e9));
    let get = |x: i32, y: i32| {
        let [x, y] = [wrapped(x, size.x, texture.wrap[0]), wrapped(y, size.y, texture.wrap[1])];
        Vec3::from_array(image.get_pixel(x as u32, y as u32).0.map(|code| LINEAR[usize::from(code)]))
    };
    if texture.nearest {
        let at = at.floor().as_ivec2();
        return get(at.x, at.y);
    }
    let at = at - 0.5;
    let (cell, f) = (at.floor().as_ivec2(), at - at.floor());
    let row = |y: i32| get(cell.x, y).lerp(get(cell.x + 1, y), f.x);
    row(cell.y).lerp(row(cell.y + 1), f.y)
}

/// Index of a texel inside a row of `n`.
fn wrapped(i: i32, n: i32, wrap: Wrap) -> i32 {
    match wrap {
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            i.min(2 * n - 1 - i)
        }
    }
}

/// Linear values of the codes of sRGB.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let x = code as f64 / 255.0;
        let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        linear as f32
    })
});
