//! The thin lens: a picture is sharp at one distance, and points elsewhere become discs.
//!
//! Each sample of the picture sees the scene from a point of its own on the lens. The image is moved with it,
//! so that the plane in focus stays where it is: for a pinhole beside the axis, parallel to the image plane,
//! a projection is sheared by exactly that.

use std::f64::consts::PI;

use super::{Camera, Image};

/// Height of the sensor, metres: that of a 35 mm film frame.
pub const SENSOR_HEIGHT: f64 = 0.024;

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of its opening, metres.
    pub radius: f64,
    /// Distance of the plane in focus along the view axis, metres.
    pub focus: f64,
}

impl Lens {
    /// Lens of a camera whose image has the given tangent of half its vertical field of view, with an
    /// f-number above 0, focused on a plane `focus` metres away.
    ///
    /// The sensor lies v = ½·[`SENSOR_HEIGHT`]/tan behind the lens, where it is sharp for the plane in focus:
    /// 1/f = 1/v + 1/focus. The opening is f divided by the f-number.
    pub fn new(tan_half_fov: f64, f_number: f64, focus: f64) -> Lens {
        let image = 0.5 * SENSOR_HEIGHT / tan_half_fov;
        let focal = image * focus / (image + focus);
        Lens { radius: 0.5 * focal / f_number, focus }
    }

    /// Returns the diameter of the disc that a point becomes, in pixels of the image; `depth` is its distance
    /// along the view axis in metres. This is the circle of confusion A·|depth − focus|/depth·v/focus on the
    /// sensor, with the opening A and the distance v of the sensor.
    pub fn blur(&self, camera: &Camera, image: &Image, depth: f64) -> f64 {
        let pixels = 0.5 * f64::from(image.height) / f64::from(camera.tan_half_fov);
        2.0 * self.radius * (1.0 / self.focus - 1.0 / depth).abs() * pixels
    }

    /// Returns the point of the lens through which sample `sample` of an image sees the scene, to the right
    /// of its middle and above, metres.
    ///
    /// The points lie on a spiral of the golden angle, whose turns have equal areas (Vogel 1979). Each has a
    /// mirror image, as the samples' places in the pixel have, so that their mean is the middle.
    pub fn point(&self, image: &Image, sample: u32) -> [f64; 2] {
        let n = f64::from(image.samples);
        let Some(pair) = sample.div_ceil(2).checked_sub(1) else { return [0.0; 2] };
        let pair = f64::from(pair);
        let odd = f64::from(image.samples % 2);
        let r = self.radius * ((odd + 2.0 * pair + 1.0) / n).min(1.0).sqrt();
        let (sin, cos) = (pair * PI * (3.0 - 5f64.sqrt())).sin_cos();
        let side = if sample.is_multiple_of(2) { -r } else { r };
        [side * cos, side * sin]
    }

    /// Returns the camera and the image of one sample, which sees the scene through its own point of the
    /// lens.
    pub fn seen(&self, camera: &Camera, image: &Image, sample: u32) -> (Camera, Image) {
        let [x, y] = self.point(image, sample);
        let pixels = 0.5 * f64::from(image.height) / (f64::from(camera.tan_half_fov) * self.focus);
        let eye = camera.eye + camera.right * x + camera.up * y;
        let shift = [(-x * pixels) as f32, (y * pixels) as f32];
        (Camera { eye, ..*camera }, Image { shift, ..*image })
    }
}
