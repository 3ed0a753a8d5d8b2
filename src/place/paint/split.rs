//! Paintings of meshes whose triangles were split.

use glam::{DVec3, Vec2, Vec3};

use super::{Painting, Stretch};
use crate::place::Vertex;

impl Painting {
    /// Returns the painting of the same mesh after its triangles were split. `pieces` are the numbers of
    /// parts of each triangle; the vertices of the parts of one triangle follow one another in `after`.
    ///
    /// # Panics
    /// If the numbers do not fit the vertices.
    pub fn split(&self, before: &[Vertex], after: &[Vertex], pieces: &[u32]) -> Painting {
        let (triangles, _) = before.as_chunks::<3>();
        let mut parts = after.as_chunks::<3>().0.iter();
        let (mut stretches, mut coordinates) = (Vec::new(), Vec::new());
        for (range, first, finish) in self.parts() {
            let slots = finish.map_or(0, |finish| self.finishes[finish].slots as usize);
            let count: u32 = pieces[range.clone()].iter().sum();
            stretches.push(Stretch { triangles: count, finish });
            for (number, triangle) in range.enumerate() {
                let own = &self.coordinates[first + 3 * slots * number..][..3 * slots];
                for part in parts.by_ref().take(pieces[triangle] as usize) {
                    for vertex in part {
                        let shares = shares(&triangles[triangle], vertex);
                        let at = |slot: usize, k: usize| Vec2::from(own[slots * k + slot]) * shares[k];
                        let uv = |slot: usize| at(slot, 0) + at(slot, 1) + at(slot, 2);
                        coordinates.extend((0..slots).map(|slot| uv(slot).to_array()));
                    }
                }
            }
        }
        assert!(parts.next().is_none(), "each part belongs to a triangle");
        Painting { stretches, coordinates, ..self.clone() }
    }
}

/// Shares of a triangle's corners in a point of it.
fn shares(corners: &[Vertex; 3], point: &Vertex) -> Vec3 {
    let at = |vertex: &Vertex| Vec3::from(vertex.position).as_dvec3();
    let [a, b, c] = corners.each_ref().map(at);
    let (e1, e2, d) = (b - a, c - a, at(point) - a);
    let normal = e1.cross(e2);
    let n2 = normal.length_squared();
    if n2 == 0.0 {
        return Vec3::X;
    }
    let of = |axis: DVec3| (d.dot(axis) / n2) as f32;
    let (second, third) = (of(e2.cross(normal)), of(normal.cross(e1)));
    Vec3::new(1.0 - second - third, second, third)
}
