//! §3 The one-to-one map between a convex quad in the world and the face z = 0 of the volume.
//!
//! A quad A(0,0) B(1,0) C(1,1) D(0,1) is handled in its own plane, with the axes e1 (along AB), e2 (such that
//! A, B, C, D run counter-clockwise) and n = e1 × e2. Lengths are metres.
//!
//! [`QuadMap::uv`] inverts the map: from a point of the plane to (u, v). `quad.rs` adds a material to a quad;
//! `sheet.rs` and `splash.rs` cut falling water into quads.
//!
//! [`PlaneView`] finds the point of the plane under a pixel.
//!
//! Twins in `shaders/mapping.wgsl`: `CellFrame`, `plane_hit`, and `quad_hit`, which inverts the map at the
//! point under a pixel. On the CPU `map_quad` in `src/engine/cpu/gbuffer.rs` does so.

mod quad;
mod sheet;
pub mod shell;
mod splash;
mod surge;
mod tears;
mod view;

use glam::{DVec3, Vec2, Vec3};

pub use quad::Quad;
pub use sheet::{Ends, GRAVITY, Sheet, SheetFault, Station};
pub use splash::Splash;
pub use surge::Surges;
pub use tears::{Tear, Tears};
pub use view::{FARTHEST, PlaneView};

/// Cross product of two vectors in a plane: its component along the normal.
#[inline]
pub fn cross(a: Vec2, b: Vec2) -> f32 {
    a.x * b.y - a.y * b.x
}

/// Reason why a quad cannot be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuadFault {
    /// Two corners coincide, or the area is almost zero.
    Degenerate,
    /// The corners do not lie in one plane.
    NotPlanar,
    /// The corners form a concave or self-crossing polygon.
    NotConvex,
}

impl QuadFault {
    /// Words for the fault that continue the sentence "the quad …".
    pub fn words(self) -> &'static str {
        match self {
            QuadFault::Degenerate => "has no area: corners coincide or nearly so, or edges cross",
            QuadFault::NotPlanar => "is not planar",
            QuadFault::NotConvex => "is not convex (concave or self-crossing)",
        }
    }
}

/// Convex planar quad in its own plane, prepared for the inverse map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadMap {
    /// Corner A in the world, metres. It is the origin of the plane.
    pub a_world: Vec3,
    /// Unit axis e1 of the plane in the world.
    pub e1_world: Vec3,
    /// Unit axis e2 of the plane in the world.
    pub e2_world: Vec3,
    /// Unit normal e1 × e2 in the world.
    pub n_world: Vec3,
    /// E = B − A in the plane, metres.
    pub e: Vec2,
    /// F = D − A in the plane, metres.
    pub f: Vec2,
    /// G = A − B + C − D in the plane, metres.
    pub g: Vec2,
}

impl QuadMap {
    /// Checks the corners A, B, C, D (world, metres) and prepares the map. Corners may lie off the plane
    /// through A by 1e-4 of the longer diagonal; they are projected onto it.
    ///
    /// # Errors
    /// Returns the first [`QuadFault`] of the corners.
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
            // A corner of 180° is refused like a reflex one, because the map is singular there.
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

    /// Map of a parallelogram with the corner A (world, metres) and the edges AB and AD (metres). It is
    /// exactly affine.
    ///
    /// # Errors
    /// [`QuadFault::Degenerate`] for edges that span no area.
    pub fn parallelogram(a: Vec3, ab: DVec3, ad: DVec3) -> Result<Self, QuadFault> {
        let normal = ab.cross(ad);
        if !normal.is_finite() || normal.length() <= 1e-7 * ab.length().max(ad.length()).powi(2) {
            return Err(QuadFault::Degenerate);
        }
        let (n, e1) = (normal.normalize(), ab.normalize());
        let e2 = n.cross(e1);
        Ok(QuadMap {
            a_world: a,
            e1_world: e1.as_vec3(),
            e2_world: e2.as_vec3(),
            n_world: n.as_vec3(),
            e: Vec2::new(ab.length() as f32, 0.0),
            f: Vec2::new(ad.dot(e1) as f32, ad.dot(e2) as f32),
            g: Vec2::ZERO,
        })
    }

    /// Point at (u, v) in the plane, metres from A.
    #[inline]
    pub fn point(&self, u: f32, v: f32) -> Vec2 {
        self.e * u + self.f * v + self.g * (u * v)
    }

    /// Point at (u, v) in the world, metres.
    #[inline]
    pub fn point_world(&self, u: f32, v: f32) -> Vec3 {
        let p = self.point(u, v);
        self.a_world + self.e1_world * p.x + self.e2_world * p.y
    }

    /// Inverse bilinear map of the point `hh` = X − A of the plane (§3). Returns (u, v), not clamped, and the
    /// root s of the discriminant, which equals det ∂X/∂(u,v). The quadratic is solved in the form that does
    /// not cancel.
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

    /// Whether the quad is a parallelogram but for rounding, so that the map is affine.
    pub fn is_parallelogram(&self) -> bool {
        self.g.length() <= 1e-6 * (self.e.length() + self.f.length())
    }

    /// Inverse bilinear map, clamped to the quad. The centre of a fragment that the quad covers may lie
    /// outside its edge by a rounding error.
    pub fn uv(&self, hh: Vec2) -> Vec2 {
        self.uv_and_det(hh).0.clamp(Vec2::ZERO, Vec2::ONE)
    }
}

/// Layout of the volume's copies on the quads of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Depth H of one volume, metres.
    pub thickness_m: f32,
    /// Number of copies along u.
    pub repeat_u: f32,
    /// Number of copies along v.
    pub repeat_v: f32,
    /// Number of the volume among those of the scene.
    pub volume: u32,
    /// Billows of mist.
    pub billow: Billow,
}

/// Noise that thins and thickens mist and rises through it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Billow {
    /// Strength, 0 to 1; 0: even mist.
    pub strength: f32,
    /// Reciprocal of the billows' size, 1/m.
    pub inverse_size: f32,
    /// Distance that they rise while the volume moves by its own length, metres.
    pub rise: f32,
}

/// Jacobian J = world_from_cell at one point of a quad, in the axes e1, e2 and seen normal of the quad's
/// plane. Its columns are (cx, 0), (cy, 0) and (0, 0, −depth). It is block-diagonal, so only a 2×2 block is
/// inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellFrame {
    /// Metres of the plane per cell in x.
    pub cx: Vec2,
    /// Metres of the plane per cell in y.
    pub cy: Vec2,
    /// Metres into the surface per cell in z, H / nz.
    pub depth: f32,
    /// cross(cx, cy), m² per cell².
    pub det: f32,
}

impl CellFrame {
    /// Jacobian at the texture coordinates (u, v), for a volume of `size` cells.
    #[inline]
    pub fn new(quad: &QuadMap, material: &Material, size: [u32; 3], uv: Vec2) -> Self {
        let cx = (quad.e + quad.g * uv.y) / (material.repeat_u * size[0] as f32);
        let cy = (quad.f + quad.g * uv.x) / (material.repeat_v * size[1] as f32);
        CellFrame { cx, cy, depth: material.thickness_m / size[2] as f32, det: cross(cx, cy) }
    }

    /// d_cell = J⁻¹·d, where d is given in the plane's axes e1, e2 and seen normal.
    #[inline]
    pub fn cell_from_plane(&self, d: Vec3) -> Vec3 {
        let d2 = d.truncate();
        Vec3::new(cross(d2, self.cy) / self.det, cross(self.cx, d2) / self.det, -d.z / self.depth)
    }

    /// Jᵀ·d, where d is given in the plane's axes. The dot product of this vector with a direction v in cells
    /// is (J·v)·d.
    #[inline]
    pub fn transposed(&self, d: Vec3) -> Vec3 {
        let d2 = d.truncate();
        Vec3::new(self.cx.dot(d2), self.cy.dot(d2), -self.depth * d.z)
    }
}
