//! Files that taki writes, read again to the bit. docs/grids.md tells which other programs read them.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use taki::grid::{BlockData, Builder, Class, Grid, encode_vdb, list, read, write_vdb};

use super::{Folder, MEMORY};

/// Every block of a grid in words, so that two grids can be compared to the bit.
fn words(grid: &Grid) -> Vec<String> {
    let mut all: Vec<String> = grid
        .blocks()
        .map(|block| match block.data {
            BlockData::Leaf { values, active } => {
                let bits: Vec<u32> = values.iter().map(|x| x.to_bits()).collect();
                format!("{:?} {active:?} {bits:?}", block.origin)
            }
            BlockData::Tile { value, is_active } => {
                format!("{:?} {} {:?} {is_active}", block.origin, block.side, value.map(f32::to_bits))
            }
        })
        .collect();
    all.sort();
    all
}

/// A grid with leaves and tiles of all sizes, on both sides of the origin.
fn rich(name: &str, channels: usize, background: f32, to_world: DAffine3) -> Grid {
    let mut background = [background; 3];
    if channels == 1 {
        background[1..].fill(0.0);
    }
    let mut builder = Builder::new(channels, background);
    let value = |i: usize| (i as f32 * 0.37).sin() * 1e-3f32.powi(i as i32 % 5);
    for (n, origin) in [[0, 0, 0], [8, 0, 0], [-8, -16, 4088], [-4096, 4096, 0]].into_iter().enumerate() {
        let active = std::array::from_fn(|layer| 0x0f0f_55aa_1248_8421u64.rotate_left((n + layer) as u32));
        let fill = |into: &mut [f32]| {
            into.chunks_mut(channels).enumerate().for_each(|(i, into)| {
                // Of the second leaf, what is not active has the background, and of the third its negative.
                let is_active = active[i >> 6] >> (i & 63) & 1 != 0;
                for (channel, x) in into.iter_mut().enumerate() {
                    *x = match n {
                        1 if !is_active => background[channel],
                        2 if !is_active => -background[channel],
                        _ => value(n * 512 + i + channel),
                    };
                }
            });
        };
        builder.leaf(origin, active, fill).expect("placed");
    }
    for (side, is_active) in [(8u32, true), (16, false), (64, true), (128, true), (512, false), (4096, true)]
    {
        builder
            .tile([8192, 4096 * side.trailing_zeros() as i32, 0], side, [side as f32; 3], is_active)
            .expect("placed");
    }
    builder.finish(name, Class::Staggered, to_world)
}

fn turned() -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::new(0.1, 0.2, 0.3),
        DQuat::from_rotation_z(0.3),
        DVec3::new(1.0, -2.0, 3e5),
    )
}

/// Tiles of 16, 64 and 512 samples come back as several of 8 and 128.
fn split(grid: &Grid) -> Grid {
    let mut builder = Builder::new(grid.channels(), grid.background);
    for block in grid.blocks() {
        match block.data {
            BlockData::Leaf { values, active } => {
                builder.leaf(block.origin, *active, |into| into.copy_from_slice(values)).expect("placed");
            }
            BlockData::Tile { value, is_active } => {
                let own = [4096, 128, 8].into_iter().find(|own| *own <= block.side).expect("a side");
                let parts = (block.side / own) as i32;
                for i in 0..parts.pow(3) {
                    let local = [i % parts, i / parts % parts, i / parts / parts];
                    let origin = std::array::from_fn(|a| block.origin[a] + own as i32 * local[a]);
                    builder.tile(origin, own, value, is_active).expect("placed");
                }
            }
        }
    }
    builder.finish(grid.name.clone(), grid.class, grid.to_world)
}

#[test]
fn what_is_written_is_read_to_the_bit() {
    let grids = [
        rich("density", 1, 0.0, DAffine3::from_scale(DVec3::splat(0.1))),
        rich("surface", 1, 2.5, turned()),
        rich("velocity", 3, -0.5, DAffine3::from_translation(DVec3::new(0.0, 1.0, 0.0))),
        rich("density", 1, 0.1, DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 4.0)))),
        Builder::new(3, [0.0; 3]).finish("empty", Class::Unknown, DAffine3::IDENTITY),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("grids.vdb");
    write_vdb(&path, &grids).expect("written");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1, "no other file is left");
    let names = ["density[0]", "surface", "velocity", "density[1]", "empty"];
    let listed = list(&path, MEMORY).expect("a list");
    assert_eq!(listed.iter().map(|grid| grid.name.as_str()).collect::<Vec<_>>(), names);
    for ((grid, name), summary) in grids.iter().zip(names).zip(&listed) {
        let back = read(&path, name, MEMORY).expect("a grid");
        assert_eq!(words(&back), words(&split(grid)), "{name}");
        assert_eq!(
            (back.class, back.background, back.to_world),
            (grid.class, grid.background, grid.to_world)
        );
        assert_eq!((back.bounds(), back.active_count()), (grid.bounds(), grid.active_count()));
        assert_eq!((summary.bounds, summary.active), (grid.bounds(), Some(grid.active_count())));
        assert_eq!((summary.class, summary.to_world), (grid.class, Some(grid.to_world)));
        assert_eq!(summary.compression, "zip + active mask");
    }
}

#[test]
fn the_same_grids_are_the_same_bytes() {
    let grids = [rich("density", 1, 0.0, turned()), rich("velocity", 3, 0.0, turned())];
    let encoded = || {
        let mut out = std::io::Cursor::new(Vec::new());
        encode_vdb(&grids, &mut out).expect("written");
        out.into_inner()
    };
    assert_eq!(encoded(), encoded());
}

#[test]
fn a_file_that_cannot_be_written_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = write_vdb(&folder.path().join("none/grids.vdb"), &[]).expect_err("no folder");
    assert_eq!(error.exit_code(), 73, "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn a_million_tiles_are_read_in_bounded_memory() {
    let mut builder = Builder::new(1, [0.0; 3]);
    let side = 100;
    for i in 0..side * side * side {
        let local = [i % side, i / side % side, i / side / side];
        builder.tile(local.map(|x| 8 * x), 8, [i as f32 + 1.0, 0.0, 0.0], true).expect("placed");
    }
    let grid = builder.finish("tiles", Class::FogVolume, DAffine3::IDENTITY);
    let mut out = std::io::Cursor::new(Vec::new());
    encode_vdb(std::slice::from_ref(&grid), &mut out).expect("written");
    let folder = Folder::new("tiles.vdb", &out.into_inner());
    let start = std::time::Instant::now();
    let back = read(&folder.path(), "tiles", 256 << 20).expect("a grid");
    println!("{} bytes in memory, read in {:?}", back.bytes(), start.elapsed());
    assert_eq!(back.active_count(), 512_000_000);
    assert!(back.bytes() < 64 << 20, "{} bytes", back.bytes());
    assert_eq!((back.at([0; 3])[0], back.at([799; 3])[0], back.at([800, 0, 0])[0]), (1.0, 1e6, 0.0));
    let error = read(&folder.path(), "tiles", 16 << 20).expect_err("too little memory");
    assert_eq!(error.exit_code(), 33, "{error}");
}
