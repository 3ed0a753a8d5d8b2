//! §3 The render targets of the raster pass.

use super::device::Gpu;

/// Format of the z-buffers.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Format of radiance, normals and surface points.
pub const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Shape of a window's targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TargetShape {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Layers of volume quads per pixel.
    pub layers: u32,
    /// Whether the scene has pools, which may be redrawn alone.
    pub pools: bool,
    /// Whether the picture has an alpha channel.
    pub alpha: bool,
}

/// The targets of one window.
pub struct Targets {
    /// Linear radiance of the opaque scene or the background, and metres from the eye (0: background).
    pub opaque: wgpu::Texture,
    /// Unit normal of the opaque scene (0: background), and the share of a backdrop behind the opaque scene
    /// that shows.
    pub normal: wgpu::Texture,
    /// u, v and metres from the eye of the nearest volume quad. Until the quads are drawn it holds the
    /// visible rock's position on the mesh.
    pub surface: wgpu::Texture,
    /// Numbers plus 1 of the quads under each pixel, the nearest in layer 0; 0: no further quad.
    pub quad_id: wgpu::Texture,
    /// The z-buffers. One layer and no pools need one. Otherwise the last is a copy of the opaque scene's
    /// z-buffer, from which further layers or other waves are drawn. With several layers, the first two hold
    /// the depth of the even and the odd layers in turn.
    pub(super) depth: Vec<wgpu::Texture>,
}

impl Targets {
    /// Allocates the targets of a window.
    pub fn new(gpu: &Gpu, shape: TargetShape) -> Self {
        let TargetShape { size: [width, height], layers, pools, .. } = shape;
        let texture = |label, format, usage, layers| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let (depths, depth_usage) = match (layers, pools) {
            (1, false) => (1, wgpu::TextureUsages::empty()),
            (1, true) => (2, read | wgpu::TextureUsages::COPY_DST),
            _ => (3, read | wgpu::TextureUsages::COPY_DST),
        };
        Targets {
            opaque: texture("opaque radiance", FLOATS, read, 1),
            normal: texture("opaque normal", FLOATS, read, 1),
            surface: texture("surface", FLOATS, read, 1),
            quad_id: texture("quad id", wgpu::TextureFormat::R32Uint, read, layers),
            depth: (0..depths).map(|_| texture("depth", DEPTH, depth_usage, 1)).collect(),
        }
    }

    /// Returns a view of the quads' numbers in a range of layers.
    pub fn ids(&self, layers: std::ops::Range<u32>) -> wgpu::TextureView {
        self.quad_id.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            base_array_layer: layers.start,
            array_layer_count: Some(layers.len() as u32),
            ..Default::default()
        })
    }

    /// Returns a view of the quads' numbers in one layer.
    pub fn layer(&self, layer: u32) -> wgpu::TextureView {
        self.quad_id.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..Default::default()
        })
    }
}
