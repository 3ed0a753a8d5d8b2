//! Level of detail of the opaque mesh: a picture draws only as many vertices of each tile as it needs.
//!
//! Rocks and pools are grids of squares, which are cut into tiles. A tile is drawn with every 1st, 2nd, 4th …
//! vertex (de Boer, "Fast Terrain Rendering Using Geometrical MipMapping", 2000). Shading always uses all
//! vertices: a sample finds its position on the grid, and interpolates the three nearest vertices as if all
//! were drawn. A coarser tile therefore changes outlines and depth slightly, but no normals, albedo or
//! shadows.
//!
//! The triangles of other programs' meshes are tiles too. Such a tile is a list of up to [`TRIANGLES`]
//! triangles with three vertices each, and is always drawn whole. Its positions number the triangles: the
//! corners of triangle t lie at (2t + ¼, ¼), (2t + ¾, ¼) and (2t + ¼, ¾), so that rounding leads into no
//! other triangle.

use std::sync::LazyLock;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::Vertex;
use crate::picture::{Camera, Image};

/// Squares on a side of a tile, if its grid has as many. With twice as many, more is drawn outside the view;
/// with half as many, drawing the tiles one by one takes longer.
pub const SIDE: u32 = 16;
/// Triangles of a tile that is no grid.
pub const TRIANGLES: u32 = 128;
/// Number of steps: 1, 2, 4, 8 and 16.
const STEPS: usize = 5;

/// A square part of a grid of vertices, or some triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Index of the first vertex.
    pub first: u32,
    /// Vertices in a row of the grid; 0 for triangles.
    pub pitch: u32,
    /// Squares on a side, [`SIDE`] or a smaller power of two; the number of triangles that are no grid.
    pub side: u32,
    /// Number of the pool plus 1; 0 for rock.
    pub pool: u32,
    /// Whether a picture with an alpha channel has a hole in its place.
    pub holdout: bool,
    /// Number of the paint plus 1; 0 for what is shaded as rock is.
    pub paint: u32,
    /// Number of the first texture coordinates of its triangles.
    pub coordinates: u32,
    /// Number of the stone plus 1; 0 for plain rock and all else.
    pub stone: u32,
    /// Neighbours in the same grid at the edges y = 0, x = side, y = side and x = 0.
    pub neighbours: [Option<u32>; 4],
    /// Lower corner of the bounding box, metres.
    pub low: Vec3,
    /// Upper corner of the bounding box, metres.
    pub high: Vec3,
    /// Unit normal of the grid's patch.
    out: Vec3,
    /// Distance between the vertices and the triangles drawn in their place, for each step, along `out` and
    /// across it: the root mean square, or a third of the largest distance where that is more; metres.
    lost: [Vec2; STEPS],
}

/// Cuts consecutive grids into tiles. `grids` are the squares on a side of each, powers of two, and whether
/// it is a holdout.
pub fn cut(vertices: &[Vertex], grids: impl Iterator<Item = (u32, bool)>) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let mut first = 0;
    for (squares, holdout) in grids {
        let (side, pitch) = (squares.min(SIDE), squares + 1);
        let (across, number) = (squares / side, tiles.len() as u32);
        let corner = |x, y| Vec3::from(vertices[(first + y * pitch + x) as usize].position);
        let diagonals = [corner(squares, squares) - corner(0, 0), corner(0, squares) - corner(squares, 0)];
        let out = diagonals[0].cross(diagonals[1]).normalize_or(Vec3::Z);
        for y in 0..across {
            for x in 0..across {
                let own = number + y * across + x;
                let tile = Tile {
                    first: first + (y * pitch + x) * side,
                    pitch,
                    side,
                    pool: vertices[first as usize].pool,
                    holdout,
                    paint: 0,
                    coordinates: 0,
                    stone: 0,
                    neighbours: [
                        (y > 0).then(|| own - across),
                        (x + 1 < across).then_some(own + 1),
                        (y + 1 < across).then_some(own + across),
                        (x > 0).then(|| own - 1),
                    ],
                    low: Vec3::INFINITY,
                    high: Vec3::NEG_INFINITY,
                    out,
                    lost: [Vec2::ZERO; STEPS],
                };
                tiles.push(tile);
            }
        }
        first += pitch * pitch;
    }
    tiles.par_iter_mut().for_each(|tile| tile.measure(vertices));
    tiles
}

/// Cuts triangles without a grid into tiles. The vertices from index `first` on are theirs, three each.
pub fn cut_triangles(vertices: &[Vertex], first: u32, holdout: bool) -> impl Iterator<Item = Tile> {
    let per_tile = 3 * TRIANGLES as usize;
    vertices[first as usize..].chunks(per_tile).enumerate().map(move |(i, own)| {
        let positions = own.iter().map(|vertex| Vec3::from(vertex.position));
        Tile {
            first: first + (i * per_tile) as u32,
            pitch: 0,
            side: (own.len() / 3) as u32,
            pool: 0,
            holdout,
            paint: 0,
            coordinates: 0,
            stone: 0,
            neighbours: [None; 4],
            low: positions.clone().fold(Vec3::INFINITY, Vec3::min),
            high: positions.fold(Vec3::NEG_INFINITY, Vec3::max),
            out: Vec3::Z,
            // No other step is ever chosen.
            lost: [Vec2::ZERO, Vec2::INFINITY, Vec2::INFINITY, Vec2::INFINITY, Vec2::INFINITY],
        }
    })
}

/// Returns the step of each tile in an image.
///
/// A vertex that is left out lies about `lost` from the triangle in its place. Let θ be the angle between the
/// patch's normal and the view; at most lost · (sin θ, 1) of that distance is visible. At depth z and
/// distance r, a point of a picture with a focal length of f pixels moves by no more than f·r/z² times as
/// much. The step keeps this movement below `image.rock_error` of the distance between samples, 1/√samples
/// pixels: a smaller movement falls between samples. The steps of neighbouring tiles differ by at most a
/// factor of two. All windows and samples of an image have the same steps.
pub fn steps(tiles: &[Tile], camera: &Camera, image: &Image) -> Vec<u32> {
    let focal = 0.5 * f64::from(image.height) / f64::from(camera.tan_half_fov);
    let most = f64::from(image.rock_error) / (f64::from(image.samples).sqrt() * focal);
    let mut steps: Vec<u32> = tiles.iter().map(|tile| tile.step(camera, most)).collect();
    // A tile made finer may require finer neighbours in turn.
    let mut changed = true;
    while changed {
        changed = false;
        for (i, tile) in tiles.iter().enumerate() {
            let around = tile.neighbours.iter().flatten().map(|&other| steps[other as usize]);
            let most = 2 * around.min().unwrap_or(SIDE);
            if steps[i] > most {
                steps[i] = most;
                changed = true;
            }
        }
    }
    steps
}

/// Returns which edges of a tile border on coarser tiles.
pub fn coarser(tiles: &[Tile], steps: &[u32], tile: usize) -> [bool; 4] {
    tiles[tile].neighbours.map(|other| other.is_some_and(|other| steps[other as usize] > steps[tile]))
}

/// Number of lists of triangles. The last one numbers the corners of tiles that are no grids.
pub const LISTS: usize = GRID_LISTS + 1;

/// Number of lists for grids.
const GRID_LISTS: usize = STEPS * STEPS * 16;

/// Returns the number of the list for a grid's triangles.
fn list_number(side: u32, step: u32, coarser: [bool; 4]) -> usize {
    let edges: usize = (0..4).map(|edge| usize::from(coarser[edge]) << edge).sum();
    (side.ilog2() as usize * STEPS + step.ilog2() as usize) * 16 + edges
}

/// Returns a list of triangles by its number. It is empty where the step is larger than the side.
pub fn list(number: usize) -> &'static [u16] {
    static LISTS_MADE: LazyLock<Vec<Vec<u16>>> = LazyLock::new(|| {
        let made = |number: usize| {
            let [side, step] = [number / 16 / STEPS, number / 16 % STEPS].map(|k| 1u32 << k);
            make_list(side, step, [0, 1, 2, 3].map(|edge| number >> edge & 1 == 1))
        };
        (0..GRID_LISTS).map(made).chain([(0..3 * TRIANGLES as u16).collect()]).collect()
    });
    &LISTS_MADE[number]
}

/// Returns the column and row of a corner of a grid.
fn grid_point(corner: u16) -> [u32; 2] {
    let corner = u32::from(corner);
    [corner % (SIDE + 1), corner / (SIDE + 1)]
}

fn make_list(side: u32, step: u32, coarser: [bool; 4]) -> Vec<u16> {
    if step > side {
        return Vec::new();
    }
    let corner = |x: u32, y: u32| {
        let moved = |at: u32, moves: bool| if moves { at & !(2 * step - 1) } else { at };
        let x_moves = (y == 0 && coarser[0]) || (y == side && coarser[2]);
        let y_moves = (x == 0 && coarser[3]) || (x == side && coarser[1]);
        (moved(y, y_moves) * (SIDE + 1) + moved(x, x_moves)) as u16
    };
    let mut out = Vec::new();
    for y in (0..side).step_by(step as usize) {
        for x in (0..side).step_by(step as usize) {
            let (right, up) = (x + step, y + step);
            let [a, b, c, d] = [corner(x, y), corner(right, y), corner(right, up), corner(x, up)];
            for triangle in [[a, b, c], [a, c, d]] {
                if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                    out.extend(triangle);
                }
            }
        }
    }
    out
}

impl Tile {
    /// Whether the tile is a part of a grid.
    pub fn is_grid(&self) -> bool {
        self.pitch > 0
    }

    /// Returns the number of the list of the tile's triangles, drawn with a step of its grid, and how many
    /// entries of the list are its own. [`list`] gives the corners, three for each triangle. At an edge with
    /// a coarser tile, every other vertex moves to the one before it, so that both tiles have the same edges
    /// there.
    pub fn list_number(&self, step: u32, coarser: [bool; 4]) -> (usize, usize) {
        if !self.is_grid() {
            return (GRID_LISTS, 3 * self.side as usize);
        }
        let number = list_number(self.side, step, coarser);
        (number, list(number).len())
    }

    /// Returns the corners of the tile's triangles, three for each; see [`Tile::list_number`].
    pub fn triangles(&self, step: u32, coarser: [bool; 4]) -> &'static [u16] {
        let (number, count) = self.list_number(step, coarser);
        &list(number)[..count]
    }

    /// Returns the index of the vertex in a column and row of a grid.
    pub fn vertex(&self, [x, y]: [u32; 2]) -> u32 {
        self.first + y * self.pitch + x
    }

    /// Returns the index of the vertex of a corner.
    pub fn vertex_of(&self, corner: u16) -> u32 {
        if self.is_grid() { self.vertex(grid_point(corner)) } else { self.first + u32::from(corner) }
    }

    /// Returns the position of a corner in the tile: in squares of a grid, or between the triangles'.
    pub fn place_of(&self, corner: u16) -> Vec2 {
        if self.is_grid() {
            return Vec2::from(grid_point(corner).map(|i| i as f32));
        }
        let (triangle, k) = (corner / 3, corner % 3);
        let side = |is: bool| if is { 0.75 } else { 0.25 };
        Vec2::new(f32::from(2 * triangle) + side(k == 1), side(k == 2))
    }

    /// Returns the three vertices around a position in the tile, with their weights. Twin: `opaque_point` in
    /// shaders/engine/gbuffer.wgsl.
    pub fn around(&self, position: Vec2) -> ([u32; 3], Vec3) {
        if !self.is_grid() {
            let triangle = (position.x * 0.5).floor().clamp(0.0, self.side as f32 - 1.0);
            let b = ((position - Vec2::new(2.0 * triangle + 0.25, 0.25)) * 2.0).clamp(Vec2::ZERO, Vec2::ONE);
            let first = self.first + 3 * triangle as u32;
            return ([first, first + 1, first + 2], Vec3::new(1.0 - b.x - b.y, b.x, b.y));
        }
        let cell = position.clamp(Vec2::ZERO, Vec2::splat(self.side as f32 - 1.0)).as_uvec2().as_vec2();
        let f = (position - cell).clamp(Vec2::ZERO, Vec2::ONE);
        let a = self.vertex([cell.x as u32, cell.y as u32]);
        let b = if f.x >= f.y { a + 1 } else { a + self.pitch };
        let (low, high) = (f.min_element(), f.max_element());
        ([a, b, a + self.pitch + 1], Vec3::new(1.0 - high, high - low, low))
    }

    /// Sets the bounding box and `lost`.
    fn measure(&mut self, vertices: &[Vertex]) {
        let at = |x: u32, y: u32| Vec3::from(vertices[self.vertex([x, y]) as usize].position);
        let (mut low, mut high) = (self.low, self.high);
        for p in (0..=self.side).flat_map(|y| (0..=self.side).map(move |x| at(x, y))) {
            (low, high) = (low.min(p), high.max(p));
        }
        let mut lost = self.lost;
        for k in 1..STEPS {
            let step = 1 << k;
            if self.pool > 0 || step > self.side {
                lost[k] = Vec2::INFINITY;
                continue;
            }
            let (mut most, mut sum, mut count) = (Vec2::ZERO, Vec2::ZERO, 0.0);
            let squares = (0..self.side).step_by(step as usize);
            for (left, bottom) in squares.clone().flat_map(|x| squares.clone().map(move |y| (x, y))) {
                let (right, top) = (left + step, bottom + step);
                let [a, b, c, d] = [at(left, bottom), at(right, bottom), at(right, top), at(left, top)];
                for (x, y) in (0..=step).flat_map(|y| (0..=step).map(move |x| (x, y))) {
                    let [f, g] = [x, y].map(|i| i as f32 / step as f32);
                    let mixed =
                        if x >= y { a + (b - a) * f + (c - b) * g } else { a + (d - a) * g + (c - d) * f };
                    let away = at(left + x, bottom + y) - mixed;
                    let along = away.dot(self.out);
                    let parts = Vec2::new(along.abs(), (away - self.out * along).length());
                    most = most.max(parts);
                    sum += parts * parts;
                    count += 1.0;
                }
            }
            lost[k] = lost[k - 1].max((sum / count).map(f32::sqrt)).max(most / 3.0);
        }
        (self.low, self.high, self.lost) = (low, high, lost);
    }

    /// Returns the largest step that moves no point of the picture by more than `most` focal lengths.
    fn step(&self, camera: &Camera, most: f64) -> u32 {
        let corners = (0..8).map(|i| {
            let corner =
                Vec3::from_array([0, 1, 2].map(|c| if i >> c & 1 == 0 { self.low[c] } else { self.high[c] }));
            corner.as_dvec3() - camera.eye_local()
        });
        let (mut depth, mut distance, mut sin2) = (f64::INFINITY, 0f64, 0f64);
        let (mut front, mut back) = (false, false);
        for to_corner in corners {
            let (r, along) = (to_corner.length(), to_corner.dot(self.out.as_dvec3()));
            depth = depth.min(to_corner.dot(camera.forward));
            distance = distance.max(r);
            // Directions within one angle of the normal form a cone. It is convex, so it contains the box if
            // it contains the corners.
            sin2 = sin2.max(1.0 - (along / r) * (along / r));
            (front, back) = (front || along >= 0.0, back || along <= 0.0);
        }
        if depth <= f64::from(camera.near) {
            return 1;
        }
        let sin = if front && back { 1.0 } else { sin2.sqrt() };
        let effective_depth = depth * depth / distance;
        let fits = |lost: &Vec2| f64::from(lost.x) * sin + f64::from(lost.y) <= most * effective_depth;
        1 << (1..STEPS).take_while(|&k| fits(&self.lost[k])).count()
    }
}
