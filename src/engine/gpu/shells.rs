//! Shells on the device: their points, prisms and hulls in one texture, the faces of hulls that the eye sees,
//! and V at their vertices, which a compute pass fills and which is kept from frame to frame. Shadows of
//! opaque matter and diffuse light come from the host, into rows behind V. CPU twins:
//! `Projection::hulls` and `src/engine/cpu/integrate/shell_light.rs`.

use std::sync::Arc;

use glam::{UVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::binding::{bind_buffer, bind_texture, shell_light as at};
use super::compute_pipeline;
use super::device::Gpu;
use super::layout::{HullFace, ShellLightPart};
use super::shader::resolve;
use super::specialise::Source;
use super::timing::Timer;
use super::upload::{Uploaded, write_rows};
use crate::light::{Light, Visibility};
use crate::mapping::shell::{Inside, Shell};
use crate::place::{DiffuseOfShells, ShellShadows};
use crate::scene::Scene;
use crate::trace::{extinction, flow_cells};
use crate::util::error::{Error, Result};
use crate::volume::{LevelSets, VolumeTexture};

/// Texels in a row of the texture of shells. Twin: `SHELL_ROW` of `shaders/mapping/shell.wgsl`, which is the
/// logarithm.
pub const SHELL_ROW: u32 = 1 << 13;
/// Texels in front of the headers, of a header, of a prism, and of the tangents at a vertex. Twins: constants
/// of `shaders/mapping/shell.wgsl`.
pub const SHELL_TABLE: u32 = 1;
/// See [`SHELL_TABLE`].
pub const SHELL_HEADER: u32 = 3;
/// See [`SHELL_TABLE`].
pub const PRISM: u32 = 4;
/// See [`SHELL_TABLE`].
pub const TANGENTS: u32 = 4;

/// Bits of a header's word that tell whether a shell has a skin, and whether it shows its volume once; the
/// others are the volume's number. Twins: `skin` and `is_single` of `shaders/mapping/shell.wgsl`.
const SKIN: u32 = 1 << 31;
/// See [`SKIN`].
const SINGLE: u32 = 1 << 30;

/// Values of V in the first submission. The size of later ones follows the measured time, as for tiles.
const FIRST_VALUES: u32 = 1 << 10;
/// Largest number of values in a submission: 65535 workgroups of 64 along one dimension of a dispatch.
const MOST_VALUES: u32 = 65535 * 64;
/// Target time of a submission in seconds, as for tiles of the integrate pass.
const SECONDS: f64 = 0.03;

/// Returns the shader of the pass that fills V, with everything it imports.
pub fn source() -> String {
    resolve("#import light::shell_light")
}

/// Shells that stay on the device from frame to frame.
#[derive(Default)]
pub struct ResidentShells(Option<(Table, wgpu::TextureView)>);

/// What the texture of shells holds.
#[derive(Clone, Default)]
struct Table {
    shells: Vec<Arc<Shell>>,
    /// Places of the eye inside the shells.
    eyes: Vec<Option<Inside>>,
    /// Number of quads, in front of the faces of hulls.
    quads: u32,
    /// Layers between which V is interpolated in each shell; 0 where rays walk to the lights.
    layers: Vec<u32>,
    /// First value of V of each shell, and behind the last the number of all values.
    firsts: Vec<u32>,
    /// First share of light of each shell, if opaque matter hides any, and behind the last the end of all.
    /// They begin in the row behind V.
    shadows: Vec<u32>,
    /// First value of J of each shell, if light scatters many times in it, and behind the last the end of
    /// all. They begin in the row behind the shadows.
    diffuse: Vec<u32>,
}

/// Values that the host computes at the vertices of shells.
#[derive(Clone)]
pub struct AtVertices {
    /// Shadows of opaque matter, if there are any.
    pub shadows: Option<Arc<ShellShadows>>,
    /// Diffuse light, if light scatters many times in any shell.
    pub diffuse: Option<Arc<DiffuseOfShells>>,
}

impl AtVertices {
    fn is(&self, other: &AtVertices) -> bool {
        self.shadows.as_ref().map(Arc::as_ptr) == other.shadows.as_ref().map(Arc::as_ptr)
            && self.diffuse.as_ref().map(Arc::as_ptr) == other.diffuse.as_ref().map(Arc::as_ptr)
    }
}

/// The shells of a scene on the device.
pub struct UploadedShells {
    table: Table,
    /// `texture_2d<u32>`, `rgba32uint`: one word texel, the headers, then points, tangents, prisms and hull
    /// of each shell.
    pub texels: wgpu::TextureView,
    /// `array<HullFace>` of the faces that the eye sees, in parts that can be bound, with their numbers.
    pub faces: Vec<(wgpu::Buffer, u32)>,
}

impl UploadedShells {
    /// Whether rays walk to the lights in some shells, and whether V is kept in some, in a scene of the
    /// visibility [`Visibility::Cached`].
    pub fn walks_and_keeps(&self) -> [bool; 2] {
        let any = |kept: bool| self.table.layers.iter().any(|&layers| (layers > 0) == kept);
        [any(false), any(true)]
    }
}

impl Table {
    fn new(gpu: &Gpu, scene: &Scene, volumes: &[VolumeTexture]) -> Result<Table> {
        let layers_of = |shell: &Arc<Shell>| match scene.visibility {
            Visibility::Cached => shell.light_layers(volumes[shell.volume as usize].size).unwrap_or(0),
            Visibility::None | Visibility::March => 0,
        };
        let layers: Vec<u32> = scene.shells.iter().map(layers_of).collect();
        let lights = scene.volume_lights().len() as u64;
        let (mut firsts, mut next) = (vec![0], 0u64);
        for (shell, &layers) in scene.shells.iter().zip(&layers) {
            if layers > 0 {
                next += lights * shell.vertices() as u64 * u64::from(layers + 1);
            }
            firsts.push(next as u32);
        }
        fits(gpu, "the light at the vertices of the shells", next, "use light.visibility=march")?;
        let mut shadows = vec![next.next_multiple_of(SHELL_ROW.into()) as u32];
        for shell in &scene.shells {
            let own = 2 * lights * shell.vertices() as u64;
            shadows.push(shadows[shadows.len() - 1].saturating_add(own.try_into().unwrap_or(u32::MAX)));
        }
        let mut diffuse = vec![shadows[shadows.len() - 1].next_multiple_of(SHELL_ROW)];
        for shell in &scene.shells {
            let layers = volumes[shell.volume as usize].size[2].div_ceil(2);
            let own = 3 * shell.vertices() as u64 * u64::from(layers + 1);
            let own = if scene.scatters_many_times(shell.volume as usize) { own } else { 0 };
            diffuse.push(diffuse[diffuse.len() - 1].saturating_add(own.try_into().unwrap_or(u32::MAX)));
        }
        let eyes = scene.shells.iter().map(|shell| scene.eye_inside(shell)).collect();
        let (shells, quads) = (scene.shells.clone(), scene.quads.len() as u32);
        Ok(Table { shells, eyes, quads, layers, firsts, shadows, diffuse })
    }

    /// Whether both hold the same, wherever the eye is.
    fn is(&self, other: &Table) -> bool {
        self.shells.len() == other.shells.len()
            && self.shells.iter().zip(&other.shells).all(|(a, b)| Shell::is_same(a, b))
            && (self.quads, &self.layers) == (other.quads, &other.layers)
            && (&self.firsts, &self.shadows) == (&other.firsts, &other.shadows)
            && self.diffuse == other.diffuse
    }

    /// Number of texels.
    fn texels(&self) -> u64 {
        let of = |shell: &Arc<Shell>| {
            let (prisms, tangents) = (shell.prisms.len() * PRISM as usize, shell.tangents.len());
            (shell.points.len() + tangents * TANGENTS as usize + prisms + shell.hull.len()) as u64
        };
        u64::from(SHELL_TABLE)
            + self.shells.len() as u64 * u64::from(SHELL_HEADER)
            + self.shells.iter().map(of).sum::<u64>()
    }

    /// Packs the texels, in whole rows.
    fn packed(&self) -> Vec<[u32; 4]> {
        let count = self.texels() as usize;
        let mut out: Vec<[u32; 4]> = Vec::with_capacity(count.next_multiple_of(SHELL_ROW as usize));
        out.push([self.shells.len() as u32, self.quads, 0, 0]);
        let mut points = SHELL_TABLE + self.shells.len() as u32 * SHELL_HEADER;
        let mut face = self.quads;
        for (i, shell) in self.shells.iter().enumerate() {
            let tangents = points + shell.points.len() as u32;
            let prisms = tangents + shell.tangents.len() as u32 * TANGENTS;
            let hull = prisms + shell.prisms.len() as u32 * PRISM;
            let volume =
                shell.volume | if shell.skin { SKIN } else { 0 } | if shell.is_single { SINGLE } else { 0 };
            out.push([points, prisms, hull, face]);
            out.push([volume, self.firsts[i], self.layers[i], shell.vertices() as u32]);
            out.push([self.shadows[i], self.diffuse[i], 0, 0]);
            face += shell.hull.len() as u32;
            points = hull + shell.hull.len() as u32;
        }
        for (shell, eye) in self.shells.iter().zip(&self.eyes) {
            out.extend(shell.points.iter().enumerate().map(|(i, point)| {
                let [x, y, z] = point.to_array().map(f32::to_bits);
                [x, y, z, shell.corner_of(i / 2)]
            }));
            out.extend_from_slice(bytemuck::cast_slice(&shell.tangents));
            for prism in &shell.prisms {
                let [a, b, c] = prism.vertices;
                let [ab, bc, ac] = prism.beyond.map(|beyond| match beyond.get() {
                    Some((prism, edge)) => (4 * prism + edge) as u32,
                    None => u32::MAX,
                });
                let [uv_a, uv_b, uv_c] = prism.uv.map(|uv: Vec2| uv.to_array().map(f32::to_bits));
                out.push([a, b, c, ab]);
                out.push([uv_a[0], uv_a[1], uv_b[0], uv_b[1]]);
                out.push([uv_c[0], uv_c[1], bc, ac]);
                let [a, b, c] = prism.tangents;
                out.push([a, b, c, 0]);
            }
            out.extend(shell.hull.iter().map(|face| match (face.is_eye(), eye) {
                (true, Some(Inside { tetrahedron: [prism, own], point })) => {
                    let [x, y, z] = point.to_array().map(f32::to_bits);
                    [4 * (4 * *prism as u32 + *own as u32) + face.tetrahedron, x, y, z]
                }
                _ => {
                    let [a, b, c] = face.points;
                    [4 * face.prism + face.tetrahedron, a, b, c]
                }
            }));
        }
        out.resize(count.next_multiple_of(SHELL_ROW as usize), [0; 4]);
        out
    }
}

impl ResidentShells {
    /// Uploads the shells of a scene unless they are resident, and the faces that its eye sees.
    ///
    /// # Errors
    /// [`Error::Device`] if they are too large for the device, and errors of [`Gpu::run`].
    pub fn get(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        volumes: &[VolumeTexture],
        faces: &[HullFace],
    ) -> Result<UploadedShells> {
        let table = Table::new(gpu, scene, volumes)?;
        self.0.take_if(|(known, _)| !known.is(&table) || known.eyes != table.eyes);
        let texels = match &self.0 {
            Some((_, view)) => view.clone(),
            None => {
                let view = upload(gpu, &table)?;
                self.0.insert((table.clone(), view)).1.clone()
            }
        };
        let most =
            (gpu.device.limits().max_storage_buffer_binding_size / size_of::<HullFace>() as u64) as usize;
        let part = |faces: &[HullFace]| {
            let bytes = bytemuck::cast_slice(faces);
            (gpu.buffer_with("faces of hulls", bytes, wgpu::BufferUsages::STORAGE), faces.len() as u32)
        };
        Ok(UploadedShells { table, texels, faces: faces.chunks(most).map(part).collect() })
    }
}

/// Returns the faces of hulls that face the eye, numbered after the quads, shell by shell.
pub fn seen_faces(scene: &Scene) -> Vec<HullFace> {
    let mut first = scene.quads.len() as u32;
    let mut out = Vec::new();
    for shell in &scene.shells {
        let corners_of = scene.seen_hull(shell);
        let seen = shell.hull.par_iter().enumerate().filter_map(|(i, face)| {
            let [a, b, c] = corners_of(face)?.map(|p: Vec3| p.to_array());
            let [uv_a, uv_b, uv_c] = scene.hull_corners(shell, face).1.map(|uv| uv.to_array());
            Some(HullFace { a, number: first + i as u32, b, u_a: uv_a[0], c, v_a: uv_a[1], uv_b, uv_c })
        });
        out.par_extend(seen);
        first += shell.hull.len() as u32;
    }
    out
}

/// Checks that a number of texels fits into the device's largest texture.
fn fits(gpu: &Gpu, what: &str, texels: u64, way: &str) -> Result<()> {
    let most = gpu.device.limits().max_texture_dimension_2d;
    if SHELL_ROW > most || texels > u64::from(SHELL_ROW) * u64::from(most) {
        return Err(Error::device(
            format!("{what} ({texels} values) are too large for {}", gpu.name()),
            format!("{way} or --engine cpu"),
        ));
    }
    Ok(())
}

/// Allocates a texture of whole rows.
fn texture(gpu: &Gpu, name: &str, texels: u64, format: wgpu::TextureFormat) -> Result<wgpu::Texture> {
    let height = texels.div_ceil(u64::from(SHELL_ROW)).max(1) as u32;
    // Scenes without shells bind one texel.
    let width = if texels == 0 { 1 } else { SHELL_ROW };
    let usage = match format {
        wgpu::TextureFormat::R32Float => wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        _ => wgpu::TextureUsages::COPY_DST,
    };
    gpu.allocate(
        || format!("a texture of {texels} values of shells"),
        || {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(name),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | usage,
                view_formats: &[],
            })
        },
    )
}

fn upload(gpu: &Gpu, table: &Table) -> Result<wgpu::TextureView> {
    let format = wgpu::TextureFormat::Rgba32Uint;
    if table.shells.is_empty() {
        return Ok(texture(gpu, "no shells", 0, format)?.create_view(&Default::default()));
    }
    fits(gpu, "the shells", table.texels(), "use meshes of fewer triangles")?;
    let texture = texture(gpu, "shells", table.texels(), format)?;
    write_rows(gpu, &texture, [SHELL_ROW, 0], &table.packed(), "upload shells")?;
    Ok(texture.create_view(&Default::default()))
}

/// The pass that fills V at the vertices of shells, and the values of the last frame that had any.
#[derive(Default)]
pub struct ShellLightPass {
    pipelines: Vec<([bool; 3], wgpu::ComputePipeline)>,
    last: Option<(Filled, wgpu::TextureView)>,
    /// One texel, for scenes that keep no V in shells.
    none: Option<wgpu::TextureView>,
}

/// Inputs of V at the vertices.
struct Filled {
    table: Table,
    levels: LevelSets,
    lights: Vec<Light>,
    /// Cells that each volume has moved down the flow, and its extinction.
    volumes: Vec<[f32; 2]>,
    max_cells: u32,
    at_vertices: AtVertices,
}

impl Filled {
    fn is(&self, other: &Filled) -> bool {
        self.table.is(&other.table)
            && Arc::ptr_eq(&self.levels, &other.levels)
            && self.lights == other.lights
            && self.volumes == other.volumes
            && self.max_cells == other.max_cells
            && self.at_vertices.is(&other.at_vertices)
    }
}

impl ShellLightPass {
    /// Drops the values of the last frame.
    pub fn forget(&mut self) {
        self.last = None;
    }

    /// Returns V at the vertices of a scene's shells and `at_vertices` behind it, `r32float`, and the seconds
    /// it took to fill V: 0 if it is that of the last call. Calls `between` after each submission with the
    /// values done so far and in total; its error stops the work.
    ///
    /// # Errors
    /// Errors of `between` and of the device: see [`Gpu::run`].
    pub fn get(
        &mut self,
        (gpu, timer): (&Gpu, &Timer),
        scene: &Scene,
        volumes: &[VolumeTexture],
        (up, at_vertices): (&Uploaded, &AtVertices),
        between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<(wgpu::TextureView, f64)> {
        let format = wgpu::TextureFormat::R32Float;
        let table = &up.shells.table;
        let kept = table.firsts.last().copied().unwrap_or(0);
        let end = |of: &[u32]| of.last().copied().unwrap_or(0);
        let count = match at_vertices {
            AtVertices { diffuse: Some(_), .. } => end(&table.diffuse),
            AtVertices { shadows: Some(_), .. } => end(&table.shadows),
            _ => kept,
        };
        if count == 0 {
            self.last = None;
            if self.none.is_none() {
                let texture = texture(gpu, "no light in shells", 0, format)?;
                self.none = Some(texture.create_view(&Default::default()));
            }
            return Ok((self.none.clone().expect("it was just made"), 0.0));
        }
        let flows = scene.flows(volumes);
        let constants = volumes.iter().zip(flows).map(|(volume, flow)| {
            [flow_cells(flow, volume.size[1]), extinction(&scene.trace.attenuation, volume.alpha)]
        });
        let filled = Filled {
            table: table.clone(),
            levels: up.levels.clone(),
            lights: scene.volume_lights(),
            volumes: constants.collect(),
            max_cells: scene.trace.max_cells,
            at_vertices: at_vertices.clone(),
        };
        if let Some((last, view)) = &self.last
            && last.is(&filled)
        {
            return Ok((view.clone(), 0.0));
        }
        // The old values are dropped first, because both might not fit.
        self.last = None;
        let what = "the light and shadows at the vertices of the shells";
        fits(gpu, what, count.into(), "use fewer lights, or meshes of fewer triangles")?;
        let texture = texture(gpu, "light in shells", u64::from(count), format)?;
        let view = texture.create_view(&Default::default());
        let write = |first: u32, mut values: Vec<f32>, what| {
            values.resize(values.len().next_multiple_of(SHELL_ROW as usize), 1.0);
            write_rows(gpu, &texture, [SHELL_ROW, first / SHELL_ROW], &values, what)
        };
        if let Some(shadows) = &at_vertices.shadows {
            write(table.shadows[0], shadows.values().collect(), "upload shadows on shells")?;
        }
        if let Some(diffuse) = &at_vertices.diffuse {
            let values = diffuse.iter().flatten().flat_map(|own| &own.values);
            let values = values.flat_map(|value| value.to_array()).collect();
            write(table.diffuse[0], values, "upload diffuse light in shells")?;
        }
        let seconds = match kept {
            0 => 0.0,
            _ => self.fill((gpu, timer), volumes, up, &filled, &view, between)?,
        };
        self.last = Some((filled, view.clone()));
        Ok((view, seconds))
    }

    fn fill(
        &mut self,
        (gpu, timer): (&Gpu, &Timer),
        volumes: &[VolumeTexture],
        up: &Uploaded,
        filled: &Filled,
        view: &wgpu::TextureView,
        mut between: impl FnMut(u64, u64) -> Result<()>,
    ) -> Result<f64> {
        let Filled { table, lights, max_cells, .. } = filled;
        let pyramid = up.levels.iter().any(|levels| levels.len() > 1);
        let pipeline = self.pipeline(gpu, [up.is_sparse(), up.levels.len() > 1, pyramid]);
        let part = gpu.buffer(
            "part of the light in shells",
            size_of::<ShellLightPart>() as u64,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let mut entries = vec![
            bind_buffer(at::PART, &part),
            bind_buffer(at::LIGHTS, &up.lights),
            bind_texture(at::VOLUME, &up.volume),
            bind_texture(at::SHELLS, &up.shells.texels),
            bind_texture(at::SHELL_LIGHT, view),
        ];
        // The pipeline's layout holds only the bindings that its specialised shader uses.
        if up.is_sparse() {
            entries.push(bind_texture(at::BRICKS, &up.bricks));
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light in shells"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let total = u64::from(table.firsts.last().copied().unwrap_or(0));
        let (mut seconds, mut done, mut values) = (0.0, 0, FIRST_VALUES);
        for (number, shell) in table.shells.iter().enumerate() {
            let own = (table.firsts[number + 1] - table.firsts[number]) / lights.len().max(1) as u32;
            let volume = shell.volume as usize;
            let [flow_cells, extinction] = filled.volumes[volume];
            for light in 0..lights.len() as u32 {
                let mut first = 0;
                while first < own {
                    let count = values.min(own - first);
                    let uniform = ShellLightPart {
                        cells: UVec3::from(volumes[volume].size).as_ivec3().to_array(),
                        extinction,
                        base: up.origins[volume].map(|n| n as i32),
                        flow_cells,
                        shell: number as u32,
                        light,
                        first,
                        count,
                        max_cells: *max_cells,
                        ..ShellLightPart::default()
                    };
                    gpu.queue.write_buffer(&part, 0, bytemuck::bytes_of(&uniform));
                    let groups = count.div_ceil(64);
                    let took = timer.dispatch(gpu, "light in shells", &pipeline, &group, groups)?;
                    seconds += took;
                    first += count;
                    done += u64::from(count);
                    between(done, total)?;
                    let wanted = f64::from(count) * SECONDS / took.max(1e-6);
                    values = wanted.clamp(64.0, f64::from(values.saturating_mul(4).min(MOST_VALUES))) as u32;
                }
            }
        }
        Ok(seconds)
    }

    fn pipeline(&mut self, gpu: &Gpu, variant: [bool; 3]) -> wgpu::ComputePipeline {
        if let Some((_, pipeline)) = self.pipelines.iter().find(|known| known.0 == variant) {
            return pipeline.clone();
        }
        let names = ["SPARSE", "SEVERAL", "PYRAMID"];
        let constants: Vec<(&str, f64)> =
            names.into_iter().zip(variant.map(|on| f64::from(u8::from(on)))).collect();
        let source = Source::read("shell_light", &source());
        let pipeline = compute_pipeline(gpu, None, &source, "fill", &constants);
        self.pipelines.push((variant, pipeline.clone()));
        pipeline
    }
}
