//! The pinhole camera: rays through pixels, and the matrix that puts geometry under them.

use glam::{DMat4, DVec4, Mat4, Vec3, Vec4};

use crate::frame::Window;
use crate::scene::Camera;

impl Camera {
    /// Half the image plane at distance 1: (right, up), scaled by the field of view.
    pub fn image_plane(&self, width: u32, height: u32) -> (Vec3, Vec3) {
        let aspect = width as f32 / height as f32;
        (self.right * (self.tan_half_fov * aspect), self.up * self.tan_half_fov)
    }

    /// Clip space with reversed infinite depth (z/w is 1 at the near plane, 0 at infinity): the sample
    /// at `offset` inside each pixel comes to lie on the pixel's centre, where rasterisers look.
    pub fn clip_from_world(&self, width: u32, height: u32, offset: [f32; 2]) -> Mat4 {
        let (right, up) = self.image_plane(width, height);
        // Rows of view coordinates in units of the image plane; the eye goes in with float64.
        let row = |axis: Vec3, scale: f32| {
            let axis64 = axis.as_dvec3() / scale as f64;
            let moved = -axis64.dot(self.eye.as_dvec3());
            axis64.as_vec3().extend(moved as f32)
        };
        let w = row(self.forward, 1.0);
        let x = row(right, right.length_squared()) - w * ((2.0 * offset[0] - 1.0) / width as f32);
        let y = row(up, up.length_squared()) + w * ((2.0 * offset[1] - 1.0) / height as f32);
        let z = Vec4::new(0.0, 0.0, 0.0, self.near);
        Mat4::from_cols(x, y, z, w).transpose()
    }

    /// Unit direction through a pixel of the whole image, at `offset` from its top left corner.
    /// Twin: `view_ray` in `shaders/frame.wgsl`.
    pub fn view_ray(&self, width: u32, height: u32, pixel: [u32; 2], offset: [f32; 2]) -> Vec3 {
        let (right, up) = self.image_plane(width, height);
        let x = 2.0 * (pixel[0] as f32 + offset[0]) / width as f32 - 1.0;
        let y = 1.0 - 2.0 * (pixel[1] as f32 + offset[1]) / height as f32;
        let d = self.forward + right * x + up * y;
        d / d.dot(d).sqrt()
    }
}

/// The clip space of a window from that of the whole image, in float64; the same bits where the window is
/// the whole image.
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

/// Where sample `sample` of `samples` lies inside a pixel: the centre for one sample, else the R2
/// sequence (Roberts 2018), which fills the pixel evenly for any number and needs no random numbers.
pub fn sample_offset(sample: u32, samples: u32) -> [f32; 2] {
    if samples == 1 {
        return [0.5, 0.5];
    }
    // Powers of the inverse of the plastic number.
    const A: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    A.map(|a| (0.5 + a * sample as f64).fract() as f32)
}
