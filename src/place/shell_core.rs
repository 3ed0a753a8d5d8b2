//! Thickness of the body below a shell, at every vertex.

use rayon::prelude::*;

use super::bvh::{Bvh, Caster};
use crate::light::scatter::shell::Opposite;
use crate::mapping::shell::Shell;

/// Tangent of the angle by which a ray is turned that found nothing.
const TILT: f32 = 0.01;

/// The inner surface opposite each vertex: where the ray against the normal leaves the body again, less the
/// shell on both sides. Rays begin at the outer surface, because thin parts have no room for the inner ones.
pub fn opposite(shell: &Shell) -> Vec<Option<Opposite>> {
    let outer: Vec<_> =
        shell.hull.iter().filter(|face| !face.is_eye() && face.points.iter().all(|p| p % 2 == 0)).collect();
    let casters: Vec<Caster> =
        outer.iter().map(|face| Caster { corners: shell.corners(face), kinds: 1 }).collect();
    let body = Bvh::new(&casters);
    let margin = body.margin();
    let normals = shell.normals();
    let thickness = |vertex: usize| shell.points[2 * vertex].distance(shell.points[2 * vertex + 1]);
    let of = |(vertex, normal): (usize, &glam::Vec3)| {
        let from = shell.points[2 * vertex] - *normal * margin;
        let (a, b) = normal.any_orthonormal_pair();
        // A ray may slip through between two triangles.
        let ways =
            [*normal, *normal + a * TILT, *normal - (a + b) * TILT].map(|way| -way.normalize_or_zero());
        let hit = ways.into_iter().find_map(|way| body.first_way_out(from, way))?;
        let vertices = outer[hit.triangle].points.map(|point| point / 2);
        let there = vertices.map(|vertex| thickness(vertex as usize));
        let both = thickness(vertex) + hit.shares.dot(there.into());
        let distance = (hit.t + margin - both).max(0.0);
        Some(Opposite { vertices, shares: hit.shares, distance })
    };
    normals.par_iter().enumerate().map(of).collect()
}
