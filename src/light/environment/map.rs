//! Equirectangular map: the texture coordinates of a direction, and the radiance there.
//!
//! u runs from left to right, v from the top (straight up, +y) to the bottom. The middle column lies at −z,
//! where a camera looks by default, with +x to its right. The left and right edges meet at +z:
//!
//! ```text
//! u = ½ + atan2(x, −z)/2π        x =  cos φ · sin 2π(u − ½)
//! v = ½ − φ/π,  sin φ = y        z = −cos φ · cos 2π(u − ½)
//! ```

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

/// Radiance from every direction, linear RGB.
#[derive(PartialEq)]
pub struct Map {
    /// Number of columns, at least 1.
    pub width: u32,
    /// Number of rows, at least 1.
    pub height: u32,
    /// Radiance as r, g, b and padding, the device's format. Row by row from the top.
    pub texels: Vec<[f32; 4]>,
}

impl std::fmt::Debug for Map {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Map({}×{})", self.width, self.height)
    }
}

/// Coefficients of arctan x ≈ x·Σ a_k·x^(2k) on 0 ≤ x ≤ 1, good to 2e-8 (Abramowitz and Stegun 1964, 4.4.49).
/// Devices have an arctangent of their own; with this one both engines see the map in the same position.
pub const ARCTAN: [f32; 9] = [
    1.0,
    -0.333_331_47,
    0.199_935_51,
    -0.142_089,
    0.106_562_64,
    -0.075_289_64,
    0.042_909_614,
    -0.016_165_737,
    0.002_866_225_7,
];

/// Angle of (x, y) from the x axis, −π to π radians; 0 at the origin. Twin: `angle_of` in
/// `shaders/light/environment.wgsl`.
pub fn angle_of(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let r = ax.min(ay) / ax.max(ay).max(1e-30);
    let r2 = r * r;
    let mut sum = ARCTAN[8];
    for k in (0..8).rev() {
        sum = sum * r2 + ARCTAN[k];
    }
    let mut angle = sum * r;
    if ay > ax {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 { -angle } else { angle }
}

/// Texture coordinates (u, v), each from 0 to 1, of a unit direction in a map rotated by `turn` turns about
/// +y, from +z towards +x.
pub fn uv_of(d: Vec3, turn: f32) -> [f32; 2] {
    let u = 0.5 + angle_of(d.x, -d.z) * (0.5 * FRAC_1_PI) + turn;
    let v = 0.5 - angle_of(d.y, (d.x * d.x + d.z * d.z).sqrt()) * FRAC_1_PI;
    [u - u.floor(), v]
}

/// Unit direction at the texture coordinates (u, v) of a map without rotation.
pub fn direction_at(u: f64, v: f64) -> DVec3 {
    let (sin_phi, cos_phi) = ((0.5 - v) * std::f64::consts::PI).sin_cos();
    let (sin, cos) = ((u - 0.5) * std::f64::consts::TAU).sin_cos();
    DVec3::new(cos_phi * sin, sin_phi, -cos_phi * cos)
}

impl Map {
    /// Radiance at texture coordinates, interpolated linearly between four texels. The interpolation wraps
    /// across the left and right edges and is clamped to the centres of the first and last row. Twin:
    /// `environment_radiance` in `shaders/light/environment.wgsl`.
    pub fn radiance(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (columns, rows) = (self.width as f32, self.height as f32);
        let s = u * columns - 0.5;
        let t = (v * rows - 0.5).clamp(0.0, rows - 1.0);
        let left = s.floor();
        let top = t.floor();
        let (f, g) = (s - left, t - top);
        let x0 = if left < 0.0 { self.width - 1 } else { (left as u32).min(self.width - 1) };
        let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
        let y0 = top as u32;
        let y1 = (y0 + 1).min(self.height - 1);
        let upper = self.texel(x0, y0) + (self.texel(x1, y0) - self.texel(x0, y0)) * f;
        let lower = self.texel(x0, y1) + (self.texel(x1, y1) - self.texel(x0, y1)) * f;
        upper + (lower - upper) * g
    }

    fn texel(&self, x: u32, y: u32) -> Vec3 {
        let [r, g, b, _] = self.texels[y as usize * self.width as usize + x as usize];
        Vec3::new(r, g, b)
    }

    /// Map resampled to at least `columns` × `rows` texels, or `None` if it has them already.
    pub fn enlarged(&self, columns: u32, rows: u32) -> Option<Map> {
        if self.width >= columns && self.height >= rows {
            return None;
        }
        let (width, height) = (self.width.max(columns), self.height.max(rows));
        let centre = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        let texel = |x, y| self.radiance([centre(x, width), centre(y, height)]).extend(0.0).to_array();
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
        Some(Map { width, height, texels })
    }

    /// Memory of the texels, bytes.
    pub fn bytes(&self) -> u64 {
        self.texels.len() as u64 * 16
    }

    /// CRC-32 of the size and the texels.
    pub fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(bytemuck::bytes_of(&[self.width, self.height]));
        hasher.update(bytemuck::cast_slice(&self.texels));
        hasher.finalize()
    }
}
