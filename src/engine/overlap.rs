//! Overlap of the volume quads in the image. It bounds the sheets a ray may cross, and thus the layers that
//! the raster pass keeps. A scene whose quads stand side by side needs one layer.

use glam::{DVec2, DVec3, Vec3};

use crate::scene::Scene;

/// Width of a strip in pixels: quads whose images share a narrower one count as side by side. It is half a
/// step of the 1/256 pixel grid that rasterisers snap corners to, and far more than the rounding of shared
/// corners.
const LEAST_WIDTH: f64 = 1.0 / 512.0;
/// Pairs of quads that are compared before [`sheets`] gives up and returns `trace.layers`: some milliseconds.
const MOST_PAIRS: usize = 1 << 21;
/// Polygons that are cut before [`sheets`] gives up, as for [`MOST_PAIRS`].
const MOST_CUTS: usize = 1 << 14;

/// Returns the largest number of volume quads that any ray of the scene's image meets: at least 1, at most
/// `trace.layers`, which it is in a scene with shells. Opaque geometry in front of them is ignored, so the
/// result may be too large. It is too small only where the overlap in the image is narrower than 1/512 pixel.
/// Every window and sample gets the same result.
pub fn sheets(scene: &Scene) -> u32 {
    let most = scene.trace.layers;
    // A shell is entered again behind each fold and hole.
    if !scene.shells.is_empty() {
        return most.max(1);
    }
    if most < 2 || scene.quads.len() < 2 {
        return 1;
    }
    let mut images = images(scene);
    images.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
    let mut search = Search { images: &images, cuts: 0, best: 1, most: most as usize };
    let mut pairs = 0;
    for (i, image) in images.iter().enumerate() {
        let mut candidates = Vec::new();
        for (j, other) in images.iter().enumerate().skip(i + 1) {
            pairs += 1;
            if other.low.x >= image.high.x || pairs > MOST_PAIRS {
                break;
            }
            if other.low.y < image.high.y && image.low.y < other.high.y {
                candidates.push(j);
            }
        }
        search.descend(image, &candidates, 1);
        if search.best >= search.most || search.cuts > MOST_CUTS || pairs > MOST_PAIRS {
            return most;
        }
    }
    search.best as u32
}

/// A convex polygon in pixels of the image, counter-clockwise in its axes, with its bounding box.
#[derive(Clone)]
struct Polygon {
    corners: Vec<DVec2>,
    low: DVec2,
    high: DVec2,
}

/// Depth-first search for the largest set of polygons that share an area.
struct Search<'a> {
    images: &'a [Polygon],
    /// Polygons cut so far.
    cuts: usize,
    /// Size of the largest set found so far.
    best: usize,
    /// Size at which the search may stop.
    most: usize,
}

impl Search<'_> {
    /// Extends a set of `depth` polygons whose common area is `common` by polygons of `candidates`.
    fn descend(&mut self, common: &Polygon, candidates: &[usize], depth: usize) {
        self.best = self.best.max(depth);
        for (n, &i) in candidates.iter().enumerate() {
            let enough = self.best >= self.most || self.cuts > MOST_CUTS;
            if enough || depth + candidates.len() - n <= self.best {
                return;
            }
            self.cuts += 1;
            if let Some(part) = common.cut(&self.images[i]) {
                self.descend(&part, &candidates[n + 1..], depth + 1);
            }
        }
    }
}

/// Projects the quads into the image and clips them at the near plane and the image's edge.
fn images(scene: &Scene) -> Vec<Polygon> {
    let size = DVec2::new(scene.image.width.into(), scene.image.height.into());
    // One pixel is added on every side because samples lie anywhere in their pixels.
    let [a, d] = [DVec2::splat(-1.0), size + 1.0];
    let Some(frame) = Polygon::new(vec![a, DVec2::new(d.x, a.y), d, DVec2::new(a.x, d.y)]) else {
        return Vec::new();
    };
    // Corners may leave their plane by 1e-4, so a quad seen edge-on may not be convex.
    let outline = Outline::new(scene);
    let outlines = scene.quads.iter().map(|quad| outline.of(&quad.corners));
    outlines.filter_map(|points| Polygon::new(hull(points))?.cut(&frame)).collect()
}

/// The projection of faces' corners to pixels.
struct Outline {
    /// Forward, right and up.
    axes: [DVec3; 3],
    eye: DVec3,
    near: f64,
    /// Size of the image, pixels.
    size: DVec2,
    /// Distance by which it is shifted, pixels.
    shift: DVec2,
}

impl Outline {
    fn new(scene: &Scene) -> Self {
        let [width, height] = [scene.image.width, scene.image.height];
        Outline {
            axes: scene.camera.rays(width, height),
            eye: scene.camera.eye_local(),
            near: f64::from(scene.camera.near),
            size: DVec2::new(width.into(), height.into()),
            shift: DVec2::from(scene.image.shift.map(f64::from)),
        }
    }

    /// Projects a face's corners after clipping at the near plane. A face behind it has none.
    fn of(&self, corners: &[Vec3]) -> Vec<DVec2> {
        let &Outline { axes: [forward, right, up], eye, near, size, shift } = self;
        // x and y are in units of the image plane; z is the distance along the view axis.
        let in_view = |corner: Vec3| {
            let away = corner.as_dvec3() - eye;
            let along = |axis: DVec3| away.dot(axis) / axis.length_squared();
            DVec3::new(along(right), along(up), along(forward))
        };
        let mut points = Vec::with_capacity(corners.len() + 1);
        let mut add = |p: DVec3| {
            points.push((DVec2::new(p.x, -p.y) / p.z * 0.5 + 0.5) * size - shift);
        };
        for i in 0..corners.len() {
            let (p, q) = (in_view(corners[i]), in_view(corners[(i + 1) % corners.len()]));
            if p.z >= near {
                add(p);
            }
            if (p.z >= near) != (q.z >= near) {
                let mut cut = p.lerp(q, (near - p.z) / (q.z - p.z));
                cut.z = near;
                add(cut);
            }
        }
        points
    }
}

/// Pixels by which a quad's image may exceed its outline here: samples lie within a pixel and a half of it,
/// and float32 rounds.
const MARGIN: f64 = 3.0;

/// Marks the squares of a grid that a volume quad or a face of a shell's hull may appear in, row by row. The
/// grid has `count` squares along x and y, each `side` pixels wide, and begins at pixel `corner` of the
/// image. Every square in which a face appears is marked; a few others may be.
pub fn covered(scene: &Scene, corner: [u32; 2], count: [u32; 2], side: u32) -> Vec<bool> {
    let [across, down] = count.map(|n| n as usize);
    let corner = DVec2::new(corner[0].into(), corner[1].into());
    let side = f64::from(side);
    let mut squares = vec![false; across * down];
    let outline = Outline::new(scene);
    let mut mark = |corners: &[Vec3]| {
        let mut points = outline.of(corners);
        points.iter_mut().for_each(|p| *p -= corner);
        let [low, high] = points
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p.y), high.max(p.y)]);
        let first = ((low - MARGIN) / side).floor().max(0.0) as usize;
        let end = (((high + MARGIN) / side).floor() + 1.0).clamp(0.0, down as f64) as usize;
        for row in first..end {
            let [top, bottom] = [row as f64 * side - MARGIN, (row + 1) as f64 * side + MARGIN];
            let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
            for (i, &p) in points.iter().enumerate() {
                let q = points[(i + 1) % points.len()];
                let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
                if q.y < top || p.y > bottom {
                    continue;
                }
                let x_at = |y: f64| {
                    if q.y > p.y { p.lerp(q, ((y - p.y) / (q.y - p.y)).clamp(0.0, 1.0)).x } else { p.x }
                };
                // A level edge lies wholly in the row.
                let ends = if q.y > p.y { [x_at(top), x_at(bottom)] } else { [p.x, q.x] };
                low = low.min(ends[0]).min(ends[1]);
                high = high.max(ends[0]).max(ends[1]);
            }
            let first = ((low - MARGIN) / side).floor().max(0.0);
            let end = ((high + MARGIN) / side).ceil().min(across as f64);
            if first < end {
                squares[row * across..][first as usize..end as usize].fill(true);
            }
        }
    };
    scene.quads.iter().for_each(|quad| mark(&quad.corners));
    for shell in &scene.shells {
        let own = shell.hull.iter().filter(|face| !face.is_eye());
        own.for_each(|face| mark(&shell.corners(face)));
        if scene.eye_inside(shell).is_some() {
            mark(&scene.eye_face());
        }
    }
    squares
}

impl Polygon {
    /// Returns the polygon; `None` for fewer than three corners.
    fn new(corners: Vec<DVec2>) -> Option<Self> {
        let low = corners.iter().copied().reduce(DVec2::min)?;
        let high = corners.iter().copied().reduce(DVec2::max)?;
        (corners.len() > 2).then_some(Polygon { corners, low, high })
    }

    /// Iterates over the edges: each corner with the next.
    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().copied().zip(next.copied())
    }

    /// Returns the intersection with another polygon (Sutherland and Hodgman 1974); `None` if it is not wider
    /// than [`LEAST_WIDTH`].
    fn cut(&self, other: &Polygon) -> Option<Polygon> {
        let mut common = self.clone();
        for (a, b) in other.edges() {
            let side = |p: DVec2| (b - a).perp_dot(p - a);
            let mut corners = Vec::with_capacity(common.corners.len() + 1);
            for (p, q) in common.edges() {
                let (side_p, side_q) = (side(p), side(q));
                if side_p >= 0.0 {
                    corners.push(p);
                }
                if (side_p > 0.0 && side_q < 0.0) || (side_p < 0.0 && side_q > 0.0) {
                    corners.push(p.lerp(q, side_p / (side_p - side_q)));
                }
            }
            common = Polygon::new(corners)?;
        }
        (common.width() > LEAST_WIDTH).then_some(common)
    }

    /// Returns the distance between the two closest parallel lines that enclose the polygon. One of them lies
    /// along an edge.
    fn width(&self) -> f64 {
        let across = |(a, b): (DVec2, DVec2)| {
            let along = (b - a).normalize_or_zero();
            let away = self.corners.iter().map(|&p| along.perp_dot(p - a).abs()).fold(0.0, f64::max);
            if along == DVec2::ZERO { f64::INFINITY } else { away }
        };
        self.edges().map(across).fold(f64::INFINITY, f64::min)
    }
}

/// Returns the convex hull of points, counter-clockwise (Andrew 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}
