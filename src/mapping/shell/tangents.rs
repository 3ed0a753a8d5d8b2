//! Tangents of the texture at the vertices of a shell, between which light's frame is interpolated.
//!
//! The texture's axes have one direction in each triangle, so light computed with them would show the facets
//! of the mesh. Their means at the vertices go on from triangle to triangle: the error falls with the square
//! of the edges' length instead of with the length itself.

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::{Prism, is_an_area};

/// Tangents at a vertex: metres of the world per copy of the volume along u and v, on the outer and on the
/// inner surface, and the way from the outer to the inner surface. They are packed as the GPU reads them: one
/// after the other, and a zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tangents(pub [Vec4; 4]);

impl Tangents {
    fn new([outer_u, outer_v, inner_u, inner_v, down]: [Vec3; 5]) -> Self {
        let all = [outer_u, outer_v, inner_u, inner_v, down].map(|v| v.to_array());
        let all: &[f32] = all.as_flattened();
        Tangents(
            [0, 4, 8, 12].map(|i| Vec4::from_array([0, 1, 2, 3].map(|k| *all.get(i + k).unwrap_or(&0.0)))),
        )
    }

    /// Sum of several, each times its share.
    #[inline]
    pub fn mean(parts: [(&Tangents, f32); 3]) -> Self {
        let [(a, a_share), (b, b_share), (c, c_share)] = parts;
        let mut out = [Vec4::ZERO; 4];
        for (i, out) in out.iter_mut().enumerate() {
            *out = a.0[i] * a_share + b.0[i] * b_share + c.0[i] * c_share;
        }
        Tangents(out)
    }

    /// Jacobian at a depth from 0 to 1, as columns.
    #[inline]
    pub fn at(&self, depth: f32) -> [Vec3; 3] {
        let [p, q, r, down] = self.0;
        let outer = [p.truncate(), Vec3::new(p.w, q.x, q.y)];
        let inner = [Vec3::new(q.z, q.w, r.x), Vec3::new(r.y, r.z, r.w)];
        let along = |k: usize| outer[k] + (inner[k] - outer[k]) * depth;
        [along(0), along(1), down.truncate()]
    }
}

/// Cosine of the largest angle between tangents that are one direction on a smooth surface. A larger one is
/// an edge of the mesh, or a seam behind which the texture runs in another direction.
const SMOOTH: f64 = 0.5;

/// Corners of prisms at one vertex that share tangents.
struct Group {
    /// Axes of the first corner, which decides who belongs to the group.
    axes: [DVec3; 2],
    /// Sum of the tangents, weighted by the angles at the vertex: outer u, v and inner u, v.
    sum: [DVec3; 4],
    weight: f64,
    /// Number of the tangents.
    number: u32,
}

/// Averages the tangents of the prisms at each vertex, and tells every prism the numbers of those at its
/// corners. A prism without an area in the texture gets the number 0 and has none.
///
/// A corner joins the first group of its vertex to whose first corner it is smooth. A vertex has few groups,
/// since their directions differ, so a fan of any size takes time in proportion to it.
pub fn average(points: &[Vec3], prisms: &mut [Prism]) -> Vec<Tangents> {
    let mut groups: Vec<Vec<Group>> = (0..points.len() / 2).map(|_| Vec::new()).collect();
    let mut count = 0;
    for prism in prisms.iter_mut() {
        let Some(own) = of_prism(points, prism) else { continue };
        let axes = [own[0] + own[2], own[1] + own[3]].map(DVec3::normalize_or_zero);
        let middles = prism.vertices.map(|vertex| {
            let [outer, inner] = [0, 1].map(|k| points[2 * vertex as usize + k].as_dvec3());
            0.5 * (outer + inner)
        });
        for k in 0..3 {
            let [at, next, last] = [0, 1, 2].map(|i| middles[(k + i) % 3]);
            let angle = (next - at).angle_between(last - at);
            let weight = if angle > 0.0 { angle } else { 1e-9 };
            let known = &mut groups[prism.vertices[k] as usize];
            let is_near = |group: &Group| (0..2).all(|i| group.axes[i].dot(axes[i]) >= SMOOTH);
            let group = match known.iter().position(is_near) {
                Some(i) => &mut known[i],
                None => {
                    known.push(Group { axes, sum: [DVec3::ZERO; 4], weight: 0.0, number: count });
                    count += 1;
                    known.last_mut().expect("it was just added")
                }
            };
            (0..4).for_each(|i| group.sum[i] += own[i] * weight);
            group.weight += weight;
            prism.tangents[k] = group.number;
        }
    }
    let mut out = vec![Tangents::default(); count as usize];
    for (vertex, groups) in groups.iter().enumerate() {
        let down = points[2 * vertex + 1] - points[2 * vertex];
        for Group { sum, weight, number, .. } in groups {
            let [outer_u, outer_v, inner_u, inner_v] = sum.map(|sum| (sum / *weight).as_vec3());
            out[*number as usize] = Tangents::new([outer_u, outer_v, inner_u, inner_v, down]);
        }
    }
    out
}

/// Tangents of a prism on its outer and its inner triangle. `None` where it has no area in the texture.
fn of_prism(points: &[Vec3], prism: &Prism) -> Option<[DVec3; 4]> {
    let [a, b, c] = prism.uv;
    if !is_an_area(b - a, c - a) {
        return None;
    }
    let [a, b]: [DVec2; 2] = [b - a, c - a].map(|edge| edge.as_dvec2());
    let of = |k: usize| {
        let [p, q, r] = prism.vertices.map(|vertex| points[2 * vertex as usize + k].as_dvec3());
        let (e1, e2) = (q - p, r - p);
        [(e1 * b.y - e2 * a.y) / a.perp_dot(b), (e2 * a.x - e1 * b.x) / a.perp_dot(b)]
    };
    let [[outer_u, outer_v], [inner_u, inner_v]] = [0, 1].map(of);
    Some([outer_u, outer_v, inner_u, inner_v])
}
