//! The tree of nodes, and the instances of their meshes.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::super::budget::Budget;
use super::super::{Model, ModelNode, Pose};
use super::{Gltf, json};
use crate::util::error::Result;

impl Gltf<'_> {
    /// Reads the nodes. Those that the file's scene does not show keep no mesh, camera or light.
    pub fn read_nodes(&self, model: &mut Model, budget: &mut Budget) -> Result<()> {
        let nodes = &self.document.nodes;
        let whole = nodes.len() as u128 * size_of::<ModelNode>() as u128;
        budget.take(whole, || format!("{}: {} nodes", self.file.path.display(), nodes.len()))?;
        for (i, node) in nodes.iter().enumerate() {
            let place = format!("nodes[{i}]");
            let document = &self.document;
            let check = |index: Option<usize>, member: &str, count: usize, list: &str| match index {
                Some(index) => self.index(&format!("{place}.{member}"), index, count, list).map(Some),
                None => Ok(None),
            };
            let light = node.extensions.light.as_ref().map(|light| light.light);
            model.nodes.push(ModelNode {
                name: node.name.clone(),
                local: self.pose(&place, node)?,
                mesh: check(node.mesh, "mesh", document.meshes.len(), "meshes")?,
                camera: check(node.camera, "camera", document.cameras.len(), "cameras")?,
                light: check(light, "extensions.KHR_lights_punctual", model.lights.len(), "lights")?,
                ..ModelNode::default()
            });
        }
        self.join(model)?;
        let mut hidden = 0_u64;
        for i in self.place_in_world(model)? {
            let node = &mut model.nodes[i];
            hidden += u64::from(node.mesh.is_some());
            (node.mesh, node.camera, node.light) = (None, None, None);
        }
        if hidden > 0 {
            model.note(format!("{hidden} nodes with meshes are in no scene, or not in the file's own"));
        }
        for i in 0..nodes.len() {
            if model.nodes[i].mesh.is_some() {
                model.nodes[i].instances = self.instances(i, model.nodes[i].world, budget)?;
            }
        }
        Ok(())
    }

    /// Sets the parents.
    fn join(&self, model: &mut Model) -> Result<()> {
        let count = model.nodes.len();
        for (i, node) in self.document.nodes.iter().enumerate() {
            for (c, &child) in node.children.iter().enumerate() {
                let place = format!("nodes[{i}].children[{c}]");
                self.index(&place, child, count, "nodes")?;
                if let Some(other) = model.nodes[child].parent.replace(i) {
                    return Err(self.fault(&place, format!("nodes[{child}] is already in nodes[{other}]")));
                }
            }
        }
        Ok(())
    }

    /// Computes the transforms to the world. Returns the nodes that the scene does not show.
    fn place_in_world(&self, model: &mut Model) -> Result<Vec<usize>> {
        let document = &self.document;
        let mut seen = vec![false; model.nodes.len()];
        let roots: Vec<usize> = (0..seen.len()).filter(|i| model.nodes[*i].parent.is_none()).collect();
        self.descend(model, &roots, &mut seen)?;
        if let Some(i) = seen.iter().position(|seen| !seen) {
            return Err(self.fault(&format!("nodes[{i}]"), "it is its own ancestor"));
        }
        if document.scenes.is_empty() {
            return Ok(Vec::new());
        }
        let scene = self.index("scene", document.scene.unwrap_or(0), document.scenes.len(), "scenes")?;
        let mut shown = vec![false; seen.len()];
        let mut open = Vec::new();
        for (n, &node) in document.scenes[scene].nodes.iter().enumerate() {
            let place = format!("scenes[{scene}].nodes[{n}]");
            open.push(self.index(&place, node, seen.len(), "nodes")?);
        }
        while let Some(i) = open.pop() {
            if !std::mem::replace(&mut shown[i], true) {
                open.extend(&document.nodes[i].children);
            }
        }
        Ok((0..shown.len()).filter(|i| !shown[*i]).collect())
    }

    fn descend(&self, model: &mut Model, roots: &[usize], seen: &mut [bool]) -> Result<()> {
        let mut open = roots.to_vec();
        while let Some(i) = open.pop() {
            let parent = model.nodes[i].parent.map_or(DAffine3::IDENTITY, |parent| model.nodes[parent].world);
            let world = parent * model.nodes[i].local.matrix();
            if !world.is_finite() {
                return Err(self.fault(&format!("nodes[{i}]"), "its place in the world is not finite"));
            }
            model.nodes[i].world = world;
            seen[i] = true;
            open.extend(&self.document.nodes[i].children);
        }
        Ok(())
    }

    fn pose(&self, place: &str, node: &json::Node) -> Result<Pose> {
        if let Some(matrix) = &node.matrix {
            let matrix = DMat4::from_cols_array(matrix);
            let last = matrix.row(3);
            if !matrix.is_finite() || last != glam::DVec4::W {
                return Err(self.fault(&format!("{place}.matrix"), "it is no affine transform"));
            }
            return Ok(Pose::Matrix(DAffine3::from_mat4(matrix)));
        }
        let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let unit = glam::DVec4::from(rotation).try_normalize().map(DQuat::from_vec4);
        let Some(rotation) = unit else {
            return Err(self.fault(&format!("{place}.rotation"), "it is no rotation"));
        };
        Ok(Pose::Parts {
            translation: node.translation.unwrap_or_default().into(),
            rotation,
            scale: node.scale.unwrap_or([1.0; 3]).into(),
        })
    }

    /// Returns the transforms of a node's mesh to the world.
    fn instances(&self, node: usize, world: DAffine3, budget: &mut Budget) -> Result<Vec<DAffine3>> {
        let place = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let Some(instancing) = &self.document.nodes[node].extensions.instancing else {
            return Ok(vec![world]);
        };
        let open = |name: &str, width: usize| match instancing.attributes.get(name) {
            Some(&index) => self.attribute(&format!("{place}.{name}"), index, &[width]).map(Some),
            None => Ok(None),
        };
        let parts = [open("TRANSLATION", 3)?, open("ROTATION", 4)?, open("SCALE", 3)?];
        let counts: Vec<usize> = parts.iter().flatten().map(|part| part.count).collect();
        let Some(&count) = counts.first() else { return Ok(vec![world]) };
        if counts.iter().any(|other| *other != count) {
            return Err(self.fault(&place, format!("the attributes have {counts:?} elements")));
        }
        let bytes = count as u128 * size_of::<DAffine3>() as u128;
        budget.take(bytes, || format!("{}: {place} with {count} instances", self.file.path.display()))?;
        let value = |part: usize, i: usize, or: [f32; 4]| -> [f64; 4] {
            parts[part].as_ref().map_or(or, |part| part.floats(i)).map(f64::from)
        };
        let mut out = Vec::with_capacity(count);
        for i in 0..count {
            let [x, y, z, _] = value(0, i, [0.0; 4]);
            let [sx, sy, sz, _] = value(2, i, [1.0; 4]);
            let rotation = glam::DVec4::from(value(1, i, [0.0, 0.0, 0.0, 1.0])).try_normalize();
            let local = rotation.map(|rotation| {
                let (scale, translation) = (DVec3::new(sx, sy, sz), DVec3::new(x, y, z));
                DAffine3::from_scale_rotation_translation(scale, DQuat::from_vec4(rotation), translation)
            });
            match local.map(|local| world * local).filter(|transform| transform.is_finite()) {
                Some(transform) => out.push(transform),
                None => return Err(self.fault(&place, format!("instance {i} has no finite transform"))),
            }
        }
        Ok(out)
    }
}
