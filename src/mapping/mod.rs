//! §3 The one-to-one map between a convex quad in the world and the face z = 0 of the volume.
//!
//! A quad A(0,0) B(1,0) C(1,1) D(0,1) is handled in its own plane: axes e1 (along AB), e2 (so that
//! A, B, C, D run counter-clockwise) and n = e1 × e2. Lengths are metres.
//! Twins: `quad_hit` ([`QuadMap::uv`]) and `CellFrame` in `shaders/mapping.wgsl`.

mod quad;
mod sheet;
mod splash;

use glam::{Vec2, Vec3};

pub use quad::Quad;
pub use sheet::{Ends, GRAVITY, Sheet, SheetFault, Station};
pub use splash::Splash;

/// z component of the cross product of two vectors in a plane.
pub fn cross(a: Vec2, b: Vec2) -> f32 {
    a.x * b.y - a.y * b.x
}

/// Reason why a quad cannot be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuadFault {
    /// Two corners are the same point, or the area is (next to) zero.
    Degenerate,
    /// The corners do not lie in one plane.
    NotPlanar,
    /// The corners form a concave or self-crossing polygon.
    NotConvex,
}

impl QuadFault {
    /// Describes the fault for an error message.
    pub fn words(self) -> &'static str {
        match self {
            QuadFault::Degenerate => "has no area or repeats a corner",
            QuadFault::NotPlanar => "is not planar",
            QuadFault::NotConvex => "is not convex (concave or self-crossing)",
        }
    }
}

/// A convex planar quad in its own plane, ready for the inverse map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadMap {
    /// Corner A in the world, metres; the origin of the plane.
    pub a_world: Vec3,
    /// Unit axes of the plane in the world.
    pub e1_world: Vec3,
    /// See `e1_world`.
    pub e2_world: Vec3,
    /// Unit normal e1 × e2.
    pub n_world: Vec3,
    /// E = B − A in the plane, metres.
    pub e: Vec2,
    /// F = D − A.
    pub f: Vec2,
    /// G = A − B + C − D.
    pub g: Vec2,
}

impl QuadMap {
    /// Checks the corners (world, metres) and builds the map. Corners may lie off the plane by up to 1e-4 of
    /// the diagonal; they are then projected onto the plane through A.
    ///
    /// # Errors
    /// A [`QuadFault`] if the corners do not form a convex planar quad.
    pub fn new([a, b, c, d]: [Vec3; 4]) -> Result<Self, QuadFault> {
        let (ac, bd) = ((c - a).as_dvec3(), (d - b).as_dvec3());
        let size = ac.length().max(bd.length());
        // The cross product of the diagonals is twice the vector area.
        let normal = ac.cross(bd);
        if !normal.is_finite() || normal.length() <= 1e-9 * size * size {
            return Err(QuadFault::Degenerate);
        }
        let n = normal.normalize();
        for (p, q) in [(a, b), (b, c), (c, d), (d, a)] {
            let edge = (q - p).as_dvec3();
            if edge.length() < 1e-6 * size {
                return Err(QuadFault::Degenerate);
            }
            if edge.dot(n).abs() > 1e-4 * size {
                return Err(QuadFault::NotPlanar);
            }
        }
        let e1 = (b - a).as_dvec3();
        let e1 = (e1 - n * e1.dot(n)).normalize();
        let e2 = n.cross(e1);
        let plane = |p: Vec3| {
            let v = (p - a).as_dvec3();
            glam::DVec2::new(v.dot(e1), v.dot(e2))
        };
        let (pb, pc, pd) = (plane(b), plane(c), plane(d));
        let pa = glam::DVec2::ZERO;
        for [p, q, r] in [[pa, pb, pc], [pb, pc, pd], [pc, pd, pa], [pd, pa, pb]] {
            // The map is singular at a corner of 180°, so it is rejected like a reflex one.
            if (q - p).perp_dot(r - q) <= 1e-7 * size * size {
                return Err(QuadFault::NotConvex);
            }
        }
        Ok(QuadMap {
            a_world: a,
            e1_world: e1.as_vec3(),
            e2_world: e2.as_vec3(),
            n_world: n.as_vec3(),
            e: pb.as_vec2(),
            f: pd.as_vec2(),
            g: (pc - pb - pd).as_vec2(),
        })
    }

    /// Returns the point of the plane at (u, v), metres from A.
    pub fn point(&self, u: f32, v: f32) -> Vec2 {
        self.e * u + self.f * v + self.g * (u * v)
    }

    /// Returns the point at (u, v) in the world, metres.
    pub fn point_world(&self, u: f32, v: f32) -> Vec3 {
        let p = self.point(u, v);
        self.a_world + self.e1_world * p.x + self.e2_world * p.y
    }

    /// Inverse bilinear map of a point `hh` = X − A of the plane. Returns the unclamped (u, v) and the root
    /// s, which equals det ∂X/∂(u,v). Solves the robust form of the quadratic, method §3.
    pub fn uv_and_det(&self, hh: Vec2) -> (Vec2, f32) {
        let k2 = cross(self.g, self.f);
        let k1 = cross(self.e, self.f) + cross(hh, self.g);
        let k0 = cross(hh, self.e);
        let s = (k1 * k1 - 4.0 * k0 * k2).max(0.0).sqrt();
        let v = if k1 >= 0.0 { -2.0 * k0 / (k1 + s) } else { (s - k1) / (2.0 * k2) };
        let along = self.e + self.g * v;
        let u = (hh - self.f * v).dot(along) / along.dot(along);
        (Vec2::new(u, v), s)
    }

    /// Inverse bilinear map, clamped to the quad: a fragment's centre may lie a rounding error
    /// outside the edge that covered it.
    pub fn uv(&self, hh: Vec2) -> Vec2 {
        self.uv_and_det(hh).0.clamp(Vec2::ZERO, Vec2::ONE)
    }
}

/// Repetition and depth of the volume on a quad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Depth H of one volume, metres.
    pub thickness_m: f32,
    /// Copies along u.
    pub repeat_u: f32,
    /// Copies along v.
    pub repeat_v: f32,
}

/// Jacobian world_from_cell at one point of a quad, in the axes of its plane: e1, e2 and the normal on the
/// visible side. Its columns are (cx, 0), (cy, 0) and (0, 0, −depth). It is block-diagonal, so its inverse
/// needs only a 2×2 inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellFrame {
    /// Metres of the plane per cell in x.
    pub cx: Vec2,
    /// Metres of the plane per cell in y.
    pub cy: Vec2,
    /// Metres into the surface per cell in z: H / nz.
    pub depth: f32,
    /// cross(cx, cy), m² per cell².
    pub det: f32,
}

impl CellFrame {
    /// Returns the Jacobian at the quad's coordinates (u, v), for a volume of `size` cells.
    pub fn new(quad: &QuadMap, material: &Material, size: [u32; 3], uv: Vec2) -> Self {
        let cx = (quad.e + quad.g * uv.y) / (material.repeat_u * size[0] as f32);
        let cy = (quad.f + quad.g * uv.x) / (material.repeat_v * size[1] as f32);
        CellFrame { cx, cy, depth: material.thickness_m / size[2] as f32, det: cross(cx, cy) }
    }

    /// d_cell = world_from_cell⁻¹ d, for d in the plane's axes with z along the visible
    /// side's normal.
    pub fn cell_from_plane(&self, d: Vec3) -> Vec3 {
        let d2 = d.truncate();
        Vec3::new(cross(d2, self.cy) / self.det, cross(self.cx, d2) / self.det, -d.z / self.depth)
    }

    /// world_from_cellᵀ d, for d in the plane's frame: the vector whose dot product with a cell
    /// direction v is (J v)·d.
    pub fn transposed(&self, d: Vec3) -> Vec3 {
        let d2 = d.truncate();
        Vec3::new(self.cx.dot(d2), self.cy.dot(d2), -self.depth * d.z)
    }
}
