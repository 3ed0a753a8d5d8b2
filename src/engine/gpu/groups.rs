//! The workgroups of the integrate pass: wet ones, which volume quads may cover, and dry ones, which need no
//! walk.
//!
//! They are dispatched apart because software Vulkan runs through the whole shader even if no lane has work
//! to do.

use super::device::Gpu;
use super::layout::{Tile, WORKGROUP};
use crate::engine::overlap;
use crate::scene::Scene;
use crate::util::window::Window;

/// List of all workgroups of an area, by their position in workgroups from its corner.
pub struct GroupList {
    /// `array<u32>` of x | y << 16: first the wet workgroups row by row, then the dry ones.
    pub buffer: wgpu::Buffer,
    /// Number of wet workgroups.
    pub wet: u32,
    /// Number of dry workgroups.
    pub dry: u32,
}

impl GroupList {
    /// Lists the workgroups of an area of a window, and uploads the list.
    pub fn new(gpu: &Gpu, scene: &Scene, window: Window, area: Tile) -> Self {
        let [across, down] = [area.width, area.height].map(|n| n.div_ceil(WORKGROUP));
        let corner = [window.x + area.x, window.y + area.y];
        let covered = overlap::covered(scene, corner, [across, down], WORKGROUP);
        let positions = |wet: bool| {
            let chosen = covered.iter().enumerate().filter(move |(_, covered)| **covered == wet);
            chosen.map(move |(i, _)| (i as u32 % across) | ((i as u32 / across) << 16))
        };
        let mut list: Vec<u32> = positions(true).collect();
        let wet = list.len() as u32;
        list.extend(positions(false));
        let buffer = gpu.buffer_with("workgroups", bytemuck::cast_slice(&list), wgpu::BufferUsages::STORAGE);
        GroupList { buffer, wet, dry: list.len() as u32 - wet }
    }
}
