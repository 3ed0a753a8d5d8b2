//! The linear frame, the raster pass's layers and the layers of an EXR file.

use glam::Vec3;

use super::camera::{CENTRE, sample_offset};
use super::{Camera, Image};
use crate::util::window::Window;

/// Seconds per stage. On the GPU engine gbuffer, integrate and resolve are device time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Seconds {
    /// Building or reading the volume texture (host).
    pub volume: f64,
    /// Opening the device and compiling the passes that all scenes share (host).
    pub device: f64,
    /// Compiling the pass that is specialised to the scene (host).
    pub pipelines: f64,
    /// Upload of volume, quads and mesh (host).
    pub upload: f64,
    /// Filling the light volumes, unless those of the previous frame still serve.
    pub visibility: f64,
    /// Raster pass.
    pub gbuffer: f64,
    /// Walk through the volume, and light.
    pub integrate: f64,
    /// Development of the picture: white balance, exposure, tone curve and 8 bits.
    pub resolve: f64,
    /// Read-back (host).
    pub readback: f64,
    /// Encoding and writing the outputs (host).
    pub output: f64,
}

impl std::ops::AddAssign for Seconds {
    fn add_assign(&mut self, other: Seconds) {
        self.volume += other.volume;
        self.device += other.device;
        self.pipelines += other.pipelines;
        self.upload += other.upload;
        self.visibility += other.visibility;
        self.gbuffer += other.gbuffer;
        self.integrate += other.integrate;
        self.resolve += other.resolve;
        self.readback += other.readback;
        self.output += other.output;
    }
}

/// Layers of the raster pass, at the centre of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Distance from the eye to the nearest water or opaque surface, metres; 0 in the background.
    pub depth: Vec<f32>,
    /// The part of that distance that lies along the view, metres: the surface lies on a plane so far before
    /// the eye. See [`Surface::set_planar`].
    pub z: Vec<f32>,
    /// Texture coordinates (u, v) on the quad, 0 to 1.
    pub uv: Vec<[f32; 2]>,
    /// Number of the nearest quad plus 1; 0 without a quad.
    pub quad: Vec<u32>,
    /// Unit normal on the seen side; 0 in the background.
    pub normal: Vec<[f32; 3]>,
}

/// Finished frame. Every layer runs row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Linear radiance R, G, B and the volume's transmittance, averaged over the samples.
    pub radiance: Vec<[f32; 4]>,
    /// Cells walked by view rays and by light rays, summed over the samples.
    pub counts: Vec<[u32; 2]>,
    /// Share of what is put behind the picture that it hides, 0 to 1: the alpha by which R, G, B of
    /// `radiance` are multiplied already. `None` if the picture has no alpha channel.
    pub alpha: Option<Vec<f32>>,
    /// Developed picture: sRGB bytes R, G, B, A. The colour is not multiplied by alpha.
    pub picture: Vec<[u8; 4]>,
    /// Layers of the raster pass, if requested.
    pub surface: Option<Surface>,
    /// Seconds per stage.
    pub seconds: Seconds,
}

impl Surface {
    /// Empty layers for that many pixels.
    pub fn new(pixels: usize) -> Self {
        Surface {
            depth: vec![0.0; pixels],
            z: vec![0.0; pixels],
            uv: vec![[0.0; 2]; pixels],
            quad: vec![0; pixels],
            normal: vec![[0.0; 3]; pixels],
        }
    }

    /// Stores pixel `i`.
    ///
    /// `face` is the number plus 1 of the nearest face of water, or 0; `hit` is (u, v, metres from the eye)
    /// on it, and `normal` returns its normal on the side that is seen. `behind` is the depth in metres and
    /// the normal of the opaque surface, which are stored if `face` is 0.
    pub fn set(
        &mut self,
        i: usize,
        face: u32,
        hit: [f32; 4],
        normal: impl FnOnce(usize, [f32; 2]) -> Vec3,
        behind: (f32, Vec3),
    ) {
        self.quad[i] = face;
        if face == 0 {
            self.depth[i] = behind.0;
            self.normal[i] = behind.1.to_array();
            return;
        }
        self.depth[i] = hit[2];
        self.uv[i] = [hit[0], hit[1]];
        self.normal[i] = normal(face as usize - 1, self.uv[i]).to_array();
    }

    /// Fills `z` from `depth`, for the part `window` of an image.
    pub fn set_planar(&mut self, camera: &Camera, image: &Image, window: Window) {
        let offset = sample_offset(image, CENTRE);
        let rows = self.z.chunks_mut(window.width as usize).zip(self.depth.chunks(window.width as usize));
        for ((z, depth), y) in rows.zip(window.y..) {
            for ((z, depth), x) in z.iter_mut().zip(depth).zip(window.x..) {
                *z = depth * camera.cosine(image.width, image.height, [x, y], offset);
            }
        }
    }
}

impl Frame {
    /// Empty frame, with the raster pass's layers if `surface` is set.
    pub fn new(width: u32, height: u32, surface: bool) -> Self {
        let pixels = width as usize * height as usize;
        Frame {
            width,
            height,
            radiance: vec![[0.0; 4]; pixels],
            counts: vec![[0; 2]; pixels],
            alpha: None,
            picture: vec![[0; 4]; pixels],
            surface: surface.then(|| Surface::new(pixels)),
            seconds: Seconds::default(),
        }
    }

    /// Total number of cells walked by view rays and by light rays.
    pub fn cells_walked(&self) -> [u64; 2] {
        self.counts.iter().fold([0, 0], |[a, b], c| [a + c[0] as u64, b + c[1] as u64])
    }

    /// Number of pixels in which any sample walks the volume.
    pub fn covered_pixels(&self) -> u64 {
        self.counts.iter().filter(|c| c[0] > 0).count() as u64
    }

    /// Number of pixels whose radiance or transmittance is infinite or NaN. It is 0 in a correct frame.
    pub fn non_finite_pixels(&self) -> u64 {
        self.radiance.iter().filter(|r| !r.iter().all(|x| x.is_finite())).count() as u64
    }
}

/// Layer of an EXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Linear radiance: channels R, G, B.
    Rgb,
    /// The same multiplied by alpha, and alpha: channels R, G, B, A. It takes the place of `Rgb` in a picture
    /// with an alpha channel; see [`Layer::of_picture`].
    Rgba,
    /// Two depths of the first surface in metres, along the view and along the ray; 0 in the background.
    Depth,
    /// Texture coordinates on the nearest quad.
    Uv,
    /// Number of the nearest quad plus 1; 0 without a quad.
    Quad,
    /// Transmittance of the volume, 0 to 1.
    Transmittance,
    /// Number of cells walked by view rays.
    Cells,
    /// Unit normal on the seen side; 0 in the background.
    Normal,
}

impl Layer {
    /// All layers that can be asked for; the default for an EXR file.
    pub const ALL: [Layer; 7] =
        [Layer::Rgb, Layer::Depth, Layer::Uv, Layer::Quad, Layer::Transmittance, Layer::Cells, Layer::Normal];

    /// Whether the layer comes from the raster pass.
    pub fn of_surface(self) -> bool {
        matches!(self, Layer::Depth | Layer::Uv | Layer::Quad | Layer::Normal)
    }

    /// Returns the layer as a picture with or without an `alpha` channel has it.
    pub fn of_picture(self, alpha: bool) -> Layer {
        if self == Layer::Rgb && alpha { Layer::Rgba } else { self }
    }

    /// Name of the layer on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Rgb | Layer::Rgba => "rgb",
            Layer::Depth => "depth",
            Layer::Uv => "uv",
            Layer::Quad => "quad",
            Layer::Transmittance => "transmittance",
            Layer::Cells => "cells",
            Layer::Normal => "normal",
        }
    }

    /// Channels of the layer in the file.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Layer::Rgb => &["R", "G", "B"],
            Layer::Rgba => &["R", "G", "B", "A"],
            Layer::Depth => &["depth.Z", "distance.D"],
            Layer::Uv => &["uv.U", "uv.V"],
            Layer::Quad => &["quad.ID"],
            Layer::Transmittance => &["transmittance.T"],
            Layer::Cells => &["cells.N"],
            Layer::Normal => &["normal.X", "normal.Y", "normal.Z"],
        }
    }

    /// Value of channel number `channel` of the layer at pixel `i`.
    pub fn value(self, frame: &Frame, channel: usize, i: usize) -> f32 {
        let surface = |get: fn(&Surface, usize, usize) -> f32| {
            frame.surface.as_ref().map_or(0.0, |s| get(s, channel, i))
        };
        match self {
            Layer::Rgba if channel == 3 => frame.alpha.as_ref().map_or(1.0, |alpha| alpha[i]),
            Layer::Rgb | Layer::Rgba => frame.radiance[i][channel],
            Layer::Depth => surface(|s, c, i| [s.z[i], s.depth[i]][c]),
            Layer::Uv => surface(|s, c, i| s.uv[i][c]),
            Layer::Quad => surface(|s, _, i| s.quad[i] as f32),
            Layer::Transmittance => frame.radiance[i][3],
            Layer::Cells => frame.counts[i][0] as f32,
            Layer::Normal => surface(|s, c, i| s.normal[i][c]),
        }
    }
}
