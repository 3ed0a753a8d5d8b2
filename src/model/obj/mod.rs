//! OBJ: vertices and polygons in lines of text, with the materials of MTL.
//!
//! Quads stay quads where they are convex; other polygons are cut into triangles. Every `o` is a mesh and a
//! node; in a file without `o` every `g` is.

mod lines;
mod mtl;
mod parts;

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DVec3};

use super::budget::Budget;
use super::faces::{Cutter, MOST_CORNERS, is_convex};
use super::{Face, File, Model, ModelMaterial, ModelMesh, ModelNode, Pose};
use crate::util::colour::Curve;
use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use lines::{Counts, Lines, numbers};
use parts::{Corner, MISSING, Part, Vertices};

/// Bytes between two reports of progress. The largest polygons take 2 s for so many on one core.
const STEP: usize = 1 << 20;

/// Reads an OBJ file whose bytes are already counted.
pub(super) fn read(file: &File, bytes: &[u8], budget: &mut Budget, monitor: &dyn Monitor) -> Result<Model> {
    let counts = Counts::of(bytes);
    budget.take(counts.bytes(), || format!("the geometry of {}", file.path.display()))?;
    if counts.positions == 0 {
        return Err(file.fault("the file", "there is no vertex (a line that begins with v)"));
    }
    let mut reader = Reader::new(file, &counts);
    let mut lines = Lines::new(bytes);
    let mut next = 0;
    while let Some((line, text)) = lines.next() {
        if lines.done() >= next {
            monitor.progress("mesh", lines.done() as u64, bytes.len() as u64)?;
            next = lines.done() + STEP;
        }
        reader.line(line, &text, budget)?;
    }
    Ok(reader.finish())
}

struct Reader<'a> {
    file: &'a File<'a>,
    model: Model,
    vertices: Vertices,
    parts: Vec<Part>,
    /// Material of the next faces.
    material: Option<usize>,
    materials: HashMap<String, usize>,
    libraries: HashSet<String>,
    /// Images by the path that names them.
    images: HashMap<String, usize>,
    /// The keyword that begins a mesh: `o`, or `g` in a file without `o`.
    begins: &'static str,
    cutter: Cutter,
    /// Points, lines and faces of fewer than three corners.
    thin: u64,
    without_area: u64,
    free_form: bool,
}

impl<'a> Reader<'a> {
    fn new(file: &'a File, counts: &Counts) -> Reader<'a> {
        Reader {
            file,
            model: Model::default(),
            vertices: Vertices::with_capacity(counts),
            parts: Vec::new(),
            material: None,
            materials: HashMap::new(),
            libraries: HashSet::new(),
            images: HashMap::new(),
            begins: if counts.objects > 0 { "o" } else { "g" },
            cutter: Cutter::new(),
            thin: 0,
            without_area: 0,
            free_form: false,
        }
    }

    fn line(&mut self, line: usize, text: &str, budget: &mut Budget) -> Result<()> {
        let (keyword, rest) = text.split_once([' ', '\t']).unwrap_or((text, ""));
        let rest = rest.trim();
        match keyword {
            "v" => self.position(line, rest)?,
            "vt" => {
                let [u, v, ..] = self.numbers::<3>(line, "vt", rest, 1)?;
                self.vertices.uvs.push([u as f32, 1.0 - v as f32]);
            }
            "vn" => {
                let normal = self.numbers::<3>(line, "vn", rest, 3)?;
                self.vertices.normals.push(normal.map(|x| x as f32));
            }
            "f" => self.face(line, rest)?,
            "l" | "p" => self.thin += 1,
            "curv" | "curv2" | "surf" => self.free_form = true,
            "usemtl" => self.material = (!rest.is_empty()).then(|| self.material_named(rest)),
            "mtllib" => self.library(rest, budget)?,
            _ if keyword == self.begins => self.begin(rest),
            _ => {}
        }
        Ok(())
    }

    fn place(&self, line: usize) -> String {
        format!("line {line}")
    }

    fn fault(&self, line: usize, why: impl std::fmt::Display) -> Error {
        self.file.fault(&self.place(line), why)
    }

    /// Reads up to `N` numbers, at least `least`. Those that are missing are 0.
    fn numbers<const N: usize>(&self, line: usize, key: &str, text: &str, least: usize) -> Result<[f64; N]> {
        let (values, found) = numbers(text).map_err(|word| {
            self.fault(line, format!("{key}: {:?} is no finite number", super::paths::shorten(word)))
        })?;
        if found < least {
            return Err(self.fault(line, format!("{key}: {found} numbers, {least} are needed")));
        }
        Ok(values)
    }

    fn position(&mut self, line: usize, text: &str) -> Result<()> {
        let count = text.split_ascii_whitespace().take(7).count();
        let [x, y, z, r, g, b] = self.numbers::<6>(line, "v", text, 3)?;
        if count >= 6 {
            let missing = self.vertices.positions.len();
            let colors = self.vertices.colors.get_or_insert_default();
            colors.resize(missing, [1.0; 4]);
            let [r, g, b] = [r, g, b].map(|c| Curve::Srgb.decode(c.clamp(0.0, 1.0) as f32));
            colors.push([r, g, b, 1.0]);
        }
        self.vertices.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    /// Resolves one index of a corner. Indices count from 1, negative ones from the end.
    fn resolve(&self, line: usize, word: &str, count: usize, list: &str) -> Result<u32> {
        let index: i64 = word
            .parse()
            .map_err(|_| self.fault(line, format!("f: {:?} is no index", super::paths::shorten(word))))?;
        let from_start = if index < 0 { count as i64 + index } else { index - 1 };
        match u32::try_from(from_start) {
            Ok(found) if (found as usize) < count => Ok(found),
            _ => Err(self.fault(line, format!("f: index {index}, there are {count} lines of {list} so far"))),
        }
    }

    fn corner(&self, line: usize, word: &str) -> Result<Corner> {
        let mut parts = word.split('/');
        let mut next = |count: usize, list: &str| match parts.next().unwrap_or("") {
            "" => Ok(MISSING),
            word => self.resolve(line, word, count, list),
        };
        let corner = [
            next(self.vertices.positions.len(), "v")?,
            next(self.vertices.uvs.len(), "vt")?,
            next(self.vertices.normals.len(), "vn")?,
        ];
        if corner[0] == MISSING || parts.next().is_some() {
            return Err(self.fault(line, format!("f: {:?} is no corner", super::paths::shorten(word))));
        }
        Ok(corner)
    }

    fn face(&mut self, line: usize, text: &str) -> Result<()> {
        let words = text.split_ascii_whitespace();
        let corners = words.map(|word| self.corner(line, word)).collect::<Result<Vec<Corner>>>()?;
        if corners.len() < 3 {
            self.thin += 1;
            return Ok(());
        }
        let points: Vec<DVec3> = corners.iter().map(|c| self.vertices.positions[c[0] as usize]).collect();
        let quad = points.first_chunk::<4>().filter(|_| points.len() == 4);
        let faces: Vec<Face> = if quad.is_some_and(|quad| is_convex(*quad)) {
            vec![Face::Quad([0, 1, 2, 3])]
        } else if points.len() == 3 {
            vec![Face::Triangle([0, 1, 2])]
        } else {
            let Some(cut) = self.cutter.cut(&points) else {
                return Err(self.file.fault_with(
                    &self.place(line),
                    format!("f: a concave polygon of {} corners, {MOST_CORNERS} at most", points.len()),
                    "cut the polygons into triangles on export",
                ));
            };
            self.without_area += u64::from(cut.is_empty());
            cut.into_iter().map(Face::Triangle).collect()
        };
        if self.parts.is_empty() {
            self.begin("");
        }
        if let Some(part) = self.parts.last_mut() {
            part.add(self.material, &corners, &faces);
        }
        Ok(())
    }

    fn begin(&mut self, name: &str) {
        match self.parts.last_mut() {
            Some(part) if part.is_empty() => part.name = name.to_owned(),
            last => {
                if let Some(part) = last {
                    part.close();
                }
                self.parts.push(Part::new(name));
            }
        }
    }

    /// Returns the index of a material. One that no library defines has its name and no more.
    fn material_named(&mut self, name: &str) -> usize {
        let next = self.model.materials.len();
        let index = *self.materials.entry(name.to_owned()).or_insert(next);
        if index == next {
            self.model.materials.push(ModelMaterial { name: name.into(), ..mtl::plain() });
        }
        index
    }

    fn finish(mut self) -> Model {
        let note = |model: &mut Model, count: u64, what: &str| {
            if count > 0 {
                model.note(format!("{count} {what}"));
            }
        };
        note(&mut self.model, self.thin, "points or lines are left out");
        if self.free_form {
            self.model.note("curves and surfaces of free form are left out".into());
        }
        self.model.degenerate += self.without_area;
        let origin = self.vertices.origin();
        let mut bare = 0;
        for part in self.parts {
            if part.is_empty() {
                continue;
            }
            let name = part.name.clone();
            let primitives = part.finish(&self.vertices, origin, &mut self.model.degenerate, &mut bare);
            let mesh = self.model.meshes.len();
            self.model.meshes.push(ModelMesh { name: name.clone(), primitives });
            let world = DAffine3::from_translation(origin);
            let local =
                Pose::Parts { translation: origin, rotation: glam::DQuat::IDENTITY, scale: DVec3::ONE };
            let node = ModelNode {
                name,
                local,
                world,
                mesh: Some(mesh),
                instances: vec![world],
                ..ModelNode::default()
            };
            self.model.nodes.push(node);
        }
        note(
            &mut self.model,
            bare,
            "corners have no texture coordinates where others of their part have: (0, 0)",
        );
        self.model
    }
}
