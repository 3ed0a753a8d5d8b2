//! §3 Textures, roughness and relief of opaque triangles: what a mesh brings, and how the raster pass reads
//! it.

mod sample;
mod split;
pub mod texture;

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use crate::model::Wrap;
pub use sample::{MOST_STRETCH, MOST_TAPS, Painted, Sight};
use texture::{Texture, dropped, size_at};

/// Most sets of texture coordinates that a corner has: one for each of a finish's textures.
pub const MOST_SLOTS: u32 = 3;

/// A texture as a finish uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Number of the texture among those of the mesh.
    pub texture: usize,
    /// Number of its texture coordinates among those of a corner.
    pub slot: u32,
    /// Continuation along u and along v.
    pub wrap: [Wrap; 2],
    /// Whether a texel is enlarged without interpolation.
    pub nearest: bool,
}

/// What the triangles of one material look like.
#[derive(Clone, Debug, PartialEq)]
pub struct Finish {
    /// Factor of the albedo.
    pub color: Option<Layer>,
    /// Factors of roughness (green) and of how metallic it is (blue).
    pub surface: Option<Layer>,
    /// Normals in tangent space.
    pub relief: Option<Layer>,
    /// Factor of the normals' x and y.
    pub relief_scale: f32,
    /// Roughness, 0 to 1, and how metallic it is, 0 to 1. `None`: it is Lambertian.
    pub gloss: Option<[f32; 2]>,
    /// Sets of texture coordinates that each corner has.
    pub slots: u32,
}

/// Consecutive triangles with one finish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Number of triangles.
    pub triangles: u32,
    /// Number of the finish; `None` for triangles that are shaded as rock is.
    pub finish: Option<usize>,
}

/// Finishes of the triangles of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Painting {
    /// Textures.
    pub textures: Vec<Arc<Texture>>,
    /// Finishes.
    pub finishes: Vec<Finish>,
    /// All triangles, in their order.
    pub stretches: Vec<Stretch>,
    /// Texture coordinates: triangle by triangle, corner by corner, slot by slot.
    pub coordinates: Vec<[f32; 2]>,
}

/// A [`Layer`] as shaders read it. Twin: `shaders/engine/paint.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[allow(missing_docs)] // The shaders' structs describe the fields.
pub struct TextureUse {
    pub first: u32,
    pub size: u32,
    pub levels: u32,
    pub rule: u32,
}

/// A [`Finish`] as shaders read it. Twin: `shaders/engine/paint.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Paint {
    pub color: TextureUse,
    pub surface: TextureUse,
    pub relief: TextureUse,
    pub relief_scale: f32,
    pub roughness: f32,
    pub metallic: f32,
    pub has_gloss: u32,
    pub slots: u32,
}

/// Paints of the opaque mesh of a scene, as both engines read them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paints {
    /// Paints. A tile has the number of its paint plus 1.
    pub all: Vec<Paint>,
    /// Texture coordinates of corners.
    pub coordinates: Vec<[f32; 2]>,
    /// Textures: each begins with the places of its levels, relative to its own; texels follow.
    pub words: Vec<u32>,
}

impl Layer {
    /// The bits of [`TextureUse::rule`].
    fn rule(&self, is_srgb: bool) -> u32 {
        let code = |wrap: Wrap| match wrap {
            Wrap::Repeat => REPEAT,
            Wrap::Mirror => MIRROR,
            Wrap::Clamp => CLAMP,
        };
        let [u, v] = self.wrap.map(code);
        self.slot | u << 2 | v << 4 | u32::from(self.nearest) << 6 | u32::from(is_srgb) << 7
    }
}

const REPEAT: u32 = 0;
/// Code of [`Wrap::Mirror`] in shaders.
pub const MIRROR: u32 = 1;
/// Code of [`Wrap::Clamp`] in shaders.
pub const CLAMP: u32 = 2;

impl TextureUse {
    /// Whether there is a texture.
    pub fn is_some(&self) -> bool {
        self.levels > 0
    }

    /// Width and height of a level, texels.
    fn size_at(&self, level: u32) -> [u32; 2] {
        size_at([self.size & 0xffff, self.size >> 16], level)
    }

    /// Number of the texture coordinates.
    fn slot(&self) -> usize {
        (self.rule & 3) as usize
    }

    /// Codes of the continuation along u and v.
    fn wrap(&self) -> [u32; 2] {
        [self.rule >> 2 & 3, self.rule >> 4 & 3]
    }

    fn is_nearest(&self) -> bool {
        self.rule >> 6 & 1 == 1
    }

    fn is_srgb(&self) -> bool {
        self.rule >> 7 & 1 == 1
    }
}

impl Painting {
    /// Bytes that textures and texture coordinates take in memory.
    pub fn bytes(&self) -> u64 {
        let textures: u64 = self.textures.iter().map(|texture| texture.bytes()).sum();
        textures + 8 * self.coordinates.len() as u64
    }

    /// Iterates over the stretches: the triangles of each, the number of its first texture coordinates, and
    /// its finish.
    pub fn parts(&self) -> impl Iterator<Item = (Range<usize>, usize, Option<usize>)> {
        let (mut triangle, mut coordinate) = (0, 0);
        self.stretches.iter().map(move |stretch| {
            let (first, own) = (triangle, coordinate);
            triangle += stretch.triangles as usize;
            let slots = stretch.finish.map_or(0, |finish| self.finishes[finish].slots as usize);
            coordinate += 3 * slots * stretch.triangles as usize;
            (first..triangle, own, stretch.finish)
        })
    }
}

impl Paints {
    /// Returns the mean colour by which a paint multiplies the albedo.
    pub fn tint(&self, paint: &Paint) -> Vec3 {
        match paint.color.is_some() {
            true => self.sample(&paint.color, Vec2::ZERO, f32::INFINITY),
            false => Vec3::ONE,
        }
    }

    /// Joins the paintings of meshes. Textures that take more than `most` bytes together lose their finest
    /// levels. Returns the paints, and for each painting the numbers of its first paint and its first texture
    /// coordinates.
    pub fn join<'a>(
        paintings: impl Iterator<Item = &'a Painting> + Clone,
        most: u64,
    ) -> (Paints, Vec<[usize; 2]>) {
        let textures = distinct(paintings.clone());
        let drops = drops(&textures, most);
        let mut out = Paints::default();
        let places: Vec<u32> = textures.iter().zip(&drops).map(|(t, &drop)| out.add(t, drop)).collect();
        let mut firsts = Vec::new();
        for painting in paintings {
            firsts.push([out.all.len(), out.coordinates.len()]);
            let used = |layer: &Option<Layer>| {
                let Some(layer) = layer else { return TextureUse::default() };
                let texture = &painting.textures[layer.texture];
                let i = textures.iter().position(|known| Arc::ptr_eq(known, texture));
                let i = i.expect("all textures were added");
                let [width, height] = size_at(texture.size, drops[i]);
                TextureUse {
                    first: places[i],
                    size: width | height << 16,
                    levels: texture.levels.len() as u32 - drops[i],
                    rule: layer.rule(texture.is_srgb),
                }
            };
            out.all.extend(painting.finishes.iter().map(|finish| Paint {
                color: used(&finish.color),
                surface: used(&finish.surface),
                relief: used(&finish.relief),
                relief_scale: finish.relief_scale,
                roughness: finish.gloss.map_or(1.0, |[roughness, _]| roughness),
                metallic: finish.gloss.map_or(0.0, |[_, metallic]| metallic),
                has_gloss: u32::from(finish.gloss.is_some()),
                slots: finish.slots,
            }));
            out.coordinates.extend_from_slice(&painting.coordinates);
        }
        (out, firsts)
    }

    /// Adds a texture without its `drop` finest levels. Returns its place.
    fn add(&mut self, texture: &Texture, drop: u32) -> u32 {
        let first = self.words.len() as u32;
        let levels = &texture.levels[drop as usize..];
        let mut place = levels.len() as u32;
        for level in levels {
            self.words.push(place);
            place += level.len() as u32;
        }
        levels.iter().for_each(|level| self.words.extend_from_slice(level));
        first
    }
}

/// Returns the textures of paintings, each once.
fn distinct<'a>(paintings: impl Iterator<Item = &'a Painting>) -> Vec<Arc<Texture>> {
    let mut textures: Vec<Arc<Texture>> = Vec::new();
    for texture in paintings.flat_map(|painting| &painting.textures) {
        if !textures.iter().any(|known| Arc::ptr_eq(known, texture)) {
            textures.push(texture.clone());
        }
    }
    textures
}

fn drops(textures: &[Arc<Texture>], most: u64) -> Vec<u32> {
    dropped(&textures.iter().map(|texture| texture.size).collect::<Vec<_>>(), most)
}

/// Returns the number of textures that have lost their finest levels, so that all fit `most` bytes; and the
/// largest number of levels that one of them has lost.
pub fn coarsened<'a>(paintings: impl Iterator<Item = &'a Painting>, most: u64) -> (usize, u32) {
    let textures = distinct(paintings);
    let lost = drops(&textures, most).into_iter().zip(&textures).map(|(drop, t)| drop + t.dropped);
    let lost: Vec<u32> = lost.filter(|&lost| lost > 0).collect();
    (lost.len(), lost.into_iter().max().unwrap_or(0))
}
