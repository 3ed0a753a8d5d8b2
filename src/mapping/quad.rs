//! §3 Quads of the surface that carry the volume.

use glam::{Vec2, Vec3};

use super::{Material, QuadFault, QuadMap, Tear};

/// Quad with its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corners of what is drawn, in the world, metres: A, B, C, D. A triangle repeats its last corner.
    pub corners: [Vec3; 4],
    /// Map of the quad in its plane. That of a triangle is the map of a parallelogram around it.
    pub map: QuadMap,
    /// Layout of the volume's copies on the quad.
    pub material: Material,
    /// Texture position of corner A, in copies of the volume along u and v.
    pub offset: Vec2,
    /// Erosion e at A, B, C and D, bilinear between them. It leaves max(ρ − e, 0) of the density ρ.
    pub erosion: [f32; 4],
    /// Erosion at A, B, C and D without that between surges, which changes with time.
    pub worn: [f32; 4],
    /// Holes in the water.
    pub tear: Tear,
    /// Ψ of mist, which replaces that of the cells. With 0 the quad is not mist.
    pub mist: f32,
}

impl Quad {
    /// Quad that begins at the texture's origin and has no erosion, no holes and no mist. `corners` are in
    /// the world, metres.
    ///
    /// # Errors
    /// Returns the [`QuadFault`] of corners that cannot be mapped.
    pub fn new(corners: [Vec3; 4], material: Material) -> std::result::Result<Quad, QuadFault> {
        let map = QuadMap::new(corners)?;
        Ok(Quad {
            corners,
            map,
            material,
            offset: Vec2::ZERO,
            erosion: [0.0; 4],
            worn: [0.0; 4],
            tear: Tear::default(),
            mist: 0.0,
        })
    }

    /// Triangle of a mesh, whose corners (world, metres) have the texture coordinates `uv`, in copies of the
    /// volume. Its map is that of the parallelogram whose coordinates are the bounding box of `uv`; only the
    /// triangle of it is drawn.
    ///
    /// # Errors
    /// [`QuadFault::Degenerate`] where the triangle has no area in the world or in the texture.
    pub fn triangle(
        corners: [Vec3; 3],
        uv: [Vec2; 3],
        material: Material,
    ) -> std::result::Result<Quad, QuadFault> {
        let [a, b, c] = corners;
        let [low, high] = [Vec2::min, Vec2::max].map(|f| f(uv[0], f(uv[1], uv[2])).as_dvec2());
        let [ab, ac] = [b, c].map(|p| p.as_dvec3() - a.as_dvec3());
        let uv = uv.map(|uv| uv.as_dvec2());
        let [uv_b, uv_c] = [uv[1] - uv[0], uv[2] - uv[0]];
        let (det, size) = (uv_b.perp_dot(uv_c), high - low);
        if det.abs() <= 1e-6 * size.x * size.y {
            return Err(QuadFault::Degenerate);
        }
        // Metres per copy along u and along v.
        let along_u = (ab * uv_c.y - ac * uv_b.y) / det;
        let along_v = (ac * uv_b.x - ab * uv_c.x) / det;
        let first = a.as_dvec3() + along_u * (low.x - uv[0].x) + along_v * (low.y - uv[0].y);
        let map = QuadMap::parallelogram(first.as_vec3(), along_u * size.x, along_v * size.y)?;
        let material = Material { repeat_u: size.x as f32, repeat_v: size.y as f32, ..material };
        // Whole copies are left out: they would cost digits.
        let offset = (low - low.floor()).as_vec2();
        Ok(Quad {
            corners: [a, b, c, c],
            map,
            material,
            offset,
            erosion: [0.0; 4],
            worn: [0.0; 4],
            tear: Tear::default(),
            mist: 0.0,
        })
    }

    /// Whether holes are torn into the quad.
    pub fn is_torn(&self) -> bool {
        self.tear.open != [0.0; 2]
    }

    /// Whether the quad shows less than the volume's own matter, or mist in its place.
    pub fn changes_matter(&self) -> bool {
        self.mist > 0.0 || self.erosion != [0.0; 4] || self.is_torn()
    }

    /// Whether a triangle is drawn.
    pub fn is_triangle(&self) -> bool {
        self.corners[2] == self.corners[3]
    }
}
