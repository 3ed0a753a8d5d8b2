//! Faces of a primitive: quads found again in triangles, and polygons cut into triangles.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::{DVec3, Vec3};

use super::Primitive;

/// Face of a primitive, as indices of vertices. Seen from the front, they run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// Triangle.
    Triangle([u32; 3]),
    /// Convex quad. Its corners need not lie in a plane.
    Quad([u32; 4]),
}

/// Least cosine between the normals of two triangles that are taken for one quad, 60°. A quad of a sheet that
/// is bent more is rare, and the two sides of a box's edge are 90° apart.
const LEAST_COSINE: f64 = 0.5;

impl Primitive {
    /// Returns the faces in the order of the triangles: the file's own quads where it has any (OBJ), and else
    /// pairs of consecutive triangles that a quad was cut into.
    ///
    /// Exporters cut the quad `a b c d` into `a b c`, `a c d` or into `a b d`, `b c d`. So two consecutive
    /// triangles of one of these orders are a quad, if it is convex and bent by less than 60°. A mesh of
    /// triangles may have such pairs by chance; a pair then lies on the same surface as its triangles did.
    pub fn faces(&self) -> Vec<Face> {
        let mut faces = Vec::with_capacity(self.triangles.len());
        let mut own = self.quads.as_deref().map(|quads| quads.iter().peekable());
        let mut i = 0;
        while i < self.triangles.len() {
            let pair = self.triangles.get(i + 1).and_then(|next| self.pair(self.triangles[i], *next));
            let quad = match &mut own {
                Some(own) => own.next_if(|&&first| first as usize == i).and(pair),
                None => pair,
            };
            faces.push(quad.map_or(Face::Triangle(self.triangles[i]), Face::Quad));
            i += if quad.is_some() { 2 } else { 1 };
        }
        faces
    }

    /// The quad that was cut into two triangles, if it is convex.
    fn pair(&self, first: [u32; 3], second: [u32; 3]) -> Option<[u32; 4]> {
        let quad = if first[0] == second[0] && first[2] == second[1] {
            [first[0], first[1], first[2], second[2]]
        } else if first[1] == second[0] && first[2] == second[2] {
            [first[0], first[1], second[1], first[2]]
        } else {
            return None;
        };
        let corner = |i: u32| Vec3::from(self.positions[i as usize]).as_dvec3();
        (quad[1] != quad[3] && quad[0] != quad[2] && is_convex(quad.map(corner))).then_some(quad)
    }
}

/// Tells whether a quad is convex in its mean plane and bent by less than 60° along each diagonal.
pub(super) fn is_convex(p: [DVec3; 4]) -> bool {
    let mean = (p[2] - p[0]).cross(p[3] - p[1]);
    let normal = |a: usize, b: usize, c: usize| (p[b] - p[a]).cross(p[c] - p[b]);
    let corners = [normal(3, 0, 1), normal(0, 1, 2), normal(1, 2, 3), normal(2, 3, 0)];
    let bent = |a: DVec3, b: DVec3| a.dot(b) < LEAST_COSINE * a.length() * b.length();
    corners.iter().all(|corner| corner.dot(mean) > 0.0)
        && !bent(corners[1], corners[3])
        && !bent(corners[0], corners[2])
}

/// Most corners of a polygon that is not convex. The time of cutting grows with their square, and more.
pub(super) const MOST_CORNERS: usize = 1024;

/// Cutter of polygons. It keeps its memory from one to the next.
pub(super) struct Cutter {
    ears: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

impl Cutter {
    pub fn new() -> Cutter {
        Cutter { ears: Earcut::new(), flat: Vec::new(), cut: Vec::new() }
    }

    /// Cuts a polygon into triangles, given as indices of its corners. A convex one becomes a fan around its
    /// first corner. Returns an empty list where the polygon has no area, and `None` where it is not convex
    /// and has too many corners.
    pub fn cut(&mut self, polygon: &[DVec3]) -> Option<Vec<[u32; 3]>> {
        let count = polygon.len() as u32;
        // Relative to a corner, so that a polygon far from the origin keeps its digits.
        let near: Vec<DVec3> = polygon.iter().map(|p| *p - polygon[0]).collect();
        let area: DVec3 = near.windows(2).map(|edge| edge[0].cross(edge[1])).sum();
        let Some(normal) = area.try_normalize() else { return Some(Vec::new()) };
        let fan: Vec<[u32; 3]> = (1..count - 1).map(|i| [0, i, i + 1]).collect();
        if is_fan(&near, normal) {
            return Some(fan);
        }
        if polygon.len() > MOST_CORNERS {
            return None;
        }
        let corners: Vec<[f64; 3]> = near.iter().map(|p| p.to_array()).collect();
        if !project3d_to_2d(&corners, corners.len(), &mut self.flat) {
            return Some(Vec::new());
        }
        self.cut.clear();
        self.ears.earcut(self.flat.iter().copied(), &[], &mut self.cut);
        Some(self.cut.as_chunks::<3>().0.to_vec())
    }
}

/// Tells whether the triangles around the first corner cover a polygon once: it turns one way only, and no
/// triangle of the fan is turned over.
fn is_fan(polygon: &[DVec3], normal: DVec3) -> bool {
    let n = polygon.len();
    let turns = (0..n).all(|i| {
        let [a, b, c] = [polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]];
        (b - a).cross(c - b).dot(normal) >= 0.0
    });
    turns
        && (1..n - 1).all(|i| {
            let [a, b] = [polygon[i] - polygon[0], polygon[i + 1] - polygon[0]];
            a.cross(b).dot(normal) >= 0.0
        })
}

/// Tells whether a triangle has no area: two corners are the same, or all three lie on a line.
pub(super) fn is_degenerate(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| Vec3::from(p).as_dvec3());
    (b - a).cross(c - a) == DVec3::ZERO
}
