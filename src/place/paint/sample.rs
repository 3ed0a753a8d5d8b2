//! §3 Lookup of textures on triangles. Twin: `shaders/engine/paint.wgsl`.

use glam::{IVec2, Vec2, Vec3};

use super::texture::value;
use super::{CLAMP, MIRROR, Paint, Paints, TextureUse};

/// Most lookups along the longer axis of a sample's footprint.
pub const MOST_TAPS: f32 = 4.0;

/// Largest ratio between the axes of a lookup's own footprint. What is seen at a still smaller angle is
/// filtered for this ratio, so that a floor stays sharp across the view.
pub const MOST_STRETCH: f32 = 8.0;

/// A sample's point on a triangle and its footprint there, in shares of the edges from the first corner.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    /// The point.
    pub point: Vec2,
    /// Extent across the view.
    pub across: Vec2,
    /// Extent along the view, where the surface is foreshortened.
    pub along: Vec2,
}

/// What the textures say about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Painted {
    /// Factor of the albedo.
    pub color: Vec3,
    /// Roughness, 0 to 1.
    pub roughness: f32,
    /// How metallic it is, 0 to 1.
    pub metallic: f32,
    /// Unit normal.
    pub normal: Vec3,
}

/// A triangle as a sample sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// First corner from the eye, metres.
    pub corner: Vec3,
    /// Edges from the first corner to the second and to the third, metres.
    pub edges: [Vec3; 2],
    /// Vector from the eye to the sample's point of the image plane at distance 1.
    pub ray: Vec3,
    /// Size of a sample on that plane.
    pub angle: f32,
    /// Unit normal, interpolated between the corners, on the eye's side.
    pub normal: Vec3,
}

impl Footprint {
    /// Returns where the ray meets the triangle. The rasteriser's own position has the digits of a place in a
    /// tile, too few for a texture that is repeated many times.
    pub fn new(sight: &Sight) -> Footprint {
        let [e1, e2] = sight.edges;
        let normal = e1.cross(e2);
        let n2 = normal.dot(normal).max(1e-37);
        let towards = normal.dot(sight.ray);
        let depth = normal.dot(sight.corner) / towards;
        let shares = |d: Vec3| Vec2::new(d.dot(e2.cross(normal)), d.dot(normal.cross(e1))) / n2;
        let point = shares(sight.ray * depth - sight.corner).max(Vec2::ZERO).min(Vec2::ONE);
        // The view straight down has no direction on the surface; any will do.
        let side = normal.cross(sight.ray);
        let side = if side.dot(side) > 1e-12 * n2 { side } else { e1 };
        let across = side / side.dot(side).max(1e-37).sqrt();
        let along = across.cross(normal) / n2.sqrt();
        let cos = towards.abs() / (n2 * sight.ray.dot(sight.ray)).sqrt();
        let radius = depth.abs() * sight.angle;
        Footprint { point, across: shares(across * radius), along: shares(along * (radius / cos.max(1e-3))) }
    }

    /// Returns the lookups of a texture with these differences of its coordinates along the edges, and this
    /// size of the finest level.
    fn filter(&self, steps: [Vec2; 2], size: Vec2) -> Filter {
        let [across, along] = [self.across, self.along].map(|d| steps[0] * d.x + steps[1] * d.y);
        let [a, b] = [across, along].map(|d| (d * size).length());
        // Inside a texel there is nothing to tell lookups apart.
        let (long, short) = (a.max(b), a.min(b).max(1.0));
        let ratio = (long / short).clamp(1.0, MOST_TAPS);
        Filter {
            level: (long / ratio).min(MOST_STRETCH * short).max(1e-9).log2(),
            taps: if ratio < 1.2 { 1 } else { ratio.ceil() as u32 },
            spread: if b >= a { along } else { across } * (1.0 - 1.0 / ratio),
        }
    }
}

/// Lookups that stand for a footprint, evenly along its longer axis.
struct Filter {
    level: f32,
    taps: u32,
    /// Texture coordinates from the first lookup to the last.
    spread: Vec2,
}

impl Paints {
    /// Returns what the textures of a paint say about a point. `coordinates` is the number of the triangle's
    /// first texture coordinates.
    pub fn at(&self, paint: &Paint, coordinates: usize, sight: &Sight) -> Painted {
        let mut out = Painted {
            color: Vec3::ONE,
            roughness: paint.roughness,
            metallic: paint.metallic,
            normal: sight.normal,
        };
        if paint.slots == 0 {
            return out;
        }
        let footprint = Footprint::new(sight);
        let look_up = |used: &TextureUse| {
            let slots = paint.slots as usize;
            let uv = [0, 1, 2].map(|k| Vec2::from(self.coordinates[coordinates + slots * k + used.slot()]));
            let steps = [uv[1] - uv[0], uv[2] - uv[0]];
            let size = Vec2::from(used.size_at(0).map(|n| n as f32));
            let Filter { level, taps, spread } = footprint.filter(steps, size);
            let at = uv[0] + steps[0] * footprint.point.x + steps[1] * footprint.point.y;
            let mut sum = self.sample(used, if taps > 1 { at - spread * 0.5 } else { at }, level);
            for tap in 1..taps {
                let share = tap as f32 / (taps - 1) as f32;
                sum += self.sample(used, at + spread * (share - 0.5), level);
            }
            (sum / taps as f32, steps)
        };
        if paint.color.is_some() {
            out.color = look_up(&paint.color).0;
        }
        if paint.surface.is_some() {
            let factors = look_up(&paint.surface).0;
            out.roughness *= factors.y;
            out.metallic *= factors.z;
        }
        if paint.relief.is_some() {
            let (texel, steps) = look_up(&paint.relief);
            let m = (texel * 2.0 - 1.0) * Vec3::new(paint.relief_scale, paint.relief_scale, 1.0);
            out.normal = bent(sight, steps, m);
        }
        out
    }

    /// Returns the colour of a texture at texture coordinates: trilinear between texels and levels.
    pub fn sample(&self, used: &TextureUse, uv: Vec2, level: f32) -> Vec3 {
        if level <= 0.0 && used.is_nearest() {
            let at = (uv * Vec2::from(used.size_at(0).map(|n| n as f32))).floor().as_ivec2();
            return self.texel(used, 0, at);
        }
        let level = level.clamp(0.0, (used.levels - 1) as f32);
        let whole = level.floor();
        let near = self.bilinear(used, uv, whole as u32);
        if level == whole {
            return near;
        }
        near.lerp(self.bilinear(used, uv, whole as u32 + 1), level - whole)
    }

    fn bilinear(&self, used: &TextureUse, uv: Vec2, level: u32) -> Vec3 {
        let at = uv * Vec2::from(used.size_at(level).map(|n| n as f32)) - 0.5;
        let (cell, f) = (at.floor().as_ivec2(), at - at.floor());
        let row = |y: i32| {
            let [left, right] = [0, 1].map(|x| self.texel(used, level, cell + IVec2::new(x, y)));
            left.lerp(right, f.x)
        };
        row(0).lerp(row(1), f.y)
    }

    /// Returns the colour of a texel, whose column and row may lie outside.
    fn texel(&self, used: &TextureUse, level: u32, at: IVec2) -> Vec3 {
        let [width, height] = used.size_at(level).map(|n| n as i32);
        let [along_u, along_v] = used.wrap();
        let (x, y) = (wrapped(at.x, width, along_u), wrapped(at.y, height, along_v));
        let first = used.first as usize;
        let own = first + self.words[first + level as usize] as usize;
        let [r, g, b, _] = self.words[own + (y * width + x) as usize].to_le_bytes();
        Vec3::from([r, g, b].map(|code| value(code, used.is_srgb())))
    }
}

/// Index of a texel inside a row of `n`.
fn wrapped(i: i32, n: i32, wrap: u32) -> i32 {
    if wrap == CLAMP {
        return i.clamp(0, n - 1);
    }
    let period = if wrap == MIRROR { 2 * n } else { n };
    let k = i.rem_euclid(period);
    k.min(2 * n - 1 - k)
}

/// Returns a normal in tangent space as a unit vector of the world. The first axis of that space runs with u
/// on the surface, the second against v, which runs down an image, and the third is the normal.
fn bent(sight: &Sight, steps: [Vec2; 2], m: Vec3) -> Vec3 {
    let ([e1, e2], n) = (sight.edges, sight.normal);
    let det = steps[0].x * steps[1].y - steps[1].x * steps[0].y;
    let sign = if det < 0.0 { -1.0 } else { 1.0 };
    let u = (e1 * steps[1].y - e2 * steps[0].y) * sign;
    let v = (e2 * steps[0].x - e1 * steps[1].x) * sign;
    let t = u - n * n.dot(u);
    let length = t.dot(t).sqrt();
    if length.is_nan() || length <= 1e-30 {
        return n;
    }
    let t = t / length;
    let b = n.cross(t);
    let b = if b.dot(v) > 0.0 { -b } else { b };
    let bent = t * m.x + b * m.y + n * m.z;
    let length = bent.dot(bent).sqrt();
    if length > 1e-6 { bent / length } else { n }
}
