//! §5 Bindings of the integrate pass for the reflection model and multiple scattering.

use std::sync::Arc;

use super::device::Gpu;
use super::layout;
use super::strand::StrandTexture;
use crate::light::scatter::optics::ShellOptics;
use crate::light::scatter::{Profile, Similarity};
use crate::light::strand::table::StrandTable;
use crate::scene::Scene;
use crate::volume::VolumeTexture;

/// Tables that stay on the device from frame to frame.
#[derive(Default)]
pub struct Reflections {
    strand: Option<(Option<Arc<StrandTable>>, StrandTexture)>,
    profiles: Option<(Vec<Arc<Profile>>, wgpu::Buffer)>,
}

/// The bindings of one scene.
pub struct BoundReflection {
    /// Uniform `Reflection`.
    pub uniform: wgpu::Buffer,
    /// Table of the strand model.
    pub table: wgpu::TextureView,
    /// Trilinear sampler of the table.
    pub sampler: wgpu::Sampler,
    /// `array<vec4<f32>>`: the profiles of multiple scattering one after the other.
    pub profiles: wgpu::Buffer,
    /// Constants of multiple scattering in each volume; none with single scattering.
    pub waters: Vec<Similarity>,
    /// Optics of the shells of each volume; `None` where light scatters once.
    pub optics: Vec<Option<ShellOptics>>,
}

impl Reflections {
    /// Returns the bindings for a scene, and uploads the tables that are not on the device yet.
    pub fn bind(&mut self, gpu: &Gpu, scene: &Scene, volumes: &[VolumeTexture]) -> BoundReflection {
        let strand = scene.reflection.shading();
        let media = scene.media(volumes);
        let waters = media.as_ref().map_or(Vec::new(), |media| media.waters.clone());
        let optics = scene.shell_optics(volumes);
        let first = optics.first().and_then(Option::as_ref);
        let uniform = layout::Reflection::new(scene, strand.as_ref(), waters.first(), first);
        let table = strand.map(|strand| strand.table);
        let is_resident = match (&self.strand, &table) {
            (Some(_), None) => true,
            (Some((Some(old), _)), Some(new)) => Arc::ptr_eq(old, new),
            _ => false,
        };
        if !is_resident {
            let texture = match &table {
                Some(table) => StrandTexture::new(gpu, table),
                None => StrandTexture::empty(gpu),
            };
            self.strand = Some((table, texture));
        }
        let profiles: Vec<_> = media.into_iter().flat_map(|m| m.media).map(|medium| medium.profile).collect();
        let alike = |old: &[Arc<Profile>]| {
            old.len() == profiles.len() && old.iter().zip(&profiles).all(|(a, b)| Arc::ptr_eq(a, b))
        };
        if !self.profiles.as_ref().is_some_and(|(old, _)| alike(old)) {
            let values: Vec<[f32; 4]> = profiles.iter().flat_map(|p| p.values.iter().copied()).collect();
            let bytes = bytemuck::cast_slice(&values);
            self.profiles = Some((profiles, gpu.buffer_with("profiles", bytes, wgpu::BufferUsages::STORAGE)));
        }
        let (Some((_, strand)), Some((_, profiles))) = (&self.strand, &self.profiles) else {
            unreachable!("both were just filled")
        };
        BoundReflection {
            uniform: gpu.buffer_with("reflection", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM),
            table: strand.view.clone(),
            sampler: strand.sampler.clone(),
            profiles: profiles.clone(),
            waters,
            optics,
        }
    }
}
