//! The path of a ray through a shell, tetrahedron by tetrahedron.
//!
//! The corners of a tetrahedron are seen along the ray, as points of a plane with the ray at its origin. The
//! ray enters through a triangle around the origin. The fourth corner cuts that triangle's far side into
//! three, and the signs of three cross products tell which one the ray leaves through.
//!
//! A cross product belongs to an edge, and every tetrahedron around the edge computes the same number. Where
//! it is 0, the ray counts as moved by less than any number, always in the same direction. So a ray that is
//! aimed at an edge or a vertex goes on through exactly one face, as any other does. The parameter and the
//! texture coordinates of a face's point are means of those of its corners, so a segment begins where the
//! last one ended, to the bit.

mod lanes;

use glam::{Vec2, Vec3};

pub use lanes::{LanePaths, LaneSegments};

use super::{AT_SIDES, FACES, Face, HullFace, Prism, Shell};

/// Faces that a path passes before it is given up. A path through a real shell is shorter; only one that
/// rounding leads in a circle would be longer. Twin: `MOST_FACES` of
/// `shaders/mapping/shell_path.wgsl`.
pub const MOST_FACES: u32 = 1 << 16;

/// Share of the way to a tetrahedron's middle by which the origin of a line is moved that passes the
/// tetrahedron by. Twin: `INWARDS` of `shaders/mapping/shell_path.wgsl`.
pub const INWARDS: f32 = 1e-3;

/// The part of a ray inside one tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Prism and tetrahedron.
    pub prism: usize,
    /// Number of the tetrahedron in the prism.
    pub tetrahedron: usize,
    /// Parameters where the ray enters and leaves, metres from the path's origin.
    pub t: [f32; 2],
    /// Texture coordinates there: copies of the volume along u and v, and the depth from 0 to 1.
    pub at: [Vec3; 2],
    /// Shares of the prism's vertices there: barycentric coordinates of the points of both surfaces between
    /// which the ray is.
    pub shares: [Vec3; 2],
    /// Space behind the segment.
    pub end: End,
}

impl Segment {
    /// The part of the segment behind the parameter `t`, if it lies inside the segment.
    pub fn from(&self, t: f32) -> Segment {
        let [t_in, t_out] = self.t;
        if t <= t_in || t > t_out {
            return *self;
        }
        let share = ((t - t_in) / (t_out - t_in)).clamp(0.0, 1.0);
        let part = |[from, to]: [Vec3; 2]| [from.lerp(to, share), to];
        Segment { t: [t, t_out], at: part(self.at), shares: part(self.shares), ..*self }
    }

    /// The part of the segment before the parameter `t`.
    pub fn until(&self, t: f32) -> Segment {
        let [t_in, t_out] = self.t;
        if t >= t_out {
            return *self;
        }
        let share = ((t - t_in) / (t_out - t_in)).clamp(0.0, 1.0);
        let part = |[from, to]: [Vec3; 2]| [from, from.lerp(to, share)];
        Segment { t: [t_in, t.max(t_in)], at: part(self.at), shares: part(self.shares), ..*self }
    }
}

/// Space behind a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum End {
    /// The next segment.
    #[default]
    Segment,
    /// The outside of the outer surface.
    Outer,
    /// The other side of the inner surface.
    Inner,
    /// The outside of a border.
    Border,
}

/// A ray on its way through a shell: an iterator over its segments.
#[derive(Clone, Debug)]
pub struct ShellPath<'a> {
    shell: &'a Shell,
    origin: Vec3,
    direction: Vec3,
    /// Unit vectors across the direction.
    across: [Vec3; 2],
    prism: usize,
    tetrahedron: usize,
    /// Corners of the face that the ray enters through next, counter-clockwise around it.
    corners: [Corner; 3],
    /// Their shares in the point where it does.
    shares: [f32; 3],
    /// What [`ShellPath::texture`] returns there, if it is known.
    texture: Option<(Vec3, Vec3)>,
    t: f32,
    /// Number of faces that may still be passed; 0 behind the last segment.
    left: u32,
}

/// A corner as the ray sees it.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Number of the point.
    point: u32,
    /// Position across the ray, metres.
    at: Vec2,
    /// Position along the ray, metres.
    t: f32,
}

impl<'a> ShellPath<'a> {
    /// Path of the ray from `origin` along the unit vector `direction` that enters the shell through a face
    /// of its hull. The origin should be near the face: parameters are relative to it, and lose digits with
    /// the distance.
    ///
    /// A rasteriser rounds corners and may choose a face that the ray passes by. The ray is then moved onto
    /// the face. A path through a face that is seen edge-on may have no segments.
    pub fn new(shell: &'a Shell, face: &HullFace, origin: Vec3, direction: Vec3) -> Self {
        let mut path =
            ShellPath::at(shell, face.prism as usize, face.tetrahedron as usize, origin, direction);
        let see = |path: &Self| face.points.map(|point| path.corner(point));
        path.enter(see(&path));
        if !path.is_met() {
            // A little inside, where rounding does not put it outside again.
            let shares = path.shares.map(|share| share * 0.999 + 0.001 / 3.0);
            let at: Vec2 = path.corners.iter().zip(shares).map(|(corner, share)| corner.at * share).sum();
            path.origin += path.across[0] * at.x + path.across[1] * at.y;
            path.enter(see(&path));
            path.left = if path.is_met() { MOST_FACES } else { 0 };
        }
        path
    }

    /// Path of a ray whose origin lies in a tetrahedron. It begins where the line of the ray enters the
    /// tetrahedron, with a parameter that is not above 0.
    ///
    /// A line in the plane of a face, or one that rounding moves, may pass the tetrahedron by. The origin is
    /// then moved a little to the middle of the tetrahedron. `None` if the line misses it even so, because
    /// the tetrahedron has no volume.
    pub fn inside(shell: &'a Shell, place: [usize; 2], origin: Vec3, direction: Vec3) -> Option<Self> {
        ShellPath::along_line(shell, place, origin, direction).or_else(|| {
            let corners = shell.tetrahedron(place[0], place[1]).map(|point| shell.points[point as usize]);
            let middle = (corners[0] + corners[1] + corners[2] + corners[3]) * 0.25;
            ShellPath::along_line(shell, place, origin + (middle - origin) * INWARDS, direction)
        })
    }

    /// [`ShellPath::inside`], but `None` if the line misses the tetrahedron.
    fn along_line(
        shell: &'a Shell,
        [prism, tetrahedron]: [usize; 2],
        origin: Vec3,
        direction: Vec3,
    ) -> Option<Self> {
        let mut path = ShellPath::at(shell, prism, tetrahedron, origin, direction);
        let all = shell.tetrahedron(prism, tetrahedron).map(|point| path.corner(point));
        let mut entry: Option<([Corner; 3], f32)> = None;
        for out in 0..4 {
            let mut face = [0, 1, 2].map(|k| all[k + usize::from(k >= out)]);
            let turns = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| is_left(&face[a], &face[b]));
            if turns != [turns[0]; 3] {
                continue;
            }
            if !turns[0] {
                face.swap(1, 2);
            }
            let t = point_of(&face).1;
            if entry.is_none_or(|(_, least)| t < least) {
                entry = Some((face, t));
            }
        }
        path.enter(entry?.0);
        path.t = path.t.min(0.0);
        Some(path)
    }

    /// Whether the ray passes the face that the path enters through next.
    fn is_met(&self) -> bool {
        let [a, b, c] = &self.corners;
        is_left(a, b) && is_left(b, c) && is_left(c, a)
    }

    /// Whether the ray passes a face of the hull. It passes exactly one of the faces around an edge or a
    /// vertex.
    pub fn meets(shell: &Shell, face: &HullFace, origin: Vec3, direction: Vec3) -> bool {
        let mut path =
            ShellPath::at(shell, face.prism as usize, face.tetrahedron as usize, origin, direction);
        path.enter(face.points.map(|point| path.corner(point)));
        path.is_met()
    }

    fn at(shell: &'a Shell, prism: usize, tetrahedron: usize, origin: Vec3, direction: Vec3) -> Self {
        let (x, y) = direction.any_orthonormal_pair();
        let none = Corner { point: 0, at: Vec2::ZERO, t: 0.0 };
        ShellPath {
            shell,
            origin,
            direction,
            across: [x, y],
            prism,
            tetrahedron,
            corners: [none; 3],
            shares: [0.0; 3],
            texture: None,
            t: 0.0,
            left: MOST_FACES,
        }
    }

    /// Enters through a face, seen from either side.
    fn enter(&mut self, mut corners: [Corner; 3]) {
        let [a, b, c] = corners.map(|corner| corner.at);
        if (b - a).perp_dot(c - a) < 0.0 {
            corners.swap(1, 2);
        }
        self.corners = corners;
        (self.shares, self.t) = point_of(&corners);
    }

    /// Axes across the ray and along it, in which the corners are seen.
    #[inline]
    fn corner(&self, point: u32) -> Corner {
        let away = self.shell.points[point as usize] - self.origin;
        let at = Vec2::new(away.dot(self.across[0]), away.dot(self.across[1]));
        Corner { point, at, t: away.dot(self.direction) }
    }

    /// Texture coordinates of a point of a face, given by its corners' shares, and the shares of the prism's
    /// vertices there.
    #[inline]
    fn texture(&self, corners: &[Corner; 3], shares: [f32; 3]) -> (Vec3, Vec3) {
        let Prism { vertices, uv, .. } = &self.shell.prisms[self.prism];
        let (mut of_vertices, mut depth) = (Vec3::ZERO, 0.0);
        for (corner, share) in corners.iter().zip(shares) {
            let vertex = corner.point / 2;
            let is = Vec3::from_array(vertices.map(|own| if own == vertex { share } else { 0.0 }));
            of_vertices += is;
            depth += share * (corner.point % 2) as f32;
        }
        let at = uv[0] * of_vertices.x + uv[1] * of_vertices.y + uv[2] * of_vertices.z;
        // The shares' sum is 1 only but for rounding.
        (at.extend(depth.min(1.0)), of_vertices)
    }
}

impl Iterator for ShellPath<'_> {
    type Item = Segment;

    #[inline]
    fn next(&mut self) -> Option<Segment> {
        if self.left == 0 {
            return None;
        }
        let [a, b, c] = self.corners;
        let points = self.shell.tetrahedron(self.prism, self.tetrahedron);
        let is_old = |point: u32| [a.point, b.point, c.point].contains(&point);
        let new = points.into_iter().find(|&point| !is_old(point)).unwrap_or(points[3]);
        let d = self.corner(new);
        // The face that the ray leaves through lies between a corner to whose left the ray passes and one to
        // whose right it does, as seen from the new corner.
        let left = [a, b, c].map(|corner| is_left(&d, &corner));
        let (face, dropped) = match left {
            [true, false, _] => ([a, b, d], c),
            [_, true, false] => ([b, c, d], a),
            _ => ([c, a, d], b),
        };
        let (from, shares_in) = self.texture.unwrap_or_else(|| self.texture(&self.corners, self.shares));
        let (shares, t) = point_of(&face);
        let t_in = self.t;
        self.t = t.max(t_in);
        let (to, shares_out) = self.texture(&face, shares);
        let mut segment = Segment {
            prism: self.prism,
            tetrahedron: self.tetrahedron,
            t: [t_in, self.t],
            at: [from, to],
            shares: [shares_in, shares_out],
            end: End::Segment,
        };
        (self.corners, self.shares) = (face, shares);
        self.texture = Some((to, shares_out));
        let opposite = points.iter().position(|&point| point == dropped.point).unwrap_or(3);
        match FACES[self.tetrahedron][opposite] {
            Face::Tetrahedron(next) => self.tetrahedron = next,
            Face::Side(edge, half) => match self.shell.prisms[self.prism].beyond[edge].get() {
                Some((prism, edge)) => {
                    (self.prism, self.tetrahedron) = (prism, AT_SIDES[edge][half]);
                    self.texture = None;
                }
                None => segment.end = End::Border,
            },
            Face::Surface if self.tetrahedron == 0 => segment.end = End::Outer,
            Face::Surface => segment.end = End::Inner,
        }
        self.left = if segment.end == End::Segment { self.left - 1 } else { 0 };
        Some(segment)
    }
}

/// Whether the ray passes to the left of the edge from `p` to `q`. One of p–q and q–p has it on its left. A
/// ray that meets the edge counts as moved, by far less than any number, along the first axis across it, and
/// by less still along the second.
#[inline]
fn is_left(p: &Corner, q: &Corner) -> bool {
    // Both products are exact, so their difference has the right sign: all answers fit one another.
    let [p_at, q_at] = [p, q].map(|corner| corner.at.as_dvec2());
    let side = p_at.x * q_at.y - p_at.y * q_at.x;
    if side != 0.0 {
        return side > 0.0;
    }
    let along = q.at - p.at;
    if along.y != 0.0 {
        return along.y > 0.0;
    }
    // An edge along the ray parts nothing; only its two directions differ.
    if along.x != 0.0 { along.x < 0.0 } else { p.point < q.point }
}

/// Shares of a face's corners in the point where the ray passes it, and its parameter. Rounding may put the
/// ray outside the face; the point stays inside.
#[inline]
fn point_of([a, b, c]: &[Corner; 3]) -> ([f32; 3], f32) {
    let shares = [[b, c], [c, a], [a, b]].map(|[p, q]| p.at.perp_dot(q.at).max(0.0));
    let sum = shares[0] + shares[1] + shares[2];
    let shares = if sum > 0.0 { shares.map(|share| share / sum) } else { [1.0 / 3.0; 3] };
    (shares, shares[0] * a.t + shares[1] * b.t + shares[2] * c.t)
}
