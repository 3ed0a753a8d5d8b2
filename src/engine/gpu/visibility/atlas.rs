//! The texture that holds all light volumes of a frame.

use crate::engine::gpu::device::Gpu;
use crate::engine::gpu::packing::Packing;
use crate::light::visibility::LightVolumes;
use crate::util::error::{Error, Result};

/// Arrangement of the light volumes in their texture: as many as fit along z, then along x, then along y.
pub struct LightVolumeAtlas(Packing);

impl LightVolumeAtlas {
    /// Arranges light volumes of these sizes in texels.
    ///
    /// # Errors
    /// [`Error::Device`] if they do not fit into the device's largest 3-D texture.
    pub fn new(gpu: &Gpu, sizes: &[[u32; 3]]) -> Result<Self> {
        let most = gpu.device.limits().max_texture_dimension_3d;
        // z comes first: it is the order of the volume's own slices.
        Packing::along([2, 0, 1], sizes, most).map(LightVolumeAtlas).ok_or_else(|| {
            let largest = sizes.iter().max_by_key(|size| size.iter().map(|&n| u64::from(n)).product::<u64>());
            let [nx, ny, nz] = largest.copied().unwrap_or_default();
            let (count, up_to) =
                (sizes.len(), if sizes.iter().all(|s| s == &sizes[0]) { "" } else { "up to " });
            Error::device(
                format!(
                    "{count} light volumes of {up_to}{nx}×{ny}×{nz} cells are too large for {}",
                    gpu.name()
                ),
                "use light.visibility=march, or --engine cpu",
            )
        })
    }

    /// Returns the size of the texture, texels.
    pub fn extent(&self) -> [u32; 3] {
        self.0.extent
    }

    /// Returns the origin of a light volume in the texture, texels.
    pub fn origin(&self, number: u32) -> [i32; 3] {
        self.0.origins[number as usize].map(|n| n as i32)
    }
}

/// Allocates the texture of all light volumes.
pub fn texture(gpu: &Gpu, [width, height, depth]: [u32; 3]) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("light volumes"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Uploads the table that tells where the light volumes of each quad and light are:
/// [`FilledVolumes::places`].
///
/// [`FilledVolumes::places`]: super::FilledVolumes::places
pub fn light_places(gpu: &Gpu, plan: &LightVolumes, atlas: &LightVolumeAtlas) -> wgpu::Buffer {
    let before = plan.patches.len() as u32;
    let patches = plan.patches.iter().map(|p| {
        let [nu, nv] = p.count.map(|n| n as i32);
        [(before + p.first) as i32, nu, nv, i32::from(p.cornered)]
    });
    let numbers = plan.numbers.iter().zip(&plan.marched).map(|(&number, &marched)| {
        let [x, y, z] = atlas.origin(number);
        [x, y, z, i32::from(marched)]
    });
    let all: Vec<[i32; 4]> = patches.chain(numbers).collect();
    gpu.buffer_with("light places", bytemuck::cast_slice(&all), wgpu::BufferUsages::STORAGE)
}
