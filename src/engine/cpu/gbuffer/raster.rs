//! The rasteriser of the CPU engine. It follows the fill rule of a GPU: corners snap to 1/256 pixel, and
//! points on an edge belong to the triangle whose top or left edge it is.

use glam::{Vec3, Vec4};

use crate::util::window::Window;

/// A triangle in pixels, clipped at the near plane.
pub struct ScreenTriangle {
    x: [f64; 3],
    y: [f64; 3],
    inverse_w: [f64; 3],
    /// Reversed depth z/w.
    depth: [f64; 3],
    /// Weights of the corners before clipping, for each corner.
    weights: [Vec3; 3],
    /// Number of the tile or the quad.
    pub id: u32,
    /// Corners in the tile, numbered as in [`crate::place::tiles`].
    pub corners: [u16; 3],
}

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

/// Projects a part of [`clip_near`] to an image of `width` × `height` pixels. Its corners snap to 1/256
/// pixel, as on a GPU, and are ordered so that its area is positive.
#[inline]
pub fn to_screen(
    part: [(Vec4, Vec3); 3],
    [width, height]: [usize; 2],
    id: u32,
    corners: [u16; 3],
) -> ScreenTriangle {
    // Far outside the image, snapping has no meaning and would lose the fraction's bits.
    let snap = |x: f64| (x.clamp(-1e9, 1e9) * 256.0).round() / 256.0;
    let mut t = ScreenTriangle {
        x: part.map(|(c, _)| snap((c.x as f64 / c.w as f64 * 0.5 + 0.5) * width as f64)),
        y: part.map(|(c, _)| snap((0.5 - c.y as f64 / c.w as f64 * 0.5) * height as f64)),
        inverse_w: part.map(|(c, _)| 1.0 / c.w as f64),
        depth: part.map(|(c, _)| c.z as f64 / c.w as f64),
        weights: part.map(|(_, w)| w),
        id,
        corners,
    };
    if t.area() < 0.0 {
        t.x.swap(1, 2);
        t.y.swap(1, 2);
        t.inverse_w.swap(1, 2);
        t.depth.swap(1, 2);
        t.weights.swap(1, 2);
    }
    t
}

impl ScreenTriangle {
    /// Twice the signed area of the triangle between edge `i` and the point `p`.
    fn edge(&self, i: usize, p: [f64; 2]) -> f64 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        (self.x[b] - self.x[a]) * (p[1] - self.y[a]) - (self.y[b] - self.y[a]) * (p[0] - self.x[a])
    }

    /// Twice the signed area.
    fn area(&self) -> f64 {
        self.edge(2, [self.x[2], self.y[2]])
    }

    /// Whether the triangle has an area and its bounding box holds the centre of a pixel of the window.
    pub fn covers_centres(&self, window: Window) -> bool {
        let ((x0, x1), (y0, y1)) = self.centres(window);
        self.area() > 0.0 && x0 < x1 && y0 < y1
    }

    /// Half-open ranges of the columns and rows of the window whose centres lie in the bounding box.
    fn centres(&self, window: Window) -> ((usize, usize), (usize, usize)) {
        let range = |v: [f64; 3], first: u32, count: u32| {
            let low = (v[0].min(v[1]).min(v[2]) - 0.5).ceil().max(first as f64);
            let high = (v[0].max(v[1]).max(v[2]) - 0.5).floor() + 1.0;
            (low as usize, (high.max(0.0) as usize).min((first + count) as usize))
        };
        (range(self.x, window.x, window.width), range(self.y, window.y, window.height))
    }

    /// Whether points on edge `i` belong to this triangle: true for top and left edges.
    fn owns_edge(&self, i: usize) -> bool {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (dx, dy) = (self.x[b] - self.x[a], self.y[b] - self.y[a]);
        dy < 0.0 || (dy == 0.0 && dx > 0.0)
    }

    /// Returns the perspective-correct weights of the original corners at a position in pixels.
    pub fn weights_at(&self, p: [f64; 2]) -> Vec3 {
        let w = [0, 1, 2].map(|i| self.edge(i, p) * self.inverse_w[i]);
        let sum: f64 = w.iter().sum();
        (0..3).map(|i| self.weights[i] * (w[i] / sum) as f32).sum()
    }
}

/// Returns, for each band of `rows` rows of the window, the indices of the triangles that reach into it, in
/// order.
fn bins(triangles: &[ScreenTriangle], window: Window, rows: usize) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); (window.height as usize).div_ceil(rows)];
    for (number, t) in triangles.iter().enumerate() {
        let (_, (top, bottom)) = t.centres(window);
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
    pub triangles: Vec<ScreenTriangle>,
    bins: Vec<Vec<u32>>,
}

impl Rasteriser {
    /// Sorts triangles into the bands of `rows` rows that a window is cut into.
    pub fn new(triangles: Vec<ScreenTriangle>, window: Window, rows: usize) -> Self {
        let bins = bins(&triangles, window, rows);
        Rasteriser { triangles, bins }
    }

    /// Draws the triangles of band number `bin`, whose pixels are `band`. `covered` holds `layers` entries
    /// per pixel, the nearest first; of equal depths the first drawn comes first. Of several triangles with
    /// one `id` only the nearest stays: where snapping folds a quad that is seen edge-on, its two triangles
    /// overlap.
    pub fn draw(&self, bin: usize, band: Window, covered: &mut [Covered], layers: usize) {
        let (left, top, width) = (band.x as usize, band.y as usize, band.width as usize);
        for &number in &self.bins[bin] {
            let t = &self.triangles[number as usize];
            let area = t.area();
            let ((x0, x1), (y0, y1)) = t.centres(band);
            let owns = [0, 1, 2].map(|i| t.owns_edge(i));
            for y in y0..y1 {
                for x in x0..x1 {
                    let p = [x as f64 + 0.5, y as f64 + 0.5];
                    let e = [0, 1, 2].map(|i| t.edge(i, p));
                    if (0..3).all(|i| e[i] > 0.0 || (e[i] == 0.0 && owns[i])) {
                        let depth = ((0..3).map(|i| e[i] * t.depth[i]).sum::<f64>() / area) as f32;
                        let pixel = ((y - top) * width + x - left) * layers;
                        insert(&mut covered[pixel..pixel + layers], (depth, number + 1), |other| {
                            self.triangles[other as usize - 1].id == t.id
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
