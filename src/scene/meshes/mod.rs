//! Meshes of other programs in a scene: what their parts become.

mod build;
mod camera;
mod coordinates;
mod faces;
mod listing;
mod memo;
mod names;
mod opaque;
mod paint;
mod shells;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, EulerRot, Vec3};

pub(super) use build::build;
pub(super) use camera::{lights, with_camera};
pub use listing::PartSummary;
pub use memo::{Loaded, ModelMemo};
use names::{Named, listed};
pub(super) use names::{dotted, in_key, other_spellings, unquoted, written};
pub(super) use shells::turned_over;

use super::build::confine;
use super::names::likeliest;
use super::param::POINT_MAX;
use super::{Limits, Values};
use crate::mapping::shell::Side;
use crate::model::Primitive;
use crate::place::{MeshShade, Show};
use crate::util::error::{Error, Result};
use crate::util::words::words;

/// What carries the volume on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carrier {
    /// Each face, as a quad.
    Face,
    /// A shell over the mesh.
    Shell,
}

words! { Carrier { Face => "face", Shell => "shell" } }

/// What scales the thickness of a shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ThicknessFrom {
    /// Nothing.
    None,
    /// The red of the vertices' colour.
    Color,
}

words! { ThicknessFrom { None => "none", Color => "color" } }

/// Words of the sides of a shell.
pub(super) const SIDES: &[&str] = Side::WORDS;

/// Texture coordinates in place of the file's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// None: those of the file.
    None,
    /// Along the axis that a triangle faces most.
    Box,
    /// Along z.
    Planar,
    /// Around the y axis.
    Cylinder,
}

words! { Projection { None => "none", Box => "box", Planar => "planar", Cylinder => "cylinder" } }

/// Words that stand in place of a material of the scene.
const OPAQUE: &str = "opaque";
const NONE: &str = "none";

/// Whether a word stands in place of a material of the scene.
pub(super) fn is_word(name: &str) -> bool {
    [OPAQUE, NONE].contains(&name)
}

/// Whether `path` is a table of materials of a mesh.
pub(super) fn is_materials(path: &str) -> bool {
    path.strip_prefix("meshes.").and_then(|rest| rest.strip_suffix(".materials")).is_some()
}

/// Whether `key` is the file of a mesh that is hidden, and so is not read.
pub(super) fn is_hidden(v: &Values, key: &str) -> bool {
    let name = key.strip_prefix("meshes.").and_then(|rest| rest.strip_suffix(".file"));
    name.is_some_and(|name| v.choice(&format!("meshes.{name}.show"), Show::from_word) == Show::Hidden)
}

/// Returns the names of the scene's materials that parts of meshes have.
pub(super) fn named_materials(v: &Values) -> Vec<String> {
    v.names("meshes").into_iter().flat_map(|name| materials_of(v, &name)).collect()
}

/// Returns the names of the scene's materials that parts of the mesh `name` have.
pub(super) fn materials_of(v: &Values, name: &str) -> Vec<String> {
    let own = v.names(&format!("meshes.{name}.materials")).into_iter();
    let keys = own.map(|own| format!("meshes.{name}.materials.{own}"));
    let keys = keys.chain([format!("meshes.{name}.material")]);
    keys.map(|key| v.text(&key)).filter(|name| !is_word(name)).collect()
}

/// What a part of a mesh becomes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Becomes {
    /// Nothing.
    None,
    /// Opaque triangles.
    Opaque,
    /// A surface with this material of the scene.
    Material(String),
}

impl Becomes {
    fn new(word: String) -> Becomes {
        match word.as_str() {
            NONE => Becomes::None,
            OPAQUE => Becomes::Opaque,
            _ => Becomes::Material(word),
        }
    }

    /// The word in scene files.
    pub fn word(&self) -> &str {
        match self {
            Becomes::None => NONE,
            Becomes::Opaque => OPAQUE,
            Becomes::Material(name) => name,
        }
    }
}

/// A mesh of a scene, read from its file.
#[derive(Clone, Debug)]
pub struct SceneMesh {
    /// Name in the scene.
    pub name: String,
    /// Path of the file, resolved and inside the allowed folders.
    pub file: PathBuf,
    /// Content of the file.
    pub loaded: Arc<Loaded>,
    /// Transform from the file's world to the scene's.
    pub place: DAffine3,
    /// Factor on the size.
    pub scale: f64,
    /// Whether a picture with an alpha channel has a hole in place of its opaque parts.
    pub holdout: bool,
    /// What the parts with each material of the file become, and last those without a material.
    pub becomes: Vec<Becomes>,
    /// Keys of what the materials of the file become; `None` for one without a name.
    keys: Vec<Option<String>>,
    /// Set of texture coordinates.
    pub uv: usize,
    /// Texture coordinates in place of the file's, and the size of a copy of the volume in them, metres.
    pub projection: (Projection, f64),
    /// Albedo in place of the file's.
    pub color: Option<Vec3>,
    /// Whether the file's lights shine.
    pub lights: bool,
    /// Shade and wetness of its opaque parts.
    pub shade: MeshShade,
}

impl SceneMesh {
    fn read(
        v: &Values,
        name: &str,
        folder: Option<&Path>,
        limits: &Limits,
        memory: u64,
    ) -> Result<SceneMesh> {
        let key = |what: &str| format!("meshes.{name}.{what}");
        let file = v.text(&key("file"));
        if file.is_empty() {
            return Err(Error::input(
                format!("mesh {name} has no file"),
                format!("give {} a file of glTF (.glb, .gltf) or OBJ", key("file")),
            ));
        }
        let file = confine(&key("file"), Path::new(&file), folder, &limits.allow_paths)?;
        let loaded = limits.models.read(&file, memory, &limits.allow_paths)?;
        let color = v.is_set(&key("color")).then(|| v.triple(&key("color")));
        if let Some(color) = color.filter(|color| color.max_element() > 1.0) {
            return Err(Error::input(
                format!("{} = {color} reflects more light than it receives", key("color")),
                "an albedo is at most 1 in each component; write \"#rrggbb\" for numbers up to 255",
            ));
        }
        let Named { becomes, keys } = Named::new(v, name, &file, &loaded.model)?;
        let mesh = SceneMesh {
            name: name.into(),
            becomes,
            keys,
            file,
            loaded,
            place: mesh_place(v, name),
            scale: v.coordinate(&key("scale")),
            holdout: v.choice(&key("show"), Show::from_word) == Show::Holdout,
            uv: v.count(&key("uv")) as usize,
            projection: (
                v.choice(&key("projection"), Projection::from_word),
                v.coordinate(&key("projection_size")),
            ),
            color,
            lights: v.is_on(&key("lights")),
            shade: MeshShade {
                occlusion: v.float(&key("occlusion")),
                shadow: v.float(&key("shadow")),
                wet: v.float(&key("wet")),
                wet_reach: v.float(&key("wet_reach")),
                most_added: 0,
            },
        };
        mesh.check_place()?;
        Ok(mesh)
    }

    /// Checks that all of the mesh lies where a scene's points may.
    ///
    /// # Errors
    /// [`Error::Input`] with the node that lies outside.
    fn check_place(&self) -> Result<()> {
        let farthest = |bounds| {
            let corners = box_corners(bounds).map(|corner| self.place.transform_point3(corner).abs());
            let far = corners.map(|p| if p.is_finite() { p.max_element() } else { f64::INFINITY });
            far.into_iter().fold(0.0, f64::max)
        };
        for node in &self.loaded.summary().nodes {
            let Some(far) = node.bounds.map(farthest).filter(|far| *far > POINT_MAX) else { continue };
            let at = if far.is_finite() { format!("{far:.3e} m") } else { "infinitely far".into() };
            let (mesh, file) = (&self.name, self.file.display());
            return Err(Error::input(
                format!("mesh {mesh}: the node {} of {file} reaches {at} from the scene's origin", node.name),
                format!(
                    "a scene's points lie within ±{POINT_MAX:e} m: move or scale the node in the program \
                     that made it, or lower meshes.{mesh}.scale"
                ),
            ));
        }
        Ok(())
    }

    /// What a primitive becomes.
    pub fn becomes(&self, primitive: &Primitive) -> &Becomes {
        &self.becomes[primitive.material.unwrap_or(self.becomes.len() - 1)]
    }

    /// Corners of the box around the mesh, in the world, metres. It has the axes of the file. `None` where no
    /// node shows anything.
    pub fn corners(&self) -> Option<[DVec3; 8]> {
        let corners = box_corners(self.loaded.bounds()?);
        Some(corners.map(|corner| self.place.transform_point3(corner)))
    }

    /// Middle of the mesh in the world, metres. `None` where no node shows anything.
    pub(super) fn middle(&self) -> Option<DVec3> {
        let [low, high] = self.loaded.bounds()?;
        Some(self.place.transform_point3((low + high) / 2.0))
    }
}

/// Corners of a box: corner `i` has the greater x where bit 0 of `i` is set, y for bit 1, z for bit 2.
pub fn box_corners(bounds: [DVec3; 2]) -> [DVec3; 8] {
    let pick = |i: usize, axis: usize| bounds[i >> axis & 1][axis];
    std::array::from_fn(|i| DVec3::new(pick(i, 0), pick(i, 1), pick(i, 2)))
}

/// Transform from the world of a mesh's file to the scene's.
pub fn mesh_place(v: &Values, name: &str) -> DAffine3 {
    let key = |what: &str| format!("meshes.{name}.{what}");
    let turn = turn_of(v.point(&key("turn")));
    let scale = DVec3::splat(v.coordinate(&key("scale")));
    DAffine3::from_scale_rotation_translation(scale, turn, v.point(&key("position")))
}

/// Rotation by angles about the x, then the y, then the z axis, degrees.
pub fn turn_of(degrees: DVec3) -> DQuat {
    let [x, y, z] = degrees.to_array().map(f64::to_radians);
    DQuat::from_euler(EulerRot::ZYX, z, y, x)
}

/// Reads the meshes of a scene that are not hidden.
///
/// # Errors
/// [`Error::Input`] where a file is unusable, or has no material of a name that the scene gives;
/// [`Error::Memory`] where the files need more than the limit.
pub(super) fn read(v: &Values, folder: Option<&Path>, limits: &Limits) -> Result<Vec<SceneMesh>> {
    let mut meshes: Vec<SceneMesh> = Vec::new();
    for name in v.names("meshes") {
        if v.choice(&format!("meshes.{name}.show"), Show::from_word) == Show::Hidden {
            continue;
        }
        let mut files: Vec<&Arc<Loaded>> = meshes.iter().map(|mesh| &mesh.loaded).collect();
        files.dedup_by(|a, b| Arc::ptr_eq(a, b));
        let taken: u64 = files.iter().map(|loaded| loaded.bytes).sum();
        meshes.push(SceneMesh::read(v, &name, folder, limits, limits.memory.saturating_sub(taken))?);
    }
    limits.models.forget_others(meshes.len());
    Ok(meshes)
}

/// Returns the mesh that a text names, and what stands behind a slash.
pub(super) fn named<'a>(
    meshes: &'a [SceneMesh],
    text: &'a str,
    key: &str,
) -> Result<(&'a SceneMesh, &'a str)> {
    let find = |name: &str| meshes.iter().find(|mesh| mesh.name == name);
    if let Some(mesh) = find(text) {
        return Ok((mesh, ""));
    }
    let (name, rest) = text.split_once('/').unwrap_or((text, ""));
    find(name).map(|mesh| (mesh, rest)).ok_or_else(|| {
        let names = || meshes.iter().map(|mesh| mesh.name.as_str());
        let fix = match likeliest(name, names()) {
            Some(near) => format!("did you mean {near}?"),
            None if meshes.is_empty() => format!("add [meshes.{name}] with a file that has a camera"),
            None => format!("meshes that are not hidden: {}", listed(names())),
        };
        Error::input(format!("{key} = {text:?}: the scene shows no mesh {name}"), fix)
    })
}
