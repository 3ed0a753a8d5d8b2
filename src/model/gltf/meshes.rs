//! Meshes: primitives of triangles, of which only the vertices that are used are read.

use super::super::budget::Budget;
use super::super::faces::is_degenerate;
use super::super::{Model, ModelMesh, Primitive};
use super::accessor::{Accessor, Component};
use super::{Gltf, compressed, json};
use crate::util::error::Result;
use crate::util::monitor::Monitor;

/// What a primitive will take, and where it is.
struct Plan<'a> {
    place: String,
    source: &'a json::Primitive,
    /// Vertices of the attributes' accessors.
    count: u64,
    /// Corners that the primitive lists.
    corners: u64,
}

/// Modes of drawing that make triangles.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

impl Gltf<'_> {
    /// Reads the meshes, after the memory that all of them take was counted.
    pub fn read_meshes(&self, model: &mut Model, budget: &mut Budget, monitor: &dyn Monitor) -> Result<()> {
        let mut plans = Vec::new();
        let mut largest = 0;
        let mut skipped = 0_u64;
        for (m, mesh) in self.document.meshes.iter().enumerate() {
            let mut planned = Vec::new();
            for (p, source) in mesh.primitives.iter().enumerate() {
                let place = format!("meshes[{m}].primitives[{p}]");
                match self.plan(place, source)? {
                    Some(plan) => {
                        let what = || format!("{}: {}", self.file.path.display(), plan.place);
                        budget.take(plan.kept_bytes(), what)?;
                        largest = largest.max(plan.passing_bytes());
                        planned.push(plan);
                    }
                    None => skipped += 1,
                }
            }
            plans.push(planned);
        }
        budget.take(largest, || format!("{}: the largest primitive", self.file.path.display()))?;
        if skipped > 0 {
            model.note(format!("{skipped} primitives of points or lines are left out"));
        }
        let total = plans.iter().map(|planned| planned.len() as u64).sum();
        let mut done = 0;
        for (mesh, planned) in self.document.meshes.iter().zip(plans) {
            let mut primitives = Vec::with_capacity(planned.len());
            for plan in planned {
                monitor.progress("mesh", done, total)?;
                primitives.push(self.primitive(&plan, model)?);
                done += 1;
            }
            model.meshes.push(ModelMesh { name: mesh.name.clone(), primitives });
        }
        self.note_what_is_ignored(model);
        Ok(())
    }

    fn note_what_is_ignored(&self, model: &mut Model) {
        let document = &self.document;
        if document.nodes.iter().any(|node| node.skin.is_some()) {
            model.note("skins are ignored: their meshes are shown as they were before rigging".into());
        }
        let moved = |weights: &[f64]| weights.iter().any(|weight| *weight != 0.0);
        let targets = |mesh: &json::Mesh| mesh.primitives.iter().any(|p| !p.targets.is_empty());
        if document.meshes.iter().any(|mesh| targets(mesh) && moved(&mesh.weights))
            || document.nodes.iter().any(|node| moved(&node.weights))
        {
            model.note("morph targets are ignored: meshes have their base shape".into());
        }
    }

    /// Finds out what a primitive takes. Returns `None` for points and lines.
    fn plan<'a>(&self, place: String, source: &'a json::Primitive) -> Result<Option<Plan<'a>>> {
        match source.mode.unwrap_or(TRIANGLES) {
            0..=3 => return Ok(None),
            TRIANGLES | STRIP | FAN => {}
            mode => return Err(self.fault(&format!("{place}.mode"), format!("{mode} is no mode of drawing"))),
        }
        let at = format!("{place}.attributes.POSITION");
        let Some(&position) = source.attributes.get("POSITION") else {
            return Err(self.fault(&at, "a primitive without positions"));
        };
        let count = self.shape(&at, position)?.count;
        let whole = &self.document.accessors[position];
        if source.extensions.draco.is_some() && whole.buffer_view.is_none() && whole.sparse.is_none() {
            return Err(compressed(self.file, &place, "KHR_draco_mesh_compression"));
        }
        let corners = match source.indices {
            Some(indices) => self.shape(&format!("{place}.indices"), indices)?.count,
            None => count,
        };
        if let Some(material) = source.material {
            self.index(&format!("{place}.material"), material, self.document.materials.len(), "materials")?;
        }
        Ok(Some(Plan { place, source, count, corners }))
    }

    fn primitive(&self, plan: &Plan, model: &mut Model) -> Result<Primitive> {
        let (place, attributes) = (&plan.place, &plan.source.attributes);
        let at = format!("{place}.attributes.POSITION");
        let position = self.attribute(&at, attributes["POSITION"], &[3])?;
        if position.component == Component::U32 {
            return Err(self.fault(&at, "positions are no integers of 32 bits"));
        }
        let mut triangles = self.triangles(plan, position.count)?;
        let used = compact(&mut triangles, position.count);
        let mut out = Primitive { material: plan.source.material, ..Primitive::default() };
        out.positions = self.gather(&at, &position, &used)?.into_iter().map(cut).collect();
        let before = triangles.len();
        triangles.retain(|t| {
            let distinct = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
            distinct && !is_degenerate(t.map(|i| out.positions[i as usize]))
        });
        model.degenerate += (before - triangles.len()) as u64;
        out.triangles = triangles;
        if let Some(&normal) = attributes.get("NORMAL") {
            let at = format!("{place}.attributes.NORMAL");
            let accessor = self.same_count(&at, normal, &[3], position.count)?;
            out.normals = self.normals(&at, &accessor, &used, model);
        }
        while let Some(&set) = attributes.get(&format!("TEXCOORD_{}", out.uvs.len())) {
            let at = format!("{place}.attributes.TEXCOORD_{}", out.uvs.len());
            let accessor = self.same_count(&at, set, &[2], position.count)?;
            out.uvs.push(self.gather(&at, &accessor, &used)?.into_iter().map(cut).collect());
        }
        if let Some(&color) = attributes.get("COLOR_0") {
            let at = format!("{place}.attributes.COLOR_0");
            let mut accessor = self.same_count(&at, color, &[3, 4], position.count)?;
            // Colours are never above 1 by integers.
            accessor.normalized = true;
            let mut colors = self.gather(&at, &accessor, &used)?;
            if accessor.width == 3 {
                colors.iter_mut().for_each(|color| color[3] = 1.0);
            }
            out.colors = Some(colors);
        }
        if attributes.contains_key("COLOR_1") {
            model.note(format!(
                "{place} has several sets of colours: COLOR_0 is used; in Blender, export the active ones"
            ));
        }
        Ok(out)
    }

    /// Opens an accessor whose elements have one of the given numbers of components.
    pub fn attribute(&self, at: &str, index: usize, widths: &[usize]) -> Result<Accessor<'_>> {
        let accessor = self.accessor(at, index)?;
        if widths.contains(&accessor.width) {
            return Ok(accessor);
        }
        let why = format!("accessor {index} has {} components, {widths:?} are needed", accessor.width);
        Err(self.fault(at, why))
    }

    fn same_count(&self, at: &str, index: usize, widths: &[usize], count: usize) -> Result<Accessor<'_>> {
        let accessor = self.attribute(at, index, widths)?;
        if accessor.count == count {
            return Ok(accessor);
        }
        Err(self.fault(at, format!("accessor {index} has {} elements, POSITION {count}", accessor.count)))
    }

    /// Reads the elements of the used vertices and checks that they are finite.
    fn gather(&self, at: &str, accessor: &Accessor, used: &[u32]) -> Result<Vec<[f32; 4]>> {
        let mut out = Vec::with_capacity(used.len());
        for &vertex in used {
            let value = accessor.floats(vertex as usize);
            if !value.iter().all(|x| x.is_finite()) {
                return Err(self.fault(at, format!("vertex {vertex} is not finite")));
            }
            out.push(value);
        }
        Ok(out)
    }

    /// Reads unit normals. Where one is not finite or has no length, all of the primitive are left out.
    fn normals(
        &self,
        at: &str,
        accessor: &Accessor,
        used: &[u32],
        model: &mut Model,
    ) -> Option<Vec<[f32; 3]>> {
        let mut out = Vec::with_capacity(used.len());
        for &vertex in used {
            let [x, y, z, _] = accessor.floats(vertex as usize);
            let finite = [x, y, z].iter().all(|x| x.is_finite());
            match crate::util::unit::unit(glam::Vec3::new(x, y, z)).filter(|_| finite) {
                Some(unit) => out.push(unit.to_array()),
                None => {
                    let why = "has no direction, so the primitive's normals are left out";
                    model.note(format!("{at}: the normal of vertex {vertex} {why}"));
                    return None;
                }
            }
        }
        Some(out)
    }

    /// Returns the triangles of a primitive, as indices of the accessors' vertices.
    fn triangles(&self, plan: &Plan, count: usize) -> Result<Vec<[u32; 3]>> {
        let at = format!("{}.indices", plan.place);
        let list = match plan.source.indices {
            Some(index) => {
                let accessor = self.attribute(&at, index, &[1])?;
                if !matches!(accessor.component, Component::U8 | Component::U16 | Component::U32) {
                    return Err(self.fault(&at, format!("accessor {index} has no unsigned integers")));
                }
                Some(accessor)
            }
            None => None,
        };
        let corners = list.as_ref().map_or(count, |list| list.count);
        let corner = |i: usize| list.as_ref().map_or(i as u32, |list| list.index_at(i));
        if let Some(i) = (0..corners).find(|i| corner(*i) as usize >= count) {
            let why = format!("index {i} is {}, there are {count} vertices", corner(i));
            return Err(self.fault(&at, why));
        }
        let strips = corners.saturating_sub(2);
        Ok(match plan.source.mode.unwrap_or(TRIANGLES) {
            STRIP => (0..strips)
                .map(|i| match i % 2 {
                    0 => [corner(i), corner(i + 1), corner(i + 2)],
                    _ => [corner(i), corner(i + 2), corner(i + 1)],
                })
                .collect(),
            FAN => (0..strips).map(|i| [corner(i + 1), corner(i + 2), corner(0)]).collect(),
            _ if !corners.is_multiple_of(3) => {
                let place = if list.is_some() { at } else { plan.place.clone() };
                return Err(self.fault(&place, format!("{corners} corners are no whole triangles")));
            }
            _ => (0..corners / 3).map(|i| [corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)]).collect(),
        })
    }
}

impl Plan<'_> {
    /// Triangles at most.
    fn triangles(&self) -> u128 {
        let corners = u128::from(self.corners);
        if self.source.mode.unwrap_or(TRIANGLES) == TRIANGLES { corners / 3 } else { corners }
    }

    /// Vertices that can be used.
    fn vertices(&self) -> u128 {
        u128::from(self.count).min(3 * self.triangles())
    }

    /// Bytes of the primitive in the model.
    fn kept_bytes(&self) -> u128 {
        let vertex: u128 = self.source.attributes.keys().map(|name| vertex_bytes(name)).sum();
        self.triangles() * 12 + self.vertices() * vertex
    }

    /// Bytes that the reading of the primitive takes for a while: the map of used vertices, the list of
    /// them, and one attribute as four floats.
    fn passing_bytes(&self) -> u128 {
        self.vertices() * (16 + 4)
            + (3 * self.triangles() * 4).max(if self.is_dense() { u128::from(self.count) * 4 } else { 0 })
    }

    fn is_dense(&self) -> bool {
        is_dense(3 * self.triangles(), u128::from(self.count))
    }
}

fn vertex_bytes(attribute: &str) -> u128 {
    match attribute {
        "POSITION" | "NORMAL" => 12,
        "COLOR_0" => 16,
        name if name.starts_with("TEXCOORD_") => 8,
        _ => 0,
    }
}

/// Tells whether so many corners use enough of the vertices for a map of all vertices.
fn is_dense(corners: u128, count: u128) -> bool {
    corners >= count / 8
}

/// Renumbers the corners so that only used vertices have numbers, in the order they had. Returns the old
/// numbers. Exporters let many primitives share one long list of vertices.
fn compact(triangles: &mut [[u32; 3]], count: usize) -> Vec<u32> {
    let corners = triangles.as_flattened_mut();
    if is_dense(corners.len() as u128, count as u128) {
        let mut number = vec![u32::MAX; count];
        corners.iter().for_each(|corner| number[*corner as usize] = 0);
        let mut used = Vec::with_capacity(number.iter().filter(|n| **n == 0).count());
        for (vertex, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = used.len() as u32;
            used.push(vertex as u32);
        }
        corners.iter_mut().for_each(|corner| *corner = number[*corner as usize]);
        return used;
    }
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    used.shrink_to_fit();
    for corner in corners {
        *corner = used.partition_point(|vertex| *vertex < *corner) as u32;
    }
    used
}

fn cut<const N: usize>(value: [f32; 4]) -> [f32; N] {
    std::array::from_fn(|i| value[i])
}
