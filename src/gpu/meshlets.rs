//! §3 The opaque mesh in small parts: those out of view are not drawn, the nearest are drawn first.
//!
//! A part's vertices lie together. Software Vulkan shades vertices for 1023 indices at a time and knows in them the
//! last vertex of each of 256 places: in the rows of a height field every vertex is shaded four times or more, in
//! such parts once.

use std::ops::Range;

use glam::{DVec3, DVec4, Mat4, Vec3};

use super::layout::OpaqueVertex;
use crate::scene::Mesh;

/// Triangles of a part: 1023 indices.
const TRIANGLES: usize = 341;

/// A mesh in parts. What its triangles are, and each triangle's first corner, are the mesh's own.
pub struct Meshlets {
    /// The parts' vertices, one part after the other.
    pub vertices: Vec<OpaqueVertex>,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
    /// Rock.
    pub rock: Vec<Meshlet>,
    /// The indices of each pool, in order.
    pub pools: Vec<Range<u32>>,
}

/// A part: its indices, and the box it lies in.
#[derive(Clone)]
pub struct Meshlet {
    indices: Range<u32>,
    low: DVec3,
    high: DVec3,
}

impl Meshlets {
    /// Cuts a mesh, whose pools follow its rock.
    pub fn new(mesh: &Mesh) -> Meshlets {
        let mut out =
            Meshlets { vertices: Vec::new(), indices: Vec::new(), rock: Vec::new(), pools: Vec::new() };
        out.indices.reserve(mesh.indices.len());
        // The part that last used a vertex, and its number there.
        let mut last_use = vec![(u32::MAX, 0u32); mesh.vertices.len()];
        let of_pool = |triangle: &[u32; 3]| mesh.vertices[triangle[0] as usize].pool;
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let mut part = 0;
        for run in triangles.chunk_by(|a, b| of_pool(a) == of_pool(b)) {
            let first = out.indices.len() as u32;
            for triangles in run.chunks(TRIANGLES) {
                let begin = (out.indices.len() as u32, out.vertices.len());
                for &old in triangles.as_flattened() {
                    let (user, number) = &mut last_use[old as usize];
                    if *user != part {
                        (*user, *number) = (part, out.vertices.len() as u32);
                        out.vertices.push((&mesh.vertices[old as usize]).into());
                    }
                    out.indices.push(*number);
                }
                part += 1;
                if of_pool(&run[0]) == 0 {
                    let own = out.vertices[begin.1..].iter().map(|v| Vec3::from(v.position_world).as_dvec3());
                    let (low, high) = own.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                        (low.min(p), high.max(p))
                    });
                    out.rock.push(Meshlet { indices: begin.0..out.indices.len() as u32, low, high });
                }
            }
            if of_pool(&run[0]) > 0 {
                out.pools.push(first..out.indices.len() as u32);
            }
        }
        out
    }
}

/// The indices of the parts that may be seen in a window, the nearest to the eye first.
pub fn in_view(parts: &[Meshlet], clip_from_world: Mat4, eye: DVec3) -> Vec<Range<u32>> {
    let mut seen: Vec<(f64, &Meshlet)> = parts
        .iter()
        .filter(|part| part.may_be_seen(clip_from_world))
        .map(|part| (eye.distance_squared(eye.clamp(part.low, part.high)), part))
        .collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.into_iter().map(|(_, part)| part.indices.clone()).collect()
}

impl Meshlet {
    /// Whether its box reaches into the view, or the rounding of a device might see it there.
    fn may_be_seen(&self, clip_from_world: Mat4) -> bool {
        let [x, y, _, w] = [0, 1, 2, 3].map(|i| clip_from_world.row(i).as_dvec4());
        let near = f64::from(clip_from_world.w_axis.z);
        let far_corner = self.low.abs().max(self.high.abs()).extend(1.0);
        // A sum of four products is off by less than this share of what their sizes add up to.
        const ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
        // In view where all of them are positive.
        let planes = [w + x, w - x, w + y, w - y, w - DVec4::W * near];
        planes.iter().all(|plane| {
            // Its corner farthest on the plane's inner side.
            let normal = plane.truncate();
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), self.high, self.low);
            let room = ROUNDING * (x.abs() + y.abs() + w.abs()).dot(far_corner);
            plane.dot(corner.extend(1.0)) >= -room
        })
    }
}
