//! Shells from meshes.

use std::collections::HashMap;

use glam::{DVec3, Mat3, Vec2, Vec3};

use crate::util::words::words;

use super::{AT_SIDES, Beyond, EDGES, HullFace, MAX_PRISMS, Prism, Shell, tangents};

/// The side of a mesh that a shell lies on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Along the normals: the mesh is the inner surface. For fur and grass.
    #[default]
    Outward,
    /// Against the normals: the mesh is the outer surface.
    Inward,
}

words! { Side { Outward => "outward", Inward => "inward" } }

/// A mesh that a shell is built on.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// Positions of the vertices, metres. Vertices at one position are one vertex of the surface.
    pub positions: Vec<Vec3>,
    /// Texture coordinates of the vertices, in copies of the volume.
    pub uv: Vec<Vec2>,
    /// Thickness of the shell at the vertices, metres.
    pub thickness: Vec<f32>,
    /// Triangles, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Reason why a mesh carries no shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShellFault {
    /// No triangle has an area.
    Empty,
    /// No triangle has an area in the texture.
    Unmapped,
    /// The mesh has more than [`MAX_PRISMS`] triangles.
    TooLarge,
    /// A position, a texture coordinate or a thickness is not finite, or a thickness is negative.
    NotFinite,
}

impl ShellFault {
    /// Words for the fault that continue the sentence "the mesh …".
    pub fn words(self) -> &'static str {
        match self {
            ShellFault::Empty => "has no triangle with an area",
            ShellFault::Unmapped => "has texture coordinates without any area",
            ShellFault::TooLarge => "has too many triangles for a shell",
            ShellFault::NotFinite => {
                "has a position, a texture coordinate or a thickness that is not a finite number"
            }
        }
    }
}

impl Shell {
    /// Builds the shell of a mesh. Triangles without an area are left out.
    ///
    /// # Errors
    /// Returns the [`ShellFault`] of a mesh that carries no shell.
    ///
    /// # Panics
    /// If a triangle names a vertex that the mesh does not have, or the lists of the vertices differ in
    /// length.
    pub fn new(mesh: &SurfaceMesh, side: Side) -> Result<Shell, ShellFault> {
        let SurfaceMesh { positions, uv, thickness, triangles } = mesh;
        assert!(positions.len() == uv.len() && positions.len() == thickness.len());
        let is_finite = positions.iter().all(|p| p.is_finite())
            && uv.iter().all(|uv| uv.is_finite())
            && thickness.iter().all(|h| h.is_finite() && *h >= 0.0);
        if !is_finite {
            return Err(ShellFault::NotFinite);
        }
        if triangles.len() > MAX_PRISMS {
            return Err(ShellFault::TooLarge);
        }
        let welded = weld(positions);
        let count = welded.iter().max().map_or(0, |&most| most as usize + 1);
        let mut places = vec![Vec3::ZERO; count];
        let mut heights = vec![0.0f32; count];
        for (i, &vertex) in welded.iter().enumerate() {
            places[vertex as usize] = positions[i];
            heights[vertex as usize] = heights[vertex as usize].max(thickness[i]);
        }
        // Corners of triangles with an area, as numbers of welded and of the mesh's own vertices.
        let kept: Vec<([u32; 3], [u32; 3])> = triangles
            .iter()
            .map(|&own| (own.map(|i| welded[i as usize]), own))
            .filter(|&(t, _)| twice_area(&places, t).length() > 0.0)
            .collect();
        if kept.is_empty() {
            return Err(ShellFault::Empty);
        }
        let normals = smooth_normals(&places, kept.iter().map(|&(t, _)| t));
        let mut points = Vec::with_capacity(2 * count);
        for v in 0..count {
            let away = (normals[v] * f64::from(heights[v])).as_vec3();
            points.extend(match side {
                Side::Outward => [places[v] + away, places[v]],
                Side::Inward => [places[v], places[v] - away],
            });
        }
        Shell::between(points, &kept, uv)
    }

    /// Builds the shell between the outer and inner points of each vertex. `kept` are the triangles, as
    /// numbers of vertices and of texture coordinates, counter-clockwise as seen from outside.
    ///
    /// # Errors
    /// [`ShellFault::Unmapped`] where no triangle has an area in the texture.
    pub(super) fn between(
        points: Vec<Vec3>,
        kept: &[([u32; 3], [u32; 3])],
        uv: &[Vec2],
    ) -> Result<Shell, ShellFault> {
        let mut prisms: Vec<Prism> = kept.iter().map(|&(welded, own)| prism(welded, own, uv)).collect();
        let mut corner_of = vec![0; points.len() / 2];
        for (i, prism) in prisms.iter().enumerate() {
            for (k, &vertex) in prism.vertices.iter().enumerate() {
                corner_of[vertex as usize] = (4 * i + k) as u32;
            }
        }
        let tangents = tangents::average(&points, &mut prisms);
        let mut shell = Shell {
            points,
            prisms,
            hull: Vec::new(),
            tangents,
            corner_of,
            volume: 0,
            skin: false,
            is_single: false,
        };
        for i in 0..shell.prisms.len() {
            let volume = |k: usize| {
                shell.jacobian(i, k).map_or(0.0, |[x, y, z]| Mat3::from_cols(x, y, z).determinant().abs())
            };
            shell.prisms[i].volumes = shell.jacobian(i, 0).map(|_| [0, 1, 2].map(volume));
        }
        if !(0..shell.prisms.len()).any(|prism| shell.is_mapped(prism)) {
            return Err(ShellFault::Unmapped);
        }
        shell.join();
        shell.hull = shell.enclose(kept.iter().map(|&(t, _)| t));
        Ok(shell)
    }

    /// Finds the prism beyond every side.
    fn join(&mut self) {
        let mut sides: HashMap<[u32; 2], Vec<(usize, usize)>> =
            HashMap::with_capacity(self.prisms.len() * 3 / 2);
        for (i, prism) in self.prisms.iter().enumerate() {
            for (e, ends) in EDGES.iter().enumerate() {
                sides.entry(ends.map(|end| prism.vertices[end])).or_default().push((i, e));
            }
        }
        for at in sides.values() {
            if let &[(a, edge_a), (b, edge_b)] = &at[..] {
                self.prisms[a].beyond[edge_a] = Beyond::new(b, edge_b);
                self.prisms[b].beyond[edge_b] = Beyond::new(a, edge_a);
            }
        }
    }

    /// Returns the hull. `triangles` are those of the prisms, counter-clockwise.
    fn enclose(&self, triangles: impl Iterator<Item = [u32; 3]>) -> Vec<HullFace> {
        let mut hull = Vec::with_capacity(2 * self.prisms.len());
        for (i, (prism, [a, b, c])) in self.prisms.iter().zip(triangles).enumerate() {
            let mut add = |tetrahedron: usize, points: [u32; 3]| {
                hull.push(HullFace { prism: i as u32, tetrahedron: tetrahedron as u32, points });
            };
            add(0, [2 * a, 2 * b, 2 * c]);
            add(2, [2 * a + 1, 2 * c + 1, 2 * b + 1]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let low = from.min(to);
                let edge =
                    EDGES.iter().position(|ends| ends.map(|end| prism.vertices[end]) == [low, from.max(to)]);
                let edge = edge.expect("the edge of a triangle is one of its prism");
                if prism.beyond[edge] != Beyond::NOTHING {
                    continue;
                }
                let [upper, lower] = AT_SIDES[edge];
                // The diagonal runs from the outer point of the lower number to the inner point of the
                // higher.
                if from == low {
                    add(upper, [2 * from, 2 * to + 1, 2 * to]);
                    add(lower, [2 * from, 2 * from + 1, 2 * to + 1]);
                } else {
                    add(upper, [2 * from, 2 * from + 1, 2 * to]);
                    add(lower, [2 * to, 2 * from + 1, 2 * to + 1]);
                }
            }
        }
        hull
    }
}

/// Numbers the positions: equal ones have one number, in the order of their first use.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut numbers = HashMap::with_capacity(positions.len());
    positions
        .iter()
        .map(|&p| {
            // −0 equals 0.
            let key = (p + Vec3::ZERO).to_array().map(f32::to_bits);
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        })
        .collect()
}

/// The normal of a triangle, twice as long as its area.
fn twice_area(places: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| places[v as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// Unit normals of the vertices: the means of their triangles' normals, weighted by the angles there. So
/// they do not depend on how flat parts are cut into triangles.
fn smooth_normals(places: &[Vec3], triangles: impl Iterator<Item = [u32; 3]>) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; places.len()];
    let mut any = sums.clone();
    for t in triangles {
        let normal = twice_area(places, t).normalize();
        for k in 0..3 {
            let [at, next, last] = [0, 1, 2].map(|i| places[t[(k + i) % 3] as usize].as_dvec3());
            sums[t[k] as usize] += normal * (next - at).angle_between(last - at);
            any[t[k] as usize] = normal;
        }
    }
    // Where the triangles of a vertex cancel out, one of them stands for all.
    sums.iter().zip(any).map(|(sum, any)| sum.try_normalize().unwrap_or(any)).collect()
}

/// The prism of a triangle, without neighbours.
fn prism(welded: [u32; 3], own: [u32; 3], uv: &[Vec2]) -> Prism {
    let mut order = [0, 1, 2];
    order.sort_by_key(|&k| welded[k]);
    Prism {
        vertices: order.map(|k| welded[k]),
        uv: order.map(|k| uv[own[k] as usize]),
        tangents: [0; 3],
        volumes: None,
        beyond: [Beyond::NOTHING; 3],
    }
}
