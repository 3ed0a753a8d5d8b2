//! A scene made ready for the passes, as renderer and benchmark share it.

use super::device::Gpu;
use super::integrate::Variant;
use super::layout;
use super::reflection::{BoundReflection, Reflections};
use super::shells::AtVertices;
use super::upload::{Resident, Uploaded};
use crate::engine::overlap;
use crate::light::Visibility;
use crate::light::visibility::LightVolumes;
use crate::picture::camera::DepthRange;
use crate::place::Mesh;
use crate::scene::Scene;
use crate::util::error::Result;
use crate::util::monitor::Monitor;
use crate::volume::VolumeTexture;

/// A scene on the device, with the plan of its light volumes.
pub struct PreparedScene {
    /// The scene's buffers and textures.
    pub up: Uploaded,
    /// Layers of volume quads: see [`overlap::sheets`].
    pub layers: u32,
    /// The light volumes to fill, if there are any: see [`Scene::light_plan`].
    pub light_volumes: Option<LightVolumes>,
    /// Values that the host has computed at the vertices of shells.
    pub at_vertices: AtVertices,
    /// The reflection model and multiple scattering.
    pub reflection: BoundReflection,
    /// Uniform of the constants of all volumes, `array<VolumeConstants>`.
    pub volumes: wgpu::Buffer,
    /// The variant of the integrate pass that renders the scene.
    pub variant: Variant,
    /// Depths of the scene.
    pub depth: DepthRange,
}

impl PreparedScene {
    /// Plans the light volumes, makes the shadows on shells and their diffuse light, and uploads what is not
    /// resident yet.
    pub fn new(
        gpu: &Gpu,
        (resident, reflections): (&mut Resident, &mut Reflections),
        scene: &Scene,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let shadows = scene.shadows_on_shells(mesh, monitor)?;
        let diffuse = scene.diffuse_on_shells(volumes, mesh, shadows.as_ref(), monitor)?;
        let at_vertices = AtVertices { shadows, diffuse };
        let layers = overlap::sheets(scene);
        let light_volumes = scene.light_plan(volumes)?.filter(|_| !scene.quads.is_empty());
        let up = Uploaded::new(gpu, resident, scene, volumes, mesh)?;
        let reflection = reflections.bind(gpu, scene, volumes);
        let constants =
            layout::volume_constants(scene, volumes, &up.origins, &reflection.waters, &reflection.optics);
        let volumes = bytemuck::cast_slice(&constants);
        let volumes = gpu.buffer_with("volumes", volumes, wgpu::BufferUsages::UNIFORM);
        let storage = [up.leaps(), up.is_sparse()];
        let mut variant = Variant::of(scene, layers, light_volumes.as_ref(), storage)
            .with_shell_shadows(at_vertices.shadows.is_some())
            .with_shell_optics(scene, &reflection.optics);
        if scene.visibility == Visibility::Cached {
            variant = variant.with_shell_light(up.shells.walks_and_keeps());
        }
        let depth = scene.depth_range(mesh);
        Ok(PreparedScene { up, layers, light_volumes, at_vertices, reflection, volumes, variant, depth })
    }
}
