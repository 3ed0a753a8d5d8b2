//! Textures and roughness of the opaque parts of a mesh.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use rayon::prelude::*;

use super::build::{Key, Part};
use crate::model::{ModelMaterial, Primitive, TextureRef, TextureTransform, Wrap};
use crate::place::paint::texture::{MOST_BYTES, dropped, pyramid_bytes, size_at};
use crate::place::paint::{Finish, Layer, MOST_SLOTS, Painting, Stretch};
use crate::util::error::{Error, Result};

/// Triangles whose coordinates one thread makes at a time.
const AT_ONCE: usize = 4096;

/// Largest texture coordinate. Multiplied by the largest texture's width it is a whole number of 32 bits.
const MOST_COORDINATE: f32 = 30_000.0;

/// Copies of textures and coordinates: those of the mesh, those that all meshes share, and the device's.
const COPIES: u128 = 3;

/// A set of texture coordinates with its transform, and the continuation by which it may be moved.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    set: usize,
    transform: TextureTransform,
    wrap: [Wrap; 2],
}

/// An image as it is looked up: its number, and whether its codes are those of sRGB.
type ImageUse = (usize, bool);

/// Finishes of the opaque parts of a mesh, and the images that they need.
#[derive(Default)]
pub(super) struct Plan {
    images: Vec<ImageUse>,
    finishes: Vec<Finish>,
    /// Texture coordinates of each finish.
    slots: Vec<Vec<Slot>>,
    /// Finish of the parts with a material and a number of sets of coordinates.
    of_parts: HashMap<(Option<usize>, usize), Option<usize>>,
    /// Corners times slots of all parts.
    coordinates: u128,
}

impl Plan {
    /// Plans the finishes of a mesh. One with a colour of its own needs none.
    pub fn new(key: &Key) -> Plan {
        let mut plan = Plan::default();
        if key.mesh.color.is_some() {
            return plan;
        }
        for part in key.parts().filter(|part| key.is_opaque(part)) {
            let primitive = part.primitive;
            let name = (primitive.material, primitive.uvs.len());
            let finish = match plan.of_parts.get(&name) {
                Some(known) => *known,
                None => {
                    let made = plan.finish(key, primitive);
                    plan.of_parts.insert(name, made);
                    made
                }
            };
            let slots = finish.map_or(0, |finish| plan.slots[finish].len());
            plan.coordinates += 3 * slots as u128 * primitive.triangles.len() as u128;
        }
        plan
    }

    /// Adds the finish of a primitive. Returns its number, or `None` where rock's shading is all it needs.
    fn finish(&mut self, key: &Key, primitive: &Primitive) -> Option<usize> {
        let material = &key.mesh.loaded.model.materials[primitive.material?];
        let mut slots = Vec::new();
        let mut layer = |texture: &Option<TextureRef>, is_srgb| {
            let texture = texture.as_ref().filter(|texture| (texture.set as usize) < primitive.uvs.len())?;
            let slot = Slot { set: texture.set as usize, transform: texture.transform, wrap: texture.wrap };
            Some(Layer {
                texture: number_of(&mut self.images, (texture.image, is_srgb)),
                slot: number_of(&mut slots, slot) as u32,
                wrap: texture.wrap,
                nearest: texture.nearest,
            })
        };
        let finish = Finish {
            color: layer(&material.base_color_texture, true),
            surface: layer(&material.roughness_texture, false),
            relief: layer(&material.normal_texture, false),
            relief_scale: material.normal_scale,
            gloss: gloss(material),
            slots: slots.len() as u32,
        };
        if slots.is_empty() && finish.gloss.is_none() {
            return None;
        }
        self.finishes.push(finish);
        self.slots.push(slots);
        Some(self.finishes.len() - 1)
    }

    /// Returns the levels that each image drops, and the bytes of all that is left.
    fn drops(&self, key: &Key, memory: u64) -> Result<(Vec<u32>, u64)> {
        let size = |&(image, _): &ImageUse| key.mesh.loaded.image_size(image, memory);
        let sizes = self.images.iter().map(size).collect::<Result<Vec<_>>>()?;
        let drops = dropped(&sizes, MOST_BYTES);
        let bytes = sizes.iter().zip(&drops).map(|(&size, &drop)| pyramid_bytes(size_at(size, drop))).sum();
        Ok((drops, bytes))
    }

    /// Returns the bytes that textures and their coordinates will take.
    ///
    /// # Errors
    /// Those of [`Loaded::image_size`](super::Loaded::image_size).
    pub fn bytes(&self, key: &Key, memory: u64) -> Result<u128> {
        Ok(COPIES * (u128::from(self.drops(key, memory)?.1) + 8 * self.coordinates))
    }

    /// Makes textures and coordinates within `memory` bytes; `None` where no part needs any.
    ///
    /// # Errors
    /// [`Error::Input`] where an image is missing or broken, [`Error::Memory`] where they are too large.
    pub fn painting(self, key: &Key, memory: u64) -> Result<Option<Arc<Painting>>> {
        if self.finishes.is_empty() {
            return Ok(None);
        }
        let (drops, bytes) = self.drops(key, memory)?;
        let need = COPIES * u128::from(bytes);
        if need > u128::from(memory) {
            let what = format!("the textures of mesh {}", key.mesh.name);
            return Err(Error::memory(what, need, memory, "scale them down, or raise --memory"));
        }
        let left = memory - need as u64;
        let of = |(&(image, is_srgb), &drop)| key.mesh.loaded.texture(image, is_srgb, drop, left);
        let textures = self.images.iter().zip(&drops).map(of).collect::<Result<Vec<_>>>()?;
        let (mut stretches, mut coordinates) = (Vec::new(), Vec::new());
        for part in key.parts().filter(|part| key.is_opaque(part)) {
            let primitive = part.primitive;
            let finish = self.of_parts[&(primitive.material, primitive.uvs.len())];
            stretches.push(Stretch { triangles: primitive.triangles.len() as u32, finish });
            if let Some(finish) = finish {
                add_coordinates(&part, &self.slots[finish], &mut coordinates);
            }
        }
        Ok(Some(Arc::new(Painting { textures, finishes: self.finishes, stretches, coordinates })))
    }
}

/// Most sentences about textures without coordinates.
const MOST_SENTENCES: usize = 8;

/// Returns a sentence about each material of the opaque parts of a mesh with a texture whose coordinates the
/// mesh does not have. Such a texture is left out.
pub(super) fn untextured(key: &Key) -> Vec<String> {
    if key.mesh.color.is_some() {
        return Vec::new();
    }
    let materials = &key.mesh.loaded.model.materials;
    let mut lacking: BTreeMap<(usize, u32), usize> = BTreeMap::new();
    for part in key.parts().filter(|part| key.is_opaque(part)) {
        let Some(number) = part.primitive.material else { continue };
        let (material, has) = (&materials[number], part.primitive.uvs.len());
        let textures = [&material.base_color_texture, &material.roughness_texture, &material.normal_texture];
        for set in
            textures.into_iter().flatten().map(|texture| texture.set).filter(|set| *set as usize >= has)
        {
            let least = lacking.entry((number, set)).or_insert(has);
            *least = has.min(*least);
        }
    }
    let more = lacking.len().saturating_sub(MOST_SENTENCES);
    let sentence = |(&(number, set), has): (&(usize, u32), &usize)| {
        format!(
            "mesh {}, material {}: its texture uses set {set} of texture coordinates; the mesh has {has}, \
             and is plain there",
            key.mesh.name, materials[number].name
        )
    };
    let mut all: Vec<String> = lacking.iter().take(MOST_SENTENCES).map(sentence).collect();
    if more > 0 {
        all.push(format!("mesh {}: {more} more textures have no coordinates", key.mesh.name));
    }
    all
}

/// Returns the number of an item in a list, which is added unless it is there.
fn number_of<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// Roughness, and how metallic it is. `None` where the file says nothing of either, and where a dielectric is
/// as rough as can be: its lobe is too weak to be seen beside its diffuse light.
fn gloss(material: &ModelMaterial) -> Option<[f32; 2]> {
    let [roughness, metallic] = [material.roughness, material.metallic];
    let is_dull = roughness == 1.0 && metallic == 0.0 && material.roughness_texture.is_none();
    (material.says_roughness && !is_dull).then_some([roughness, metallic])
}

/// Adds the texture coordinates of a part's corners.
fn add_coordinates(part: &Part, slots: &[Slot], out: &mut Vec<[f32; 2]>) {
    let count = slots.len();
    let own = |&corners: &[u32; 3]| {
        let corners = part.facing(corners);
        let mut all = [[0.0; 2]; 3 * MOST_SLOTS as usize];
        for (s, slot) in slots.iter().enumerate() {
            let uvs = corners.map(|i| slot.transform.apply(part.primitive.uvs[slot.set][i as usize]));
            let uvs = near_origin(uvs, slot.wrap);
            (0..3).for_each(|k| all[count * k + s] = uvs[k]);
        }
        all.into_iter().take(3 * count)
    };
    let triangles = part.primitive.triangles.par_chunks(AT_ONCE);
    out.par_extend(triangles.flat_map_iter(|triangles| triangles.iter().flat_map(own)));
}

/// Moves the coordinates of a triangle by whole copies of its texture to the origin, where they have more
/// digits, and bounds them.
fn near_origin(uvs: [[f32; 2]; 3], wrap: [Wrap; 2]) -> [[f32; 2]; 3] {
    let mut out = uvs.map(|uv| uv.map(|x| if x.is_finite() { x } else { 0.0 }));
    for axis in 0..2 {
        let least = out.iter().map(|uv| uv[axis]).fold(f32::INFINITY, f32::min);
        // A mirrored texture repeats after two copies.
        let move_by = if wrap[axis] == Wrap::Clamp { 0.0 } else { 2.0 * (least / 2.0).floor() };
        for uv in &mut out {
            uv[axis] = (uv[axis] - move_by).clamp(-MOST_COORDINATE, MOST_COORDINATE);
        }
    }
    out
}
