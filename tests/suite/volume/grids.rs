//! Volumes as grids of OpenVDB and NanoVDB: every cell to the bit, and the place of the box. docs/grids.md
//! tells which other programs read the files.

use std::fs;
use std::path::Path;

use glam::{DAffine3, DVec3};
use taki::grid::{Grid, list, read};
use taki::scene::Scene;
use taki::util::monitor::Unwatched;
use taki::volume::{Cell, VolumeTexture};

use crate::cli::faults::{run, taki};
use crate::scene::meshes::{Folder, PLACE};

const MEMORY: u64 = 1 << 28;

/// A scene whose volume of curves fills a turned box, sparse or dense.
fn text(storage: &str) -> String {
    format!(
        "{PLACE}[volumes.w]\nnx = 21\nny = 18\nnz = 9\nalpha = 0.7\nstorage = {storage:?}\n[curves]\nacross \
         = 4\n[boxes.b]\nvolume = \"w\"\nposition = [1, 2, -3]\nsize = [4.2, 1.8, 0.9]\nturn = [20, 30, \
         40]\n"
    )
}

/// Reads the four grids of a file.
fn grids(path: &Path) -> [Grid; 4] {
    ["density", "velocity", "kd", "ks"].map(|name| read(path, name, MEMORY).expect(name))
}

/// Compares every sample with the cell of its index. `place` takes texture coordinates to the world.
fn check(grids: &[Grid; 4], volume: &VolumeTexture, place: DAffine3) {
    let size = volume.size.map(|n| n as i32);
    let edge = DVec3::ONE / DVec3::from_array(size.map(f64::from));
    let mut active = 0;
    for z in -1..=size[2] {
        for y in -1..=size[1] {
            for x in -1..=size[0] {
                let index = [x, y, z];
                let is_inside = (0..3).all(|a| (0..size[a]).contains(&index[a]));
                let cell = is_inside.then(|| volume.cell(x as u32, y as u32, z as u32));
                let cell = cell.filter(|cell| cell.has_direction());
                active += u64::from(cell.is_some());
                let [density, velocity, k_d, k_s] = [0, 1, 2, 3].map(|i| grids[i].at(index));
                let Some(cell) = cell else {
                    assert_eq!([density, velocity, k_d, k_s], [[0.0; 3]; 4]);
                    continue;
                };
                let (d, s) = cell.k();
                let bits = |x: [f32; 3]| x[0].to_bits();
                let truth = [cell.rho() * volume.alpha, d, s].map(f32::to_bits);
                assert_eq!([density, k_d, k_s].map(bits), truth, "{index:?}");
                // The flow of the cell, as a step in the world.
                let at = DVec3::from_array(index.map(f64::from)) + 0.5;
                let step = place.transform_point3((at + cell.v().as_dvec3()) * edge)
                    - place.transform_point3(at * edge);
                let found = DVec3::from_array(velocity.map(f64::from));
                if place.matrix3 == VolumeTexture::unit_box(volume.size).matrix3 {
                    assert_eq!(velocity.map(f32::to_bits), cell.v().to_array().map(f32::to_bits));
                }
                assert!((found - step.normalize()).length() < 1e-6, "{index:?}: {found} {step}");
                assert!(
                    grids[0].to_world.transform_point3(at - 0.5).distance(place.transform_point3(at * edge))
                        < 1e-9
                );
            }
        }
    }
    assert!(active > 100, "{active}");
    assert!(grids.iter().all(|grid| grid.active_count() == active));
}

fn build(scene: &Scene) -> VolumeTexture {
    scene.volume(MEMORY, &Unwatched).expect("a volume")
}

#[test]
fn every_cell_is_a_voxel_in_the_place_of_the_box() {
    for (storage, file) in [("dense", "v.VDB"), ("sparse", "v.vdb"), ("dense", "v.nvdb")] {
        let folder = Folder::new();
        let scene = folder.scene(&text(storage), &[]);
        let mut command = taki(["volume", "build", "s.toml", "-o", file]);
        run(command.current_dir(folder.0.path())).done();
        let path = folder.path(file);
        let names: Vec<String> =
            list(&path, MEMORY).expect("grids").into_iter().map(|own| own.name).collect();
        assert_eq!(names, ["density", "velocity", "kd", "ks"]);
        check(&grids(&path), &build(&scene), scene.boxes[0].world_from_texture);
    }
}

#[test]
fn a_volume_without_a_box_has_a_longest_side_of_one() {
    let folder = Folder::new();
    let sets = ["--set", "nx=20", "--set", "ny=16", "--set", "nz=10"];
    let mut command = taki(["volume", "build", "fig5", "-o", "v.vdb"]);
    run(command.args(sets).current_dir(folder.0.path())).done();
    let scene = folder.scene("version = 1\nbase = \"fig5\"\n", &["nx=20", "ny=16", "nz=10"]);
    let volume = build(&scene);
    let place = VolumeTexture::unit_box(volume.size);
    assert_eq!(place.transform_point3(DVec3::ONE), DVec3::new(0.5, 0.4, 0.25));
    let grids = grids(&folder.path("v.vdb"));
    check(&grids, &volume, place);
    let said = volume.grids(place, 10_000).expect_err("too large").to_string();
    assert!(said.contains("--memory") && said.contains(".npz"), "{said}");
}

#[test]
fn what_was_written_is_the_same_volume_again_to_the_bit() {
    for file in ["v.vdb", "v.nvdb"] {
        let folder = Folder::new();
        let first = folder.scene(&text("dense"), &[]);
        let mut command = taki(["volume", "build", "s.toml", "-o", file]);
        run(command.current_dir(folder.0.path())).done();
        let again = format!(
            "{PLACE}[volumes.w]\nbuilder = \"flow\"\nsource = {file:?}\nreflect = \"stored\"\n[boxes.b]\n\
             volume = \"w\"\n"
        );
        let again = folder.scene(&again, &[]);
        let (one, other) = (build(&first), build(&again));
        assert_eq!(one.alpha.to_bits(), other.alpha.to_bits());
        let bounds = again.recipes[0].measured.as_ref().expect("measured").bounds;
        let mut matter = 0;
        for z in 0..one.size[2] {
            for y in 0..one.size[1] {
                for x in 0..one.size[0] {
                    let was = one.cell(x, y, z);
                    let [i, j, k] = [0, 1, 2].map(|a| [x, y, z][a].wrapping_sub(bounds.min[a] as u32));
                    let is_inside = (0..3).all(|a| [i, j, k][a] < other.size[a]);
                    let is = if is_inside { other.cell(i, j, k) } else { Cell::default() };
                    // ρ, k and v: all codes. A cell without matter loses what cannot be seen.
                    let truth = if was.rho_code() > 0 { was } else { Cell::default() };
                    assert_eq!(is, truth, "{file} {:?}", [x, y, z]);
                    matter += u32::from(was.rho_code() > 0);
                }
            }
        }
        assert!(matter > 100, "{matter}");
    }
}

#[test]
fn only_files_of_openvdb_are_replaced() {
    let folder = Folder::new();
    let build = |arguments: &[&str]| {
        let mut command = taki(["volume", "build", "fig5", "--set", "ny=12", "-o", "v.vdb"]);
        run(command.args(arguments).current_dir(folder.0.path()))
    };
    folder.write("v.vdb", b"notes of mine");
    build(&[]).refused(73, &["v.vdb", "no OpenVDB file", "--overwrite"]);
    assert_eq!(fs::read(folder.path("v.vdb")).unwrap(), b"notes of mine");
    build(&["--overwrite"]).done();
    let made = fs::read(folder.path("v.vdb")).unwrap();
    build(&[]).done();
    // The same scene gives the same bytes.
    assert!(fs::read(folder.path("v.vdb")).unwrap() == made);
    fs::rename(folder.path("v.vdb"), folder.path("v.nvdb")).unwrap();
    let mut command = taki(["volume", "build", "fig5", "-o", "v.nvdb"]);
    let refused = run(command.current_dir(folder.0.path()));
    refused.refused(73, &["v.nvdb", "no NanoVDB file", "--overwrite"]);
    let mut command = taki(["volume", "build", "fig5", "-o", "v.abc"]);
    let refused = run(command.current_dir(folder.0.path()));
    refused.refused(2, &["v.abc", "an .npz file, or a .vdb, .nvdb or .hair for other programs", "v.npz"]);
    fs::rename(folder.path("v.nvdb"), folder.path("v.vdb")).unwrap();
    folder.write("s.toml", text("dense"));
    let own = ["--set", "volume.builder=flow", "--set", "volume.source=v.vdb", "-o", "v.vdb"];
    let mut command = taki(["volume", "build", "fig5"]);
    let found = run(command.args(own).current_dir(folder.0.path()));
    found.refused(2, &["v.vdb", "reads its volume from this file"]);
}
