//! A tree of boxes around triangles (BVH), for rays and for the nearest point.
//!
//! Four children lie side by side in a node, so that one SIMD test meets all of them (Dammertz, Hanika and
//! Keller 2008).

mod build;

use glam::{Vec3, Vec4};

pub use build::Caster;

/// Children of a node. A box that holds nothing has its lower corner above its upper one.
struct Node {
    /// Lower corners along x, y and z, metres.
    low: [Vec4; 3],
    /// Upper corners, metres.
    high: [Vec4; 3],
    /// First triangle of a leaf; otherwise the number of the node.
    first: [u32; 4],
    /// Triangles of a leaf; 0 where the child is a node.
    count: [u32; 4],
}

/// A triangle, as rays meet it.
struct Face {
    corner: Vec3,
    /// Edges from `corner` to the second and to the third corner.
    edges: [Vec3; 2],
    /// Number among the triangles that the tree was built of.
    number: u32,
    kinds: u8,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Number of the triangle.
    pub triangle: usize,
    /// Distance along the ray, metres.
    pub t: f32,
    /// Shares of the triangle's corners, which add up to 1.
    pub shares: Vec3,
}

/// Levels of the tree at most; the builder splits evenly from [`build::MAX_UNEVEN`] on.
const MAX_LEVELS: usize = build::MAX_UNEVEN + 32;

/// Nodes that wait during a walk at most: three of the four children at each level.
const STACK: usize = 3 * MAX_LEVELS + 1;

/// Triangles in a tree of boxes.
pub struct Bvh {
    nodes: Vec<Node>,
    faces: Vec<Face>,
    low: Vec3,
    high: Vec3,
}

impl Bvh {
    /// Whether there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Distance from a surface at which a ray may start without meeting it, metres. Rounding of positions and
    /// of intersections is smaller.
    pub fn margin(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let farthest = self.low.abs().max(self.high.abs()).max_element();
        (1e-5 * self.low.distance(self.high)).max(4.0 * f32::EPSILON * farthest)
    }

    /// Whether a ray from `from` along the unit vector `direction` meets a triangle that has one of the bits
    /// `kinds`.
    pub fn is_hit(&self, from: Vec3, direction: Vec3, kinds: u8) -> bool {
        self.is_hit_before(from, direction, f32::INFINITY, kinds)
    }

    /// [`Bvh::is_hit`], nearer than `end` metres.
    pub fn is_hit_before(&self, from: Vec3, direction: Vec3, end: f32, kinds: u8) -> bool {
        self.walk(from, direction, end, |face, end| {
            face.kinds & kinds != 0 && face.is_hit(from, direction, *end)
        })
    }

    /// The nearest triangle whose back a ray from `from` along the unit vector `direction` meets. Corners are
    /// counter-clockwise as seen from the front.
    pub fn first_way_out(&self, from: Vec3, direction: Vec3) -> Option<Hit> {
        let mut nearest = None;
        self.walk(from, direction, f32::INFINITY, |face, end| {
            let [b, c] = face.edges;
            if b.cross(c).dot(direction) > 0.0
                && let Some([u, v, t]) = face.hit(from, direction, *end)
            {
                *end = t;
                nearest =
                    Some(Hit { triangle: face.number as usize, t, shares: Vec3::new(1.0 - u - v, u, v) });
            }
            false
        });
        nearest
    }

    /// Calls `is_enough` for triangles near a ray until it is true, and returns whether it was. Those farther
    /// than `end` metres are left out; `is_enough` may lower that.
    #[inline]
    fn walk(
        &self,
        from: Vec3,
        direction: Vec3,
        mut end: f32,
        mut is_enough: impl FnMut(&Face, &mut f32) -> bool,
    ) -> bool {
        // A component of 0 would make 0·∞ in a box whose face holds the origin.
        let inverse =
            direction.to_array().map(|d| 1.0 / if d.abs() < 1e-20 { 1e-20f32.copysign(d) } else { d });
        let axes = [0, 1, 2].map(|axis| (Vec4::splat(from[axis]), Vec4::splat(inverse[axis])));
        let mut stack = [0u32; STACK];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let node = &self.nodes[stack[waiting] as usize];
            let (mut near, mut far) = (Vec4::ZERO, Vec4::splat(end));
            for (axis, (from, inverse)) in axes.iter().enumerate() {
                let [a, b] = [node.low[axis], node.high[axis]].map(|bound| (bound - *from) * *inverse);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
            // Boxes are entered a little early, so that rounding loses no triangle on their faces.
            let is_near = near.cmple(far * (1.0 + 4.0 * f32::EPSILON));
            let mut met = is_near.bitmask() & node.low[0].cmple(node.high[0]).bitmask();
            while met != 0 {
                let child = met.trailing_zeros() as usize;
                met &= met - 1;
                let (first, count) = (node.first[child], node.count[child]);
                if count == 0 {
                    stack[waiting] = first;
                    waiting += 1;
                    continue;
                }
                let own = &self.faces[first as usize..(first + count) as usize];
                if own.iter().any(|face| is_enough(face, &mut end)) {
                    return true;
                }
            }
        }
        false
    }

    /// Returns the least `measure` of the vectors from triangles to `point`, but at most `most`. `measure`
    /// may not shrink where a component grows away from 0; the nearest point of a triangle is the one in a
    /// straight line.
    pub fn nearest(&self, point: Vec3, most: f32, measure: impl Fn(Vec3) -> f32) -> f32 {
        let mut best = most;
        let mut stack = [(0.0f32, 0u32); STACK];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let (least, number) = stack[waiting];
            if least >= best {
                continue;
            }
            let node = &self.nodes[number as usize];
            let mut found = [(0.0f32, 0usize); 4];
            let mut count = 0;
            for child in 0..4 {
                let [low, high] =
                    [&node.low, &node.high].map(|c| Vec3::from_array([0, 1, 2].map(|i| c[i][child])));
                if low.x <= high.x {
                    found[count] = (measure(point - point.clamp(low, high)), child);
                    count += 1;
                }
            }
            // The nearest child is the last that is put on the stack.
            found[..count].sort_by(|a, b| b.0.total_cmp(&a.0));
            for &(least, child) in &found[..count] {
                let (first, inside) = (node.first[child], node.count[child]);
                if least >= best {
                    continue;
                }
                if inside == 0 {
                    stack[waiting] = (least, first);
                    waiting += 1;
                    continue;
                }
                for face in &self.faces[first as usize..(first + inside) as usize] {
                    let [b, c] = face.edges.map(|edge| face.corner + edge);
                    let nearest = super::rock::wet::nearest_on_triangle(point, [face.corner, b, c]);
                    best = best.min(measure(point - nearest));
                }
            }
        }
        best
    }
}

impl Face {
    /// Whether a ray meets the triangle before `end`.
    #[inline]
    fn is_hit(&self, from: Vec3, direction: Vec3, end: f32) -> bool {
        self.hit(from, direction, end).is_some()
    }

    /// Shares of the second and the third corner where a ray meets the triangle before `end`, and the
    /// distance (Möller and Trumbore 1997).
    #[inline]
    fn hit(&self, from: Vec3, direction: Vec3, end: f32) -> Option<[f32; 3]> {
        let [b, c] = self.edges;
        let p = direction.cross(c);
        let inverse = 1.0 / b.dot(p);
        let away = from - self.corner;
        let u = away.dot(p) * inverse;
        let q = away.cross(b);
        let v = direction.dot(q) * inverse;
        let t = c.dot(q) * inverse;
        // Comparisons with NaN, of a triangle seen from its edge, are false.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < end).then_some([u, v, t])
    }
}
