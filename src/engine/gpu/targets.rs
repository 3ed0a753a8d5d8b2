//! §3 What the raster pass writes.

use super::device::Gpu;

/// Of the z-buffers.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Of radiance, normals and points.
pub const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The targets of one window.
pub struct Targets {
    /// Radiance of the opaque scene or the background; metres from the eye (0: background).
    pub opaque: wgpu::Texture,
    /// Normal of the opaque scene (0: background).
    pub normal: wgpu::Texture,
    /// u, v and metres from the eye of the nearest volume quad; before it is drawn, where on the mesh the rock is that is seen.
    pub surface: wgpu::Texture,
    /// Numbers plus 1 of the quads under each pixel, the nearest in layer 0; 0: no more.
    pub quad_id: wgpu::Texture,
    /// The z-buffer, and last that of the opaque scene, where layers behind the nearest or other waves may be
    /// drawn; with several layers the first and the second hold that of the even and of the odd ones in turn.
    pub(super) depth: Vec<wgpu::Texture>,
}

impl Targets {
    /// Targets for a window of `width` × `height` pixels under which `layers` quads may lie, and perhaps pools.
    pub fn new(gpu: &Gpu, width: u32, height: u32, layers: u32, pools: bool) -> Self {
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
            normal: texture("opaque normal", FLOATS, wgpu::TextureUsages::COPY_SRC, 1),
            surface: texture("surface", FLOATS, read, 1),
            quad_id: texture("quad id", wgpu::TextureFormat::R32Uint, read, layers),
            depth: (0..depths).map(|_| texture("depth", DEPTH, depth_usage, 1)).collect(),
        }
    }

    /// The quads' numbers in some of the layers.
    pub fn ids(&self, layers: std::ops::Range<u32>) -> wgpu::TextureView {
        self.quad_id.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            base_array_layer: layers.start,
            array_layer_count: Some(layers.len() as u32),
            ..Default::default()
        })
    }

    /// The quads' numbers in one layer.
    pub fn layer(&self, layer: u32) -> wgpu::TextureView {
        self.quad_id.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..Default::default()
        })
    }
}
