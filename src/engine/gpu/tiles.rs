//! §3 The tiles of the opaque mesh that are drawn: only those in view, the nearest first.
//!
//! Software Vulkan shades vertices in batches of 1023 indices, with a cache of 256 slots that each hold one
//! vertex. Indices therefore number the vertices within their tile, so that no two rows share a slot, and the
//! shader computes the vertex's index in the mesh.

use std::ops::Range;

use glam::{DVec3, Mat4};

use super::layout::MeshTile;
use crate::place::tiles::{self, Tile};

/// The drawn triangles of a tile, and the tile's bounding box.
#[derive(Clone, Debug)]
pub struct Part {
    /// Number of the tile.
    pub tile: u32,
    /// Range of its indices in those of [`lists`].
    pub indices: Range<u32>,
    low: DVec3,
    high: DVec3,
}

/// Returns the indices of all lists of triangles, one list after the other, and the range of each list.
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

/// Returns the tiles as shaders read them.
pub fn packed(tiles: &[Tile]) -> Vec<MeshTile> {
    let packed = |t: &Tile| MeshTile {
        first: t.first,
        pitch: t.pitch,
        side: t.side,
        holdout: u32::from(t.holdout),
        paint: t.paint,
        coordinates: t.coordinates,
        stone: t.stone,
    };
    tiles.iter().map(packed).collect()
}

/// Returns the parts of the rock, and those of each pool, that are drawn with these steps of the tiles'
/// grids.
pub fn parts(tiles: &[Tile], steps: &[u32], ranges: &[Range<u32>]) -> (Vec<Part>, Vec<Vec<Part>>) {
    let (mut rock, mut pools) = (Vec::new(), Vec::<Vec<Part>>::new());
    for (i, tile) in tiles.iter().enumerate() {
        let (list, count) = tile.list_number(steps[i], tiles::coarser(tiles, steps, i));
        let first = ranges[list].start;
        let part = Part {
            tile: i as u32,
            indices: first..first + count as u32,
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

/// Returns the parts that may be visible in a window, the nearest to the eye first.
pub fn in_view(parts: &[Part], clip_from_world: Mat4, eye: DVec3) -> Vec<&Part> {
    let mut visible: Vec<(f64, &Part)> = parts
        .iter()
        .filter(|part| part.may_be_visible(clip_from_world))
        .map(|part| (eye.distance_squared(eye.clamp(part.low, part.high)), part))
        .collect();
    visible.sort_by(|a, b| a.0.total_cmp(&b.0));
    visible.into_iter().map(|(_, part)| part).collect()
}

impl Part {
    /// Whether the bounding box reaches into the view, or is outside by no more than a device may round.
    fn may_be_visible(&self, clip_from_world: Mat4) -> bool {
        let [x, y, z, w] = [0, 1, 2, 3].map(|i| clip_from_world.row(i).as_dvec4());
        let far_corner = self.low.abs().max(self.high.abs()).extend(1.0);
        // The rounding error of a sum of four products is below this share of the sum of their magnitudes.
        const ROUNDING: f64 = 8.0 * f32::EPSILON as f64;
        // A point is in view if it lies on the positive side of all planes.
        let planes = [w + x, w - x, w + y, w - y, w - z];
        planes.iter().all(|plane| {
            // The corner that lies farthest on the plane's positive side.
            let normal = plane.truncate();
            let corner = DVec3::select(normal.cmpge(DVec3::ZERO), self.high, self.low);
            let margin = ROUNDING * (x.abs() + y.abs() + z.abs() + w.abs()).dot(far_corner);
            plane.dot(corner.extend(1.0)) >= -margin
        })
    }
}
