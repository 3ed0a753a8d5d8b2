//! §3 The opaque mesh in tiles: those out of view are not drawn, the nearest are drawn first.
//!
//! Software Vulkan shades vertices for 1023 indices at a time and knows in them the last vertex of each of
//! 256 places. So vertices have numbers in their tile, of which two rows never share a place, and the shader
//! finds where they are.

use std::ops::Range;

use glam::{DVec3, DVec4, Mat4};

use super::layout::MeshTile;
use crate::place::tiles::{self, Tile};

/// What is drawn of a tile: its indices, and the box that it lies in.
#[derive(Clone, Debug)]
pub struct Part {
    /// Number of the tile.
    pub tile: u32,
    /// Of the indices of [`lists`].
    pub indices: Range<u32>,
    low: DVec3,
    high: DVec3,
}

/// The triangles of all kinds of tiles, one list after the other, and where they are.
pub fn lists() -> (Vec<u32>, Vec<Range<u32>>) {
    let mut indices: Vec<u32> = Vec::new();
    let mut ranges = Vec::new();
    for number in 0..tiles::LISTS {
        let first = indices.len() as u32;
        indices.extend(tiles::list(number).iter().map(|&corner| u32::from(corner)));
        ranges.push(first..indices.len() as u32);
    }
    (indices, ranges)
}

/// The tiles as shaders read them.
pub fn packed(tiles: &[Tile]) -> Vec<MeshTile> {
    tiles.iter().map(|t| MeshTile { first: t.first, pitch: t.pitch, side: t.side, pad: 0 }).collect()
}

/// What is drawn with these steps: of the rock, and of each pool.
pub fn parts(tiles: &[Tile], steps: &[u32], ranges: &[Range<u32>]) -> (Vec<Part>, Vec<Vec<Part>>) {
    let (mut rock, mut pools) = (Vec::new(), Vec::<Vec<Part>>::new());
    for (i, tile) in tiles.iter().enumerate() {
        let list = tiles::list_number(tile.side, steps[i], tiles::coarser(tiles, steps, i));
        let part = Part {
            tile: i as u32,
            indices: ranges[list].clone(),
            low: tile.low.as_dvec3(),
            high: tile.high.as_dvec3(),
        };
        if tile.pool == 0 {
            rock.push(part);
        } else {
            pools.resize_with(pools.len().max(tile.pool as usize), Vec::new);
            pools[tile.pool as usize - 1].push(part);
        }
    }
    (rock, pools)
}

/// The parts that may be seen in a window, the nearest to the eye first.
pub fn in_view(parts: &[Part], clip_from_world: Mat4, eye: DVec3) -> Vec<&Part> {
    let mut seen: Vec<(f64, &Part)> = parts
        .iter()
        .filter(|part| part.may_be_seen(clip_from_world))
        .map(|part| (eye.distance_squared(eye.clamp(part.low, part.high)), part))
        .collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    seen.into_iter().map(|(_, part)| part).collect()
}

impl Part {
    /// Whether its box reaches into the view, or the rounding of a device might see it there.
    fn may_be_seen(&self, clip_from_world: Mat4) -> bool {
        let [x, y, _, w] = [0, 1, 2, 3].map(|i| clip_from_world.row(i).as_dvec4());
        let near = f64::from(clip_from_world.w_axis.z);
        let far_corner = self.low.abs().max(self.high.abs()).extend(1.0);
        // A sum of four products is off by less than this share of what their sizes add up to.
        const ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
        // In view where all of them are positive.
        let planes = [w + x, w - x, w + y, w - y, w - DVec4::W * near];
        planes.iter().all(|plane| {
            // Its corner farthest on the plane's inner side.
            let normal = plane.truncate();
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), self.high, self.low);
            let room = ROUNDING * (x.abs() + y.abs() + w.abs()).dot(far_corner);
            plane.dot(corner.extend(1.0)) >= -room
        })
    }
}
