//! Pools on the device.

use super::device::Gpu;
use super::tiles::Part;
use super::upload::upload_floats;
use crate::engine::pool_surface::{SlopeMap, Surface};
use crate::place::{Mesh, PoolField};
use crate::util::error::Result;

/// A pool on the device.
pub struct UploadedPool {
    /// Uniform `Surface`.
    pub surface: wgpu::Buffer,
    /// Slopes and foam of a pool with a field.
    pub field: Option<[wgpu::TextureView; 2]>,
    /// Parts to draw.
    pub parts: Vec<Part>,
}

impl UploadedPool {
    /// Uploads surfaces and slopes. `carried` are the pools' textures of foam, and `parts` what is drawn of
    /// each.
    ///
    /// # Errors
    /// Errors of [`Gpu::run`].
    pub fn all(
        gpu: &Gpu,
        surfaces: &[Surface],
        slopes: &[Option<SlopeMap>],
        carried: Vec<Option<wgpu::TextureView>>,
        parts: Vec<Vec<Part>>,
    ) -> Result<Vec<UploadedPool>> {
        // A mesh that was made for no pools has no foam.
        let carried = carried.into_iter().chain(std::iter::repeat(None));
        let each = surfaces.iter().zip(slopes).zip(carried).zip(parts);
        each.map(|(((surface, slopes), carried), parts)| {
            let field = match slopes.as_ref().zip(carried) {
                None => None,
                Some((SlopeMap { size, texels }, carried)) => {
                    Some([upload_floats(gpu, "pool slopes", size.map(|n| n as u32), texels)?, carried])
                }
            };
            let surface = bytemuck::bytes_of(surface);
            let surface = gpu.buffer_with("pool", surface, wgpu::BufferUsages::UNIFORM);
            Ok(UploadedPool { surface, field, parts })
        })
        .collect()
    }
}

/// Uploads the foam of each pool of a mesh that has a field.
pub(super) fn upload_carried(gpu: &Gpu, mesh: &Mesh) -> Result<Vec<Option<wgpu::TextureView>>> {
    let upload = |field: &Option<PoolField>| {
        let Some(PoolField { coarse, carried, .. }) = field else { return Ok(None) };
        upload_floats(gpu, "pool foam", coarse.size.map(|n| n as u32), carried).map(Some)
    };
    mesh.fields.iter().map(upload).collect()
}
