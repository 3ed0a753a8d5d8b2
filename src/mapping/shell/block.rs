//! Boxes: shells that a volume fills once, without a mesh under them.
//!
//! The box is a parallelepiped. Its face z = 0 is the outer surface of a shell of even squares, and all that
//! walks shells walks it too. An eye may stand inside: then it sees no face of the hull from outside, and
//! rays begin at the eye, in the tetrahedron that holds it.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec2, Vec3};

use super::{HullFace, Shell, ShellFault};

/// Smallest share of a tetrahedron's corners in the place of an eye. On an edge, lines to half of all sides
/// would miss the tetrahedron, so the eye is moved inside by this much.
const LEAST_SHARE: f64 = 1e-5;

/// The place of a point inside a shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside {
    /// Prism, and number of the tetrahedron in it.
    pub tetrahedron: [usize; 2],
    /// The point, moved inside the tetrahedron if it is on its border, metres.
    pub point: Vec3,
}

impl Shell {
    /// Builds the shell that fills a box. `corner` is that of the cell 0, 0, 0, and `axes` lead from there
    /// along x, y and z to the other ends of the volume, metres. The face z = 0 is cut into `squares` along x
    /// and y, so that V may be kept at their corners.
    ///
    /// # Errors
    /// [`ShellFault::NotFinite`] where a point is not finite, [`ShellFault::Empty`] where the box is flat,
    /// and [`ShellFault::TooLarge`] for too many squares.
    pub fn block(corner: DVec3, axes: [DVec3; 3], squares: [u32; 2]) -> Result<Shell, ShellFault> {
        let [x, y, z] = axes;
        let volume = DMat3::from_cols(x, y, z).determinant();
        if !corner.is_finite() || !volume.is_finite() {
            return Err(ShellFault::NotFinite);
        }
        if volume.abs() <= 1e-9 * x.length() * y.length() * z.length() {
            return Err(ShellFault::Empty);
        }
        let [nu, nv] = squares.map(|n| n.max(1));
        if 2 * u64::from(nu) * u64::from(nv) > super::MAX_PRISMS as u64 {
            return Err(ShellFault::TooLarge);
        }
        let (mut points, mut uv) = (Vec::new(), Vec::new());
        for j in 0..=nv {
            for i in 0..=nu {
                let [u, v] = [f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv)];
                let outer = corner + x * u + y * v;
                points.extend([outer.as_vec3(), (outer + z).as_vec3()]);
                uv.push(Vec2::new(u as f32, v as f32));
            }
        }
        let mut triangles = Vec::with_capacity(2 * nu as usize * nv as usize);
        for j in 0..nv {
            for i in 0..nu {
                let at = |di: u32, dj: u32| (j + dj) * (nu + 1) + i + di;
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                // The outside of the face z = 0 is where z is negative.
                for [p, q, r] in [[a, b, c], [a, c, d]] {
                    let own = if volume < 0.0 { [p, q, r] } else { [p, r, q] };
                    triangles.push((own, own));
                }
            }
        }
        let mut shell = Shell::between(points, &triangles, &uv)?;
        shell.is_single = true;
        shell.hull.push(HullFace::EYE);
        Ok(shell)
    }

    /// Whether two shells are the same. Those of meshes are shared from scene to scene, and are not compared
    /// point by point; boxes are made anew.
    pub fn is_same(a: &Arc<Shell>, b: &Arc<Shell>) -> bool {
        Arc::ptr_eq(a, b) || (a.is_single && a == b)
    }

    /// The place of an eye inside a box, relative to the scene's origin as the box is. `None` for an eye
    /// outside, and for other shells.
    pub fn eye_inside(&self, eye: DVec3) -> Option<Inside> {
        if !self.is_single {
            return None;
        }
        let [low, high] = self.bounds().map(Vec3::as_dvec3);
        if eye.cmplt(low).any() || eye.cmpgt(high).any() {
            return None;
        }
        for prism in 0..self.prisms.len() {
            for tetrahedron in 0..3 {
                let corners = self.tetrahedron(prism, tetrahedron);
                let places = corners.map(|point| self.points[point as usize].as_dvec3());
                let [a, b, c, d] = places;
                let of = DMat3::from_cols(b - a, c - a, d - a).inverse() * (eye - a);
                let shares = [1.0 - of.x - of.y - of.z, of.x, of.y, of.z];
                if !shares.iter().all(|share| *share >= -1e-12) {
                    continue;
                }
                let shares = shares.map(|share| share.max(LEAST_SHARE));
                let sum: f64 = shares.iter().sum();
                let point: DVec3 = places.into_iter().zip(shares).map(|(p, share)| p * (share / sum)).sum();
                return Some(Inside { tetrahedron: [prism, tetrahedron], point: point.as_vec3() });
            }
        }
        None
    }
}
