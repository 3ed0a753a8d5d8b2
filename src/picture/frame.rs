//! The linear frame with its layers.

use glam::Vec3;

use crate::mapping::Quad;

/// Seconds per stage. On the GPU engine gbuffer, integrate and resolve are the device's own time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Seconds {
    /// Building or reading the volume texture (host).
    pub volume: f64,
    /// Opening the device and compiling the passes all scenes share (host).
    pub device: f64,
    /// Compiling the pass specialised to the scene (host).
    pub pipelines: f64,
    /// Upload of volume, quads and mesh (host).
    pub upload: f64,
    /// Light volumes, where they are not kept from the frame before.
    pub visibility: f64,
    /// Raster pass.
    pub gbuffer: f64,
    /// Walk and light.
    pub integrate: f64,
    /// Tone and 8 bits.
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

/// What the raster pass saw at the first sample of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Metres from the eye to the water's face or the opaque scene; 0 where nothing is.
    pub depth: Vec<f32>,
    /// Texture coordinates on the quad.
    pub uv: Vec<[f32; 2]>,
    /// Number of the quad plus 1; 0 where there is none.
    pub quad: Vec<u32>,
    /// Unit normal on the seen side; 0 where nothing is.
    pub normal: Vec<[f32; 3]>,
}

/// A finished frame: row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Linear radiance and the volume's transmittance, means over the samples.
    pub radiance: Vec<[f32; 4]>,
    /// Cells walked by view rays and by light rays, sums over the samples.
    pub counts: Vec<[u32; 2]>,
    /// The picture: sRGB bytes R, G, B, A.
    pub picture: Vec<[u8; 4]>,
    /// The raster pass's layers, if asked for.
    pub surface: Option<Surface>,
    /// Seconds per stage.
    pub seconds: Seconds,
}

impl Surface {
    /// Empty layers.
    pub fn new(pixels: usize) -> Self {
        Surface {
            depth: vec![0.0; pixels],
            uv: vec![[0.0; 2]; pixels],
            quad: vec![0; pixels],
            normal: vec![[0.0; 3]; pixels],
        }
    }

    /// Stores pixel `i`: the number plus 1 of the nearest of `quads` with its (u, v, metres), or 0; and the
    /// depth and normal of what is behind, in metres.
    pub fn set(
        &mut self,
        i: usize,
        (quads, eye): (&[Quad], Vec3),
        quad: u32,
        hit: [f32; 4],
        behind: (f32, Vec3),
    ) {
        self.quad[i] = quad;
        if quad == 0 {
            self.depth[i] = behind.0;
            self.normal[i] = behind.1.to_array();
            return;
        }
        let map = &quads[quad as usize - 1].map;
        let to_eye = eye - map.point_world(hit[0], hit[1]);
        let side = if map.n_world.dot(to_eye) < 0.0 { -1.0 } else { 1.0 };
        self.depth[i] = hit[2];
        self.uv[i] = [hit[0], hit[1]];
        self.normal[i] = (map.n_world * side).to_array();
    }
}

impl Frame {
    /// An empty frame.
    pub fn new(width: u32, height: u32, surface: bool) -> Self {
        let pixels = width as usize * height as usize;
        Frame {
            width,
            height,
            radiance: vec![[0.0; 4]; pixels],
            counts: vec![[0; 2]; pixels],
            picture: vec![[0; 4]; pixels],
            surface: surface.then(|| Surface::new(pixels)),
            seconds: Seconds::default(),
        }
    }

    /// Cells walked by view rays and by light rays.
    pub fn cells_walked(&self) -> [u64; 2] {
        self.counts.iter().fold([0, 0], |[a, b], c| [a + c[0] as u64, b + c[1] as u64])
    }

    /// Pixels with a volume quad in any sample.
    pub fn covered_pixels(&self) -> u64 {
        self.counts.iter().filter(|c| c[0] > 0).count() as u64
    }

    /// Pixels whose radiance or transmittance is infinite or not a number. Always 0 in a sound frame.
    pub fn non_finite_pixels(&self) -> u64 {
        self.radiance.iter().filter(|r| !r.iter().all(|x| x.is_finite())).count() as u64
    }
}

/// A layer of the EXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Linear radiance: channels R, G, B.
    Rgb,
    /// Metres to the first surface; 0: none.
    Depth,
    /// Texture coordinates on the quad.
    Uv,
    /// Quad number plus 1; 0: none.
    Quad,
    /// Transmittance of the volume.
    Transmittance,
    /// Cells walked by the view rays.
    Cells,
    /// Normal on the seen side.
    Normal,
}

impl Layer {
    /// All layers, as written by default.
    pub const ALL: [Layer; 7] =
        [Layer::Rgb, Layer::Depth, Layer::Uv, Layer::Quad, Layer::Transmittance, Layer::Cells, Layer::Normal];

    /// Whether it comes from the raster pass.
    pub fn of_surface(self) -> bool {
        matches!(self, Layer::Depth | Layer::Uv | Layer::Quad | Layer::Normal)
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Rgb => "rgb",
            Layer::Depth => "depth",
            Layer::Uv => "uv",
            Layer::Quad => "quad",
            Layer::Transmittance => "transmittance",
            Layer::Cells => "cells",
            Layer::Normal => "normal",
        }
    }

    /// Its channels in the file.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Layer::Rgb => &["R", "G", "B"],
            Layer::Depth => &["depth.Z"],
            Layer::Uv => &["uv.U", "uv.V"],
            Layer::Quad => &["quad.ID"],
            Layer::Transmittance => &["transmittance.T"],
            Layer::Cells => &["cells.N"],
            Layer::Normal => &["normal.X", "normal.Y", "normal.Z"],
        }
    }

    /// Value of its channel `channel` at pixel `i`.
    pub fn value(self, frame: &Frame, channel: usize, i: usize) -> f32 {
        let surface = |get: fn(&Surface, usize, usize) -> f32| {
            frame.surface.as_ref().map_or(0.0, |s| get(s, channel, i))
        };
        match self {
            Layer::Rgb => frame.radiance[i][channel],
            Layer::Depth => surface(|s, _, i| s.depth[i]),
            Layer::Uv => surface(|s, c, i| s.uv[i][c]),
            Layer::Quad => surface(|s, _, i| s.quad[i] as f32),
            Layer::Transmittance => frame.radiance[i][3],
            Layer::Cells => frame.counts[i][0] as f32,
            Layer::Normal => surface(|s, c, i| s.normal[i][c]),
        }
    }
}
