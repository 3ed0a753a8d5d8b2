//! §3 Shells: the volume between a mesh and its offset along smooth normals.
//!
//! A quad carries copies of the volume that go on without end beside and behind it. A shell carries only the
//! cells between two surfaces, so the matter ends where the mesh ends: it has a silhouette. The outer surface
//! is the face z = 0 of the volume, and the inner one lies `nz` cells behind it.
//!
//! Above every triangle of the mesh stands a prism. It is cut into three tetrahedra, each with an affine map
//! from the world to the cells (Porumbescu, Budge, Feng and Joy, "Shell Maps", SIGGRAPH 2005). A ray goes
//! from one to the next, and the walk of §4 runs through the cells in each ([`ShellPath`]).
//!
//! - **The cut.** Let a prism stand on the vertices 0, 1 and 2, in the order of their numbers in the mesh. On
//!   each side the diagonal runs from the outer point of the lower number to the inner point of the higher.
//!   So the prisms on both sides of an edge cut their common side alike, and no ray passes between them.
//! - **Seams.** Vertices that files split, because their texture coordinates differ, are joined by their
//!   positions. The shell has no crack there; the walk goes on with the other coordinates.
//! - **Borders.** An edge of one triangle, or of more than two, is an end of the shell.

mod block;
mod build;
mod path;
mod tangents;

use glam::{Vec2, Vec3};

pub use block::Inside;
pub use build::{ShellFault, Side, SurfaceMesh};
pub use path::{End, INWARDS, LanePaths, LaneSegments, MOST_FACES, Segment, ShellPath};
pub use tangents::Tangents;

/// A volume between two surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Shell {
    /// Outer and inner point of each vertex of the mesh: of vertex v at 2v and 2v + 1. Metres.
    pub points: Vec<Vec3>,
    /// Prisms, one above each triangle.
    pub prisms: Vec<Prism>,
    /// Triangles that enclose the shell.
    pub hull: Vec<HullFace>,
    /// Tangents of the texture, which the corners of prisms number.
    pub tangents: Vec<Tangents>,
    /// A prism at each vertex of the mesh: four times its number, plus the vertex's position there.
    corner_of: Vec<u32>,
    /// Number of the volume among those of the scene.
    pub volume: u32,
    /// Whether opaque matter lies behind the inner surface, so that no light comes from there.
    pub skin: bool,
    /// Whether the shell is a box that shows the volume once ([`Shell::block`]): what is looked up near one
    /// end of the volume does not go on at the other, and the eye may be inside.
    pub is_single: bool,
}

/// A prism between the two surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prism {
    /// Numbers of its vertices in the mesh, ascending.
    pub vertices: [u32; 3],
    /// Texture coordinates of the vertices, in copies of the volume.
    pub uv: [Vec2; 3],
    /// Numbers of the tangents at the vertices.
    pub tangents: [u32; 3],
    /// Determinant of the Jacobian of each tetrahedron: m³ of the world per copy of the volume. `None` where
    /// the triangle has no area in the texture.
    pub volumes: Option<[f32; 3]>,
    /// Prisms beyond the sides on [`EDGES`].
    pub beyond: [Beyond; 3],
}

/// The prism beyond a side of another: four times its number, plus the number of its own edge there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beyond(u32);

impl Beyond {
    /// The shell ends here.
    pub const NOTHING: Beyond = Beyond(u32::MAX);

    fn new(prism: usize, edge: usize) -> Beyond {
        Beyond((prism * 4 + edge) as u32)
    }

    /// The prism's number and its edge, if there is one.
    #[inline]
    pub fn get(self) -> Option<(usize, usize)> {
        (self != Beyond::NOTHING).then_some((self.0 as usize / 4, self.0 as usize % 4))
    }
}

/// Most prisms of a shell.
pub const MAX_PRISMS: usize = 1 << 28;

/// Most cells in the mean edge of a mesh whose vertices keep V. Between vertices that are farther from one
/// another it would be too coarse, and rays walk to the light.
const MOST_EDGE: f32 = 16.0;

/// Number in place of a tetrahedron's in [`HullFace::EYE`]. Twin: `EYE_FACE` of
/// `shaders/mapping/shell.wgsl`.
pub const EYE_FACE: u32 = 3;

/// Edges of a prism, as positions of their ends among its vertices.
pub const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

/// Space beyond a face of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Face {
    /// Another tetrahedron of the prism.
    Tetrahedron(usize),
    /// The half of a side of the prism that has both outer points (0) or both inner points (1) of an edge.
    Side(usize, usize),
    /// The outer or the inner surface.
    Surface,
}

/// Faces of the three tetrahedra, each opposite the corner of the same position in
/// [`Shell::tetrahedron`].
const FACES: [[Face; 4]; 3] = [
    [Face::Side(1, 0), Face::Side(2, 0), Face::Tetrahedron(1), Face::Surface],
    [Face::Side(1, 1), Face::Tetrahedron(2), Face::Tetrahedron(0), Face::Side(0, 0)],
    [Face::Surface, Face::Tetrahedron(1), Face::Side(2, 1), Face::Side(0, 1)],
];

/// Tetrahedra at the halves of each side of a prism: with both outer points, and with both inner points.
const AT_SIDES: [[usize; 2]; 3] = [[1, 2], [0, 1], [0, 2]];

/// A triangle of the hull of a shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HullFace {
    /// Prism that it belongs to.
    pub prism: u32,
    /// Its tetrahedron in the prism, 0 to 2; or [`EYE_FACE`].
    pub tetrahedron: u32,
    /// Numbers of its points, counter-clockwise as seen from outside.
    pub points: [u32; 3],
}

impl HullFace {
    /// The last face of a box, which stands for the place of an eye inside it. It has no area; the raster
    /// pass draws it over the whole view where the eye is inside.
    pub const EYE: HullFace = HullFace { prism: 0, tetrahedron: EYE_FACE, points: [0; 3] };

    /// Whether the face stands for the place of the eye.
    #[inline]
    pub fn is_eye(&self) -> bool {
        self.tetrahedron == EYE_FACE
    }
}

impl Shell {
    /// The corners of a hull face, metres.
    pub fn corners(&self, face: &HullFace) -> [Vec3; 3] {
        face.points.map(|point| self.points[point as usize])
    }

    /// Numbers of the points of a tetrahedron.
    #[inline]
    pub fn tetrahedron(&self, prism: usize, tetrahedron: usize) -> [u32; 4] {
        let [a, b, c] = self.prisms[prism].vertices.map(|vertex| 2 * vertex);
        match tetrahedron {
            0 => [a, b, c, c + 1],
            1 => [a, b, b + 1, c + 1],
            _ => [a, a + 1, b + 1, c + 1],
        }
    }

    /// Number of vertices of the mesh.
    pub fn vertices(&self) -> usize {
        self.points.len() / 2
    }

    /// A prism at a vertex: four times its number, plus the vertex's position there.
    pub fn corner_of(&self, vertex: usize) -> u32 {
        self.corner_of[vertex]
    }

    /// Number of layers between which V is interpolated in a volume of `size` cells, two cells each. `None`
    /// where V is not kept at the vertices, because they are too far from one another.
    pub fn light_layers(&self, size: [u32; 3]) -> Option<u32> {
        (self.edge_cells(size) <= MOST_EDGE).then_some(size[2].div_ceil(2))
    }

    /// A point that lies `depth` (0 to 1) below a vertex and a little beside it, so that it is inside a
    /// tetrahedron: returns the point and the tetrahedron.
    pub fn below_vertex(&self, vertex: usize, depth: f32) -> (Vec3, [usize; 2]) {
        let corner = self.corner_of[vertex] as usize;
        let (prism, position) = (corner / 4, corner % 4);
        // Only one tetrahedron has the upright edge of the vertex. Close to its ends others are as near.
        let depth = depth.clamp(0.01, 0.99);
        let at = self.prisms[prism].vertices.map(|v| {
            let [outer, inner] = [0, 1].map(|k| self.points[2 * v as usize + k]);
            outer.lerp(inner, depth)
        });
        let middle = (at[0] + at[1] + at[2]) / 3.0;
        (at[position].lerp(middle, 0.003), [prism, 2 - position])
    }

    /// A point in a prism, and the tetrahedron that holds it. `shares` are those of the prism's vertices, and
    /// `depth` (0 to 1) is that from the outer surface.
    pub fn below_triangle(&self, prism: usize, shares: Vec3, depth: f32) -> (Vec3, [usize; 2]) {
        let Vec3 { x: a, y: b, z: c } = shares;
        // The inner corners' shares add up to the depth. A tetrahedron has them in the order c, b, a.
        let (tetrahedron, of_corners) = if depth <= c {
            (0, [a, b, c - depth, depth])
        } else if depth <= b + c {
            (1, [a, b + c - depth, depth - c, c])
        } else {
            (2, [1.0 - depth, depth - b - c, b, c])
        };
        let corners = self.tetrahedron(prism, tetrahedron).map(|point| self.points[point as usize]);
        let point = corners.into_iter().zip(of_corners).map(|(corner, share)| corner * share).sum();
        (point, [prism, tetrahedron])
    }

    /// Mean length of the mesh's edges in the texture, cells of a volume of `size`.
    pub fn edge_cells(&self, size: [u32; 3]) -> f32 {
        let n = Vec2::new(size[0] as f32, size[1] as f32);
        let of = |prism: &Prism| -> f32 {
            EDGES.iter().map(|&[a, b]| ((prism.uv[b] - prism.uv[a]) * n).length()).sum()
        };
        self.prisms.iter().map(of).sum::<f32>() / (3 * self.prisms.len()) as f32
    }

    /// Texture coordinates of a point of a hull face, in copies of the volume.
    pub fn uv(&self, face: &HullFace, point: u32) -> Vec2 {
        let Prism { vertices, uv, .. } = &self.prisms[face.prism as usize];
        uv[vertices.iter().position(|&vertex| vertex == point / 2).unwrap_or(0)]
    }

    /// Whether a prism's triangle has an area in the texture.
    #[inline]
    pub fn is_mapped(&self, prism: usize) -> bool {
        self.prisms[prism].volumes.is_some()
    }

    /// Jacobian of a tetrahedron, as columns: metres of the world per copy of the volume along u, along v and
    /// into the depth. `None` where the triangle has no area in the texture.
    pub fn jacobian(&self, prism: usize, tetrahedron: usize) -> Option<[Vec3; 3]> {
        let Prism { vertices, uv, .. } = &self.prisms[prism];
        let point = |vertex: usize, depth: u32| self.points[(2 * vertices[vertex] + depth) as usize];
        // Each tetrahedron has one vertical edge. Before it in the order of vertices corners are outer ones,
        // behind it inner ones.
        let upright = 2 - tetrahedron;
        let down = point(upright, 1) - point(upright, 0);
        let flat = |vertex: usize| {
            // From vertex 0 to `vertex` along the surface, with the depth taken out.
            let depth = u32::from(vertex > upright);
            point(vertex, depth) - point(0, 0) - down * depth as f32
        };
        along_texture(uv, flat(1), flat(2)).map(|[x, y]| [x, y, down])
    }

    /// Corners of the box around the shell, metres.
    pub fn bounds(&self) -> [Vec3; 2] {
        [Vec3::min, Vec3::max].map(|f| self.points.iter().copied().reduce(f).unwrap_or_default())
    }

    /// Outward unit normals at the vertices: along the thickness, or where there is none, those of the outer
    /// surface.
    pub fn normals(&self) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; self.vertices()];
        let is_outer = |face: &&HullFace| !face.is_eye() && face.points.iter().all(|point| point % 2 == 0);
        for face in self.hull.iter().filter(is_outer) {
            let [a, b, c] = self.corners(face);
            let normal = (b - a).cross(c - a);
            face.points.iter().for_each(|point| sums[*point as usize / 2] += normal);
        }
        let along = |([outer, inner], sum): (&[Vec3; 2], Vec3)| {
            (*outer - *inner).try_normalize().unwrap_or_else(|| sum.normalize_or_zero())
        };
        self.points.as_chunks::<2>().0.iter().zip(sums).map(along).collect()
    }

    /// Mean distance of the two surfaces at the vertices, metres.
    pub fn mean_thickness(&self) -> f64 {
        let pairs = self.points.as_chunks::<2>().0;
        let sum: f64 = pairs.iter().map(|[outer, inner]| f64::from(outer.distance(*inner))).sum();
        sum / pairs.len().max(1) as f64
    }

    /// Number of prisms that turn over: an edge of one surface runs against the same edge of the other,
    /// because the thickness is larger than the radius by which the mesh bends towards it.
    pub fn turned_over(&self) -> usize {
        let edge = |prism: &Prism, [a, b]: [usize; 2], depth: u32| {
            let [a, b] = [a, b].map(|k| self.points[(2 * prism.vertices[k] + depth) as usize]);
            b - a
        };
        let turns =
            |prism: &&Prism| EDGES.iter().any(|&ends| edge(prism, ends, 0).dot(edge(prism, ends, 1)) < 0.0);
        self.prisms.iter().filter(turns).count()
    }

    /// Jacobian with which light is computed at a place in a prism that has an area in the texture, as
    /// columns like those of [`Shell::jacobian`]. The place is given by the shares of the prism's vertices
    /// and the depth from 0 to 1. The [`Tangents`] are interpolated along the surface and into the depth, so
    /// the Jacobian has no steps between prisms.
    #[inline]
    pub fn frame(&self, prism: usize, shares: Vec3, depth: f32) -> [Vec3; 3] {
        let [a, b, c] = self.prisms[prism].tangents.map(|number| &self.tangents[number as usize]);
        Tangents::mean([(a, shares.x), (b, shares.y), (c, shares.z)]).at(depth)
    }

    /// Bytes that the shell takes in memory.
    pub fn bytes(&self) -> u64 {
        let of = |count: usize, size: usize| (count * size) as u64;
        of(self.points.len(), size_of::<Vec3>())
            + of(self.prisms.len(), size_of::<Prism>())
            + of(self.hull.len(), size_of::<HullFace>())
            + of(self.corner_of.len(), size_of::<u32>())
            + of(self.tangents.len(), size_of::<Tangents>())
    }
}

/// Metres per copy of the volume along u and along v, where the edges from the first corner of a triangle to
/// the others are e1 and e2. `None` where the triangle has no area in the texture.
fn along_texture(uv: &[Vec2; 3], e1: Vec3, e2: Vec3) -> Option<[Vec3; 2]> {
    let [a, b] = [uv[1] - uv[0], uv[2] - uv[0]];
    let inverse = 1.0 / a.perp_dot(b);
    is_an_area(a, b).then(|| [(e1 * b.y - e2 * a.y) * inverse, (e2 * a.x - e1 * b.x) * inverse])
}

/// Whether two edges span an area. Below the limit, the rounding errors of the coordinates would decide.
fn is_an_area(a: Vec2, b: Vec2) -> bool {
    a.perp_dot(b).abs() > 1e-6 * a.length() * b.length()
}
