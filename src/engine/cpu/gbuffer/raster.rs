//! The rasteriser of the CPU engine. It follows the fill rule of a GPU: corners snap to 1/256 pixel, and
//! points on an edge belong to the triangle whose top or left edge it is.

use std::ops::Range;

use glam::{Vec3, Vec4};

use crate::util::window::Window;

/// A corner of a triangle in pixels.
#[derive(Clone, Copy, Debug)]
pub struct ScreenPoint {
    x: f64,
    y: f64,
    inverse_w: f64,
    /// Reversed depth z/w.
    depth: f64,
}

impl ScreenPoint {
    /// Projects a point in clip space to an image of `width` × `height` pixels. It snaps to 1/256 pixel, as
    /// on a GPU.
    #[inline]
    pub fn new(c: Vec4, [width, height]: [usize; 2]) -> Self {
        ScreenPoint {
            x: snapped((c.x as f64 / c.w as f64 * 0.5 + 0.5) * width as f64),
            y: snapped((0.5 - c.y as f64 / c.w as f64 * 0.5) * height as f64),
            inverse_w: 1.0 / c.w as f64,
            depth: c.z as f64 / c.w as f64,
        }
    }
}

/// Rounds to 1/256, halves away from zero. Far outside the image, snapping has no meaning and would lose the
/// fraction's bits. `f64::round` is a call into the C library on processors without SSE 4.1.
#[inline]
fn snapped(x: f64) -> f64 {
    let scaled = x.clamp(-1e9, 1e9) * 256.0;
    let whole = scaled as i64;
    let rest = scaled - whole as f64;
    let away = i64::from(rest >= 0.5) - i64::from(rest <= -0.5);
    (whole + away) as f64 / 256.0
}

/// Triangles in pixels, clipped at the near plane, and the points between which they lie.
#[derive(Default)]
pub struct Triangles {
    points: Vec<ScreenPoint>,
    all: Vec<ScreenTriangle>,
}

/// A triangle in pixels, whose points may be those of others too.
pub struct ScreenTriangle {
    /// Indices of its points, ordered so that its area is positive.
    points: [u32; 3],
    /// Weights of the original corners in `points` where the near plane has cut the triangle.
    weights: Option<Box<[Vec3; 3]>>,
    /// Number of the tile or the quad.
    pub id: u32,
    /// Corners in the tile, numbered as in [`crate::place::tiles`].
    pub corners: [u16; 3],
    /// Whether the last two points were exchanged to make the area positive.
    flipped: bool,
}

/// The points of a triangle.
#[derive(Clone, Copy)]
struct Corners([ScreenPoint; 3]);

/// Columns of a bounding box that are tested one by one.
const NARROW: usize = 4;

/// A covered pixel: depth (reversed, 0 is far), and the index of the triangle plus 1 (0: none).
pub type Covered = (f32, u32);

/// Clips a triangle at w = near. Calls `part` for each resulting triangle, with its corners in clip space and
/// their weights of the original three.
pub fn clip_near(clip: [Vec4; 3], near: f32, mut part: impl FnMut([(Vec4, Vec3); 3])) {
    let corners = [(clip[0], Vec3::X), (clip[1], Vec3::Y), (clip[2], Vec3::Z)];
    // Almost all triangles lie wholly in front.
    if clip.iter().all(|corner| corner.w >= near) {
        return part(corners);
    }
    let mut polygon: Vec<(Vec4, Vec3)> = Vec::with_capacity(4);
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

impl Triangles {
    /// Adds a point and returns its index.
    #[inline]
    pub fn add_point(&mut self, point: ScreenPoint) -> u32 {
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// Adds the triangle between three points, in either order, if it may cover the centre of a pixel of the
    /// window. `weights` are those of the original corners where the triangle is a part of [`clip_near`].
    #[inline]
    pub fn add(
        &mut self,
        mut points: [u32; 3],
        weights: Option<[Vec3; 3]>,
        (id, corners): (u32, [u16; 3]),
        window: Window,
    ) {
        let mut seen = self.corners(&points);
        let flipped = seen.area() < 0.0;
        if flipped {
            seen.0.swap(1, 2);
            points.swap(1, 2);
        }
        // Most triangles of a fine mesh lie between the pixels' centres.
        if seen.covers_centres(window) {
            self.all.push(ScreenTriangle { points, weights: weights.map(Box::new), id, corners, flipped });
        }
    }

    /// Joins lists, in order.
    pub fn joined(lists: Vec<Triangles>) -> Triangles {
        let mut joined = Triangles {
            points: Vec::with_capacity(lists.iter().map(|list| list.points.len()).sum()),
            all: Vec::with_capacity(lists.iter().map(|list| list.all.len()).sum()),
        };
        for list in lists {
            let first = joined.points.len() as u32;
            joined.points.extend(list.points);
            joined.all.extend(
                list.all
                    .into_iter()
                    .map(|t| ScreenTriangle { points: t.points.map(|point| first + point), ..t }),
            );
        }
        joined
    }

    #[inline]
    fn corners(&self, points: &[u32; 3]) -> Corners {
        Corners(points.map(|point| self.points[point as usize]))
    }
}

impl Corners {
    /// Twice the signed area of the triangle between edge `i` and the point `p`.
    #[inline]
    fn edge(&self, i: usize, p: [f64; 2]) -> f64 {
        let (a, b) = (&self.0[(i + 1) % 3], &self.0[(i + 2) % 3]);
        (b.x - a.x) * (p[1] - a.y) - (b.y - a.y) * (p[0] - a.x)
    }

    /// Twice the signed area.
    #[inline]
    fn area(&self) -> f64 {
        self.edge(2, [self.0[2].x, self.0[2].y])
    }

    /// Whether the triangle has an area and its bounding box holds the centre of a pixel of the window.
    #[inline]
    fn covers_centres(&self, window: Window) -> bool {
        let ((x0, x1), (y0, y1)) = self.centres(window);
        x0 < x1 && y0 < y1 && self.area() > 0.0
    }

    /// Half-open ranges of the columns and rows of the window whose centres lie in the bounding box.
    #[inline]
    fn centres(&self, window: Window) -> ((usize, usize), (usize, usize)) {
        let range = |v: [f64; 3], first: u32, count: u32| {
            let (mut low, mut high) = (v[0], v[0]);
            for x in [v[1], v[2]] {
                low = if x < low { x } else { low };
                high = if x > high { x } else { high };
            }
            // A point is a whole number of 256ths, so whole numbers find the centres exactly.
            let [low, high] = [low, high].map(|x| (x * 256.0) as i64 - 128);
            let (first, end) = (i64::from(first), i64::from(first + count));
            (((low + 255) >> 8).clamp(first, end) as usize, ((high >> 8) + 1).clamp(first, end) as usize)
        };
        let [a, b, c] = &self.0;
        (range([a.x, b.x, c.x], window.x, window.width), range([a.y, b.y, c.y], window.y, window.height))
    }

    /// Returns the part of `columns` in which the triangle may cover centres of row `y`, at most two columns
    /// too wide.
    #[inline]
    fn span(&self, y: usize, columns: Range<usize>) -> Range<usize> {
        // In few columns, to divide takes longer than to test them all.
        if columns.len() <= NARROW {
            return columns;
        }
        let (mut low, mut high) = (columns.start as f64, columns.end as f64);
        for i in 0..3 {
            let (a, b) = (&self.0[(i + 1) % 3], &self.0[(i + 2) % 3]);
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            // The column where the edge crosses the row.
            let at = a.x - 0.5 + dx * (y as f64 + 0.5 - a.y) / dy;
            if dy < 0.0 {
                low = low.max(at - 1.0);
            } else if dy > 0.0 {
                high = high.min(at + 2.0);
            }
        }
        (low as usize).max(columns.start)..(high.max(0.0) as usize).min(columns.end)
    }

    /// Whether points on edge `i` belong to this triangle: true for top and left edges.
    #[inline]
    fn owns_edge(&self, i: usize) -> bool {
        let (a, b) = (&self.0[(i + 1) % 3], &self.0[(i + 2) % 3]);
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        dy < 0.0 || (dy == 0.0 && dx > 0.0)
    }
}

/// Returns, for each band of `rows` rows of the window, the indices of the triangles that reach into it, in
/// order.
fn bins(triangles: &Triangles, window: Window, rows: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); (window.height as usize).div_ceil(rows)];
    for (number, t) in triangles.all.iter().enumerate() {
        let (_, (top, bottom)) = triangles.corners(&t.points).centres(window);
        let [first, last] = [top, bottom - 1].map(|y| (y - window.y as usize) / rows);
        for bin in &mut bins[first..=last] {
            bin.push(number as u32);
        }
    }
    bins
}

/// Triangles of a window, sorted into bands of rows.
pub struct Rasteriser {
    /// All triangles, in drawing order.
    triangles: Triangles,
    bins: Vec<Vec<u32>>,
}

impl Rasteriser {
    /// Sorts triangles into the bands of `rows` rows that a window is cut into.
    pub fn new(triangles: Triangles, window: Window, rows: usize) -> Self {
        let bins = bins(&triangles, window, rows);
        Rasteriser { triangles, bins }
    }

    /// Returns the triangle with an index.
    pub fn triangle(&self, number: u32) -> &ScreenTriangle {
        &self.triangles.all[number as usize]
    }

    /// Returns the perspective-correct weights of the original corners of a triangle at a position in pixels.
    #[inline]
    pub fn weights_at(&self, triangle: &ScreenTriangle, p: [f64; 2]) -> Vec3 {
        let corners = self.triangles.corners(&triangle.points);
        let mut w = [0, 1, 2].map(|i| corners.edge(i, p) * corners.0[i].inverse_w);
        let sum: f64 = w.iter().sum();
        if triangle.flipped {
            w.swap(1, 2);
        }
        let w = w.map(|w| (w / sum) as f32);
        match &triangle.weights {
            None => Vec3::from(w),
            Some(weights) => (0..3).map(|i| weights[i] * w[i]).sum(),
        }
    }

    /// Draws the triangles of band number `bin`, whose pixels are `band`. `covered` holds `layers` entries
    /// per pixel, the nearest first; of equal depths the first drawn comes first. Of several triangles with
    /// one `id` only the nearest stays: where snapping folds a quad that is seen edge-on, its two triangles
    /// overlap.
    pub fn draw(&self, bin: usize, band: Window, covered: &mut [Covered], layers: usize) {
        let (left, top, width) = (band.x as usize, band.y as usize, band.width as usize);
        for &number in &self.bins[bin] {
            let ScreenTriangle { id, points, .. } = &self.triangles.all[number as usize];
            let t = self.triangles.corners(points);
            let area = t.area();
            let ((x0, x1), (y0, y1)) = t.centres(band);
            let owns = [0, 1, 2].map(|i| t.owns_edge(i));
            for y in y0..y1 {
                for x in t.span(y, x0..x1) {
                    let p = [x as f64 + 0.5, y as f64 + 0.5];
                    let e = [0, 1, 2].map(|i| t.edge(i, p));
                    if (0..3).all(|i| e[i] > 0.0 || (e[i] == 0.0 && owns[i])) {
                        let depth = ((0..3).map(|i| e[i] * t.0[i].depth).sum::<f64>() / area) as f32;
                        let pixel = ((y - top) * width + x - left) * layers;
                        insert(&mut covered[pixel..pixel + layers], (depth, number + 1), |other| {
                            self.triangles.all[other as usize - 1].id == *id
                        });
                    }
                }
            }
        }
    }
}

/// Inserts a triangle by depth into those that cover a pixel, and drops the last one. `same` tells whether a
/// triangle has the new one's id. Twin: `peel_fragment`.
fn insert(faces: &mut [Covered], new: Covered, same: impl Fn(u32) -> bool) {
    let Some(index) = faces.iter().position(|face| new.0 > face.0) else { return };
    if faces[..index].iter().any(|face| face.1 != 0 && same(face.1)) {
        return;
    }
    let last = faces[index..].iter().position(|face| face.1 != 0 && same(face.1));
    let last = last.map_or(faces.len() - 1, |behind| index + behind);
    faces.copy_within(index..last, index + 1);
    faces[index] = new;
}
