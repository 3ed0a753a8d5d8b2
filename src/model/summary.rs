//! What a model holds, for a listing.

use glam::{DVec3, Vec2, Vec3};

use super::{Model, Primitive};

/// Content of a model in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Nodes that show a mesh.
    pub nodes: Vec<NodeSummary>,
    /// Materials in use, in the model's order, then the primitives without a material.
    pub materials: Vec<MaterialSummary>,
    /// Triangles with all instances.
    pub triangles: u128,
    /// Triangles in memory, each mesh once.
    pub stored_triangles: u64,
    /// Places at which meshes are shown.
    pub instances: u64,
    /// Triangles without area, which were left out.
    pub degenerate: u64,
    /// Least and greatest corner in the world, metres: a box around the boxes of all instances.
    pub bounds: Option<[DVec3; 2]>,
    /// Names of the nodes with a camera.
    pub cameras: Vec<String>,
    /// Names of the nodes with a light.
    pub lights: Vec<String>,
    /// Names of the animations.
    pub animations: Vec<String>,
}

/// A node that shows a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeSummary {
    /// Index in the model.
    pub node: usize,
    /// Name, or the mesh's where the node has none.
    pub name: String,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Places at which the mesh is shown.
    pub instances: u64,
    /// Corners of the box around all instances in the world, metres.
    pub bounds: Option<[DVec3; 2]>,
}

/// A material, and what has it.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSummary {
    /// Index in the model; `None` for primitives without a material.
    pub material: Option<usize>,
    /// Name.
    pub name: String,
    /// Triangles with all instances.
    pub triangles: u128,
    /// Least and greatest coordinates of each set that all primitives of the material have.
    pub uvs: Vec<[Vec2; 2]>,
}

impl Model {
    /// Lists what the model holds.
    pub fn summary(&self) -> Summary {
        let boxes: Vec<_> = self.meshes.iter().map(|mesh| around(&mesh.primitives)).collect();
        let mut shown = vec![0_u64; self.meshes.len()];
        let mut nodes = Vec::new();
        for (node, own) in self.nodes.iter().enumerate() {
            let Some(mesh) = own.mesh else { continue };
            shown[mesh] += own.instances.len() as u64;
            let corners = boxes[mesh].iter().flat_map(corners);
            let corners =
                corners.flat_map(|p| own.instances.iter().map(move |world| world.transform_point3(p)));
            nodes.push(NodeSummary {
                node,
                name: self.name_of(own),
                triangles: self.meshes[mesh].primitives.iter().map(|p| p.triangles.len() as u64).sum(),
                instances: own.instances.len() as u64,
                bounds: bounds(corners),
            });
        }
        let named = |has: &dyn Fn(usize) -> bool| -> Vec<String> {
            let found = self.nodes.iter().enumerate().filter(|(i, _)| has(*i));
            found.map(|(_, node)| node.name.clone()).collect()
        };
        Summary {
            materials: self.material_summaries(&shown),
            triangles: nodes.iter().map(|n| u128::from(n.triangles) * u128::from(n.instances)).sum(),
            stored_triangles: self.primitives().map(|(_, p)| p.triangles.len() as u64).sum(),
            instances: nodes.iter().map(|node| node.instances).sum(),
            degenerate: self.degenerate,
            bounds: bounds(nodes.iter().filter_map(|node| node.bounds).flatten()),
            cameras: named(&|i| self.nodes[i].camera.is_some()),
            lights: named(&|i| self.nodes[i].light.is_some()),
            animations: self.animations.iter().map(|animation| animation.name.clone()).collect(),
            nodes,
        }
    }

    /// All primitives, each with the index of its mesh.
    fn primitives(&self) -> impl Iterator<Item = (usize, &Primitive)> {
        self.meshes.iter().enumerate().flat_map(|(i, mesh)| mesh.primitives.iter().map(move |p| (i, p)))
    }

    /// Lists the materials of shown meshes. `shown` counts the instances of each mesh.
    fn material_summaries(&self, shown: &[u64]) -> Vec<MaterialSummary> {
        let mut lists: Vec<Vec<(u64, &Primitive)>> = vec![Vec::new(); self.materials.len() + 1];
        for (mesh, primitive) in self.primitives().filter(|(mesh, _)| shown[*mesh] > 0) {
            lists[primitive.material.unwrap_or(self.materials.len())].push((shown[mesh], primitive));
        }
        let used = lists.into_iter().enumerate().filter(|(_, list)| !list.is_empty());
        used.map(|(i, list)| MaterialSummary {
            material: (i < self.materials.len()).then_some(i),
            name: self.materials.get(i).map_or(String::new(), |material| material.name.clone()),
            triangles: list.iter().map(|(n, p)| u128::from(*n) * p.triangles.len() as u128).sum(),
            uvs: common_uvs(&list),
        })
        .collect()
    }
}

/// Ranges of the sets of coordinates that all primitives have.
fn common_uvs(list: &[(u64, &Primitive)]) -> Vec<[Vec2; 2]> {
    let sets = list.iter().map(|(_, primitive)| primitive.uvs.len()).min().unwrap_or(0);
    let range = |set: usize| {
        let all = list.iter().flat_map(move |(_, p)| p.uvs[set].iter().map(|uv| Vec2::from(*uv)));
        all.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[low, high], uv| [low.min(uv), high.max(uv)])
    };
    (0..sets).map(range).filter(|range| range[0].is_finite()).collect()
}

/// Box around the vertices of primitives, in the space of their mesh.
fn around(primitives: &[Primitive]) -> Option<[DVec3; 2]> {
    bounds(primitives.iter().flat_map(|p| &p.positions).map(|p| Vec3::from(*p).as_dvec3()))
}

fn bounds(points: impl Iterator<Item = DVec3>) -> Option<[DVec3; 2]> {
    // What overflows makes the box infinite; min and max alone would lose it.
    let points = points.map(|p| if p.is_finite() { p } else { DVec3::INFINITY });
    points.fold(None, |found: Option<[DVec3; 2]>, p| {
        let [low, high] = found.unwrap_or([p; 2]);
        Some([low.min(p), high.max(p)])
    })
}

fn corners([low, high]: &[DVec3; 2]) -> [DVec3; 8] {
    let [low, high] = [*low, *high];
    std::array::from_fn(|i| {
        let pick = |bit: usize, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
        DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    })
}
