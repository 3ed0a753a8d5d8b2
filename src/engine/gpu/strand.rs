//! The strand model's table on the device: the reflection of flowing water and of hair.

use super::device::Gpu;
use crate::light::strand::table::StrandTable;

/// The table as `shaders/light/strand.wgsl` reads it.
pub struct StrandTexture {
    /// `texture_3d<f32>`, `rgb9e5ufloat`.
    pub view: wgpu::TextureView,
    /// Trilinear sampler.
    pub sampler: wgpu::Sampler,
}

impl StrandTexture {
    /// Uploads a table, 1 or 4 MB.
    pub fn new(gpu: &Gpu, table: &StrandTable) -> Self {
        Self::with(gpu, table.size().map(|n| n as u32), table.texels())
    }

    /// Uploads one texel, which is bound for scenes without the strand model.
    pub fn empty(gpu: &Gpu) -> Self {
        Self::with(gpu, [1; 3], &[0])
    }

    fn with(gpu: &Gpu, [width, height, depth_or_array_layers]: [u32; 3], texels: &[u32]) -> Self {
        let size = wgpu::Extent3d { width, height, depth_or_array_layers };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("strand"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgb9e5Ufloat,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        gpu.queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: Some(height),
            },
            size,
        );
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("strand"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        StrandTexture { view: texture.create_view(&Default::default()), sampler }
    }
}
