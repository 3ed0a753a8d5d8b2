//! Meshes of an OBJ file: corners become vertices, once for each combination of position, coordinates and
//! normal.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::super::faces::is_degenerate;
use super::super::{Face, Primitive};
use super::lines::Counts;
use crate::util::unit::unit;

/// Indices of the position, the texture coordinates and the normal of a corner.
pub type Corner = [u32; 3];

/// Index of what a corner does not have.
pub const MISSING: u32 = u32::MAX;

/// Lists that the corners name.
pub struct Vertices {
    pub positions: Vec<DVec3>,
    /// Linear colours; those of later positions may be missing, and are white.
    pub colors: Option<Vec<[f32; 4]>>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f32; 3]>,
}

/// The distance of the origin from a model's centre, in diagonals of the model's box, beyond which the model
/// is moved to the origin. At 16, float32 keeps the diagonal to 1/500,000; maps in metres lie at 1000 and
/// more.
const FAR: f64 = 16.0;

impl Vertices {
    pub fn with_capacity(counts: &Counts) -> Vertices {
        Vertices {
            positions: Vec::with_capacity(counts.positions),
            colors: None,
            uvs: Vec::with_capacity(counts.uvs),
            normals: Vec::with_capacity(counts.normals),
        }
    }

    /// Returns the point that becomes the origin of the meshes: whole metres near the centre where that lies
    /// far away, else zero.
    pub fn origin(&self) -> DVec3 {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in &self.positions {
            (low, high) = (low.min(*p), high.max(*p));
        }
        let centre = (low + high) / 2.0;
        let is_far = centre.is_finite() && centre.length() > FAR * (high - low).length();
        if is_far && self.positions.len() > 1 { centre.round() } else { DVec3::ZERO }
    }
}

/// A mesh that is read.
pub struct Part {
    pub name: String,
    builders: Vec<Builder>,
    /// Builder of each material.
    by_material: HashMap<Option<usize>, usize>,
}

/// A primitive that is read: the faces with one material.
struct Builder {
    material: Option<usize>,
    numbers: HashMap<Corner, u32>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
}

impl Part {
    pub fn new(name: &str) -> Part {
        Part { name: name.into(), builders: Vec::new(), by_material: HashMap::new() }
    }

    pub fn is_empty(&self) -> bool {
        self.builders.is_empty()
    }

    /// Adds faces, given as indices of `corners`.
    pub fn add(&mut self, material: Option<usize>, corners: &[Corner], faces: &[Face]) {
        if faces.is_empty() {
            return;
        }
        let at = *self.by_material.entry(material).or_insert(self.builders.len());
        if at == self.builders.len() {
            let (numbers, corners, faces) = (HashMap::new(), Vec::new(), Vec::new());
            self.builders.push(Builder { material, numbers, corners, faces });
        }
        let builder = &mut self.builders[at];
        for face in faces {
            let mut vertex = |i: u32| builder.vertex(corners[i as usize]);
            let face = match *face {
                Face::Triangle(face) => Face::Triangle(face.map(&mut vertex)),
                Face::Quad(face) => Face::Quad(face.map(&mut vertex)),
            };
            builder.faces.push(face);
        }
    }

    /// Frees what only further faces would need.
    pub fn close(&mut self) {
        for builder in &mut self.builders {
            builder.numbers = HashMap::new();
        }
        self.by_material = HashMap::new();
    }

    pub fn finish(
        self,
        vertices: &Vertices,
        origin: DVec3,
        degenerate: &mut u64,
        bare: &mut u64,
    ) -> Vec<Primitive> {
        self.builders.into_iter().map(|builder| builder.finish(vertices, origin, degenerate, bare)).collect()
    }
}

impl Builder {
    fn vertex(&mut self, corner: Corner) -> u32 {
        let next = self.corners.len() as u32;
        let number = *self.numbers.entry(corner).or_insert(next);
        if number == next {
            self.corners.push(corner);
        }
        number
    }

    fn finish(self, vertices: &Vertices, origin: DVec3, degenerate: &mut u64, bare: &mut u64) -> Primitive {
        let Builder { material, numbers, corners, faces } = self;
        drop(numbers);
        let mut out = Primitive { material, ..Primitive::default() };
        let position =
            |corner: &Corner| (vertices.positions[corner[0] as usize] - origin).as_vec3().to_array();
        out.positions = corners.iter().map(position).collect();
        let without = corners.iter().filter(|corner| corner[1] == MISSING).count();
        if without < corners.len() {
            *bare += without as u64;
            let uv = |corner: &Corner| vertices.uvs.get(corner[1] as usize).copied().unwrap_or_default();
            out.uvs.push(corners.iter().map(uv).collect());
        }
        let normal = |corner: &Corner| {
            let normal = vertices.normals.get(corner[2] as usize)?;
            unit(Vec3::from(*normal)).map(|unit| unit.to_array())
        };
        out.normals = corners.iter().map(normal).collect();
        out.colors = vertices.colors.as_ref().map(|colors| {
            let color = |corner: &Corner| colors.get(corner[0] as usize).copied().unwrap_or([1.0; 4]);
            corners.iter().map(color).collect()
        });
        let mut quads = Vec::new();
        let has_quads = faces.iter().any(|face| matches!(face, Face::Quad(_)));
        for face in faces {
            let (halves, count) = match face {
                Face::Triangle(t) => ([t, t], 1),
                Face::Quad([a, b, c, d]) => ([[a, b, c], [a, c, d]], 2),
            };
            let first = out.triangles.len();
            let has_area = |t: &&[u32; 3]| !is_degenerate(t.map(|i| out.positions[i as usize]));
            out.triangles.extend(halves[..count].iter().filter(has_area));
            let kept = out.triangles.len() - first;
            *degenerate += (count - kept) as u64;
            if kept == 2 {
                quads.push(first as u32);
            }
        }
        out.quads = has_quads.then_some(quads);
        out
    }
}
