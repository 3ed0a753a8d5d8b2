//! Surfaces of a mesh: opaque triangles, quads and shells.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::paint::{Plan, untextured};
use super::{Becomes, Carrier, Projection, SceneMesh, ThicknessFrom, faces, opaque, shells};
use crate::mapping::shell::{Shell, Side};
use crate::mapping::{Billow, Material, Quad};
use crate::model::{Primitive, is_collapsed};
use crate::place::{MAX_ADDED, SHADE_BYTES, Triangles, Vertex};
use crate::scene::read::MAX_QUADS;
use crate::scene::{Limits, Recipe, Values};
use crate::trace::AttenuationKind;
use crate::util::error::{Error, Result};

/// A material of the scene on a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cover {
    pub name: String,
    pub material: Material,
    pub mist: f32,
    pub carrier: Carrier,
    pub side: Side,
    /// Whether the mesh under the shell is drawn as an opaque surface.
    pub skin: bool,
    /// Whether opaque matter lies behind the inner surface: that mesh, or flesh.
    pub has_body: bool,
    pub from: ThicknessFrom,
}

/// All that the surfaces of a mesh depend on.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub mesh: SceneMesh,
    pub origin: DVec3,
    pub covers: Vec<Cover>,
}

impl PartialEq for Key {
    fn eq(&self, other: &Key) -> bool {
        let of = |key: &Key| {
            let m = &key.mesh;
            (m.name.clone(), m.becomes.clone(), m.uv, m.projection, m.color, m.holdout, key.origin)
        };
        let place = |key: &Key| (key.mesh.place, key.mesh.scale);
        Arc::ptr_eq(&self.mesh.loaded, &other.mesh.loaded)
            && of(self) == of(other)
            && place(self) == place(other)
            && self.covers == other.covers
    }
}

/// Surfaces of one mesh.
#[derive(Debug, Default)]
pub(super) struct Built {
    pub triangles: Option<Triangles>,
    pub quads: Vec<Quad>,
    pub shells: Vec<Arc<Shell>>,
    /// Faces that carry no volume, because their texture coordinates span no area.
    pub unmapped: u64,
    /// Sentences about textures whose coordinates the mesh lacks.
    pub untextured: Vec<String>,
}

/// Surfaces of all meshes of a scene.
#[derive(Debug, Default)]
pub(in crate::scene) struct Surfaces {
    pub triangles: Vec<Triangles>,
    pub quads: Vec<Quad>,
    pub shells: Vec<Arc<Shell>>,
    /// Faces without an area in the texture, and the name of their mesh.
    pub unmapped: Vec<(String, u64)>,
    /// Sentences about textures whose coordinates a mesh lacks.
    pub untextured: Vec<String>,
}

/// A primitive at one of its places.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    pub primitive: &'a Primitive,
    /// Transform to the world, relative to the scene's origin.
    pub local: DAffine3,
    /// Transform to the mesh's own space, in metres of the scene: without its turn and position.
    pub own: DAffine3,
    /// Whether the transform turns the surface inside out.
    pub flipped: bool,
}

impl Part<'_> {
    /// Position of a vertex relative to the scene's origin, metres.
    pub fn position(&self, vertex: u32) -> Vec3 {
        self.local.transform_point3(self.vertex(vertex)).as_vec3()
    }

    pub fn vertex(&self, vertex: u32) -> DVec3 {
        Vec3::from(self.primitive.positions[vertex as usize]).as_dvec3()
    }

    /// Corners of a triangle, counter-clockwise in the world as seen from the side that the file's normals
    /// are on. Files wind triangles one way or the other.
    pub fn facing(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        let turned = self.primitive.normals.as_ref().is_some_and(|normals| {
            let [p, q, r] = [a, b, c].map(|i| self.vertex(i));
            let sum: Vec3 = [a, b, c].iter().map(|&i| Vec3::from(normals[i as usize])).sum();
            (q - p).cross(r - p).dot(sum.as_dvec3()) < 0.0
        });
        if self.flipped != turned { [a, c, b] } else { [a, b, c] }
    }
}

impl Key {
    /// Primitives at all their places.
    pub fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let model = &self.mesh.loaded.model;
        let place = DAffine3::from_translation(-self.origin) * self.mesh.place;
        let scaled = DAffine3::from_scale(DVec3::splat(self.mesh.scale));
        let shown = model.nodes.iter().filter_map(|node| Some((node.mesh?, &node.instances)));
        shown.flat_map(move |(mesh, instances)| {
            // What has no area is left out; a note of the file tells of it.
            instances.iter().filter(|world| !is_collapsed(world)).flat_map(move |world| {
                let local = place * *world;
                let flipped = local.matrix3.determinant() < 0.0;
                let own = scaled * *world;
                model.meshes[mesh].primitives.iter().map(move |primitive| Part {
                    primitive,
                    local,
                    own,
                    flipped,
                })
            })
        })
    }

    /// Parts that have a cover.
    pub fn covered<'a>(&'a self, cover: &'a Cover) -> impl Iterator<Item = Part<'a>> {
        self.parts().filter(|part| match self.mesh.becomes(part.primitive) {
            Becomes::Material(name) => *name == cover.name,
            _ => false,
        })
    }

    /// Whether a part is drawn as an opaque surface.
    pub fn is_opaque(&self, part: &Part) -> bool {
        match self.mesh.becomes(part.primitive) {
            Becomes::None => false,
            Becomes::Opaque => true,
            Becomes::Material(name) => {
                self.covers.iter().any(|c| c.name == *name && c.carrier == Carrier::Shell && c.skin)
            }
        }
    }

    /// Words for the parts with a cover, in messages.
    pub fn words(&self, cover: &Cover) -> String {
        format!("mesh {}, material {}", self.mesh.name, cover.name)
    }
}

/// Bytes that a shell takes for each triangle while it is built: points, tangents, prisms, hull, and
/// the tables by which vertices and edges find one another.
const SHELL_BYTES: u128 = 640;

/// Builds the surfaces of all meshes, relative to `origin`. `quads` is the number of quads that the scene has
/// besides.
///
/// # Errors
/// [`Error::Input`] where a part has no texture coordinates, a mesh has too many faces or carries no shell,
/// or the scene's settings do not go with shells; [`Error::Memory`] where the surfaces are too large.
pub(in crate::scene) fn build(
    v: &Values,
    meshes: &[SceneMesh],
    origin: DVec3,
    recipes: &[Recipe],
    quads: usize,
    limits: &Limits,
) -> Result<Surfaces> {
    let mut all = Surfaces::default();
    let mut taken: u128 = 0;
    for mesh in meshes {
        let used: BTreeSet<&Becomes> = mesh.used();
        let covers = used.iter().filter_map(|becomes| match becomes {
            Becomes::Material(name) => Some(cover(v, name, recipes)),
            _ => None,
        });
        let key = Key { mesh: mesh.clone(), origin, covers: covers.collect() };
        key.covers.iter().try_for_each(|cover| check(v, &key, cover))?;
        taken = key.check_size(quads + all.quads.len(), taken, limits.memory)?;
        let built = limits.models.built(key, |key| {
            Ok(Built {
                triangles: opaque::triangles(key, limits.memory)?,
                shells: shells::shells(key)?,
                untextured: untextured(key),
                ..faces::quads(key)?
            })
        })?;
        let shaded = |own: &Triangles| Triangles { shade: mesh.shade, ..own.clone() };
        all.triangles.extend(built.triangles.as_ref().map(shaded));
        all.quads.extend_from_slice(&built.quads);
        all.shells.extend(built.shells.iter().cloned());
        all.untextured.extend(built.untextured.iter().cloned());
        if built.unmapped > 0 {
            all.unmapped.push((mesh.name.clone(), built.unmapped));
        }
    }
    share_added(&mut all.triangles, u128::from(limits.memory).saturating_sub(taken));
    Ok(all)
}

/// Bytes of an opaque triangle: its vertices stand in the mesh, in what was made of the file, and on the
/// device.
const OPAQUE_BYTES: u64 = 3 * (3 * size_of::<Vertex>() as u64 + 24);

/// Shares the triangles that shade may add among the meshes that have shade. They take half of `memory` bytes
/// at most.
fn share_added(all: &mut [Triangles], memory: u128) {
    let fit = memory / 2 / u128::from(OPAQUE_BYTES + SHADE_BYTES);
    let most = fit.min(MAX_ADDED.into()) as u32;
    let count = all.iter().filter(|own| own.shade.is_wanted()).count().max(1) as u32;
    all.iter_mut().for_each(|own| own.shade.most_added = most / count);
}

impl SceneMesh {
    /// Whether its file shows any triangle.
    pub(in crate::scene) fn has_triangles(&self) -> bool {
        !self.used().is_empty()
    }

    /// What the parts that are shown become.
    pub(super) fn used(&self) -> BTreeSet<&Becomes> {
        let model = &self.loaded.model;
        let shown = model.nodes.iter().filter(|node| !node.instances.iter().all(is_collapsed));
        let primitives = shown.filter_map(|node| node.mesh).flat_map(|mesh| &model.meshes[mesh].primitives);
        primitives.filter(|primitive| !primitive.triangles.is_empty()).map(|p| self.becomes(p)).collect()
    }
}

fn cover(v: &Values, name: &str, recipes: &[Recipe]) -> Cover {
    let key = |what: &str| format!("materials.{name}.{what}");
    let float = |what: &str| v.float(&key(what));
    let volume = crate::scene::volumes::volume_of(v, name);
    let volume = recipes.iter().position(|recipe| recipe.name == volume);
    let volume = volume.expect("a volume that a mesh shows has a recipe");
    let side = v.choice(&key("side"), Side::from_word);
    let skin = side == Side::Outward && v.is_on(&key("skin"));
    Cover {
        name: name.into(),
        material: Material {
            thickness_m: float("thickness"),
            repeat_u: float("repeat_u"),
            repeat_v: float("repeat_v"),
            volume: volume as u32,
            billow: Billow::default(),
        },
        mist: float("mist"),
        carrier: v.choice(&key("carrier"), Carrier::from_word),
        side,
        skin,
        has_body: skin || recipes[volume].skin.is_some(),
        from: v.choice(&key("thickness_from"), ThicknessFrom::from_word),
    }
}

/// Checks that the settings of a scene go with a cover.
fn check(v: &Values, key: &Key, cover: &Cover) -> Result<()> {
    if cover.carrier == Carrier::Face {
        return Ok(());
    }
    let (words, name) = (key.words(cover), &cover.name);
    let bad = |what: &str, fix: String| Err(Error::input(format!("{words}: a shell {what}"), fix));
    let or_face = format!("or materials.{name}.carrier=face");
    if v.choice("trace.attenuation", AttenuationKind::from_word) == AttenuationKind::PerCell {
        return bad(
            "needs attenuation by length, and trace.attenuation is \"per-cell\"",
            format!("set trace.attenuation=path-length with a trace.sigma, {or_face}"),
        );
    }
    if cover.mist > 0.0 {
        return bad(
            &format!("cannot be mist, and materials.{name}.mist is {}", cover.mist),
            format!("set materials.{name}.mist=0, {or_face}"),
        );
    }
    Ok(())
}

impl Key {
    /// Checks that the surfaces fit, before anything of them is made. `quads` and `taken` are the quads and
    /// bytes of what is there already. Returns the bytes with those of this mesh.
    fn check_size(&self, quads: usize, taken: u128, memory: u64) -> Result<u128> {
        let (mut opaque, mut shelled, mut faces): (u128, u128, u128) = (0, 0, 0);
        for part in self.parts() {
            let count = part.primitive.triangles.len() as u128;
            if self.is_opaque(&part) {
                opaque += count;
            }
            if let Becomes::Material(name) = self.mesh.becomes(part.primitive) {
                match self.covers.iter().find(|cover| cover.name == *name).map(|cover| cover.carrier) {
                    Some(Carrier::Shell) => shelled += count,
                    _ => faces += count,
                }
            }
        }
        let name = &self.mesh.name;
        // Two triangles may be one face.
        if quads as u128 + faces.div_ceil(2) > MAX_QUADS as u128 {
            return Err(too_many_faces(name, faces));
        }
        let shade = if self.mesh.shade.is_wanted() { SHADE_BYTES } else { 0 };
        let painting = Plan::new(self).bytes(self, memory)?;
        let need = taken + opaque * u128::from(OPAQUE_BYTES + shade) + painting + shelled * SHELL_BYTES;
        // Numbers of vertices and of points have 32 bits.
        if need > u128::from(memory) || opaque > 1 << 28 {
            return Err(Error::memory(
                format!("mesh {name} with {} triangles", opaque.max(shelled)),
                need,
                memory,
                "simplify it in the program that made it, or raise --memory",
            ));
        }
        Ok(need)
    }
}

/// The error for a mesh with more faces than a scene may have quads.
pub(super) fn too_many_faces(name: &str, faces: u128) -> Error {
    Error::input(
        format!("mesh {name} has {faces} triangles that carry the volume as faces"),
        format!(
            "a scene has at most {MAX_QUADS} quads and faces: set carrier = \"shell\" in their material, \
             which has no such limit, or simplify the mesh"
        ),
    )
}

/// The error for a part without texture coordinates.
pub(super) fn no_coordinates(key: &Key, cover: &Cover, primitive: &Primitive) -> Error {
    let mesh = &key.mesh;
    let parts = match primitive.material.map(|i| mesh.loaded.model.materials[i].name.as_str()) {
        None => "the parts without a material".to_owned(),
        Some("") => "the parts with a material without a name".into(),
        Some(name) => format!("the parts {name:?}"),
    };
    let sets = match primitive.uvs.len() {
        0 => "no texture coordinates".to_owned(),
        n => format!("{n} sets of texture coordinates, and none of number {}", mesh.uv),
    };
    let name = &mesh.name;
    let projections = Projection::WORDS[1..].join(", ");
    Error::input(
        format!("{}: {parts} of {} have {sets}", key.words(cover), mesh.file.display()),
        match primitive.uvs.len() {
            0 => format!(
                "unwrap the mesh in the program that made it, or set meshes.{name}.projection to one of \
                 {projections}"
            ),
            n => format!("set meshes.{name}.uv to 0 to {}", n - 1),
        },
    )
}
