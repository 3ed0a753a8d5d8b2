//! Grids in NumPy's archives, made here by hand.

use std::io::{Cursor, Write};

use glam::{DAffine3, DMat3, DVec3};
use npyz::WriterBuilder;
use taki::grid::{Bounds, Class, is_grid, list, read};

use super::{Folder, MEMORY};

/// An archive of arrays, each with its shape, in C order or Fortran's.
fn archive(arrays: &[(&str, &[u64], bool, Vec<f32>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, shape, is_fortran, values) in arrays {
        zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).expect("a file");
        let order = if *is_fortran { npyz::Order::Fortran } else { npyz::Order::C };
        let mut bytes = Vec::new();
        let options = npyz::WriteOptions::new().default_dtype().shape(shape).order(order);
        let mut writer = options.writer(&mut bytes).begin_nd().expect("an array");
        writer.extend(values.iter().copied()).expect("numbers");
        writer.finish().expect("an array");
        zip.write_all(&bytes).expect("written");
    }
    zip.finish().expect("an archive").into_inner()
}

/// Value of a sample: nx = 4, ny = 3, nz = 2.
fn value(x: usize, y: usize, z: usize, channel: usize) -> f32 {
    (x + 10 * y + 100 * z + 1000 * channel) as f32
}

const SIZE: [usize; 3] = [4, 3, 2];

fn c_order(channels: usize) -> Vec<f32> {
    let [nx, ny, nz] = SIZE;
    let all = (0..nz * ny * nx * channels)
        .map(|i| [i / channels % nx, i / channels / nx % ny, i / channels / nx / ny, i % channels]);
    all.map(|[x, y, z, channel]| value(x, y, z, channel)).collect()
}

fn fortran_order(channels: usize) -> Vec<f32> {
    let [nx, ny, nz] = SIZE;
    let all = (0..nz * ny * nx * channels).map(|i| [i / nz / ny % nx, i / nz % ny, i % nz, i / nz / ny / nx]);
    all.map(|[x, y, z, channel]| value(x, y, z, channel)).collect()
}

/// A small archive of a density and a velocity.
pub fn small() -> Vec<u8> {
    archive(&[
        ("density", &[2, 3, 4], false, c_order(1)),
        ("velocity", &[2, 3, 4, 3], true, fortran_order(3)),
        ("origin", &[3], false, vec![1.0, 2.0, 3.0]),
        ("voxel", &[], false, vec![0.5]),
    ])
}

#[test]
fn arrays_of_an_archive_are_grids() {
    let bytes = archive(&[
        ("density", &[2, 3, 4], false, c_order(1)),
        ("velocity", &[2, 3, 4, 3], false, c_order(3)),
        ("heat", &[2, 3, 4], true, fortran_order(1)),
        ("wind", &[2, 3, 4, 3], true, fortran_order(3)),
        ("origin", &[3], false, vec![1.0, 2.0, 3.0]),
        ("voxel", &[], false, vec![0.5]),
        ("notes", &[5], false, vec![0.0; 5]),
    ]);
    let folder = Folder::new("grids.npz", &bytes);
    assert!(is_grid(&folder.path()));
    let grids = list(&folder.path(), MEMORY).expect("a list");
    let names: Vec<&str> = grids.iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["density", "heat", "velocity", "wind"]);
    let place =
        DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(0.5)), DVec3::new(1.0, 2.0, 3.0));
    let bounds = Bounds { min: [0; 3], max: [3, 2, 1] };
    assert_eq!((grids[0].active, grids[0].bounds, grids[0].to_world), (Some(24), Some(bounds), Some(place)));
    assert_eq!((grids[0].class, grids[2].kind.as_str()), (Class::FogVolume, "float32 × 3"));
    for (name, channels) in [("density", 1), ("heat", 1), ("velocity", 3), ("wind", 3)] {
        let grid = folder.read(name);
        assert_eq!((grid.channels(), grid.bounds(), grid.to_world), (channels, Some(bounds), place));
        for (z, y, x) in (0..2).flat_map(|z| (0..3).flat_map(move |y| (0..4).map(move |x| (z, y, x)))) {
            let expected: [f32; 3] =
                std::array::from_fn(|channel| if channel < channels { value(x, y, z, channel) } else { 0.0 });
            assert_eq!(grid.at([x as i32, y as i32, z as i32]), expected, "{name} {x} {y} {z}");
        }
    }
}

#[test]
fn archives_without_density_are_no_grids_and_faults_name_the_sample() {
    let volume = archive(&[("rho", &[1, 1, 1], false, vec![0.0]), ("density", &[1, 1, 1], false, vec![0.0])]);
    assert!(!is_grid(&Folder::new("v.npz", &volume).path()));
    let mut values = c_order(1);
    values[23] = f32::NAN;
    let folder = Folder::new("nan.npz", &archive(&[("density", &[2, 3, 4], false, values)]));
    let error = read(&folder.path(), "density", MEMORY).expect_err("not a number").to_string();
    assert!(error.contains("density: at [1, 2, 3]: it is NaN") && error.contains("nan_to_num"), "{error}");
    let short = archive(&[("density", &[2, 3, 4], false, c_order(1))]);
    let folder = Folder::new("large.npz", &short);
    let error = read(&folder.path(), "density", 1000).expect_err("too little memory");
    assert_eq!(error.exit_code(), 33, "{error}");
    let flat = archive(&[("density", &[2, 3, 4], false, c_order(1)), ("voxel", &[], false, vec![0.0])]);
    let error = read(&Folder::new("flat.npz", &flat).path(), "density", MEMORY).expect_err("no size");
    assert!(error.to_string().contains("no inverse"), "{error}");
}
