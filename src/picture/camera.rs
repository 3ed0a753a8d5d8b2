//! The pinhole camera: rays through pixels, and the matrix that projects geometry onto the same pixels.

use std::ops::Range;
use std::sync::LazyLock;

use glam::{DMat4, DVec3, DVec4, Mat4, Vec2, Vec3, Vec4};

use super::{Filter, Image};
use crate::util::window::Window;

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The place in the world from which all other positions of the scene are measured, metres.
    pub origin: DVec3,
    /// Position of the eye in the world, metres.
    pub eye: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit vector into the image.
    pub forward: DVec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_fov: f32,
    /// Distance of the near plane along `forward`, metres.
    pub near: f32,
}

/// Range of depths that the z-buffer tells apart, metres along the view axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthRange {
    near: f64,
    /// Infinite for a scene around the eye.
    far: f64,
}

/// Share of a distance below which a scene's depth makes the z-buffer end behind the scene. The steps of an
/// endless one are 2^-24 of the distance, so a scene would get fewer than 2^16 of them.
const SHALLOW: f64 = 1.0 / 256.0;

impl DepthRange {
    /// Reversed depth z/w of the near plane and of the far plane as A/w + B: returns A and B.
    fn scale(&self) -> [f64; 2] {
        match self.far {
            f64::INFINITY => [self.near, 0.0],
            far => [self.near * far / (far - self.near), -self.near / (far - self.near)],
        }
    }
}

/// Constants that turn a depth of the z-buffer into a point.
///
/// The point lies at the depth w = A/(z − B) along the view axis. For a distant scene, float32 would lose the
/// digits of w that count, so the point is measured from an anchor in the far plane:
/// w − far = −far·z/(z − B).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthToPoint {
    /// Point of the view axis from which points are measured: the eye, or the middle of the far plane.
    pub anchor: Vec3,
    /// B.
    pub shift: f32,
    /// The distance from the anchor along the view axis is (rise + slope·z)/(z − B).
    pub rise: f32,
    /// See `rise`.
    pub slope: f32,
    /// A.
    pub scale: f32,
}

impl Camera {
    /// Position of the eye relative to the scene's origin, metres. It is exact only in float64: a distant eye
    /// and a narrow view leave few digits for the scene.
    pub fn eye_local(&self) -> DVec3 {
        self.eye - self.origin
    }

    /// Vectors forward, right and up from the eye to the middle of the image plane at distance 1, and from
    /// there to its edges.
    pub fn rays(&self, width: u32, height: u32) -> [DVec3; 3] {
        let aspect = f64::from(width) / f64::from(height);
        let tan = f64::from(self.tan_half_fov);
        [self.forward, self.right * (tan * aspect), self.up * tan]
    }

    /// Vectors (right, up) from the centre of the image plane at distance 1 to its edges.
    pub fn image_plane(&self, width: u32, height: u32) -> (Vec3, Vec3) {
        let [_, right, up] = self.rays(width, height).map(|v| v.as_vec3());
        (right, up)
    }

    /// Returns the depths of a scene whose parts have these bounding boxes, relative to the origin.
    pub fn depth_range(&self, boxes: impl Iterator<Item = [Vec3; 2]>) -> DepthRange {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corners in boxes {
            for i in 0..8 {
                let corner = Vec3::from_array([0, 1, 2].map(|c| corners[i >> c & 1][c]));
                let depth = (corner.as_dvec3() - self.eye_local()).dot(self.forward);
                (low, high) = (low.min(depth), high.max(depth));
            }
        }
        // A margin keeps the outermost points inside.
        let margin = 0.01 * (high - low) + 1e-6 * high.abs();
        let (near, far) = (low - margin, high + margin);
        if near > f64::from(self.near) && high - low < SHALLOW * high {
            DepthRange { near, far }
        } else {
            DepthRange { near: self.near.into(), far: f64::INFINITY }
        }
    }

    /// Returns what turns depths of the z-buffer into points.
    pub fn depth_to_point(&self, depth: &DepthRange) -> DepthToPoint {
        let [scale, shift] = depth.scale().map(|x| x as f32);
        let eye = self.eye_local();
        match depth.far {
            f64::INFINITY => DepthToPoint { anchor: eye.as_vec3(), shift, rise: scale, slope: 0.0, scale },
            far => DepthToPoint {
                anchor: (eye + self.forward * far).as_vec3(),
                shift,
                rise: 0.0,
                slope: -far as f32,
                scale,
            },
        }
    }

    /// Matrix to clip space from positions relative to the origin, with reversed depth: z/w is 1 at the near
    /// plane and 0 at the far plane, or at infinity.
    ///
    /// The image is shifted so that the sample at `offset` inside each pixel lies on the pixel's centre,
    /// where rasterisers sample.
    pub fn clip_from_world(&self, width: u32, height: u32, offset: [f32; 2], depth: &DepthRange) -> Mat4 {
        let [forward, right, up] = self.rays(width, height);
        let eye = self.eye_local();
        // Rows give view coordinates in units of the image plane. The eye's part is computed in float64.
        let row = |axis: DVec3| axis.extend(-axis.dot(eye));
        let w64 = row(forward);
        let w = w64.as_vec4();
        let x = row(right / right.length_squared()).as_vec4() - w * ((2.0 * offset[0] - 1.0) / width as f32);
        let y = row(up / up.length_squared()).as_vec4() + w * ((2.0 * offset[1] - 1.0) / height as f32);
        let z = match depth.far {
            f64::INFINITY => Vec4::new(0.0, 0.0, 0.0, depth.near as f32),
            // far − w is a small difference of large numbers.
            far => ((DVec4::W * far - w64) * (depth.near / (far - depth.near))).as_vec4(),
        };
        Mat4::from_cols(x, y, z, w).transpose()
    }

    /// Matrix from the world to the camera's left-handed coordinates: x to the right, y up, z forward.
    pub fn camera_from_world(&self) -> DMat4 {
        let row = |axis: DVec3| axis.extend(-axis.dot(self.eye));
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
        let Vec2 { x, y } = Self::image_point(width, height, pixel, offset);
        1.0 / (1.0 + x * x * right.length_squared() + y * y * up.length_squared()).sqrt()
    }

    /// The point (X, Y) of the image at `offset` pixels from the top left corner of a pixel: −1 to 1 from
    /// left to right and from bottom to top. Twin: `image_point` in `shaders/layout.wgsl`.
    #[inline]
    pub fn image_point(width: u32, height: u32, pixel: [u32; 2], offset: [f32; 2]) -> Vec2 {
        Vec2::new(
            2.0 * (pixel[0] as f32 + offset[0]) / width as f32 - 1.0,
            1.0 - 2.0 * (pixel[1] as f32 + offset[1]) / height as f32,
        )
    }

    /// Vectors of [`Camera::rays`], rounded.
    pub fn ray_frame(&self, width: u32, height: u32) -> RayFrame {
        let [forward, right, up] = self.rays(width, height).map(|v| v.as_vec3());
        RayFrame { forward, right, up }
    }

    /// Vector from the eye to the point `at` of the image plane at distance 1.
    pub fn ray_to(&self, width: u32, height: u32, at: Vec2) -> Vec3 {
        self.ray_frame(width, height).to(at)
    }

    /// Unit direction through a pixel of the whole image, at `offset` pixels from the pixel's top left
    /// corner. Twin: `view_ray` in `shaders/layout.wgsl`.
    pub fn view_ray(&self, width: u32, height: u32, pixel: [u32; 2], offset: [f32; 2]) -> Vec3 {
        self.ray_frame(width, height).direction(Self::image_point(width, height, pixel, offset))
    }
}

/// Vectors from the eye to the middle of the image plane at distance 1, and from there to its edges.
#[derive(Clone, Copy, Debug)]
pub struct RayFrame {
    forward: Vec3,
    right: Vec3,
    up: Vec3,
}

impl RayFrame {
    /// Vector from the eye to the point `at` of the image plane.
    #[inline]
    pub fn to(&self, at: Vec2) -> Vec3 {
        self.forward + self.right * at.x + self.up * at.y
    }

    /// Unit direction to the point `at` of the image plane.
    #[inline]
    pub fn direction(&self, at: Vec2) -> Vec3 {
        let d = self.to(at);
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

/// Offset of sample `sample` from the top left corner of a pixel, in pixels, with the image's shift.
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
    let [x, y] = offset_in_pixel(image, sample);
    [x + image.shift[0], y + image.shift[1]]
}

/// [`sample_offset`] without the image's shift.
pub fn offset_in_pixel(image: &Image, sample: u32) -> [f32; 2] {
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
