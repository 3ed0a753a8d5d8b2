//! Files that taki writes, read again to the bit. docs/grids.md tells which other programs read them.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use taki::grid::{
    BlockData, Builder, Class, Grid, encode_nvdb, encode_vdb, list, read, write_nvdb, write_vdb,
};

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

/// A small file of NanoVDB.
pub fn nano() -> Vec<u8> {
    let mut builder = Builder::new(3, [0.5; 3]);
    let fill = |into: &mut [f32]| into.iter_mut().enumerate().for_each(|(i, x)| *x = i as f32);
    builder.leaf([8, -8, 0], [0x0ff0; 8], fill).expect("placed");
    builder.tile([256, 0, 0], 128, [1.0, 2.0, 3.0], true).expect("placed");
    builder.tile([0, 64, 0], 8, [4.0, 5.0, 6.0], false).expect("placed");
    let mut out = std::io::Cursor::new(Vec::new());
    encode_nvdb(&[builder.finish("flow", Class::Staggered, turned())], &mut out).expect("written");
    out.into_inner()
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
    type Write = fn(&std::path::Path, &[Grid]) -> taki::util::error::Result<()>;
    let formats: [(&str, Write, &str); 2] =
        [("grids.vdb", write_vdb, "zip + active mask"), ("grids.nvdb", write_nvdb, "zip")];
    for (file, write, compression) in formats {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(file);
        write(&path, &grids).expect("written");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1, "no other file is left");
        let names = ["density[0]", "surface", "velocity", "density[1]", "empty"];
        let listed = list(&path, MEMORY).expect("a list");
        assert_eq!(listed.iter().map(|grid| grid.name.as_str()).collect::<Vec<_>>(), names);
        for ((grid, name), summary) in grids.iter().zip(names).zip(&listed) {
            let back = read(&path, name, MEMORY).expect("a grid");
            assert_eq!(words(&back), words(&split(grid)), "{file} {name}");
            // A staggered grid of NanoVDB holds vectors.
            let class =
                if file == "grids.nvdb" && grid.channels() == 1 { Class::Unknown } else { grid.class };
            assert_eq!((back.class, back.background, back.to_world), (class, grid.background, grid.to_world));
            assert_eq!((back.bounds(), back.active_count()), (grid.bounds(), grid.active_count()));
            assert_eq!((summary.bounds, summary.active), (grid.bounds(), Some(grid.active_count())));
            assert_eq!((summary.class, summary.to_world), (class, Some(grid.to_world)));
            assert_eq!(summary.compression, compression);
        }
    }
}

/// Numbers of 4 or 8 bytes at places of an uncompressed grid.
fn numbers<const N: usize>(bytes: &[u8], places: &[usize]) -> Vec<[u8; N]> {
    places.iter().map(|&at| bytes[at..at + N].try_into().expect("inside")).collect()
}

#[test]
fn the_head_of_a_nanovdb_has_its_statistics_and_a_checksum() {
    let mut builder = Builder::new(1, [7.0, 0.0, 0.0]);
    let mut active = [0u64; 8];
    (active[0], active[1]) = (0b11, 1);
    let fill = |into: &mut [f32]| {
        into.fill(-9.0);
        (into[0], into[1], into[64]) = (1.0, 2.0, 6.0);
    };
    builder.leaf([16, -8, 8], active, fill).expect("placed");
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.5, 0.25, 2.0),
        DQuat::IDENTITY,
        DVec3::new(1.0, 2.0, 3.0),
    );
    let grid = builder.finish("a name", Class::LevelSet, place);
    let mut out = std::io::Cursor::new(Vec::new());
    encode_nvdb(&[grid], &mut out).expect("written");
    let file = out.into_inner();
    // A segment, a record, a name with its 0, the length of the block, and zlib.
    assert_eq!((&file[..8], &file[12..16]), (&b"NanoVDB0"[..], &[1, 0, 1, 0][..]));
    let mut bytes = Vec::new();
    let packed = &file[16 + 176 + 7 + 8..];
    std::io::Read::read_to_end(&mut flate2::read::ZlibDecoder::new(packed), &mut bytes).expect("zlib");
    let u64s = |places: &[usize]| -> Vec<u64> {
        numbers::<8>(&bytes, places).into_iter().map(u64::from_le_bytes).collect()
    };
    let f32s = |places: &[usize]| -> Vec<f32> {
        numbers::<4>(&bytes, places).into_iter().map(f32::from_le_bytes).collect()
    };
    let f64s = |places: &[usize]| -> Vec<f64> {
        numbers::<8>(&bytes, places).into_iter().map(f64::from_le_bytes).collect()
    };
    // Root of 64 + 32 bytes, an upper and a lower node, and a leaf.
    let [root, upper, lower, leaf] = [736, 832, 832 + 270_400, 832 + 270_400 + 33_856];
    assert_eq!(bytes.len(), leaf + 2144);
    assert_eq!(
        u64s(&[32, 672, 680, 688, 696]),
        [leaf + 2144, leaf - 672, lower - 672, upper - 672, 64].map(|x| x as u64)
    );
    assert_eq!(u64s(&[728]), [3], "active samples");
    // Least, greatest, mean and deviation, of the root after its background.
    let deviation = ((4.0 + 1.0 + 9.0) / 3.0f64).sqrt() as f32;
    let stats = [1.0, 6.0, 3.0, deviation];
    assert_eq!(f32s(&[root + 28]), [7.0]);
    for at in [root + 32, upper + 32 + 8192, lower + 32 + 1024, leaf + 80] {
        assert_eq!(f32s(&[at, at + 4, at + 8, at + 12]), stats);
    }
    let index: Vec<i32> = numbers::<4>(&bytes, &[0, 4, 8, 12, 16, 20].map(|i| root + i))
        .into_iter()
        .map(i32::from_le_bytes)
        .collect();
    assert_eq!(index, [16, -8, 8, 17, -8, 9]);
    // From the corner of index (16, -8, 8) to that behind (17, -8, 9).
    assert_eq!(f64s(&[560, 568, 576, 584, 592, 600]), [9.0, 0.0, 19.0, 10.0, 0.25, 23.0]);
    assert_eq!(f64s(&[608, 616, 624]), [0.5, 0.25, 2.0]);
    let checksum = crc32fast::hash(&bytes[16..upper]);
    assert_eq!(bytes[8..16], [checksum.to_le_bytes(), [0xff; 4]].concat());
}

#[test]
fn a_nanovdb_with_a_vector_for_each_root_tile_and_no_active_sample_is_read() {
    let mut builder = Builder::new(3, [0.0; 3]);
    builder.tile([-4096, 0, 4096], 4096, [1.0, 2.0, 3.0], false).expect("placed");
    builder.leaf([0; 3], [0; 8], |into| into.fill(4.0)).expect("placed");
    let grid = builder.finish("", Class::FogVolume, DAffine3::IDENTITY);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.nvdb");
    write_nvdb(&path, std::slice::from_ref(&grid)).expect("written");
    let back = read(&path, "grid", MEMORY).expect("a grid");
    assert_eq!((words(&back), back.bounds(), back.class), (words(&grid), None, Class::Unknown));
    let long = Builder::new(1, [0.0; 3]).finish("ä".repeat(200), Class::Unknown, DAffine3::IDENTITY);
    write_nvdb(&path, std::slice::from_ref(&long)).expect("written");
    assert_eq!(read(&path, &long.name, MEMORY).expect("a grid").name, long.name);
}

#[test]
fn the_same_grids_are_the_same_bytes() {
    let grids = [rich("density", 1, 0.0, turned()), rich("velocity", 3, 0.0, turned())];
    let encoded = |is_nano: bool| {
        let mut out = std::io::Cursor::new(Vec::new());
        let done = if is_nano { encode_nvdb(&grids, &mut out) } else { encode_vdb(&grids, &mut out) };
        done.expect("written");
        out.into_inner()
    };
    assert!(encoded(false) == encoded(false) && encoded(true) == encoded(true));
}

#[test]
fn a_file_that_cannot_be_written_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    for write in [write_vdb, write_nvdb] {
        let error = write(&folder.path().join("none/grids.vdb"), &[]).expect_err("no folder");
        assert_eq!(error.exit_code(), 73, "{error}");
    }
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

/// Writes the same grids as `TAKI_GRIDS/rich.vdb` and `.nvdb`, for the programs of docs/grids.md.
#[test]
#[ignore = "writes files for other programs"]
fn files_for_other_programs() {
    let folder = std::path::PathBuf::from(std::env::var_os("TAKI_GRIDS").expect("TAKI_GRIDS is a folder"));
    let grids = [
        rich("density", 1, 0.0, DAffine3::from_scale(DVec3::splat(0.1))),
        rich("surface", 1, 2.5, turned()),
        rich("velocity", 3, -0.5, DAffine3::from_translation(DVec3::new(0.0, 1.0, 0.0))),
        Builder::new(3, [0.0; 3]).finish("empty", Class::Unknown, DAffine3::IDENTITY),
    ];
    write_vdb(&folder.join("rich.vdb"), &grids).expect("written");
    write_nvdb(&folder.join("rich.nvdb"), &grids).expect("written");
}
