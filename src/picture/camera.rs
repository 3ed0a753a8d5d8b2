//! The pinhole camera: rays through pixels, and the matrix that projects geometry onto the same pixels.

use std::ops::Range;
use std::sync::LazyLock;

use glam::{DMat4, DVec4, Mat4, Vec3, Vec4};

use super::{Filter, Image};
use crate::util::window::Window;

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the eye, metres.
    pub eye: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit vector into the image.
    pub forward: Vec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov: f32,
    /// Distance of the near plane along `forward`, metres.
    pub near: f32,
}

impl Camera {
    /// Vectors (right, up) from the centre of the image plane at distance 1 to its edges.
    pub fn image_plane(&self, width: u32, height: u32) -> (Vec3, Vec3) {
        let aspect = width as f32 / height as f32;
        (self.right * (self.tan_half_fov * aspect), self.up * self.tan_half_fov)
    }

    /// Matrix to clip space with reversed infinite depth: z/w is 1 at the near plane and 0 at infinity.
    ///
    /// The image is shifted so that the sample at `offset` inside each pixel lies on the pixel's centre,
    /// where rasterisers sample.
    pub fn clip_from_world(&self, width: u32, height: u32, offset: [f32; 2]) -> Mat4 {
        let (right, up) = self.image_plane(width, height);
        // Rows give view coordinates in units of the image plane. The eye's part is computed in float64.
        let row = |axis: Vec3, scale: f32| {
            let axis64 = axis.as_dvec3() / scale as f64;
            let translation = -axis64.dot(self.eye.as_dvec3());
            axis64.as_vec3().extend(translation as f32)
        };
        let w = row(self.forward, 1.0);
        let x = row(right, right.length_squared()) - w * ((2.0 * offset[0] - 1.0) / width as f32);
        let y = row(up, up.length_squared()) + w * ((2.0 * offset[1] - 1.0) / height as f32);
        let z = Vec4::new(0.0, 0.0, 0.0, self.near);
        Mat4::from_cols(x, y, z, w).transpose()
    }

    /// Matrix from the world to the camera's left-handed coordinates: x to the right, y up, z forward.
    pub fn camera_from_world(&self) -> DMat4 {
        let eye = self.eye.as_dvec3();
        let row = |axis: Vec3| axis.as_dvec3().extend(-axis.as_dvec3().dot(eye));
        DMat4::from_cols(row(self.right), row(self.up), row(self.forward), DVec4::W).transpose()
    }

    /// Matrix from the world to the picture: after division by w, x is 0 at its left edge and 1 at its right
    /// one, y is 0 at its top and 1 at its bottom, and z is 0 at the near plane and 1 at infinity.
    pub fn ndc_from_world(&self, width: u32, height: u32) -> DMat4 {
        let y = f64::from(self.tan_half_fov);
        let x = y * f64::from(width) / f64::from(height);
        let ndc_from_camera = DMat4::from_cols(
            DVec4::new(0.5 / x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -0.5 / y, 0.0, 0.0),
            DVec4::new(0.5, 0.5, 1.0, 1.0),
            DVec4::new(0.0, 0.0, -f64::from(self.near), 0.0),
        );
        ndc_from_camera * self.camera_from_world()
    }

    /// Cosine of the angle between the view and the ray through a pixel of the whole image; see
    /// [`Camera::view_ray`]. It is the share of the ray's length that lies along the view.
    pub fn cosine(&self, width: u32, height: u32, pixel: [u32; 2], offset: [f32; 2]) -> f32 {
        let (right, up) = self.image_plane(width, height);
        let x = 2.0 * (pixel[0] as f32 + offset[0]) / width as f32 - 1.0;
        let y = 1.0 - 2.0 * (pixel[1] as f32 + offset[1]) / height as f32;
        1.0 / (1.0 + x * x * right.length_squared() + y * y * up.length_squared()).sqrt()
    }

    /// Unit direction through a pixel of the whole image, at `offset` pixels from the pixel's top left
    /// corner. Twin: `view_ray` in `shaders/layout.wgsl`.
    pub fn view_ray(&self, width: u32, height: u32, pixel: [u32; 2], offset: [f32; 2]) -> Vec3 {
        let (right, up) = self.image_plane(width, height);
        let x = 2.0 * (pixel[0] as f32 + offset[0]) / width as f32 - 1.0;
        let y = 1.0 - 2.0 * (pixel[1] as f32 + offset[1]) / height as f32;
        let d = self.forward + right * x + up * y;
        d / d.dot(d).sqrt()
    }
}

/// Converts the clip matrix of the whole image to that of a window, in float64. If the window is the whole
/// image, the bits of the matrix do not change.
pub fn clip_to_window(clip_from_world: Mat4, [width, height]: [u32; 2], window: Window) -> Mat4 {
    let [w, h] = [width, height].map(f64::from);
    let [x, y, window_w, window_h] = [window.x, window.y, window.width, window.height].map(f64::from);
    let window_from_clip = DMat4::from_cols(
        DVec4::new(w / window_w, 0.0, 0.0, 0.0),
        DVec4::new(0.0, h / window_h, 0.0, 0.0),
        DVec4::Z,
        DVec4::new((w - 2.0 * x) / window_w - 1.0, 1.0 - (h - 2.0 * y) / window_h, 0.0, 1.0),
    );
    (window_from_clip * clip_from_world.as_dmat4()).as_mat4()
}

/// Number of the sample at a pixel's centre. Layers, previews and inspectors take it for any number of
/// samples, even if the picture's samples do not include it.
pub const CENTRE: u32 = 0;

/// Returns the numbers of an image's samples. They include [`CENTRE`] only if the number of samples is odd.
pub fn sample_numbers(image: &Image) -> Range<u32> {
    let first = u32::from(image.samples.is_multiple_of(2));
    first..first + image.samples
}

/// Offset of sample `sample` from the top left corner of a pixel, in pixels.
///
/// The mean of an image's samples is the pixel's centre, because every sample has a mirror image: otherwise
/// pictures with different numbers of samples would not register. The samples are n successive points of the
/// R2 sequence (Roberts 2018), ½ + kα, which fills a square evenly for any n without random numbers. k runs
/// from −(n − 1)/2 to (n − 1)/2, so the points mirror each other. They are numbered from the middle outwards,
/// k = 0, 1, −1, 2 … or k = ½, −½, 1½ …, so more samples continue fewer if both numbers are odd or even.
///
/// A filter other than the box warps the square, so that the density of samples is proportional to the filter
/// (Ernst, Stamminger and Greiner, "Filter Importance Sampling", 2006). Every pixel has its own samples, and
/// its value is their unweighted mean.
pub fn sample_offset(image: &Image, sample: u32) -> [f32; 2] {
    if sample == CENTRE {
        return [0.5, 0.5];
    }
    // First and second power of the plastic number's reciprocal.
    const A: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    let first = if image.samples.is_multiple_of(2) { 0.5 } else { 0.0 };
    let k = f64::from(sample.div_ceil(2)) - first;
    // A point's mirror image is computed from the same number, so that it mirrors the point exactly.
    let side = if sample.is_multiple_of(2) { -1.0 } else { 1.0 };
    A.map(|a| {
        let away = k * a - (k * a).round();
        let away = match image.filter {
            Filter::Box => away,
            Filter::Gaussian => GAUSSIAN.quantile(0.5 + away),
            Filter::BlackmanHarris => BLACKMAN_HARRIS.quantile(0.5 + away),
        };
        (0.5 + side * away) as f32
    })
}

/// Radius of the filters other than the box, pixels.
pub const FILTER_RADIUS: f64 = 1.5;
/// Number of steps of a quantile table on either side. With this number a sample's offset is accurate to 10⁻⁵
/// pixels.
const STEPS: usize = 1024;

/// Gaussian with σ = ½ pixel, cut off at [`FILTER_RADIUS`].
static GAUSSIAN: LazyLock<Quantiles> = LazyLock::new(|| {
    const SIGMA: f64 = 0.5;
    Quantiles::new(|x| (-x * x / (2.0 * SIGMA * SIGMA)).exp())
});

/// Blackman–Harris window (Harris, "On the Use of Windows for Harmonic Analysis with the Discrete Fourier
/// Transform", 1978).
static BLACKMAN_HARRIS: LazyLock<Quantiles> = LazyLock::new(|| {
    Quantiles::new(|x| {
        let a = std::f64::consts::PI * x / FILTER_RADIUS;
        0.35875 + 0.48829 * a.cos() + 0.14128 * (2.0 * a).cos() + 0.01168 * (3.0 * a).cos()
    })
});

/// Cumulative table of a symmetric filter: the share of its integral between 0 and each step of its radius.
struct Quantiles(Vec<f64>);

impl Quantiles {
    /// Table of a filter that is positive inside its radius.
    fn new(weight: impl Fn(f64) -> f64) -> Self {
        let step = FILTER_RADIUS / STEPS as f64;
        let mut sum = 0.0;
        let mut shares = vec![0.0];
        for i in 0..STEPS {
            // Integration by Simpson's rule.
            let [a, m, b] = [0.0, 0.5, 1.0].map(|part| weight((i as f64 + part) * step));
            sum += a + 4.0 * m + b;
            shares.push(sum);
        }
        Quantiles(shares.into_iter().map(|share| share / sum).collect())
    }

    /// Offset from the filter's centre, in pixels, below which the share `p` of the filter's integral lies.
    fn quantile(&self, p: f64) -> f64 {
        let wanted = (2.0 * p - 1.0).abs();
        let above = self.0.partition_point(|&share| share <= wanted).clamp(1, STEPS);
        let (a, b) = (self.0[above - 1], self.0[above]);
        let steps = (above - 1) as f64 + ((wanted - a) / (b - a)).min(1.0);
        (steps * FILTER_RADIUS / STEPS as f64).copysign(p - 0.5)
    }
}

/// Solid angle of one sample, in sr: that of the pixel at the image centre, divided by the number of samples.
pub fn footprint(camera: &Camera, image: &Image) -> f32 {
    let (right, up) = camera.image_plane(image.width, image.height);
    let pixels = image.width as f32 * image.height as f32;
    4.0 * (right.length() * up.length()) / (pixels * image.samples as f32)
}
