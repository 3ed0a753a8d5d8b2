//! Reading of geometry from other programs. Reference truth: what each small file must become.

mod broken;
mod curves;
mod faces;
mod gltf;
mod mutations;
mod obj;
mod paths;
mod strands;
mod written;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use taki::model::{Limits, Model};
use taki::{Error, Result, Unwatched};

/// A file of glTF that is made in a test: its document and its binary chunk.
pub struct Doc {
    pub json: Value,
    pub bin: Vec<u8>,
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

pub fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Corners of the square from (0, 0, 0) to (1, 1, 0), row by row.
pub const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];

impl Doc {
    /// A node without a mesh.
    pub fn empty() -> Doc {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "Node"}],
            "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]
        });
        Doc { json, bin: Vec::new() }
    }

    /// A square of two triangles, as Blender writes it.
    pub fn square() -> Doc {
        let mut doc = Doc::empty();
        let position = doc.add("VEC3", 5126, 4, &floats(&SQUARE));
        let uv = doc.add("VEC2", 5126, 4, &floats(&[0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]));
        let indices = doc.add("SCALAR", 5123, 6, &shorts(&[0, 1, 3, 0, 3, 2]));
        doc.json["meshes"] = json!([{"name": "Square", "primitives": [{
            "attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": indices, "material": 0
        }]}]);
        doc.json["materials"] = json!([{"name": "Wet stone"}]);
        doc.json["nodes"][0]["mesh"] = json!(0);
        doc
    }

    /// Appends a buffer view, and returns its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        push(&mut self.json["bufferViews"], view)
    }

    /// Appends an accessor with a view of its own, and returns its index.
    pub fn add(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
        push(&mut self.json["accessors"], accessor)
    }

    /// The only primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Bytes of the file as `.glb`.
    pub fn glb(&self) -> Vec<u8> {
        let (mut text, mut bin) = (self.json.to_string().into_bytes(), self.bin.clone());
        text.resize(text.len().next_multiple_of(4), b' ');
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF".to_vec();
        let length = 12 + 8 + text.len() + 8 + bin.len();
        out.extend([2, length as u32].iter().flat_map(|x| x.to_le_bytes()));
        for (kind, chunk) in [(0x4e4f_534a_u32, text), (0x004e_4942, bin)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend(chunk);
        }
        out
    }

    pub fn read(&self) -> Result<Model> {
        Folder::new(&[("model.glb", &self.glb())]).read("model.glb")
    }

    pub fn model(&self) -> Model {
        self.read().expect("a valid file")
    }

    /// The error of the file, which has one.
    pub fn error(&self) -> String {
        self.read().expect_err("a broken file").to_string()
    }
}

fn push(list: &mut Value, item: Value) -> usize {
    let list = list.as_array_mut().expect("a list");
    list.push(item);
    list.len() - 1
}

/// A folder of files that vanishes with the value.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new(files: &[(&str, &[u8])]) -> Folder {
        let folder = Folder(tempfile::tempdir().expect("a folder"));
        for (name, bytes) in files {
            folder.write(name, bytes);
        }
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("created");
        std::fs::write(path, bytes).expect("written");
    }

    pub fn read(&self, name: &str) -> Result<Model> {
        read(&self.path(name), 1 << 26)
    }

    pub fn model(&self, name: &str) -> Model {
        self.read(name).expect("a valid file")
    }

    pub fn error(&self, name: &str) -> Error {
        self.read(name).expect_err("a broken file")
    }
}

pub fn read(path: &Path, memory: u64) -> Result<Model> {
    Model::read(path, &Limits { memory, allow_paths: Vec::new() }, &Unwatched)
}

/// Checks what holds for every model, whatever its file was.
pub fn check(model: &Model) {
    for primitive in model.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let count = primitive.positions.len();
        assert!(primitive.triangles.as_flattened().iter().all(|corner| (*corner as usize) < count));
        assert!(primitive.positions.as_flattened().iter().all(|x| x.is_finite()));
        assert!(primitive.uvs.iter().all(|set| set.len() == count));
        assert!(primitive.uvs.iter().all(|set| set.as_flattened().iter().all(|x| x.is_finite())));
        assert!(primitive.normals.as_ref().is_none_or(|normals| normals.len() == count));
        assert!(primitive.colors.as_ref().is_none_or(|colors| colors.len() == count));
        assert!(primitive.material.is_none_or(|material| material < model.materials.len()));
        let faces = primitive.faces();
        let triangles = faces.iter().map(|face| match face {
            taki::model::Face::Triangle(_) => 1,
            taki::model::Face::Quad(_) => 2,
        });
        assert_eq!(triangles.sum::<usize>(), primitive.triangles.len());
    }
    for texture in model.materials.iter().filter_map(|material| material.base_color_texture.as_ref()) {
        assert!(texture.image < model.images.len());
    }
    for (i, node) in model.nodes.iter().enumerate() {
        assert!(node.instances.iter().all(|world| world.is_finite()));
        assert_eq!(node.mesh.is_none(), node.instances.is_empty());
        for animation in 0..model.animations.len() {
            let _ = model.world_at(animation, i, 0.5);
        }
    }
    assert!(model.notes.len() <= 33);
    let _ = model.summary();
}
