//! Files of OpenVDB 10.0.1 (Debian 12), OpenVDB 13.0.0 (bpy 5.3.0) and vdb_tool 10.6.1, made by
//! `tests/data/grid/make.py`.

use glam::{DAffine3, DMat3, DVec3};
use taki::grid::{Bounds, Class, Grid, list};

use super::{Folder, MEMORY};

/// Code of a sample, as the script has it.
fn code(index: [i32; 3]) -> i32 {
    (index[0] * 7 + index[1] * 13 + index[2] * 29).rem_euclid(64)
}

/// The box that the script fills.
const FILLED: Bounds = Bounds { min: [1, 2, 3], max: [9, 9, 9] };

fn contains(bounds: &Bounds, index: [i32; 3]) -> bool {
    (0..3).all(|a| (bounds.min[a]..=bounds.max[a]).contains(&index[a]))
}

/// Compares the samples around `filled` with the script: `on` of the code where it is no multiple of 3, `off`
/// of it elsewhere, and the background outside.
fn check(grid: &Grid, filled: &Bounds, on: impl Fn(i32) -> [f32; 3], off: impl Fn(i32) -> [f32; 3]) {
    let mut reader = grid.reader();
    let mut active = 0;
    for x in filled.min[0] - 20..filled.max[0] + 20 {
        for y in filled.min[1] - 20..filled.max[1] + 20 {
            for z in filled.min[2] - 20..filled.max[2] + 20 {
                let index = [x, y, z];
                let h = code(index);
                let expected = match contains(filled, index) {
                    true if h % 3 != 0 => on(h),
                    true => off(h),
                    false => grid.background,
                };
                active += u64::from(contains(filled, index) && h % 3 != 0);
                assert_eq!(reader.at(index), expected, "{index:?}");
            }
        }
    }
    assert_eq!(grid.active_count(), active);
    let bounds = grid.bounds().expect("samples");
    assert_eq!(bounds, bounds_of_active(filled));
}

fn bounds_of_active(filled: &Bounds) -> Bounds {
    let mut all: Option<Bounds> = None;
    for x in filled.min[0]..=filled.max[0] {
        for y in filled.min[1]..=filled.max[1] {
            for z in filled.min[2]..=filled.max[2] {
                if code([x, y, z]) % 3 != 0 {
                    let one = Bounds { min: [x, y, z], max: [x, y, z] };
                    all = Some(all.map_or(one, |all| all.union(one)));
                }
            }
        }
    }
    all.expect("samples")
}

fn scalar(x: f32) -> [f32; 3] {
    [x, 0.0, 0.0]
}

fn on(h: i32) -> [f32; 3] {
    scalar(h as f32 / 64.0)
}

fn vector(h: i32) -> [f32; 3] {
    let h = h as f32;
    [h / 64.0, -h / 32.0, h / 16.0 - 1.0]
}

/// A value for an even code and another for an odd one.
fn either(even: f32, odd: f32) -> impl Fn(i32) -> [f32; 3] {
    move |h| scalar(if h % 2 == 0 { even } else { odd })
}

#[test]
fn a_fog_volume_is_read_with_its_class_and_transform() {
    for version in ["old", "new"] {
        let grid = Folder::sample(&format!("{version}_float.vdb")).read("density");
        assert_eq!((grid.class, grid.channels(), grid.background), (Class::FogVolume, 1, [0.0; 3]));
        assert_eq!(grid.to_world, DAffine3::from_scale(DVec3::splat(0.25)));
        check(&grid, &FILLED, on, |_| [0.0; 3]);
    }
}

#[test]
fn values_that_are_not_active_are_found_in_every_coding() {
    type Of<'a> = &'a dyn Fn(i32) -> [f32; 3];
    let all: [(&str, Of); 6] = [
        ("minus", &either(-0.5, -0.5)),
        ("one", &either(3.0, 3.0)),
        ("plus_minus", &either(0.5, -0.5)),
        ("one_and_plus", &either(0.5, 3.0)),
        ("two", &either(4.0, 3.0)),
        ("many", &|h| scalar(h as f32)),
    ];
    for (name, off) in all {
        let grid = Folder::sample(&format!("old_off_{name}.vdb")).read("density");
        assert_eq!(grid.background, scalar(0.5), "{name}");
        check(&grid, &FILLED, on, off);
    }
}

#[test]
fn every_compression_is_read_for_floats_and_halves() {
    let words = [
        ("none_32", "none", "float"),
        ("none_16", "none", "float as half"),
        ("active_32", "none + active mask", "float"),
        ("active_16", "none + active mask", "float as half"),
        ("blosc_32", "blosc + active mask", "float"),
        ("blosc_16", "blosc + active mask", "float as half"),
    ];
    for (name, compression, kind) in words {
        let folder = Folder::sample(&format!("tool_{name}.vdb"));
        let summary = &list(&folder.path(), MEMORY).expect("a list")[0];
        let found = (summary.compression.as_str(), summary.kind.as_str());
        assert_eq!(found, (compression, kind), "{name}");
        check(&folder.read("density"), &FILLED, on, either(4.0, 3.0));
    }
    for (name, compression) in [("zip", "zip"), ("zip_mask", "zip + active mask")] {
        let folder = Folder::sample(&format!("cc_{name}.vdb"));
        let summaries = list(&folder.path(), MEMORY).expect("a list");
        assert!(summaries.iter().all(|summary| summary.compression == compression), "{summaries:?}");
        check(&folder.read("density"), &FILLED, on, |_| [0.0; 3]);
        check(&folder.read("half"), &FILLED, on, |_| [0.0; 3]);
    }
    check(&Folder::sample("old_half.vdb").read("density"), &FILLED, on, either(4.0, 3.0));
}

#[test]
fn vectors_are_read_at_negative_indices() {
    let filled = Bounds { min: [-9, -8, -7], max: [-1; 3] };
    for version in ["old", "new"] {
        let folder = Folder::sample(&format!("{version}_vector.vdb"));
        for name in ["velocity", "half_velocity"] {
            let grid = folder.read(name);
            assert_eq!((grid.class, grid.channels()), (Class::Staggered, 3));
            check(&grid, &filled, vector, |_| [0.0; 3]);
        }
    }
}

#[test]
fn other_numbers_become_floats() {
    for name in ["int32", "int64", "double"] {
        let grid = Folder::sample(&format!("new_{name}.vdb")).read(name);
        check(&grid, &FILLED, |h| scalar(h as f32), |_| [0.0; 3]);
    }
    check(&Folder::sample("new_vec3d.vdb").read("vector"), &FILLED, vector, |_| [0.0; 3]);
}

#[test]
fn grids_are_listed_and_read_beside_one_that_is_not() {
    for version in ["old", "new"] {
        let folder = Folder::sample(&format!("{version}_several.vdb"));
        let mut grids = list(&folder.path(), MEMORY).expect("a list");
        grids.sort_by(|a, b| a.name.cmp(&b.name));
        let names: Vec<&str> = grids.iter().map(|grid| grid.name.as_str()).collect();
        assert_eq!(names, ["empty", "flags", "one[0]", "one[1]"]);
        assert_eq!((grids[0].active, grids[0].bounds, &grids[0].refusal), (Some(0), None, &None));
        let why = grids[1].refusal.as_deref().expect("refused");
        assert!(why.starts_with("its type is bool, which is not read; "), "{why}");
        let error = taki::grid::read(&folder.path(), "flags", MEMORY).expect_err("bool");
        assert!(error.to_string().contains("grid \"flags\": its type is bool"), "{error}");
        let place = Bounds { min: [-1, -2, -3], max: [-1, -2, -3] };
        assert_eq!((grids[2].active, grids[2].bounds), (Some(1), Some(place)));

        let empty = folder.read("empty");
        assert_eq!((empty.bounds(), empty.active_count(), empty.at([0; 3])[0]), (None, 0, -1.0));
        // A quarter turn about z and a scale of 2, given as the rows of a matrix.
        let turn = DMat3::from_cols(DVec3::new(0.0, 2.0, 0.0), DVec3::new(-2.0, 0.0, 0.0), DVec3::Z * 2.0);
        let turn = DAffine3::from_mat3_translation(turn, DVec3::new(10.0, 20.0, 30.0));
        for (name, value) in [("one[0]", 0.75), ("one[1]", 0.5)] {
            let one = folder.read(name);
            assert_eq!((one.bounds(), one.active_count()), (Some(place), 1));
            assert_eq!((one.at([-1, -2, -3])[0], one.at([-1, -2, -2])[0]), (value, 0.0));
            assert_eq!(one.to_world, turn);
            let world = one.to_world.transform_point3(DVec3::new(-1.0, -2.0, -3.0));
            assert_eq!(world, DVec3::new(14.0, 18.0, 24.0));
        }
        let error = taki::grid::read(&folder.path(), "smoke", MEMORY).expect_err("no such grid");
        let text = error.to_string();
        assert!(text.contains("no grid \"smoke\"; it has ") && text.contains("one[0]"), "{text}");
    }
}

/// Checks the grid of tiles of the script.
fn check_tiles(grid: &Grid) {
    assert_eq!(grid.active_count(), 4096u64.pow(3) + 128u64.pow(3) + 512 + 6);
    assert_eq!(grid.bounds(), Some(Bounds { min: [0; 3], max: [4352, 4095, 4095] }));
    let at = |x, y, z| grid.at([x, y, z])[0];
    assert_eq!((at(0, 0, 0), at(4095, 4095, 4095), at(-1, 0, 0), at(0, 4096, 0)), (1.0, 1.0, 0.0, 0.0));
    assert_eq!((at(4096, 0, 0), at(4223, 127, 127), at(4223, 128, 0)), (2.0, 2.0, 0.0));
    assert_eq!((at(4224, 0, 0), at(4231, 7, 7), at(4232, 0, 0)), (3.0, 3.0, 0.0));
    assert_eq!((at(4352, 0, 0), at(4352, 1, 2), at(4352, 1, 3), at(4353, 0, 0)), (4.0, 4.0, 0.0, 0.0));
    let mut sides: Vec<u32> = grid.blocks().map(|block| block.side).collect();
    sides.sort_unstable();
    assert_eq!(sides, [8, 8, 128, 4096]);
    assert!(grid.bytes() < 100_000, "{} bytes", grid.bytes());
}

#[test]
fn tiles_of_all_levels_stay_tiles() {
    check_tiles(&Folder::sample("old_tiles.vdb").read("tiles"));
    check_tiles(&Folder::sample("new_tiles.vdb").read("tiles"));
}

/// Checks the sphere of the script to `error`: distances within three voxels of the surface, and their limit
/// elsewhere.
fn check_sphere(grid: &Grid, error: f64) {
    assert_eq!(grid.class, Class::LevelSet);
    let scale = DMat3::from_diagonal(DVec3::splat(0.5));
    assert_eq!(grid.to_world, DAffine3::from_mat3_translation(scale, DVec3::new(1.5, 0.0, -2.0)));
    for x in 0..20 {
        for y in 0..20 {
            for z in 0..20 {
                let distance = DVec3::new(x as f64, y as f64, z as f64).distance(DVec3::splat(10.0)) - 4.0;
                let found = f64::from(grid.at([x, y, z])[0]);
                assert!(
                    (found - distance.clamp(-3.0, 3.0)).abs() <= error,
                    "{x} {y} {z}: {found} {distance}"
                );
            }
        }
    }
}

#[test]
fn the_inside_of_a_level_set_is_negative() {
    check_sphere(&Folder::sample("old_sphere.vdb").read("surface"), 1e-6);
    check_sphere(&Folder::sample("new_sphere.vdb").read("surface"), 1e-6);
}

#[test]
fn every_transform_but_a_frustum_is_read() {
    let folder = Folder::sample("cc_transforms.vdb");
    let at = |name: &str| folder.read(name).to_world.transform_point3(DVec3::new(1.0, 10.0, 100.0));
    assert_eq!(at("scale"), DVec3::new(1.0, 20.0, 300.0));
    assert_eq!(at("uniform"), DVec3::new(2.0, 20.0, 200.0));
    assert_eq!(at("scale_translate"), DVec3::new(5.0, 25.0, 306.0));
    assert_eq!(at("uniform_translate"), DVec3::new(6.0, 25.0, 206.0));
    assert_eq!(at("translate"), DVec3::new(5.0, 15.0, 106.0));
    assert_eq!(at("affine"), DVec3::new(10.0, 15.0, 106.0));
    // As pyopenvdb 10.0.1 tells of each.
    assert_eq!(at("turn"), DVec3::new(-10.0, 1.000_000_000_000_000_7, 100.0));
    let frustum =
        list(&folder.path(), MEMORY).expect("a list").into_iter().find(|grid| grid.name == "frustum");
    let why = frustum.and_then(|grid| grid.refusal).expect("refused");
    assert!(why.contains("frustum") && why.contains("resample"), "{why}");
}

#[test]
fn a_tree_of_other_branches_is_read() {
    let grid = Folder::sample("cc_other_tree.vdb").read("other");
    let at = |x, y, z| grid.at([x, y, z])[0];
    assert_eq!((at(64, 0, 0), at(127, 63, 63), at(128, 0, 0), at(63, 0, 0)), (2.0, 2.0, 0.0, 0.0));
    let samples = grid.active_count() - 64u64.pow(3);
    let mut found = 0;
    for x in 1..10 {
        for y in 2..10 {
            for z in 3..10 {
                let h = code([x, y, z]);
                found += u64::from(h % 3 != 0);
                assert_eq!(at(x, y, z), if h % 3 != 0 { h as f32 / 64.0 } else { 0.0 });
            }
        }
    }
    assert_eq!(samples, found);
}

#[test]
fn grids_that_share_a_tree_have_transforms_of_their_own() {
    let folder = Folder::sample("cc_shared.vdb");
    for (name, scale) in [("first", 1.0), ("second", 0.5)] {
        let grid = folder.read(name);
        assert_eq!(grid.to_world, DAffine3::from_scale(DVec3::splat(scale)), "{name}");
        check(&grid, &FILLED, on, |_| [0.0; 3]);
    }
}

#[test]
fn points_are_refused_and_the_grid_beside_them_is_read() {
    let folder = Folder::sample("cc_points.vdb");
    let error = taki::grid::read(&folder.path(), "points", MEMORY).expect_err("points").to_string();
    assert!(error.contains("grid \"points\": it holds points") && error.contains("rasterise"), "{error}");
    check(&folder.read("density"), &FILLED, on, |_| [0.0; 3]);
}

#[test]
fn nanovdb_has_what_openvdb_has() {
    for (name, codec) in [("off_two_32", "none"), ("zip", "zip"), ("blosc", "blosc")] {
        let folder = Folder::sample(&format!("tool_{name}.nvdb"));
        assert_eq!(list(&folder.path(), MEMORY).expect("a list")[0].compression, codec);
        check(&folder.read("density"), &FILLED, on, either(4.0, 3.0));
    }
    check_tiles(&Folder::sample("tool_tiles_32.nvdb").read("tiles"));
    let filled = Bounds { min: [-9, -8, -7], max: [-1; 3] };
    for name in ["velocity", "half_velocity"] {
        let grid = Folder::sample("tool_vector_32.nvdb").read(name);
        assert_eq!((grid.class, grid.channels()), (Class::Staggered, 3));
        check(&grid, &filled, vector, |_| [0.0; 3]);
    }
}

#[test]
fn quantised_nanovdb_lies_within_its_steps() {
    // Half a step of codes over the distances of a leaf, which are at most 6 apart.
    for (name, error) in
        [("32", 1e-6), ("16", 6.0 / 65535.0), ("8", 3.1 / 255.0), ("4", 3.1 / 15.0), ("N", 0.1)]
    {
        let folder = Folder::sample(&format!("tool_sphere_{name}.nvdb"));
        let kind = list(&folder.path(), MEMORY).expect("a list")[0].kind.clone();
        assert_eq!(kind, if name == "32" { "Float".into() } else { format!("Fp{name}") });
        check_sphere(&folder.read("surface"), error);
    }
}

#[test]
fn names_and_counts_are_found_in_grids_of_warp() {
    for codec in ["none", "zip", "blosc"] {
        let folder = Folder::sample(&format!("warp_{codec}.nvdb"));
        let summary = &list(&folder.path(), MEMORY).expect("a list")[0];
        // Warp fills whole leaves.
        let bounds = Bounds { min: [0; 3], max: [15, 7, 7] };
        assert_eq!(
            (summary.name.as_str(), summary.active, summary.bounds),
            ("grid", Some(1024), Some(bounds))
        );
        let grid = folder.read("grid");
        assert_eq!((grid.active_count(), grid.bounds(), grid.background[0]), (1024, Some(bounds), 0.25));
        let scale = DMat3::from_diagonal(DVec3::splat(0.5));
        let place = DAffine3::from_mat3_translation(scale, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!((grid.to_world, summary.to_world), (place, Some(place)));
        for x in 0..9 {
            for y in 0..8 {
                for z in 0..7 {
                    assert_eq!(grid.at([x, y, z])[0], code([x, y, z]) as f32 / 64.0, "{codec}");
                }
            }
        }
    }
}
