//! Faces of a mesh that carry the volume as quads do.

use glam::{DVec2, Vec3};

use super::Carrier;
use super::build::{Built, Cover, Key, Part, too_many_faces};
use super::coordinates::Coordinates;
use crate::mapping::{Material, Quad};
use crate::model::Face;
use crate::scene::read::MAX_QUADS;
use crate::util::error::{Error, Result};

/// Returns the quads of all parts that have a cover of faces.
pub(super) fn quads(key: &Key) -> Result<Built> {
    let mut built = Built::default();
    for cover in key.covers.iter().filter(|cover| cover.carrier == Carrier::Face) {
        let before = built.quads.len();
        let mut unmapped = 0;
        for part in key.covered(cover) {
            unmapped += add(key, cover, part, &mut built.quads)?;
        }
        if unmapped > 0 && built.quads.len() == before {
            return Err(unmapped_error(key, cover));
        }
        built.unmapped += unmapped;
    }
    Ok(built)
}

/// The error for parts whose texture coordinates span no area.
pub(super) fn unmapped_error(key: &Key, cover: &Cover) -> Error {
    Error::input(
        format!("{}: the texture coordinates span no area", key.words(cover)),
        format!(
            "unwrap the mesh in the program that made it, or set meshes.{}.projection to box",
            key.mesh.name
        ),
    )
}

/// Adds the quads of a part. Returns the number of faces that have no area in the texture.
fn add(key: &Key, cover: &Cover, part: Part, quads: &mut Vec<Quad>) -> Result<u64> {
    let coordinates = Coordinates::of(key, cover, part)?;
    let repeats = DVec2::new(cover.material.repeat_u.into(), cover.material.repeat_v.into());
    let mut unmapped = 0;
    for face in part.primitive.faces() {
        if quads.len() + 2 > MAX_QUADS {
            let faces = key.covered(cover).map(|part| part.primitive.triangles.len() as u128).sum();
            return Err(too_many_faces(&key.mesh.name, faces));
        }
        let triangle = |corners: [u32; 3]| {
            let uv = coordinates.at(corners).map(|uv| (uv * repeats).as_vec2());
            Quad::triangle(corners.map(|i| part.position(i)), uv, cover.material)
        };
        let made = match face {
            Face::Triangle(corners) => [Some(triangle(corners)), None],
            Face::Quad(corners) => {
                let uv = coordinates.at(corners);
                match whole(corners.map(|i| part.position(i)), uv, repeats, cover.material) {
                    Some(quad) => [Some(Ok(quad)), None],
                    None => {
                        let [a, b, c, d] = corners;
                        [[a, b, c], [a, c, d]].map(|corners| Some(triangle(corners)))
                    }
                }
            }
        };
        for quad in made.into_iter().flatten() {
            match quad {
                Ok(quad) => quads.push(Quad { mist: cover.mist, ..quad }),
                Err(_) => unmapped += 1,
            }
        }
    }
    Ok(unmapped)
}

/// Largest distance of a corner from the rectangle that the others make in the texture, as a share of its
/// sides.
const RECTANGLE: f64 = 1e-5;

/// Returns a quad whose texture coordinates are a rectangle along u and v. `None` for others, and for quads
/// that are not flat or not convex.
fn whole(corners: [Vec3; 4], uv: [DVec2; 4], repeats: DVec2, material: Material) -> Option<Quad> {
    let [low, high] = [DVec2::min, DVec2::max].map(|f| f(f(uv[0], uv[1]), f(uv[2], uv[3])));
    let size = high - low;
    let wanted = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
    let is_at = |i: usize, at: DVec2| (uv[i] - at).abs().cmple(size * RECTANGLE).all();
    let first = (0..4).find(|&i| is_at(i, wanted[0]))?;
    let order = [1, 3].into_iter().find_map(|step| {
        let order = [0, 1, 2, 3].map(|k| (first + step * k) % 4);
        (0..4).all(|k| is_at(order[k], wanted[k])).then_some(order)
    })?;
    let [copies, low] = [size, low].map(|uv| uv * repeats);
    if copies.min_element() <= 0.0 {
        return None;
    }
    let material = Material { repeat_u: copies.x as f32, repeat_v: copies.y as f32, ..material };
    let quad = Quad::new(order.map(|i| corners[i]), material).ok()?;
    // Whole copies are left out: they would cost digits.
    Some(Quad { offset: (low - low.floor()).as_vec2(), ..quad })
}
