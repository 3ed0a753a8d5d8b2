//! The rasteriser of the CPU engine. It follows the fill rule of a GPU: points snap to 1/256 pixel, and
//! centres on an edge belong to the triangle whose top or left edge it is.
//!
//! Points are projected once, as the pixels' centres see them. The sample of a pixel that lies elsewhere sees
//! them shifted by its distance from the centre, and snapped after that, as if they were projected for it
//! alone. Four samples are drawn at a time, one a lane.

use std::ops::Range;

use fearless_simd::f64x4;
use fearless_simd::prelude::*;
use glam::{Vec2, Vec4};

use super::edges::{Edges, HALF, Shift, span, weights};
use crate::util::lanes::LANES;
use crate::util::window::Window;

/// Samples that are drawn at a time.
pub const SAMPLES: usize = 4;

/// Numbers that the triangles of one piece may have. A tile has 512 triangles, and the near plane cuts a
/// triangle into two at most.
const NUMBERS: u32 = 1024;

/// A point in pixels, as the pixels' centres see it.
#[derive(Clone, Copy, Debug)]
pub struct ScreenPoint {
    pub x: f64,
    pub y: f64,
    pub inverse_w: f64,
    /// Reversed depth z/w.
    pub depth: f64,
    /// Position in the tile, in squares of its grid.
    place: Vec2,
}

impl ScreenPoint {
    /// Projects a point in clip space to an image of `width` × `height` pixels.
    #[inline]
    pub fn new(c: Vec4, [width, height]: [usize; 2], place: Vec2) -> Self {
        ScreenPoint {
            x: (c.x as f64 / c.w as f64 * 0.5 + 0.5) * width as f64,
            y: (0.5 - c.y as f64 / c.w as f64 * 0.5) * height as f64,
            inverse_w: 1.0 / c.w as f64,
            depth: c.z as f64 / c.w as f64,
            place,
        }
    }
}

/// A triangle between points of its piece.
#[derive(Clone, Copy)]
struct ScreenTriangle {
    points: [u16; 3],
    /// First and last band that it reaches into.
    bands: [u16; 2],
}

/// Triangles of one tile of rock, of one quad or of a part of a shell's hull, clipped at the near plane, in
/// drawing order.
#[derive(Clone, Default)]
pub struct Piece {
    points: Vec<ScreenPoint>,
    triangles: Vec<ScreenTriangle>,
    /// Number of each triangle's face, where all are faces of their own; empty where they are one.
    faces: Vec<u32>,
}

/// Samples that the triangles of a window are drawn for.
#[derive(Clone, Debug)]
pub struct Grid {
    /// The window, pixels.
    pub window: Window,
    /// Rows of the window that are drawn at a time.
    pub rows: u32,
    /// Smallest and largest shift of points for a sample, along x and y.
    pub shifts: [[f64; 2]; 2],
}

/// Shifts of points for up to [`SAMPLES`] samples, pixels. Unused ones repeat the first.
#[derive(Clone, Debug)]
pub struct Shifts {
    pub x: [f64; SAMPLES],
    pub y: [f64; SAMPLES],
    /// Number of samples.
    pub count: usize,
}

impl Shifts {
    /// Shifts of the samples with these offsets from the top left corners of pixels.
    pub fn new(offsets: &[[f32; 2]]) -> Self {
        let of = |i: usize, c: usize| shift(offsets.get(i).unwrap_or(&offsets[0])[c]);
        let [x, y] = [0, 1].map(|c| [0, 1, 2, 3].map(|i| of(i, c)));
        Shifts { x, y, count: offsets.len() }
    }
}

/// How far a sample sees points from where the pixel's centre sees them, along one axis.
pub fn shift(offset: f32) -> f64 {
    0.5 - f64::from(offset)
}

impl Grid {
    /// Grid of a window for samples with these offsets, drawn `rows` rows at a time.
    pub fn new(window: Window, rows: u32, offsets: &[[f32; 2]]) -> Self {
        let shifts = [0, 1].map(|c| {
            let all = offsets.iter().map(|offset| shift(offset[c]));
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        });
        Grid { window, rows, shifts }
    }

    /// Returns the number of bands.
    pub fn bands(&self) -> usize {
        self.window.height.div_ceil(self.rows) as usize
    }

    /// Returns the window of a band.
    pub fn band(&self, i: usize) -> Window {
        let y = self.window.y + i as u32 * self.rows;
        Window { y, height: self.rows.min(self.window.bottom() - y), ..self.window }
    }

    /// Returns the columns and rows of a window that may see a triangle: no sample of another pixel lies in
    /// its bounding box.
    #[inline(always)]
    fn seen(&self, points: &[&ScreenPoint; 3], window: Window) -> [Range<usize>; 2] {
        let [a, b, c] = points;
        let Window { x, y, width, height } = window;
        let range = |v: [f64; 3], [least, most]: [f64; 2], first: u32, count: u32| {
            let (mut low, mut high) = (v[0], v[0]);
            for x in [v[1], v[2]] {
                low = if x < low { x } else { low };
                high = if x > high { x } else { high };
            }
            // Centres from the low to the high edge, which may snap by half of 1/256. Rounding towards zero
            // in the 256ths adds a little.
            const SNAP: f64 = 1.0 / 256.0;
            let low = ((low + least - SNAP).max(-1e9) * 256.0) as i64 - 128;
            let high = ((high + most + SNAP).min(1e9) * 256.0) as i64 - 128;
            let (first, end) = (i64::from(first), i64::from(first + count));
            let start = ((low + 255) >> 8).clamp(first, end) as usize;
            start..(((high >> 8) + 1).clamp(first, end) as usize).max(start)
        };
        [range([a.x, b.x, c.x], self.shifts[0], x, width), range([a.y, b.y, c.y], self.shifts[1], y, height)]
    }
}

/// A covered sample: depth (reversed, 0 is far), and the number of the triangle plus 1 (0: none).
pub type Covered = (f32, u32);

/// Clips a triangle at w = near. Its corners are in clip space, with their positions in the tile. Calls
/// `part` for each resulting triangle.
pub fn clip_near(corners: [(Vec4, Vec2); 3], near: f32, mut part: impl FnMut([(Vec4, Vec2); 3])) {
    let mut polygon: Vec<(Vec4, Vec2)> = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (inside_a, inside_b) = (a.0.w >= near, b.0.w >= near);
        if inside_a {
            polygon.push(a);
        }
        if inside_a != inside_b {
            let s = (near - a.0.w) / (b.0.w - a.0.w);
            let mut cut = a.0.lerp(b.0, s);
            cut.w = near;
            polygon.push((cut, a.1.lerp(b.1, s)));
        }
    }
    for i in 2..polygon.len() {
        part([polygon[0], polygon[i - 1], polygon[i]]);
    }
}

impl Piece {
    /// Removes all points and triangles, and keeps the memory.
    pub fn clear(&mut self) {
        self.points.clear();
        self.triangles.clear();
        self.faces.clear();
    }

    /// Adds a point and returns its index.
    #[inline]
    pub fn add_point(&mut self, point: ScreenPoint) -> u16 {
        self.points.push(point);
        (self.points.len() - 1) as u16
    }

    /// Returns the position of a point in the tile.
    pub fn place(&self, point: u16) -> Vec2 {
        self.points[usize::from(point)].place
    }

    /// Numbers the faces of the triangles that were added last.
    pub fn set_face(&mut self, face: u32) {
        self.faces.resize(self.triangles.len(), face);
    }

    /// Adds the triangle between three points, in either order, if a sample of the grid may see it.
    #[inline]
    pub fn add(&mut self, points: [u16; 3], grid: &Grid) {
        let [columns, rows] = grid.seen(&points.map(|i| &self.points[usize::from(i)]), grid.window);
        // Most triangles of a fine mesh lie between the samples of a small picture.
        if !columns.is_empty() && !rows.is_empty() {
            let band = |y: usize| ((y - grid.window.y as usize) / grid.rows as usize) as u16;
            let bands = [band(rows.start), band(rows.end - 1)];
            self.triangles.push(ScreenTriangle { points, bands });
        }
    }
}

/// Triangles of a window, in bands of rows.
pub struct Rasteriser {
    /// The pieces, in drawing order.
    pieces: Vec<Piece>,
    /// For each band, the numbers of the pieces that reach into it, in order.
    bands: Vec<Vec<u32>>,
}

impl Rasteriser {
    /// Sorts pieces into the bands of a grid.
    pub fn new(pieces: Vec<Piece>, grid: &Grid) -> Self {
        let mut bands = vec![Vec::new(); grid.bands()];
        for (number, piece) in pieces.iter().enumerate() {
            let first = piece.triangles.iter().map(|t| t.bands[0]).min();
            let last = piece.triangles.iter().map(|t| t.bands[1]).max();
            if let (Some(first), Some(last)) = (first, last) {
                for band in &mut bands[usize::from(first)..=usize::from(last)] {
                    band.push(number as u32);
                }
            }
        }
        Rasteriser { pieces, bands }
    }

    /// Whether any piece reaches into band number `i`.
    pub fn reaches(&self, i: usize) -> bool {
        !self.bands[i].is_empty()
    }

    /// Returns the number of the piece of a triangle, which is that of a tile or a quad.
    pub fn piece_of(triangle: u32) -> u32 {
        triangle / NUMBERS
    }

    /// Returns the number of the face of a triangle: that of its piece, or its own.
    pub fn face_of(&self, triangle: u32) -> u32 {
        let piece = triangle / NUMBERS;
        let own = self.pieces[piece as usize].faces.get((triangle % NUMBERS) as usize);
        own.copied().unwrap_or(piece)
    }

    fn points(&self, triangle: u32) -> [&ScreenPoint; 3] {
        let piece = &self.pieces[(triangle / NUMBERS) as usize];
        let points = piece.triangles[(triangle % NUMBERS) as usize].points;
        points.map(|i| &piece.points[usize::from(i)])
    }

    /// Draws the triangles of band number `i` as the samples see them. `covered` holds `layers` entries per
    /// sample of each pixel of the band, the nearest first; of equal depths the first drawn comes first. Of
    /// several triangles of one face only the nearest stays: where snapping folds a quad that is seen
    /// edge-on, its two triangles overlap.
    #[inline(always)]
    pub fn draw<S: Simd>(
        &self,
        simd: S,
        i: usize,
        grid: &Grid,
        samples: &Shifts,
        covered: &mut [Covered],
        layers: usize,
    ) {
        let band = grid.band(i);
        let (left, top, width) = (band.x as usize, band.y as usize, band.width as usize);
        let shift = Shift { x: f64x4::load_array(simd, samples.x), y: f64x4::load_array(simd, samples.y) };
        for &piece in &self.bands[i] {
            let Piece { points, triangles, faces } = &self.pieces[piece as usize];
            let is_one = faces.is_empty();
            for (number, triangle) in triangles.iter().enumerate() {
                if usize::from(triangle.bands[0]) > i || usize::from(triangle.bands[1]) < i {
                    continue;
                }
                let points = triangle.points.map(|p| &points[usize::from(p)]);
                let [columns, rows] = grid.seen(&points, band);
                if columns.is_empty() || rows.is_empty() {
                    continue;
                }
                let id = piece * NUMBERS + number as u32 + 1;
                let edges = Edges::new(simd, points, &shift);
                for y in rows {
                    let row = edges.row(y);
                    for x in span(&points, grid, y, columns.clone()) {
                        let (inside, depth) = row.at(simd, x);
                        if inside == 0 {
                            continue;
                        }
                        let pixel = ((y - top) * width + x - left) * samples.count;
                        for sample in 0..samples.count {
                            if inside >> sample & 1 == 0 {
                                continue;
                            }
                            let new = (depth[sample] as f32, id);
                            let faces = &mut covered[(pixel + sample) * layers..][..layers];
                            if let [face] = faces {
                                if new.0 > face.0 {
                                    *face = new;
                                }
                            } else {
                                insert(faces, new, is_one);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Returns where samples of eight pixels lie in the tiles of their triangles, in squares of the grids.
    /// `triangles` and `pixels` are the number of each one's triangle, and its column and row; all see points
    /// with one shift.
    #[inline(always)]
    pub fn places<S: Simd>(
        &self,
        simd: S,
        triangles: &[u32; LANES],
        pixels: &[[u32; LANES]; 2],
        shift: [f64; 2],
    ) -> [[f32; LANES]; 2] {
        let mut out = [[0.0; LANES]; 2];
        let shift = Shift { x: f64x4::splat(simd, shift[0]), y: f64x4::splat(simd, shift[1]) };
        for half in (0..LANES).step_by(HALF) {
            let mut centre = [[0.0; HALF]; 2];
            let mut screen = [[[0.0; HALF]; 3]; 3];
            let mut place = [[[0.0; HALF]; 2]; 3];
            for lane in 0..HALF {
                let points = self.points(triangles[half + lane]);
                for c in 0..3 {
                    let ScreenPoint { x, y, inverse_w, place: at, .. } = *points[c];
                    [screen[c][0][lane], screen[c][1][lane], screen[c][2][lane]] = [x, y, inverse_w];
                    [place[c][0][lane], place[c][1][lane]] = [at.x, at.y];
                }
                for axis in 0..2 {
                    centre[axis][lane] = f64::from(pixels[axis][half + lane]) + 0.5;
                }
            }
            let weights = weights(simd, &screen, centre, &shift);
            for lane in 0..HALF {
                for axis in 0..2 {
                    let of = |c: usize| place[c][axis][lane] * weights[c][lane] as f32;
                    out[axis][half + lane] = of(0) + of(1) + of(2);
                }
            }
        }
        out
    }
}

/// Inserts a triangle by depth into those that cover a sample, and drops the last one. `is_one` tells whether
/// the triangles of its piece are one face. Twin: `peel_fragment`.
fn insert(faces: &mut [Covered], new: Covered, is_one: bool) {
    let is_same = |face: &Covered| is_one && face.1 != 0 && (face.1 - 1) / NUMBERS == (new.1 - 1) / NUMBERS;
    let Some(index) = faces.iter().position(|face| new.0 > face.0) else { return };
    if faces[..index].iter().any(is_same) {
        return;
    }
    let last = faces[index..].iter().position(is_same);
    let last = last.map_or(faces.len() - 1, |behind| index + behind);
    faces.copy_within(index..last, index + 1);
    faces[index] = new;
}
