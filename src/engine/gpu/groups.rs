//! The workgroups of the integrate pass: those that water may lie under, and the rest, which need no walk.
//!
//! Software Vulkan goes once through all of a shader even where no lane has anything to do.

use super::device::Gpu;
use super::layout::{Tile, WORKGROUP};
use crate::engine::overlap;
use crate::scene::Scene;
use crate::util::window::Window;

/// Places of all workgroups of an area, in workgroups from its corner.
pub struct GroupList {
    /// `array<u32>`, x | y << 16: first those under water, row by row, then the others.
    pub buffer: wgpu::Buffer,
    /// How many water may lie under.
    pub wet: u32,
    /// The others.
    pub dry: u32,
}

impl GroupList {
    /// Of a part of a window of a scene's image.
    pub fn new(gpu: &Gpu, scene: &Scene, window: Window, area: Tile) -> Self {
        let [across, down] = [area.width, area.height].map(|n| n.div_ceil(WORKGROUP));
        let corner = [window.x + area.x, window.y + area.y];
        let under = overlap::covered(scene, corner, [across, down], WORKGROUP);
        let places = |wet: bool| {
            let chosen = under.iter().enumerate().filter(move |(_, under)| **under == wet);
            chosen.map(move |(i, _)| (i as u32 % across) | ((i as u32 / across) << 16))
        };
        let mut list: Vec<u32> = places(true).collect();
        let wet = list.len() as u32;
        list.extend(places(false));
        let buffer = gpu.buffer_with("workgroups", bytemuck::cast_slice(&list), wgpu::BufferUsages::STORAGE);
        GroupList { buffer, wet, dry: list.len() as u32 - wet }
    }
}
