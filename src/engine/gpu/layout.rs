//! Structs that the host shares with the shaders: twins of those in `shaders/layout.wgsl` and beside the
//! bindings that use them. A test compares names, offsets, sizes and constants through naga.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::light::scatter::optics::ShellOptics;
use crate::light::strand::table::StrandShading;
use crate::light::{AngleFrame, environment, ramp, scatter};
use crate::mapping::{Billow, PlaneView, Tear};
use crate::picture::camera::{DepthRange, clip_to_window, footprint, sample_offset};
use crate::place::QuadShade;
use crate::scene::{MAX_VOLUMES, Scene};
use crate::trace::lookup::StrandTurn;
use crate::trace::{BillowTimes, extinction, flow_cells, level_atlas};
use crate::util::window::Window;
use crate::volume::VolumeTexture;

/// Side of a compute workgroup, pixels. 8×8, 16×4 and 64×1 are equally fast; 4×4 is twice as slow.
pub const WORKGROUP: u32 = 8;

/// Uniforms of one sample of one window.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)] // The shaders' structs describe the fields.
pub struct FrameUniforms {
    pub clip_from_world: [[f32; 4]; 4],
    pub eye_world: [f32; 3],
    pub jitter_x: f32,
    pub right: [f32; 3],
    pub jitter_y: f32,
    pub up: [f32; 3],
    pub sample_index: u32,
    pub forward: [f32; 3],
    pub samples: u32,
    pub zenith: [f32; 3],
    pub light_count: u32,
    pub horizon: [f32; 3],
    pub p: f32,
    pub ambient: [f32; 3],
    pub early_end: f32,
    pub cells: [i32; 3],
    pub max_cells: u32,
    pub image_width: f32,
    pub image_height: f32,
    pub extinction: f32,
    pub texture_frame: u32,
    pub haze_density: f32,
    pub haze_falloff: f32,
    pub window_x: u32,
    pub window_y: u32,
    pub window_width: u32,
    pub window_height: u32,
    pub flow_cells: f32,
    pub layers: u32,
    pub haze_color: [f32; 3],
    pub haze_far: f32,
    pub shadow_light: u32,
    pub levels: u32,
    pub footprint: f32,
    pub alpha: u32,
    pub anchor: [f32; 3],
    pub depth_shift: f32,
    pub depth_rise: f32,
    pub depth_slope: f32,
    pub depth_scale: f32,
    pub flow_moves: f32,
    pub shutter_first: f32,
    pub shutter_step: f32,
    pub strand_scale: f32,
    pub strand_shift: f32,
    pub billow: [f32; 4],
}

/// Material of a vertex of the opaque mesh. Numbers from 0 or −1 to 1 are packed in pairs into words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct VertexMaterial {
    pub albedo_r: f32,
    pub albedo_g: f32,
    pub albedo_b: f32,
    pub normal_xy: u32,
    pub normal_z_wet: u32,
    pub occlusion_shadow: u32,
}

impl From<&crate::place::Vertex> for VertexMaterial {
    fn from(vertex: &crate::place::Vertex) -> Self {
        let both = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
        let unit = |x: f32| (x.clamp(0.0, 1.0) * 65535.0).round() as u16;
        let signed = |x: f32| (x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16;
        let [albedo_r, albedo_g, albedo_b] = vertex.albedo;
        let [x, y, z] = vertex.normal.map(signed);
        VertexMaterial {
            albedo_r,
            albedo_g,
            albedo_b,
            normal_xy: both(x, y),
            normal_z_wet: both(z, unit(vertex.wet)),
            occlusion_shadow: both(unit(vertex.occlusion), unit(vertex.shadow)),
        }
    }
}

/// A tile of the opaque mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct MeshTile {
    pub first: u32,
    pub pitch: u32,
    pub side: u32,
    pub holdout: u32,
    pub paint: u32,
    pub coordinates: u32,
    pub stone: u32,
}

/// One light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Light {
    pub vector: [f32; 3],
    pub has_position: u32,
    pub intensity: [f32; 3],
    pub cos_edge: f32,
    pub axis: [f32; 3],
    pub inverse_soft: f32,
}

/// One quad.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Quad {
    pub corners: [[f32; 4]; 4],
    pub e1: [f32; 3],
    pub thickness: f32,
    pub e2: [f32; 3],
    pub repeat_u: f32,
    pub n: [f32; 3],
    pub repeat_v: f32,
    pub across: [f32; 3],
    pub height: f32,
    pub along: [f32; 3],
    pub profile: u32,
    pub normal: [f32; 3],
    pub volume: u32,
    pub e: [f32; 2],
    pub f: [f32; 2],
    pub g: [f32; 2],
    pub offset: [f32; 2],
    pub erosion: [f32; 4],
    pub a: [f32; 3],
    pub mist: f32,
    pub tear: [f32; 4],
    pub occlusion: [f32; 4],
    pub shadow: [f32; 4],
    pub billow: [f32; 4],
}

/// Uniforms of a submission that fills columns of one light volume.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct LightVolume {
    pub direction: [f32; 3],
    pub first_column: u32,
    pub offset: [i32; 3],
    pub column_count: u32,
    pub cells: [i32; 3],
    pub bits: f32,
    pub base: [i32; 3],
    pub width: u32,
    pub height: u32,
    pub pad: [u32; 3],
}

/// A face of a hull that the eye sees. Twin: `shaders/engine/gbuffer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct HullFace {
    pub a: [f32; 3],
    pub number: u32,
    pub b: [f32; 3],
    pub u_a: f32,
    pub c: [f32; 3],
    pub v_a: f32,
    pub uv_b: [f32; 2],
    pub uv_c: [f32; 2],
}

/// Uniforms of a submission that fills V at vertices of a shell. Twin: `shaders/light/shell_light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct ShellLightPart {
    pub cells: [i32; 3],
    pub extinction: f32,
    pub base: [i32; 3],
    pub flow_cells: f32,
    pub shell: u32,
    pub light: u32,
    pub first: u32,
    pub count: u32,
    pub max_cells: u32,
    pub pad_a: u32,
    pub pad_b: u32,
    pub pad_c: u32,
}

/// Constants of the strand model; its table is a texture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Strand {
    pub squeeze: f32,
    pub spread: f32,
    pub aeration: f32,
    pub g: f32,
}

/// Uniforms of a scene's environment. Twin: `shaders/light/environment.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Environment {
    pub irradiance: [[f32; 4]; 9],
    pub to_sun: [f32; 3],
    pub rim2: f32,
    pub sun_radiance: [f32; 3],
    pub intensity: f32,
    pub turn: f32,
    pub pad_a: f32,
    pub pad_b: f32,
    pub pad_c: f32,
}

impl Environment {
    /// Packs an environment.
    pub fn new(environment: &environment::Environment) -> Self {
        let sun = environment.sun;
        Environment {
            irradiance: environment.irradiance.0.map(|c| c.extend(0.0).to_array()),
            to_sun: sun.map_or([0.0; 3], |sun| sun.to_sun.to_array()),
            rim2: sun.map_or(0.0, |sun| sun.rim2),
            sun_radiance: sun.map_or([0.0; 3], |sun| sun.radiance.to_array()),
            intensity: environment.intensity,
            turn: environment.turn,
            pad_a: 0.0,
            pad_b: 0.0,
            pad_c: 0.0,
        }
    }
}

/// A part of a window, pixels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Tile {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// The workgroups of one submission of the integrate pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Groups {
    pub area: Tile,
    pub first: u32,
    pub count: u32,
    pub pad_a: u32,
    pub pad_b: u32,
}

/// Constants of multiple scattering.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Similarity {
    pub extinction: [f32; 3],
    pub g: f32,
    pub albedo: [f32; 3],
    pub pad_0: f32,
    pub reduced: [f32; 3],
    pub pad_1: f32,
    pub isotropic: [f32; 3],
    pub pad_2: f32,
}

/// Colours of a volume's cells.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Ramp {
    pub first: [f32; 3],
    pub count: f32,
    pub step_0: [f32; 3],
    pub k_s_factor: f32,
    pub step_1: [f32; 3],
    pub k_s_summand: f32,
    pub step_2: [f32; 3],
    pub pad: f32,
}

/// Optics of a volume that shells show; extinction 0 where light scatters once. Twin:
/// `shaders/light/optics.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Optics {
    pub extinction: [f32; 3],
    pub g: f32,
    pub albedo: [f32; 3],
    pub eta: f32,
    pub isotropic: [f32; 3],
    pub roughness: f32,
}

impl From<&ShellOptics> for Optics {
    fn from(optics: &ShellOptics) -> Self {
        Optics {
            extinction: optics.extinction.to_array(),
            g: optics.g,
            albedo: optics.albedo.to_array(),
            eta: optics.surface.map_or(0.0, |surface| surface.eta),
            isotropic: optics.isotropic.to_array(),
            roughness: optics.surface.map_or(0.0, |surface| surface.roughness),
        }
    }
}

/// Constants of one of several volumes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct VolumeConstants {
    pub cells: [i32; 3],
    pub extinction: f32,
    pub base: [i32; 3],
    pub flow_cells: f32,
    pub similarity: Similarity,
    pub ramp: Ramp,
    pub optics: Optics,
    pub levels: u32,
    pub strands: u32,
    /// Whether the cells keep the lines of their strands.
    pub lines: u32,
    pub flow_moves: f32,
}

/// Returns the constants of all volumes, as many as the uniform holds. `origins` are their first cells in the
/// texture, `waters` the constants of multiple scattering in them, if the scene asks for it, and `optics`
/// those of shells.
pub fn volume_constants(
    scene: &Scene,
    volumes: &[VolumeTexture],
    origins: &[[u32; 3]],
    waters: &[scatter::Similarity],
    optics: &[Option<ShellOptics>],
) -> Vec<VolumeConstants> {
    let (flows, moves) = (scene.flows(volumes), scene.flow_moves(volumes));
    let constants = |(i, volume): (usize, &VolumeTexture)| VolumeConstants {
        cells: volume.size.map(|n| n as i32),
        extinction: extinction(&scene.trace.attenuation, volume.alpha),
        base: origins[i].map(|n| n as i32),
        flow_cells: flow_cells(flows[i], volume.size[1]),
        similarity: waters.get(i).map(Similarity::from).unwrap_or_default(),
        ramp: Ramp::from(&scene.recipes[i].ramp),
        optics: optics[i].as_ref().map(Optics::from).unwrap_or_default(),
        levels: level_atlas(&scene.trace, volume.size).count,
        strands: scene.reflection_of(i).strands().is_some().into(),
        lines: scene.recipes[i].has_lines().into(),
        flow_moves: moves[i],
    };
    let mut all: Vec<VolumeConstants> = volumes.iter().enumerate().map(constants).collect();
    all.resize(MAX_VOLUMES, VolumeConstants::default());
    all
}

/// Constants of how the volume reflects and scatters light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Reflection {
    pub strand: Strand,
    pub similarity: Similarity,
    pub ramp: Ramp,
    pub optics: Optics,
    pub ambient: [f32; 3],
    pub pad: f32,
}

impl Reflection {
    /// Packs the constants of the models that a scene uses, the colours and optics of its first volume and
    /// the ambient light that cells send on; the others stay 0.
    pub fn new(
        scene: &Scene,
        strand: Option<&StrandShading>,
        similarity: Option<&scatter::Similarity>,
        optics: Option<&ShellOptics>,
    ) -> Self {
        let similarity = similarity.map(Similarity::from);
        let strand = strand.map(Strand::from);
        Reflection {
            strand: strand.unwrap_or_default(),
            similarity: similarity.unwrap_or_default(),
            ramp: Ramp::from(&scene.recipes[0].ramp),
            optics: optics.map(Optics::from).unwrap_or_default(),
            ambient: (scene.ambient * scene.reflection.ambient_share()).to_array(),
            pad: 0.0,
        }
    }
}

impl From<&ramp::Ramp> for Ramp {
    fn from(ramp: &ramp::Ramp) -> Self {
        let [step_0, step_1, step_2] = ramp.steps.map(|step| step.to_array());
        let [k_s_factor, k_s_summand] = ramp.k_s;
        Ramp {
            first: ramp.first.to_array(),
            count: ramp.count,
            step_0,
            k_s_factor,
            step_1,
            k_s_summand,
            step_2,
            pad: 0.0,
        }
    }
}

impl From<&scatter::Similarity> for Similarity {
    fn from(s: &scatter::Similarity) -> Self {
        Similarity {
            extinction: s.extinction.to_array(),
            g: s.g,
            albedo: s.albedo.to_array(),
            reduced: s.reduced.to_array(),
            isotropic: s.isotropic.to_array(),
            ..Similarity::default()
        }
    }
}

impl From<&StrandShading> for Strand {
    fn from(shading: &StrandShading) -> Self {
        let table = &shading.table;
        Strand { squeeze: table.squeeze, spread: table.spread, aeration: shading.aeration, g: shading.g }
    }
}

impl Tile {
    /// Returns all of a window.
    pub fn whole(window: Window) -> Tile {
        Tile { x: 0, y: 0, width: window.width, height: window.height }
    }
}

impl FrameUniforms {
    /// Packs the uniforms of sample `sample` of a window; what belongs to a volume is that of the first. The
    /// sums run over `samples`; the targets have `layers` layers, and `depth` is that of the scene.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        scene: &Scene,
        volumes: &[VolumeTexture],
        window: Window,
        samples: &Range<u32>,
        sample: u32,
        layers: u32,
        depth: &DepthRange,
    ) -> Self {
        let (volume, flow) = (&volumes[0], scene.flows(volumes)[0]);
        let camera = &scene.camera;
        let image = &scene.image;
        let haze = scene.haze.seen_from(camera.eye_local());
        let [jitter_x, jitter_y] = sample_offset(image, sample);
        let times = scene.sample_times(sample);
        let turn = StrandTurn::new(image.samples, sample);
        let (right, up) = camera.image_plane(image.width, image.height);
        let clip = camera.clip_from_world(image.width, image.height, [jitter_x, jitter_y], depth);
        let to_point = camera.depth_to_point(depth);
        FrameUniforms {
            clip_from_world: clip_to_window(clip, [image.width, image.height], window).to_cols_array_2d(),
            eye_world: camera.eye_local().as_vec3().to_array(),
            jitter_x,
            right: right.to_array(),
            jitter_y,
            up: up.to_array(),
            sample_index: sample - samples.start,
            forward: camera.forward.as_vec3().to_array(),
            samples: samples.len() as u32,
            zenith: scene.background.zenith.to_array(),
            light_count: scene.lights.len() as u32,
            horizon: scene.background.horizon.to_array(),
            p: scene.p,
            ambient: scene.ambient.to_array(),
            early_end: scene.trace.early_end,
            cells: volume.size.map(|n| n as i32),
            max_cells: scene.trace.max_cells,
            image_width: image.width as f32,
            image_height: image.height as f32,
            extinction: extinction(&scene.trace.attenuation, volume.alpha),
            texture_frame: u32::from(scene.angles == AngleFrame::Texture),
            haze_density: haze.density,
            haze_falloff: haze.falloff,
            window_x: window.x,
            window_y: window.y,
            window_width: window.width,
            window_height: window.height,
            flow_cells: flow_cells(flow, volume.size[1]),
            layers,
            haze_color: haze.color.to_array(),
            haze_far: haze.far,
            shadow_light: scene.shadow_light().map_or(u32::MAX, |i| i as u32),
            levels: level_atlas(&scene.trace, volume.size).count,
            footprint: footprint(camera, image),
            alpha: u32::from(image.alpha),
            anchor: to_point.anchor.to_array(),
            depth_shift: to_point.shift,
            depth_rise: to_point.rise,
            depth_slope: to_point.slope,
            depth_scale: to_point.scale,
            flow_moves: scene.flow_moves(volumes)[0],
            shutter_first: times.first,
            shutter_step: times.step,
            strand_scale: turn.scale,
            strand_shift: turn.shift,
            billow: {
                let BillowTimes { risen, weights } = BillowTimes::new(scene.wave_flow);
                [risen[0], risen[1], weights[0], weights[1]]
            },
        }
    }
}

/// Returns the scene's lights, then those that stand for its environment in the volume. Without any, it
/// returns one dark light, because no buffer may be empty.
pub fn lights(scene: &Scene) -> Vec<Light> {
    let mut lights: Vec<Light> = scene.volume_lights().iter().map(Light::new).collect();
    lights.resize(lights.len().max(1), Light::default());
    lights
}

impl Light {
    fn new(light: &crate::light::Light) -> Self {
        let base = |vector: Vec3, has_position, intensity: Vec3| Light {
            vector: vector.to_array(),
            has_position,
            intensity: intensity.to_array(),
            cos_edge: -2.0,
            ..Light::default()
        };
        match *light {
            crate::light::Light::Directional { to_light, intensity } => base(to_light, 0, intensity),
            crate::light::Light::Point { position, intensity } => base(position, 1, intensity),
            crate::light::Light::Spot { position, intensity, cone } => Light {
                cos_edge: cone.cos_edge,
                axis: cone.axis.to_array(),
                inverse_soft: cone.inverse_soft,
                ..base(position, 1, intensity)
            },
        }
    }
}

impl Quad {
    /// Packs a quad as the eye of a scene sees it, in a shade. `profile` is the index at which the profile of
    /// its material begins.
    pub fn new(quad: &crate::mapping::Quad, scene: &Scene, profile: u32, shade: &QuadShade) -> Self {
        let map = &quad.map;
        let rays = scene.camera.rays(scene.image.width, scene.image.height);
        let plane = PlaneView::of_quad(map, scene.camera.eye_local(), rays);
        Quad {
            corners: quad.corners.map(|c| c.extend(1.0).to_array()),
            e1: map.e1_world.to_array(),
            thickness: quad.material.thickness_m,
            e2: map.e2_world.to_array(),
            repeat_u: quad.material.repeat_u,
            n: map.n_world.to_array(),
            repeat_v: quad.material.repeat_v,
            across: plane.across.to_array(),
            height: plane.height,
            along: plane.along.to_array(),
            profile,
            normal: plane.normal.to_array(),
            volume: quad.material.volume,
            e: map.e.to_array(),
            f: map.f.to_array(),
            g: map.g.to_array(),
            offset: quad.offset.to_array(),
            erosion: quad.erosion,
            a: map.a_world.to_array(),
            mist: quad.mist,
            tear: {
                let Tear { open: [near, far], lattice: [across, along] } = quad.tear;
                [near, far, across as f32, along as f32]
            },
            occlusion: shade.occlusion,
            shadow: shade.shadow,
            billow: {
                let Billow { strength, inverse_size, rise } = quad.material.billow;
                [strength, inverse_size, rise, 0.0]
            },
        }
    }
}
