//! `taki devices`: lists the GPU adapters.

use super::quiet::without_noise;
use super::terminal::say;
use crate::engine::gpu::adapters;
use crate::util::error::Result;

pub fn run() -> Result<()> {
    let adapters = without_noise(adapters);
    if adapters.is_empty() {
        say(
            "no GPU adapter: taki renders on the CPU. A Vulkan driver (Debian: mesa-vulkan-drivers) enables \
             the GPU engine.",
        )?;
    }
    for adapter in adapters {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        say(&format!(
            "{} ({:?}, {:?}, driver {} {}): 3-D textures to {}, images to {}, timestamps {}",
            info.name,
            info.device_type,
            info.backend,
            info.driver,
            info.driver_info,
            limits.max_texture_dimension_3d,
            limits.max_texture_dimension_2d,
            if adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY) { "yes" } else { "no" },
        ))?;
    }
    Ok(())
}
