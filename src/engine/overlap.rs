//! How many volume quads lie over one another in the image: so many sheets a ray may have to go through,
//! and so many layers the raster pass keeps. Scenes whose quads stand side by side need one.

use glam::{DVec2, DVec3};

use crate::scene::Scene;

/// Quads whose images share less than a strip of this width, pixels, stand side by side: half the grid of
/// 1/256 pixel that rasterisers snap corners to, and far more than the rounding of corners two quads share.
const LEAST_WIDTH: f64 = 1.0 / 512.0;
/// Pairs of quads that are looked at, and polygons that are cut, before the most is taken for granted: some
/// milliseconds.
const MOST_PAIRS: usize = 1 << 21;
/// See [`MOST_PAIRS`].
const MOST_CUTS: usize = 1 << 14;

/// Most of a scene's volume quads that a ray of its image meets: at least 1, at most `trace.layers`. Opaque
/// geometry in front is left out of account, so the number may be too large, but it is never too small by
/// more than what a part of an image narrower than 1/512 pixel shows. The same for any part and sample.
pub fn sheets(scene: &Scene) -> u32 {
    let most = scene.trace.layers;
    if most < 2 || scene.quads.len() < 2 {
        return 1;
    }
    let mut images: Vec<Polygon> = images(scene);
    images.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
    let mut search = Search { images: &images, cuts: 0, best: 1, most: most as usize };
    let mut pairs = 0;
    for (i, image) in images.iter().enumerate() {
        let mut met = Vec::new();
        for (j, other) in images.iter().enumerate().skip(i + 1) {
            pairs += 1;
            if other.low.x >= image.high.x || pairs > MOST_PAIRS {
                break;
            }
            if other.low.y < image.high.y && image.low.y < other.high.y {
                met.push(j);
            }
        }
        search.go(image, &met, 1);
        if search.best >= search.most || search.cuts > MOST_CUTS || pairs > MOST_PAIRS {
            return most;
        }
    }
    search.best as u32
}

/// A convex polygon in the image, pixels, counter-clockwise in its axes, and the box around it.
#[derive(Clone)]
struct Polygon {
    corners: Vec<DVec2>,
    low: DVec2,
    high: DVec2,
}

/// Looks for the most polygons that have a part in common.
struct Search<'a> {
    images: &'a [Polygon],
    cuts: usize,
    best: usize,
    most: usize,
}

impl Search<'_> {
    /// `common` is the common part of `deep` polygons; `met` are those that may cover more of it.
    fn go(&mut self, common: &Polygon, met: &[usize], deep: usize) {
        self.best = self.best.max(deep);
        for (n, &i) in met.iter().enumerate() {
            let enough = self.best >= self.most || self.cuts > MOST_CUTS;
            if enough || deep + met.len() - n <= self.best {
                return;
            }
            self.cuts += 1;
            if let Some(part) = common.cut(&self.images[i]) {
                self.go(&part, &met[n + 1..], deep + 1);
            }
        }
    }
}

/// The quads' images, cut at the near plane and at the edge of the image.
fn images(scene: &Scene) -> Vec<Polygon> {
    let size = DVec2::new(scene.image.width.into(), scene.image.height.into());
    // A pixel more on every side: samples lie anywhere in the pixels.
    let [a, d] = [DVec2::splat(-1.0), size + 1.0];
    let Some(frame) = Polygon::new(vec![a, DVec2::new(d.x, a.y), d, DVec2::new(a.x, d.y)]) else {
        return Vec::new();
    };
    // Corners may leave the plane by 1e-4: seen from its edge such a quad is not convex.
    outlines(scene).filter_map(|points| Polygon::new(hull(points))?.cut(&frame)).collect()
}

/// Corners of the quads' images in pixels, cut at the near plane: as many as are left in front of it.
fn outlines(scene: &Scene) -> impl Iterator<Item = Vec<DVec2>> {
    let camera = &scene.camera;
    let [width, height] = [scene.image.width, scene.image.height];
    let size = DVec2::new(width.into(), height.into());
    let (right, up) = camera.image_plane(width, height);
    let [eye, right, up, forward] = [camera.eye, right, up, camera.forward].map(|v| v.as_dvec3());
    let near = f64::from(camera.near);
    scene.quads.iter().map(move |quad| {
        // x and y in units of the image plane, and the distance along the view axis.
        let seen = quad.corners.map(|corner| {
            let away = corner.as_dvec3() - eye;
            let along = |axis: DVec3| away.dot(axis) / axis.length_squared();
            DVec3::new(along(right), along(up), along(forward))
        });
        let mut points = Vec::new();
        let mut add = |p: DVec3| {
            points.push((DVec2::new(p.x, -p.y) / p.z * 0.5 + 0.5) * size);
        };
        for i in 0..4 {
            let (p, q) = (seen[i], seen[(i + 1) % 4]);
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
    })
}

/// Pixels by which a quad's image may be drawn larger than it is: samples lie within a pixel and a half of where it is
/// reckoned, and float32 rounds.
const MARGIN: f64 = 3.0;

/// Which of `count` squares, `side` pixels wide, row by row from pixel `corner` of the image, a volume quad may be seen in. None
/// that one is seen in is left out.
pub fn covered(scene: &Scene, corner: [u32; 2], count: [u32; 2], side: u32) -> Vec<bool> {
    let [across, down] = count.map(|n| n as usize);
    let corner = DVec2::new(corner[0].into(), corner[1].into());
    let side = f64::from(side);
    let mut squares = vec![false; across * down];
    for points in outlines(scene) {
        let points: Vec<DVec2> = points.iter().map(|p| *p - corner).collect();
        for row in 0..down {
            let [top, bottom] = [row as f64 * side - MARGIN, (row + 1) as f64 * side + MARGIN];
            let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
            for (i, &p) in points.iter().enumerate() {
                let q = points[(i + 1) % points.len()];
                let (p, q) = if p.y <= q.y { (p, q) } else { (q, p) };
                if q.y < top || p.y > bottom {
                    continue;
                }
                // Where the edge is level it lies in the row whole.
                let at = |y: f64| {
                    if q.y > p.y { p.lerp(q, ((y - p.y) / (q.y - p.y)).clamp(0.0, 1.0)).x } else { p.x }
                };
                let ends = if q.y > p.y { [at(top), at(bottom)] } else { [p.x, q.x] };
                low = low.min(ends[0]).min(ends[1]);
                high = high.max(ends[0]).max(ends[1]);
            }
            let first = ((low - MARGIN) / side).floor().max(0.0);
            let end = ((high + MARGIN) / side).ceil().min(across as f64);
            if first < end {
                squares[row * across..][first as usize..end as usize].fill(true);
            }
        }
    }
    squares
}

impl Polygon {
    /// None without an area.
    fn new(corners: Vec<DVec2>) -> Option<Self> {
        let low = corners.iter().copied().reduce(DVec2::min)?;
        let high = corners.iter().copied().reduce(DVec2::max)?;
        (corners.len() > 2).then_some(Polygon { corners, low, high })
    }

    /// Each corner and the next.
    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().copied().zip(next.copied())
    }

    /// What it has in common with another, if that is wide enough to count (Sutherland and Hodgman 1974).
    fn cut(&self, other: &Polygon) -> Option<Polygon> {
        let mut rest = self.clone();
        for (a, b) in other.edges() {
            let side = |p: DVec2| (b - a).perp_dot(p - a);
            let mut corners = Vec::with_capacity(rest.corners.len() + 1);
            for (p, q) in rest.edges() {
                let (at_p, at_q) = (side(p), side(q));
                if at_p >= 0.0 {
                    corners.push(p);
                }
                if (at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0) {
                    corners.push(p.lerp(q, at_p / (at_p - at_q)));
                }
            }
            rest = Polygon::new(corners)?;
        }
        (rest.width() > LEAST_WIDTH).then_some(rest)
    }

    /// The distance of the two closest parallel lines it fits between: one of them lies along an edge.
    fn width(&self) -> f64 {
        let across = |(a, b): (DVec2, DVec2)| {
            let along = (b - a).normalize_or_zero();
            let away = self.corners.iter().map(|&p| along.perp_dot(p - a).abs()).fold(0.0, f64::max);
            if along == DVec2::ZERO { f64::INFINITY } else { away }
        };
        self.edges().map(across).fold(f64::INFINITY, f64::min)
    }
}

/// The convex hull of points, counter-clockwise (Andrew 1979).
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
