//! Shaders against the host code. Every file is valid and imports what it uses. Every struct, constant and
//! binding that both sides share is equal on both.

use std::collections::BTreeSet;
use std::mem::offset_of;
use std::path::Path;

use taki::engine::cpu::gloss;
use taki::engine::gpu::binding;
use taki::engine::gpu::layout::{
    Environment, FrameUniforms, Groups, HullFace, Light, LightVolume, MeshTile, Optics, Quad, Ramp,
    Reflection, ShellLightPart, Similarity, Strand, Tile, VertexMaterial, VolumeConstants, WORKGROUP,
};
use taki::engine::gpu::shader::{FILES, imports, resolve};
use taki::engine::gpu::shells;
use taki::engine::gpu::{gbuffer_source, integrate_source, visibility_source};
use taki::engine::pool_surface::{AROUND, Foam, Surface, WAVES, Wave};
use taki::picture::{Develop, TONE_AGX, TONE_FILMIC};
use taki::place::paint::{self, Paint, TextureUse};
use taki::place::stone::{self, Octave, Stone};
use wgpu::naga;

/// Name of each stage, and its text with all imports.
fn stages() -> [(&'static str, String); 7] {
    [
        ("bare", resolve("#import engine::bare")),
        ("gbuffer", gbuffer_source()),
        ("integrate", integrate_source(true)),
        ("integrate, one sheet", integrate_source(false)),
        ("resolve", resolve("#import picture::resolve")),
        ("shell_light", shells::source()),
        ("visibility", visibility_source()),
    ]
}

fn stage(name: &str) -> String {
    let found = stages().into_iter().find(|(of, _)| *of == name);
    found.unwrap_or_else(|| panic!("no stage {name}")).1
}

fn validate(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(&module)
        .map_err(|e| e.emit_to_string(source))?;
    Ok(module)
}

/// Names of the files in a folder of shaders, without extension, as imports write them.
fn files_in(folder: &Path, prefix: &str) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the folder of shaders") {
        let entry = entry.expect("an entry");
        let name = entry.file_name().into_string().expect("UTF-8");
        if entry.path().is_dir() {
            names.extend(files_in(&entry.path(), &format!("{prefix}{name}/")));
        } else {
            names.push(format!("{prefix}{}", name.strip_suffix(".wgsl").expect("a shader")));
        }
    }
    names
}

#[test]
fn every_file_in_shaders_is_in_the_program_and_some_stage_imports_it() {
    let mut found = files_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), "");
    let mut known: Vec<&str> = FILES.iter().map(|(name, _)| *name).collect();
    found.sort_unstable();
    known.sort_unstable();
    assert_eq!(found, known);
    let stages = stages().map(|(_, text)| text).concat();
    for (name, text) in FILES {
        let own: String =
            text.lines().filter(|l| !l.starts_with("#import ")).flat_map(|l| [l, "\n"]).collect();
        assert!(stages.contains(&own), "no stage imports {name}");
    }
}

/// Names that a shader declares for others: functions, types, constants and overrides.
fn declared(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    for line in text.lines() {
        let words = ["fn ", "struct ", "const ", "override "];
        if let Some(rest) = words.iter().find_map(|word| line.strip_prefix(word)) {
            names.push(rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(""));
        }
    }
    names
}

/// Whether a shader uses a name outside its comments.
fn uses(text: &str, name: &str) -> bool {
    let called = name.starts_with(|c: char| c.is_lowercase());
    let part = |c: char| c.is_alphanumeric() || c == '_';
    text.lines().map(|line| line.split("//").next().unwrap_or("")).any(|line| {
        line.match_indices(name).any(|(at, _)| {
            let (before, after) = (&line[..at], &line[at + name.len()..]);
            !before.ends_with(part) && !after.starts_with(part) && (!called || after.starts_with('('))
        })
    })
}

#[test]
fn every_shader_imports_the_files_whose_names_it_uses() {
    let mut checked = 0;
    for (file, text) in FILES {
        let imported: Vec<String> = imports(text).collect();
        for (other, declares) in FILES.iter().filter(|(other, _)| other != file) {
            // A name that two files declare (as both kinds of sheets do) does not tell which file is meant.
            let only_there =
                |name: &&str| FILES.iter().filter(|(_, text)| declared(text).contains(name)).count() == 1;
            for name in declared(declares).into_iter().filter(only_there).filter(|name| uses(text, name)) {
                assert!(
                    imported.iter().any(|i| i == other),
                    "{file} uses {name} of {other} without an import"
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 100, "{checked}");
}

#[test]
fn every_stage_is_valid_wgsl() {
    for (name, text) in stages() {
        if let Err(e) = validate(&text) {
            panic!("{name}:\n{e}");
        }
    }
}

#[test]
fn the_validation_can_fail() {
    assert!(validate(&resolve("#import layout\nfn broken() -> f32 { return 1u; }")).is_err());
}

#[test]
#[should_panic(expected = "no shader light/nothing to import")]
fn an_import_of_nothing_is_an_error_of_the_program() {
    resolve("#import light::nothing");
}

/// Name and offset of each member of a module's struct, and the struct's size.
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
    let module = validate(&stage("integrate")).expect("valid");
    let frame = fields!(FrameUniforms: clip_from_world eye_world jitter_x right jitter_y up sample_index
        forward samples zenith light_count horizon p ambient early_end cells max_cells image_width
        image_height extinction texture_frame haze_density haze_falloff window_x window_y window_width
        window_height flow_cells layers haze_color haze_far shadow_light levels footprint alpha anchor
        depth_shift depth_rise depth_slope depth_scale flow_moves shutter_first
        shutter_step strand_scale strand_shift billow);
    assert_eq!(members(&module, "FrameUniforms"), frame);
    assert_eq!(
        members(&module, "Light"),
        fields!(Light: vector has_position intensity cos_edge axis inverse_soft)
    );
    let quad = fields!(Quad: corners e1 thickness e2 repeat_u n repeat_v across height along profile normal
        volume e f g offset erosion a mist tear occlusion shadow billow);
    assert_eq!(members(&module, "Quad"), quad);
    assert_eq!(members(&module, "Tile"), fields!(Tile: x y width height));
    assert_eq!(members(&module, "Groups"), fields!(Groups: area first count pad_a pad_b));
    assert_eq!(members(&module, "Strand"), fields!(Strand: squeeze spread aeration g));
    let similarity = fields!(Similarity: extinction g albedo pad_0 reduced pad_1 isotropic pad_2);
    assert_eq!(members(&module, "Similarity"), similarity);
    assert_eq!(
        members(&module, "Reflection"),
        fields!(Reflection: strand similarity ramp optics ambient pad)
    );
    let ramp = fields!(Ramp: first count step_0 k_s_factor step_1 k_s_summand step_2 pad);
    assert_eq!(members(&module, "Ramp"), ramp);
    let volume = fields!(VolumeConstants: cells extinction base flow_cells similarity ramp optics levels
        strands lines flow_moves);
    assert_eq!(members(&module, "VolumeConstants"), volume);
    let optics = fields!(Optics: extinction g albedo eta isotropic roughness);
    assert_eq!(members(&module, "Optics"), optics);
    let module = validate(&stage("resolve")).expect("valid");
    assert_eq!(
        members(&module, "Develop"),
        fields!(Develop: balance exposure tone balanced dither place vignette grain
        grain_seed pad)
    );
    let module = validate(&stage("visibility")).expect("valid");
    // The host pads this struct to the size that a uniform needs.
    let (mut light_volume, size) = fields!(LightVolume: direction first_column offset column_count cells
        bits base width height pad);
    light_volume.pop();
    assert_eq!(members(&module, "LightVolume"), (light_volume, size));
    let module = validate(&stage("shell_light")).expect("valid");
    let part = fields!(ShellLightPart: cells extinction base flow_cells shell light first count max_cells
        pad_a pad_b pad_c);
    assert_eq!(members(&module, "ShellLightPart"), part);
    let module = validate(&stage("gbuffer")).expect("valid");
    let environment =
        fields!(Environment: irradiance to_sun rim2 sun_radiance intensity turn pad_a pad_b pad_c);
    assert_eq!(members(&module, "Environment"), environment);
    let surface = fields!(Surface: color radius bottom holdout absorption foam_scale middle far across
        height along bend normal field_blur field_origin field_scale pad carry foam waves around);
    assert_eq!(members(&module, "Surface"), surface);
    let coat = fields!(VertexMaterial: albedo_r albedo_g albedo_b normal_xy normal_z_wet occlusion_shadow);
    assert_eq!(members(&module, "VertexMaterial"), coat);
    assert_eq!(
        members(&module, "MeshTile"),
        fields!(MeshTile: first pitch side holdout paint coordinates stone)
    );
    assert_eq!(members(&module, "TextureUse"), fields!(TextureUse: first size levels rule));
    let paint = fields!(Paint: color surface relief relief_scale roughness metallic has_gloss slots);
    assert_eq!(members(&module, "Paint"), paint);
    let octave = fields!(Octave: tone slope crack fold moss lichen tinted pad);
    assert_eq!(members(&module, "Octave"), octave);
    let stone = fields!(Stone: cells along rest moss streak_cells streaks streak_rest film up bare tint slope2
        moss_color moss2 lichen lichen2 octaves);
    assert_eq!(members(&module, "Stone"), stone);
    assert_eq!(members(&module, "HullFace"), fields!(HullFace: a number b u_a c v_a uv_b uv_c));
    assert_eq!(members(&module, "Foam"), fields!(Foam: cells rest axis pad));
    assert_eq!(members(&module, "Wave"), fields!(Wave: toward k phase slope ring decay moves));
}

#[test]
fn constants_are_the_same_on_both_sides() {
    let [integrate, resolve] = ["integrate", "resolve"].map(|name| validate(&stage(name)).expect("valid"));
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
    assert_eq!(constant("CUT"), taki::engine::gpu::CUT as f64);
    assert_eq!(constant("MAX_VOLUMES"), taki::scene::MAX_VOLUMES as f64);
    assert_eq!(constant("CELLS_A_WORD"), taki::light::visibility::CELLS_A_WORD as f64);
    assert_eq!(constant("COSINES"), taki::light::scatter::COSINES as f64);
    assert_eq!(constant("VIEWS"), taki::light::scatter::VIEWS as f64);
    assert_eq!(constant("DARK_BITS"), f64::from(taki::light::visibility::DARK_BITS));
    assert_eq!(constant("TRANSMITTANCE_OF_CODE"), f64::from(taki::light::visibility::TRANSMITTANCE_OF_CODE));
    assert_eq!(constant("MEAN_EROSION"), f64::from(taki::trace::MEAN_EROSION));
    assert_eq!(constant("NEVER"), taki::walk::NEVER as f64);
    assert_eq!(constant("PARALLEL"), taki::walk::PARALLEL as f64);
    assert_eq!(constant("LEAP_MARGIN"), taki::walk::LEAP_MARGIN as f64);
    assert_eq!(constant("MIST_OF_CELLS"), f64::from(taki::trace::MIST_OF_CELLS));
    assert_eq!(constant("MIST_RHO"), f64::from(taki::trace::MIST_RHO));
    assert_eq!(constant("SINE_SHARE"), taki::light::strand::table::SINE_SHARE as f64);
    assert_eq!(constant("MOST_FACES"), f64::from(taki::mapping::shell::MOST_FACES));
    assert_eq!(constant("INWARDS") as f32, taki::mapping::shell::INWARDS);
    assert_eq!(constant("EYE_FACE"), f64::from(taki::mapping::shell::EYE_FACE));
    assert_eq!(1u32 << constant("SHELL_ROW") as u32, shells::SHELL_ROW);
    let ours = [shells::SHELL_TABLE, shells::SHELL_HEADER, shells::PRISM].map(f64::from);
    assert_eq!(["SHELL_TABLE", "SHELL_HEADER", "PRISM"].map(constant), ours);
    let gbuffer = validate(&stage("gbuffer")).expect("valid");
    let wide = |name: &str| of(&gbuffer, name) as usize;
    assert_eq!(wide("WAVES"), WAVES);
    assert_eq!(of(&gbuffer, "MOST_STRETCH"), f64::from(paint::MOST_STRETCH));
    assert_eq!(of(&gbuffer, "MOST_TAPS"), f64::from(paint::MOST_TAPS));
    assert_eq!(of(&gbuffer, "MIRROR"), f64::from(paint::MIRROR));
    assert_eq!(of(&gbuffer, "CLAMP"), f64::from(paint::CLAMP));
    assert_eq!(of(&gbuffer, "DIELECTRIC"), f64::from(gloss::DIELECTRIC));
    assert_eq!(of(&gbuffer, "LEAST_ALPHA"), f64::from(gloss::LEAST_ALPHA));
    assert_eq!(wide("OCTAVES"), stone::OCTAVES);
    let ours = [stone::COARSEST, stone::GRADIENT, stone::CRACK, stone::CRACK_SHARE, stone::EDGE];
    let names = ["COARSEST", "GRADIENT", "CRACK", "CRACK_SHARE", "EDGE"];
    assert_eq!(names.map(|name| of(&gbuffer, name) as f32), ours);
    let streak = ["STREAK_WIDTH", "STREAK_HEIGHT"].map(|name| of(&gbuffer, name) as f32);
    assert_eq!(streak, stone::STREAK);
    assert_eq!(of(&gbuffer, "UNIT") as f32, taki::engine::cpu::stone::UNIT);
    assert_eq!(wide("TILE_ROW"), taki::place::tiles::SIDE as usize + 1);
    assert_eq!([wide("AROUND_COLUMNS"), wide("AROUND_ROWS")], AROUND);
    let size = ["STRAND_X", "STRAND_Y", "STRAND_Z"].map(|name| constant(name) as usize);
    assert_eq!(size, taki::light::strand::table::SIZE);
    assert_eq!(constant("TILTED_X") as usize, taki::light::strand::table::TILTED_X);
    assert_eq!(constant("CONE_SHARE"), taki::light::strand::table::CONE_SHARE as f64);
}

/// Names and numbers of the bindings that a stage's shader uses.
fn bound(stage_name: &str) -> BTreeSet<(String, u32)> {
    let module = validate(&stage(stage_name)).expect("valid");
    let bindings = module.global_variables.iter().filter_map(|(_, variable)| {
        let at = variable.binding?;
        assert_eq!(at.group, 0, "{stage_name}");
        Some((variable.name.clone().expect("a name").to_uppercase(), at.binding))
    });
    bindings.collect()
}

#[test]
fn binding_numbers_are_the_same_on_both_sides() {
    for (name, ours) in [
        ("gbuffer", binding::gbuffer::ALL),
        ("integrate", binding::integrate::ALL),
        ("resolve", binding::resolve::ALL),
        ("shell_light", binding::shell_light::ALL),
        ("visibility", binding::visibility::ALL),
    ] {
        let ours: BTreeSet<(String, u32)> = ours.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect();
        assert_eq!(bound(name), ours, "{name}");
    }
    let whole = bound("integrate");
    assert_eq!(bound("integrate, one sheet"), whole);
    let bare = bound("bare");
    assert!(!bare.is_empty() && bare.is_subset(&whole), "{bare:?}");
}

/// The structs that [`host_structs_have_the_layout_the_shaders_read`] compares.
const COMPARED: [&str; 25] = [
    "Develop",
    "Environment",
    "Foam",
    "FrameUniforms",
    "Groups",
    "HullFace",
    "Light",
    "LightVolume",
    "MeshTile",
    "Octave",
    "Optics",
    "Paint",
    "Quad",
    "Ramp",
    "Reflection",
    "ShellLightPart",
    "Similarity",
    "Stone",
    "Strand",
    "Surface",
    "TextureUse",
    "Tile",
    "VertexMaterial",
    "VolumeConstants",
    "Wave",
];

#[test]
fn every_struct_of_a_buffer_is_compared() {
    let mut seen = BTreeSet::new();
    for (stage, text) in stages() {
        let module = validate(&text).expect("valid");
        for (_, variable) in module.global_variables.iter() {
            if !matches!(variable.space, naga::AddressSpace::Uniform | naga::AddressSpace::Storage { .. }) {
                continue;
            }
            let mut open = vec![variable.ty];
            while let Some(handle) = open.pop() {
                let ty = &module.types[handle];
                match &ty.inner {
                    naga::TypeInner::Array { base, .. } => open.push(*base),
                    naga::TypeInner::Struct { members, .. } => {
                        let name = ty.name.clone().expect("a name");
                        assert!(COMPARED.contains(&name.as_str()), "{stage}: nobody compares {name}");
                        seen.insert(name);
                        open.extend(members.iter().map(|member| member.ty));
                    }
                    _ => {}
                }
            }
        }
    }
    assert_eq!(seen.iter().map(String::as_str).collect::<Vec<_>>(), COMPARED);
}
