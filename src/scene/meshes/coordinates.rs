//! Texture coordinates of faces: those of the file, or of a projection.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec2};

use super::Projection;
use super::build::{Cover, Key, Part, no_coordinates};
use crate::util::error::Result;

/// Texture coordinates of the faces of a part, in copies of the volume without the material's repeats.
pub(super) enum Coordinates<'a> {
    /// Those of the file.
    File(&'a [[f32; 2]]),
    /// Those of a projection.
    Projected(Box<Projected<'a>>),
}

/// A part that coordinates are projected on.
pub(super) struct Projected<'a> {
    part: Part<'a>,
    kind: Projection,
    /// Size of a copy, metres.
    size: f64,
    /// Middle of the mesh in its own space, and the number of copies around it.
    middle: DVec3,
    around: f64,
}

impl<'a> Coordinates<'a> {
    /// Returns those of a part, which has a cover.
    ///
    /// # Errors
    /// [`Error::Input`](crate::util::error::Error::Input) where it has none.
    pub fn of(key: &Key, cover: &Cover, part: Part<'a>) -> Result<Coordinates<'a>> {
        let (kind, size) = key.mesh.projection;
        if kind == Projection::None {
            let own = part.primitive.uvs.get(key.mesh.uv);
            return match own {
                Some(own) => Ok(Coordinates::File(own)),
                None => Err(no_coordinates(key, cover, part.primitive)),
            };
        }
        let [low, high] = key.mesh.loaded.bounds().unwrap_or_default().map(|p| p * key.mesh.scale);
        let half = (high - low) / 2.0;
        let around = (TAU * 0.5 * (half.x + half.z) / size).round().max(1.0);
        let middle = (low + high) / 2.0;
        Ok(Coordinates::Projected(Box::new(Projected { part, kind, size, middle, around })))
    }

    /// Whether vertices have the same coordinates in each of their faces.
    pub fn are_shared(&self) -> bool {
        match self {
            Coordinates::File(_) => true,
            Coordinates::Projected(projected) => projected.kind == Projection::Planar,
        }
    }

    /// Coordinates of a face's corners.
    pub fn at<const N: usize>(&self, corners: [u32; N]) -> [DVec2; N] {
        let Projected { part, kind, size, middle, around } = match self {
            Coordinates::File(own) => return corners.map(|i| Vec2::from(own[i as usize]).as_dvec2()),
            Coordinates::Projected(projected) => &**projected,
        };
        let (size, around) = (*size, *around);
        let at = corners.map(|i| part.own.transform_point3(part.vertex(i)));
        match kind {
            Projection::None | Projection::Planar => at.map(|p| DVec2::new(p.x, -p.y) / size),
            Projection::Box => {
                let normal = (at[1] - at[0]).cross(at[2] - at[0]) * if part.flipped { -1.0 } else { 1.0 };
                let most = normal.abs();
                // Seen from outside, u runs to the right and v down.
                let flat = |p: DVec3| match () {
                    _ if most.z >= most.x && most.z >= most.y => DVec2::new(p.x * normal.z.signum(), -p.y),
                    _ if most.x >= most.y => DVec2::new(-p.z * normal.x.signum(), -p.y),
                    _ => DVec2::new(p.x, p.z * normal.y.signum()),
                };
                at.map(|p| flat(p) / size)
            }
            Projection::Cylinder => {
                let turn = |p: DVec3| (p.x - middle.x).atan2(p.z - middle.z) / TAU;
                let first = turn(at[0]);
                at.map(|p| {
                    let turn = turn(p);
                    // A face that crosses the seam goes on beyond it.
                    let turn = turn - (turn - first).round();
                    DVec2::new(turn * around, -p.y / size)
                })
            }
        }
    }
}
