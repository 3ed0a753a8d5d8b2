//! The shaders against the host: every file is valid, and every struct and constant both sides share is
//! the same on both.

use std::mem::offset_of;

use taki::gpu::layout::{
    Coat, Develop, Environment, Frame, Groups, Light, LightVolume, MeshTile, Quad, Strand, TONE_AGX,
    TONE_FILMIC, Tile, WORKGROUP,
};
use taki::gpu::{gbuffer_source, integrate_source, shader_source, visibility_source};
use taki::pool::{AROUND, Surface, WAVES, Wave};
use wgpu::naga;

/// Files that are put in front of every stage.
const SHARED: [&str; 8] = [
    "environment.wgsl",
    "frame.wgsl",
    "haze.wgsl",
    "mapping.wgsl",
    "scatter.wgsl",
    "shading.wgsl",
    "strand.wgsl",
    "walk.wgsl",
];
/// The stages.
const STAGES: [&str; 5] = ["bare.wgsl", "gbuffer.wgsl", "integrate.wgsl", "resolve.wgsl", "visibility.wgsl"];

/// What some stages are put together from besides.
const PARTS: [&str; 10] = [
    "cells.wgsl",
    "integrate_light.wgsl",
    "integrate_many.wgsl",
    "integrate_one.wgsl",
    "levels.wgsl",
    "lookup.wgsl",
    "matter.wgsl",
    "opaque.wgsl",
    "optical_depth.wgsl",
    "pool.wgsl",
];

/// All of a stage's shader.
fn stage(name: &str) -> String {
    match name {
        "integrate.wgsl" => shader_source(&integrate_source(true)),
        "visibility.wgsl" => shader_source(&visibility_source()),
        "gbuffer.wgsl" => shader_source(&gbuffer_source()),
        "bare.wgsl" => shader_source(&[file("cells.wgsl"), file(name)].join("\n")),
        _ => shader_source(&file(name)),
    }
}

fn file(name: &str) -> String {
    let path = format!("{}/shaders/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn validate(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(&module)
        .map_err(|e| e.emit_to_string(source))?;
    Ok(module)
}

#[test]
fn every_file_in_shaders_is_a_known_stage_or_shared_and_none_is_missing() {
    let folder = format!("{}/shaders", env!("CARGO_MANIFEST_DIR"));
    let mut found: Vec<String> = std::fs::read_dir(folder)
        .expect("the folder of shaders")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    let mut known: Vec<&str> = SHARED.iter().chain(&STAGES).chain(&PARTS).copied().collect();
    found.sort_unstable();
    known.sort_unstable();
    assert_eq!(found, known);
}

#[test]
fn every_stage_is_valid_wgsl() {
    for name in STAGES {
        if let Err(e) = validate(&stage(name)) {
            panic!("{name}:\n{e}");
        }
    }
    if let Err(e) = validate(&shader_source(&integrate_source(false))) {
        panic!("integrate_one.wgsl:\n{e}");
    }
}

#[test]
fn the_validation_can_fail() {
    assert!(validate(&shader_source("fn broken() -> f32 { return 1u; }")).is_err());
}

/// (name, offset) of each member, and the size, of a struct of a module.
fn members(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found else {
        panic!("no struct {name}");
    };
    let named = |m: &naga::StructMember| (m.name.clone().expect("a name"), m.offset);
    (members.iter().map(named).collect(), *span)
}

macro_rules! fields {
    ($ty:ty: $($field:ident)*) => {
        (vec![$((stringify!($field).to_owned(), offset_of!($ty, $field) as u32)),*], size_of::<$ty>() as u32)
    };
}

#[test]
fn host_structs_have_the_layout_the_shaders_read() {
    let module = validate(&stage("integrate.wgsl")).expect("valid");
    let frame = fields!(Frame: clip_from_world eye_world jitter_x right jitter_y up sample_index forward samples
        zenith light_count horizon p ambient early_end cells max_cells image_width image_height extinction
        texture_frame haze_density haze_falloff window_x window_y window_width window_height flow_cells layers
        haze_color haze_far shadow_light levels footprint pad_c);
    assert_eq!(members(&module, "Frame"), frame);
    assert_eq!(
        members(&module, "Light"),
        fields!(Light: vector has_position intensity cos_edge axis inverse_soft)
    );
    let quad = fields!(Quad: corners e1 thickness e2 repeat_u n repeat_v eye_plane profile e f g offset erosion mist pad_a pad_b pad_c);
    assert_eq!(members(&module, "Quad"), quad);
    let environment =
        fields!(Environment: irradiance to_sun rim2 sun_radiance intensity turn pad_a pad_b pad_c);
    assert_eq!(members(&module, "Environment"), environment);
    assert_eq!(members(&module, "Tile"), fields!(Tile: x y width height));
    assert_eq!(members(&module, "Groups"), fields!(Groups: area first count pad_a pad_b));
    assert_eq!(members(&module, "Strand"), fields!(Strand: squeeze spread aeration g));
    let module = validate(&stage("resolve.wgsl")).expect("valid");
    assert_eq!(members(&module, "Develop"), fields!(Develop: balance exposure tone balanced pad_a));
    let module = validate(&stage("visibility.wgsl")).expect("valid");
    // Padded on the host to what a uniform takes.
    let (mut light_volume, size) = fields!(LightVolume: direction first_column offset column_count bits pad);
    light_volume.pop();
    assert_eq!(members(&module, "LightVolume"), (light_volume, size));
    let module = validate(&stage("gbuffer.wgsl")).expect("valid");
    let surface = fields!(Surface: color radius bottom pad_a absorption pad_b middle pad_c waves around);
    assert_eq!(members(&module, "Surface"), surface);
    let coat = fields!(Coat: albedo_r albedo_g albedo_b normal_xy normal_z_wet occlusion_shadow);
    assert_eq!(members(&module, "Coat"), coat);
    assert_eq!(members(&module, "MeshTile"), fields!(MeshTile: first pitch side pad));
    assert_eq!(members(&module, "Wave"), fields!(Wave: toward k phase slope ring decay pad));
}

#[test]
fn constants_are_the_same_on_both_sides() {
    let [integrate, resolve] =
        ["integrate.wgsl", "resolve.wgsl"].map(|name| validate(&stage(name)).expect("valid"));
    let of = |module: &naga::Module, name: &str| {
        let found = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name));
        let (_, constant) = found.unwrap_or_else(|| panic!("no constant {name}"));
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(x)) => x as f64,
            naga::Expression::Literal(naga::Literal::I32(x)) => x as f64,
            naga::Expression::Literal(naga::Literal::F32(x)) => x as f64,
            ref other => panic!("{name} is {other:?}"),
        }
    };
    let constant = |name: &str| of(&integrate, name);
    assert_eq!(of(&resolve, "TONE_FILMIC"), TONE_FILMIC as f64);
    assert_eq!(of(&resolve, "TONE_AGX"), TONE_AGX as f64);
    assert_eq!(constant("WORKGROUP"), WORKGROUP as f64);
    assert_eq!(constant("CUT"), taki::gpu::CUT as f64);
    assert_eq!(constant("CELLS_A_WORD"), taki::visibility::CELLS_A_WORD as f64);
    assert_eq!(constant("COSINES"), taki::scatter::COSINES as f64);
    assert_eq!(constant("DARK_BITS"), f64::from(taki::visibility::DARK_BITS));
    assert_eq!(constant("NEVER"), taki::walk::NEVER as f64);
    assert_eq!(constant("PARALLEL"), taki::walk::PARALLEL as f64);
    assert_eq!(constant("SHY"), taki::walk::SHY as f64);
    assert_eq!(constant("MIST_OF_CELLS"), f64::from(taki::cpu::MIST_OF_CELLS));
    assert_eq!(constant("MIST_RHO"), f64::from(taki::cpu::MIST_RHO));
    assert_eq!(constant("SINE_SHARE"), taki::strand::table::SINE_SHARE as f64);
    let gbuffer = validate(&stage("gbuffer.wgsl")).expect("valid");
    let wide = |name: &str| of(&gbuffer, name) as usize;
    assert_eq!(wide("WAVES"), WAVES);
    assert_eq!([wide("AROUND_COLUMNS"), wide("AROUND_ROWS")], AROUND);
    let size = ["STRAND_X", "STRAND_Y", "STRAND_Z"].map(|name| constant(name) as usize);
    assert_eq!(size, taki::strand::table::SIZE);
}
