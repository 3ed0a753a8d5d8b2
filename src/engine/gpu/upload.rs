//! The scene on the device: volume texture, quads, lights, mesh and environment.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;

use super::bricks::{self, UploadedBricks};
use super::device::Gpu;
use super::layout::{self, Quad, VertexMaterial};
use super::packing::Packing;
use super::pools::{UploadedPool, upload_carried};
use super::rasters::hash_twice;
use super::shells::{ResidentShells, UploadedShells, seen_faces};
use super::tiles::{self, Part};
use crate::engine::pool_surface;
use crate::light::Scattering;
use crate::light::environment::Map;
use crate::light::scatter::media::{kinds, profile_length};
use crate::place::paint::Paints;
use crate::place::stone::Stone;
use crate::place::tiles::steps;
use crate::place::{Mesh, Vertex};
use crate::scene::Scene;
use crate::util::error::{Error, Result};
use crate::volume::{
    Bricks, Cell, Cells, LevelAtlas, LevelSets, LevelsCache, StorageChoice, VolumeTexture, stored_levels,
};

/// Bytes handed to the queue at once. The queue keeps a copy of what it is given, so a volume is uploaded in
/// slabs.
pub(super) const SLAB_BYTES: usize = 64 << 20;

/// Data that stays on the device from frame to frame: the volume's cells, the mesh and the environment's map.
/// They are recognised by the address of their host memory.
#[derive(Default)]
pub struct Resident {
    /// Levels of the last volumes, and whether they are made for leaps.
    pub levels: LevelsCache,
    volumes: Option<ResidentVolumes>,
    shells: ResidentShells,
    mesh: Option<ResidentMesh>,
    /// The environment's map and the number of its upload.
    map: Option<(Arc<Map>, wgpu::TextureView, u64)>,
    /// Number of uploads of meshes and maps so far.
    uploads: u64,
}

/// Volumes on the device.
struct ResidentVolumes {
    /// The levels that were to be uploaded.
    asked: LevelSets,
    on_device: VolumesOnDevice,
}

/// The volumes of a scene in the textures that they share.
#[derive(Clone)]
struct VolumesOnDevice {
    /// The levels in the storage that the device holds.
    held: LevelSets,
    /// First cell of each volume.
    origins: Vec<[u32; 3]>,
    /// Textures of cells and bricks.
    views: [wgpu::TextureView; 2],
}

/// A mesh on the device.
#[derive(Clone)]
struct ResidentMesh {
    mesh: Mesh,
    positions: wgpu::Buffer,
    coats: wgpu::Buffer,
    tiles: wgpu::Buffer,
    paints: Option<UploadedPaints>,
    stones: wgpu::Buffer,
    /// Indices of all lists of triangles.
    indices: wgpu::Buffer,
    /// Range of each list in `indices`.
    lists: Arc<Vec<Range<u32>>>,
    /// Foam of each pool that has a field.
    carried: Vec<Option<wgpu::TextureView>>,
    /// Number of the upload, unique among meshes and maps.
    upload: u64,
}

/// A scene on the device: everything that does not change from sample to sample.
pub struct Uploaded {
    /// The levels of each volume, in the storage that the device holds: all dense or all sparse.
    pub levels: LevelSets,
    /// First cell of each volume in the texture, cells.
    pub origins: Vec<[u32; 3]>,
    /// All volumes side by side in one 3-D storage texture, `rg32uint`, the levels of each arranged by
    /// [`LevelAtlas`]; for sparse storage the stored cells.
    pub volume: wgpu::TextureView,
    /// Bricks of sparse storage, `rgba32uint`; one texel for dense storage.
    pub bricks: wgpu::TextureView,
    /// `array<Quad>`.
    pub quads: wgpu::Buffer,
    /// Number of quads.
    pub quad_count: u32,
    /// Shells, and the faces of their hulls that the eye sees.
    pub shells: UploadedShells,
    /// `array<Light>`, at least one.
    pub lights: wgpu::Buffer,
    /// Positions of the opaque mesh's vertices, metres, four floats each.
    pub positions: wgpu::Buffer,
    /// Materials of the vertices, `array<VertexMaterial>`.
    pub coats: wgpu::Buffer,
    /// Tiles of the opaque mesh, `array<MeshTile>`.
    pub tiles: wgpu::Buffer,
    /// Paints of the tiles, if any tile has one.
    pub paints: Option<UploadedPaints>,
    /// Stones of the tiles, `array<Stone>`, at least one.
    pub stones: wgpu::Buffer,
    /// Whether any tile has a stone.
    pub has_stones: bool,
    /// Indices of the lists of triangles.
    pub indices: wgpu::Buffer,
    /// Parts of the rock to draw.
    pub rock: Vec<Part>,
    /// Pools.
    pub pools: Vec<UploadedPool>,
    /// The scene's environment, if it has one.
    pub environment: Option<UploadedEnvironment>,
    /// Hash of everything drawn except the pools' waves: quads, faces of hulls, lights, mesh and environment.
    pub geometry: [u64; 2],
    /// Hash of the pools' surfaces.
    pub waves: [u64; 2],
}

/// Paints of the opaque mesh on the device.
#[derive(Clone)]
pub struct UploadedPaints {
    /// `array<Paint>`.
    pub paints: wgpu::Buffer,
    /// Texture coordinates of corners.
    pub corner_uvs: wgpu::Buffer,
    /// Textures.
    pub texels: wgpu::Buffer,
}

impl UploadedPaints {
    /// Uploads paints, if there are any.
    fn new(gpu: &Gpu, paints: &Paints) -> Option<UploadedPaints> {
        let buffer = |name, bytes| gpu.buffer_with(name, bytes, wgpu::BufferUsages::STORAGE);
        (!paints.all.is_empty()).then(|| UploadedPaints {
            paints: buffer("paints", bytemuck::cast_slice(&paints.all)),
            corner_uvs: buffer("corner uvs", bytemuck::cast_slice(&paints.coordinates)),
            texels: buffer("texels", bytemuck::cast_slice(&paints.words)),
        })
    }
}

/// An environment on the device.
pub struct UploadedEnvironment {
    /// Uniform `Environment`.
    pub uniform: wgpu::Buffer,
    /// Map of the sky, `rgba32float`.
    pub map: wgpu::TextureView,
}

impl Uploaded {
    /// Whether the device holds the volumes in bricks.
    pub fn is_sparse(&self) -> bool {
        self.levels.iter().any(|levels| levels[0].is_sparse())
    }

    /// Whether the levels are made for leaps.
    pub fn leaps(&self) -> bool {
        self.levels.iter().all(|levels| levels.leaps)
    }

    /// Uploads the parts of a scene that are not resident yet.
    ///
    /// # Errors
    /// [`Error::Device`] if a part is too large for the device, and errors of [`Gpu::run`].
    pub fn new(
        gpu: &Gpu,
        resident: &mut Resident,
        scene: &Scene,
        volumes: &[VolumeTexture],
        mesh: &Mesh,
    ) -> Result<Self> {
        let limits = gpu.device.limits();
        let (media, medium_of_quad) = kinds(&scene.quads);
        // Index at which the profile of each medium begins.
        let (mut profiles, mut length) = (Vec::new(), 0);
        for kind in &media {
            profiles.push(length as u32);
            length += match scene.scattering {
                Scattering::Multiple => u64::from(profile_length(volumes[kind.volume as usize].size[2])),
                Scattering::Single => 0,
            };
        }
        let profile_bytes = length * 16;
        if profile_bytes > limits.max_storage_buffer_binding_size {
            return Err(Error::device(
                format!(
                    "multiple scattering in {} thicknesses and mists takes {} MiB, too much for {}",
                    media.len(),
                    profile_bytes >> 20,
                    gpu.name()
                ),
                "give materials the same thickness and sheets the same mist, or use --engine cpu",
            ));
        }
        let numbered = scene.quads.iter().zip(medium_of_quad).enumerate();
        let quad = |(i, (quad, which)): (usize, (&crate::mapping::Quad, u32))| {
            let shade = mesh.on_water.get(i).copied().unwrap_or_default();
            Quad::new(quad, scene, profiles[which as usize], &shade)
        };
        let quads: Vec<Quad> = numbered.map(quad).collect();
        let lights = layout::lights(scene);
        let (quad_bytes, light_bytes): (&[u8], &[u8]) =
            (bytemuck::cast_slice(&quads), bytemuck::cast_slice(&lights));
        let pools = pool_surface::surfaces(scene, mesh);
        let pool_bytes: &[u8] = bytemuck::cast_slice(&pools);
        let largest = [
            quad_bytes.len(),
            light_bytes.len(),
            mesh.vertices.len() * size_of::<VertexMaterial>(),
            8 * mesh.paints.coordinates.len(),
        ];
        if largest.iter().any(|&b| b as u64 > limits.max_storage_buffer_binding_size) {
            return Err(Error::device(
                format!("the scene's quads, lights or rocks are too large for {}", gpu.name()),
                "lower their number or use --engine cpu",
            ));
        }
        let ResidentMesh { positions, coats, tiles, paints, stones, indices, lists, carried, upload, .. } =
            resident.mesh(gpu, mesh)?.clone();
        let steps = steps(&mesh.tiles, &scene.camera, &scene.image);
        let (rock, mut pool_parts) = tiles::parts(&mesh.tiles, &steps, &lists);
        pool_parts.resize_with(pools.len(), Vec::new);
        let slopes = pool_surface::slope_maps(scene, mesh);
        let on_device = UploadedPool::all(gpu, &pools, &slopes, carried, pool_parts)?;
        let levels = resident.levels.get(volumes, &scene.pyramid_specs(volumes));
        let packs = scene.recipes.iter().all(|recipe| recipe.asked_storage == StorageChoice::Auto);
        let VolumesOnDevice { held: levels, origins, views: [cells, bricks] } =
            resident.volumes(gpu, volumes, levels, packs)?;
        let faces = seen_faces(scene);
        let shells = resident.shells.get(gpu, scene, volumes, &faces)?;
        let face_bytes: &[u8] = bytemuck::cast_slice(&faces);
        let map = scene.environment.as_ref().map(|e| resident.map(gpu, &e.map)).transpose()?;
        let environment = scene.environment.as_ref().map(layout::Environment::new);
        let environment_bytes: &[u8] = environment.as_ref().map_or(&[], bytemuck::bytes_of);
        let number = map.as_ref().map(|(_, number)| *number);
        // The raster pass does not read erosion, which surges change from frame to frame.
        let even: Vec<Quad> = quads.iter().map(|quad| Quad { erosion: [0.0; 4], ..*quad }).collect();
        Ok(Uploaded {
            geometry: hash_twice(&(
                bytemuck::cast_slice::<_, u8>(&even),
                face_bytes,
                light_bytes,
                upload,
                &steps,
                environment_bytes,
                number,
            )),
            waves: hash_twice(&pool_bytes),
            environment: map.map(|(map, _)| UploadedEnvironment {
                uniform: gpu.buffer_with("environment", environment_bytes, wgpu::BufferUsages::UNIFORM),
                map,
            }),
            volume: cells,
            bricks,
            levels,
            origins,
            // A buffer without quads would be too small to bind.
            quads: gpu.buffer_with(
                "quads",
                if quads.is_empty() { &[0; size_of::<Quad>()] } else { quad_bytes },
                wgpu::BufferUsages::STORAGE,
            ),
            quad_count: quads.len() as u32,
            shells,
            lights: gpu.buffer_with("lights", light_bytes, wgpu::BufferUsages::STORAGE),
            positions,
            coats,
            tiles,
            stones,
            has_stones: !mesh.stones.is_empty(),
            paints,
            indices,
            rock,
            pools: on_device,
        })
    }
}

impl Resident {
    /// Returns the volumes as the device holds them, uploaded unless they are resident. If one of them is
    /// sparse, all are stored sparse there. So are dense volumes that are too large for the device, if
    /// `packs`. Their cells, and so the pictures, stay the same.
    fn volumes(
        &mut self,
        gpu: &Gpu,
        volumes: &[VolumeTexture],
        asked: LevelSets,
        packs: bool,
    ) -> Result<VolumesOnDevice> {
        if let Some(old) = &self.volumes
            && Arc::ptr_eq(&old.asked, &asked)
        {
            return Ok(old.on_device.clone());
        }
        // The old volumes are dropped first, because two sets of large ones might not fit.
        self.volumes = None;
        let sparse = || -> Result<VolumesOnDevice> {
            let stored = |volume: &VolumeTexture| match &volume.cells {
                Cells::Sparse(stored) => stored.clone(),
                Cells::Dense(cells) => Arc::new(Bricks::of(volume.size, cells)),
            };
            let stored: Vec<Arc<Bricks>> = volumes.iter().map(stored).collect();
            let UploadedBricks { views, origins } =
                bricks::upload(gpu, &stored.iter().map(|bricks| &**bricks).collect::<Vec<_>>())?;
            let held = asked.iter().zip(volumes).zip(stored).map(|((levels, volume), stored)| {
                match volume.is_sparse() {
                    true => levels.clone(),
                    false => stored_levels(VolumeTexture { cells: Cells::Sparse(stored), ..volume.clone() }),
                }
            });
            Ok(VolumesOnDevice { held: held.collect(), origins, views })
        };
        let on_device = match volumes.iter().any(VolumeTexture::is_sparse) {
            true => sparse()?,
            false => match upload_volumes(gpu, &asked) {
                Err(Error::Device { .. }) if packs => sparse()?,
                uploaded => {
                    let (cells, origins) = uploaded?;
                    VolumesOnDevice { held: asked.clone(), origins, views: [cells, bricks::none(gpu)] }
                }
            },
        };
        self.volumes = Some(ResidentVolumes { asked, on_device: on_device.clone() });
        Ok(on_device)
    }

    /// Returns the environment's map and the number of its upload, uploaded unless it is resident.
    fn map(&mut self, gpu: &Gpu, map: &Arc<Map>) -> Result<(wgpu::TextureView, u64)> {
        if let Some((old, view, upload)) = &self.map
            && Arc::ptr_eq(old, map)
        {
            return Ok((view.clone(), *upload));
        }
        self.map = None;
        let view = upload_map(gpu, map)?;
        self.uploads += 1;
        self.map = Some((map.clone(), view.clone(), self.uploads));
        Ok((view, self.uploads))
    }

    /// Returns the mesh on the device, uploaded unless it is resident.
    fn mesh(&mut self, gpu: &Gpu, mesh: &Mesh) -> Result<&ResidentMesh> {
        self.mesh.take_if(|known| !Arc::ptr_eq(&known.mesh.vertices, &mesh.vertices));
        let uploads = &mut self.uploads;
        let carried = match self.mesh {
            Some(_) => Vec::new(),
            None => upload_carried(gpu, mesh)?,
        };
        Ok(self.mesh.get_or_insert_with(|| {
            *uploads += 1;
            let buffer = |name, bytes, usage| gpu.buffer_with(name, bytes, usage);
            let position = |v: &Vertex| Vec3::from(v.position).extend(1.0).to_array();
            let positions: Vec<[f32; 4]> = mesh.vertices.iter().map(position).collect();
            let mut coats: Vec<VertexMaterial> = mesh.vertices.iter().map(VertexMaterial::from).collect();
            let mut packed = tiles::packed(&mesh.tiles);
            // The buffers are bound even for a scene without a mesh.
            coats.resize(coats.len().max(1), VertexMaterial::from(&Vertex::default()));
            packed.resize(packed.len().max(1), Zeroable::zeroed());
            let mut stones = mesh.stones.to_vec();
            stones.resize(stones.len().max(1), Stone::default());
            let (indices, lists) = tiles::lists();
            let storage = wgpu::BufferUsages::STORAGE;
            ResidentMesh {
                mesh: mesh.clone(),
                positions: buffer("positions", bytemuck::cast_slice(&positions), storage),
                coats: buffer("coats", bytemuck::cast_slice(&coats), storage),
                tiles: buffer("tiles", bytemuck::cast_slice(&packed), storage),
                paints: UploadedPaints::new(gpu, &mesh.paints),
                stones: buffer("stones", bytemuck::cast_slice(&stones), storage),
                indices: buffer("indices", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
                lists: Arc::new(lists),
                carried,
                upload: *uploads,
            }
        }))
    }
}

/// Uploads dense volumes with their levels. Returns the texture and the first cell of each volume in it.
fn upload_volumes(gpu: &Gpu, sets: &LevelSets) -> Result<(wgpu::TextureView, Vec<[u32; 3]>)> {
    let atlases: Vec<LevelAtlas> = sets.iter().map(|levels| LevelAtlas::new(levels)).collect();
    let extents: Vec<[u32; 3]> = atlases.iter().map(LevelAtlas::extent).collect();
    let most = gpu.device.limits().max_texture_dimension_3d;
    let what = || match extents[..] {
        [[nx, ny, nz]] => format!("a volume of {nx}×{ny}×{nz} cells is too large for {}", gpu.name()),
        _ => format!("{} volumes are together too large for {}", extents.len(), gpu.name()),
    };
    let Some(Packing { extent, origins }) = Packing::smallest(&extents, most) else {
        return Err(Error::device(
            what(),
            format!(
                "volume.nx, ny and nz are at most {most} there; use volume.storage=sparse or --engine cpu \
                 for more"
            ),
        ));
    };
    let [nx, ny, nz] = extent;
    let what = || match sets.len() {
        1 => format!("a dense volume of {nx}×{ny}×{nz} cells"),
        n => format!("a texture of {n} dense volumes"),
    };
    let create = || bricks::texture(gpu, "volume", wgpu::TextureFormat::Rg32Uint, extent);
    let texture = gpu.allocate(what, create)?;
    for ((levels, atlas), base) in sets.iter().zip(&atlases).zip(&origins) {
        for (number, level) in levels.iter().enumerate() {
            let own = atlas.origin(number as u32);
            upload_level(gpu, &texture, [0, 1, 2].map(|axis| base[axis] + own[axis]), level)?;
        }
    }
    Ok((texture.create_view(&Default::default()), origins))
}

fn upload_level(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    [x, y, z]: [u32; 3],
    volume: &VolumeTexture,
) -> Result<()> {
    let [nx, ny, _] = volume.size;
    let layer = nx as usize * ny as usize;
    let layers = (SLAB_BYTES / (layer * size_of::<Cell>())).max(1);
    let cells = volume.cells.dense().expect("levels are stored whole");
    for (slab, cells) in cells.chunks(layers * layer).enumerate() {
        write_layers(gpu, texture, [x, y, z + (slab * layers) as u32], [nx, ny], cells)?;
    }
    Ok(())
}

/// Writes whole layers of `width` × `height` texels into a 3-D texture at `[x, y, z]`, and waits for the
/// copy.
pub(super) fn write_layers<T: bytemuck::Pod>(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    [x, y, z]: [u32; 3],
    [width, height]: [u32; 2],
    texels: &[T],
) -> Result<()> {
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(texels),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * size_of::<T>() as u32),
            rows_per_image: Some(height),
        },
        wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: (texels.len() / (width as usize * height as usize)) as u32,
        },
    );
    gpu.run(gpu.encoder("upload volume")).map(drop)
}

/// Writes whole rows of `width` texels into a 2-D texture from row `first` on, in slabs, and waits for the
/// copies.
pub(super) fn write_rows<T: bytemuck::Pod>(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    [width, first]: [u32; 2],
    texels: &[T],
    label: &str,
) -> Result<()> {
    let row = width as usize * size_of::<T>();
    let rows = (SLAB_BYTES / row).max(1);
    for (slab, texels) in texels.chunks(rows * width as usize).enumerate() {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: first + (slab * rows) as u32, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row as u32), rows_per_image: None },
            wgpu::Extent3d {
                width,
                height: (texels.len() / width as usize) as u32,
                depth_or_array_layers: 1,
            },
        );
        gpu.run(gpu.encoder(label))?;
    }
    Ok(())
}

fn upload_map(gpu: &Gpu, map: &Map) -> Result<wgpu::TextureView> {
    let Map { width, height, .. } = *map;
    let most = gpu.device.limits().max_texture_dimension_2d;
    if width.max(height) > most {
        return Err(Error::device(
            format!("an environment map of {width}×{height} texels is too large for {}", gpu.name()),
            format!("at most {most} texels on a side fit there; make it smaller or use --engine cpu"),
        ));
    }
    upload_floats(gpu, "environment", [width, height], &map.texels)
}

/// Uploads a 2-D texture of four floats a texel.
pub(super) fn upload_floats(
    gpu: &Gpu,
    label: &str,
    [width, height]: [u32; 2],
    texels: &[[f32; 4]],
) -> Result<wgpu::TextureView> {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    write_rows(gpu, &texture, [width, 0], texels, &format!("upload {label}"))?;
    Ok(texture.create_view(&Default::default()))
}
