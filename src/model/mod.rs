//! Geometry that other programs wrote: glTF 2.0 (`.gltf` with its buffers, `.glb`), OBJ with MTL, and strands
//! of hair (`.hair`, and curves of USD).
//!
//! [`Model::read`] reads a whole file and checks all of it: a [`Model`] holds only finite numbers and indices
//! that lead somewhere. Files are not trusted. References to other files are confined to the file's folder,
//! the memory that the file will take is known before it is taken, and a fault is reported with its file and
//! its place in it.
//!
//! # Conventions
//!
//! - Lengths are metres and +Y is up, as glTF demands. OBJ knows no unit and no axes; its numbers are taken
//!   the same way.
//! - Geometry is local. Transforms to the file's world stand beside it in float64, so an instance far from
//!   the origin keeps its digits. A mesh of an OBJ file that lies far from the origin is moved to it, and its
//!   node moves it back.
//! - Texture coordinates are those of glTF: (0, 0) is the upper left corner of an image, and v runs **down**.
//!   OBJ's v runs up, and is turned on reading: `v = 1 − v_obj`. So a mesh that Blender writes to both
//!   formats has the same coordinates in both.
//! - Seen from the front, the corners of a face run counter-clockwise. A transform with a negative
//!   determinant turns that round.
//! - A camera looks along −Z of its node with +Y up, and a light shines along −Z of its node.
//!
//! # Why the crates `gltf` and `tobj` are not used
//!
//! `gltf` 1.4 refuses a file whose animation uses KHR_animation_pointer, knows no EXT_texture_webp, and
//! names the column of a missing value instead of its member. `tobj` 4.0 panics on a colour of two numbers,
//! drops the name of a material that no library defines (here the name chooses what a part becomes), shifts
//! texture coordinates where a corner has none, and its errors have no line.

mod animation;
mod budget;
mod faces;
mod gltf;
mod image;
mod look;
mod names;
mod obj;
mod paths;
mod strand_file;
mod strands;
mod summary;
mod usd;

use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};

pub use animation::{Channel, Interpolation, ModelAnimation, Pose, Target};
pub use faces::Face;
pub use image::ImageSource;
pub use look::{
    AlphaMode, CameraLens, LightKind, ModelCamera, ModelLight, ModelMaterial, TextureRef, TextureTransform,
    Wrap,
};
pub use names::{find_name, folded_name};
pub use strand_file::StrandFile;
pub use strands::Strands;
pub use summary::{MaterialSummary, NodeSummary, Summary};

use crate::util::error::{Error, Result};
use crate::util::monitor::Monitor;
use budget::{Budget, SMALLER};

/// Limits of the reading of a file.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Memory that the file and what is made of it may take together, bytes.
    pub memory: u64,
    /// Folders, besides the file's own, that its references may lead into.
    pub allow_paths: Vec<PathBuf>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { memory: 4 << 30, allow_paths: Vec::new() }
    }
}

/// Content of a file: meshes, the nodes that place them, and what they look like.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Meshes, each in its own space.
    pub meshes: Vec<ModelMesh>,
    /// Nodes. Parents may follow their children.
    pub nodes: Vec<ModelNode>,
    /// Materials.
    pub materials: Vec<ModelMaterial>,
    /// Images that the materials' textures name. They are not decoded yet.
    pub images: Vec<ImageSource>,
    /// Cameras. A node places each.
    pub cameras: Vec<ModelCamera>,
    /// Lights (KHR_lights_punctual). A node places each.
    pub lights: Vec<ModelLight>,
    /// Animations of the nodes' transforms.
    pub animations: Vec<ModelAnimation>,
    /// Triangles without area, which were left out.
    pub degenerate: u64,
    /// What the file has and the model lacks, one sentence each.
    pub notes: Vec<String>,
}

/// Mesh of one or more primitives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelMesh {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Parts, each with one material.
    pub primitives: Vec<Primitive>,
}

/// Triangles with one material. Every index leads to a vertex, and every triangle has an area.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Primitive {
    /// Positions of the vertices in the mesh's space, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the vertices, where the file has them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Sets of texture coordinates (TEXCOORD_0, TEXCOORD_1, …), one pair for every vertex in each.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear colours of the vertices (COLOR_0), where the file has them.
    pub colors: Option<Vec<[f32; 4]>>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// First triangles of the pairs that are the file's own quads. `None` where the file has none (glTF never
    /// has); then [`Primitive::faces`] looks for pairs.
    pub quads: Option<Vec<u32>>,
    /// Index of the material.
    pub material: Option<usize>,
}

/// Node of the scene's tree.
#[derive(Clone, Debug, Default)]
pub struct ModelNode {
    /// Name in the file. It may be empty.
    pub name: String,
    /// Index of the node whose space this node stands in.
    pub parent: Option<usize>,
    /// Transform from the node's space to its parent's, at rest.
    pub local: Pose,
    /// Transform from the node's space to the world, at rest.
    pub world: DAffine3,
    /// Index of the mesh that the node shows.
    pub mesh: Option<usize>,
    /// Transforms from the mesh's space to the world: one, or as many as EXT_mesh_gpu_instancing lists. Empty
    /// where the node shows no mesh.
    pub instances: Vec<DAffine3>,
    /// Index of the camera.
    pub camera: Option<usize>,
    /// Index of the light.
    pub light: Option<usize>,
}

impl Model {
    /// Reads a file of glTF (`.gltf`, `.glb`) or OBJ. The content decides which, and the extension where the
    /// content does not. Each note of the model is also a warning to the monitor.
    ///
    /// # Errors
    /// [`Error::Input`] where the file is broken, compressed, or leads out of its folder, with file and
    /// place; [`Error::Memory`] where it needs more memory than `limits` allows; [`Error::Io`] where the disk
    /// fails; any error of the monitor.
    pub fn read(path: &Path, limits: &Limits, monitor: &dyn Monitor) -> Result<Model> {
        let mut budget = Budget::new(limits.memory, SMALLER);
        let bytes = paths::read_whole(path, &mut budget)?;
        Model::parse(path, bytes, limits, &mut budget, monitor)
    }

    /// Reads the content of a file that refers to no others. `path` stands for it in errors.
    ///
    /// # Errors
    /// Those of [`Model::read`].
    pub fn from_bytes(path: &Path, bytes: &[u8], limits: &Limits, monitor: &dyn Monitor) -> Result<Model> {
        Model::parse(path, bytes.to_vec(), limits, &mut Budget::new(limits.memory, SMALLER), monitor)
    }

    fn parse(
        path: &Path,
        bytes: Vec<u8>,
        limits: &Limits,
        budget: &mut Budget,
        monitor: &dyn Monitor,
    ) -> Result<Model> {
        let file = File { path, limits };
        let mut model = match kind(path, &bytes) {
            Kind::Gltf => gltf::read(&file, bytes, budget, monitor)?,
            Kind::Obj => obj::read(&file, &bytes, budget, monitor)?,
            Kind::Other => {
                return Err(Error::input(
                    format!("{} is neither glTF nor OBJ", path.display()),
                    "export the model as .glb, .gltf or .obj",
                ));
            }
        };
        model.note_what_has_no_area();
        for note in &model.notes {
            monitor.warn(&format!("{}: {note}", path.display()));
        }
        Ok(model)
    }

    /// Notes triangles without area, and nodes that take the area of theirs away. Each fault has one note.
    fn note_what_has_no_area(&mut self) {
        let shown = |node: &&ModelNode| {
            node.mesh.is_some_and(|mesh| self.meshes[mesh].primitives.iter().any(|p| !p.triangles.is_empty()))
        };
        let flat = |node: &&ModelNode| node.instances.iter().all(is_collapsed);
        let collapsed: Vec<String> =
            self.nodes.iter().filter(shown).filter(flat).map(|node| self.name_of(node)).collect();
        let is_empty = self.meshes.iter().flat_map(|mesh| &mesh.primitives).all(|p| p.triangles.is_empty());
        match self.degenerate {
            0 if is_empty => self.note("the file has no triangles".into()),
            0 => {}
            n if is_empty => self.note(format!(
                "none of its {n} triangles has an area, so nothing of it is shown; look at the mesh in the \
                 program that made it"
            )),
            n => self.note(format!("{n} triangles without area are left out")),
        }
        match &collapsed[..] {
            [] => {}
            [one] => self.note(format!("the scale of the node {one} is 0, so nothing of it is shown")),
            [first, ..] => self.note(format!(
                "the scale of {} nodes is 0, so nothing of them is shown; the first is {first}",
                collapsed.len()
            )),
        }
    }

    /// Name of a node, or of its mesh where it has none.
    fn name_of(&self, node: &ModelNode) -> String {
        match node.mesh {
            Some(mesh) if node.name.is_empty() => self.meshes[mesh].name.clone(),
            _ => node.name.clone(),
        }
    }

    /// Adds a note, unless there are too many already.
    fn note(&mut self, text: String) {
        match self.notes.len() {
            0..MOST_NOTES => self.notes.push(text),
            MOST_NOTES => self.notes.push("there is more to say, which is left out".into()),
            _ => {}
        }
    }
}

/// Tells whether a transform takes all area away: what it makes of space is a line or a point.
pub(crate) fn is_collapsed(transform: &DAffine3) -> bool {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    [x.cross(y), y.cross(z), z.cross(x)] == [DVec3::ZERO; 3]
}

/// Most notes of a model, but for one that says so.
const MOST_NOTES: usize = 32;

/// A file that is read, and what it may do.
struct File<'a> {
    path: &'a Path,
    limits: &'a Limits,
}

/// Advice on a file that breaks its format.
const EXPORT_AGAIN: &str = "export the file again, or check it with a validator of its format";

impl File<'_> {
    /// The error for a fault at `place`, with advice.
    fn fault_with(&self, place: &str, why: impl std::fmt::Display, fix: impl Into<String>) -> Error {
        Error::input(format!("{}: {place}: {why}", self.path.display()), fix)
    }

    /// The error for a fault at `place` that breaks the format.
    fn fault(&self, place: &str, why: impl std::fmt::Display) -> Error {
        self.fault_with(place, why, EXPORT_AGAIN)
    }
}

/// Tells whether a file is one from which meshes are read, by its extension or its first bytes.
pub fn is_model(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let starts = || {
        let mut start = [0; 4];
        std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok()
            && start == *b"glTF"
    };
    ["glb", "gltf", "obj"].iter().any(|known| extension == *known) || (path.is_file() && starts())
}

enum Kind {
    Gltf,
    Obj,
    Other,
}

fn kind(path: &Path, bytes: &[u8]) -> Kind {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if bytes.starts_with(b"glTF") || text.starts_with(b"{") || extension == "gltf" || extension == "glb" {
        Kind::Gltf
    } else if extension == "obj" {
        Kind::Obj
    } else {
        Kind::Other
    }
}
