//! Broken and hostile files: each answer says where and what to do.

use glam::DAffine3;
use taki::grid::{Builder, Class, encode_vdb, list, read};

use super::{Folder, MEMORY, sample};
use crate::cli::faults::{run, taki};

/// The error of reading a changed sample.
fn error(name: &str, grid: &str, change: impl FnOnce(&mut Vec<u8>)) -> String {
    let mut bytes = sample(name);
    change(&mut bytes);
    let folder = Folder::new(name, &bytes);
    let error = read(&folder.path(), grid, MEMORY).expect_err("an error");
    assert!([33, 65].contains(&error.exit_code()), "{error}");
    let text = error.to_string();
    assert!(text.contains(name) && text.contains("; "), "{text}");
    text
}

/// Position of some bytes in a file.
fn find(bytes: &[u8], wanted: &[u8]) -> usize {
    bytes.windows(wanted.len()).position(|part| part == wanted).expect("the bytes")
}

#[test]
fn every_start_of_a_file_is_refused() {
    for (name, grid, step) in
        [("old_off_two.vdb", "density", 7), ("tool_zip.nvdb", "density", 1), ("warp_none.nvdb", "grid", 977)]
    {
        let whole = sample(name);
        for length in (0..whole.len()).step_by(step) {
            let folder = Folder::new(name, &whole[..length]);
            let error = read(&folder.path(), grid, MEMORY).expect_err("the start of a file");
            assert_eq!(error.exit_code(), 65, "{length} bytes: {error}");
        }
    }
}

#[test]
fn versions_codecs_and_types_are_refused_in_words() {
    let version = |number: u32| {
        error("old_float.vdb", "density", |bytes| bytes[8..12].copy_from_slice(&number.to_le_bytes()))
    };
    assert!(
        version(221).contains("byte 8: the file is of version 221, where 222 to 225 are read"),
        "{}",
        version(221)
    );
    assert!(version(226).contains("version 226"), "{}", version(226));
    let stream = error("old_float.vdb", "density", |bytes| bytes[20] = 0);
    assert!(stream.contains("written as a stream") && stream.contains("not to a pipe"), "{stream}");
    let kind = |from: &str, to: &str| {
        error("old_float.vdb", "density", |bytes| {
            let at = find(bytes, from.as_bytes());
            bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        })
    };
    let tree = kind("Tree_float_5_4_3", "Tree_float_5_4_2");
    assert!(tree.contains("grid \"density\": its tree is Tree_float_5_4_2"), "{tree}");
    let flag = error("old_float.vdb", "density", |bytes| {
        let descriptor = find(bytes, b"Tree_float_5_4_3") + 16 + 4;
        let start = u64::from_le_bytes(bytes[descriptor..descriptor + 8].try_into().expect("a position"));
        bytes[start as usize] |= 16;
    });
    assert!(flag.contains("unknown (0x10)") && flag.contains("write it with blosc, zip"), "{flag}");
    let nano = error("warp_none.nvdb", "grid", |bytes| {
        let version = 29u32 << 21;
        bytes[8..12].copy_from_slice(&version.to_le_bytes());
    });
    assert!(nano.contains("of version 29.0.0, where 32 is read"), "{nano}");
    let codec = error("warp_none.nvdb", "grid", |bytes| bytes[14] = 9);
    assert!(codec.contains("number 9") || codec.contains("bytes"), "{codec}");
}

#[test]
fn counts_that_nothing_could_hold_are_refused_before_memory_is_taken() {
    let tiles = |count: u32| {
        error("cc_shared.vdb", "first", |bytes| {
            // The background and the numbers of tiles and of children, before the first child's origin.
            let at =
                find(bytes, &[[1, 0, 0, 0], [0; 4], [0; 4], [1, 0, 0, 0], [0; 4], [0; 4], [0; 4]].concat());
            bytes[at + 8..at + 12].copy_from_slice(&count.to_le_bytes());
        })
    };
    assert!(tiles(u32::MAX).contains("grid \"first\""), "{}", tiles(u32::MAX));
    let metadata =
        error("old_float.vdb", "density", |bytes| bytes[57..61].copy_from_slice(&[255, 255, 255, 127]));
    assert!(metadata.contains("byte"), "{metadata}");
    let grids = error("old_float.vdb", "density", |bytes| {
        let at = find(bytes, b"\x07\0\0\0density");
        bytes[at - 4..at].copy_from_slice(&i32::MAX.to_le_bytes());
    });
    assert!(grids.contains("it counts 2147483647 grids"), "{grids}");
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_their_sample() {
    let text = error("tool_none_32.vdb", "density", |bytes| {
        // Sample 9 of the 512 of the last leaf.
        let at = bytes.len() - 4 * (512 - 9);
        bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert!(text.contains("the sample [8, 9, 9] is not a finite number"), "{text}");
}

#[test]
fn what_is_no_grid_file_is_refused() {
    for bytes in [&b""[..], b"GIF89a", &[0; 100], b"PK\x03\x04"] {
        let folder = Folder::new("x.vdb", bytes);
        let error = list(&folder.path(), MEMORY).expect_err("no grid");
        assert_eq!(error.exit_code(), 65, "{error}");
    }
    let folder = Folder::new("x.vdb", b"");
    let error = list(&folder.path().with_extension("not"), MEMORY).expect_err("no file").to_string();
    assert!(error.contains("there is no file"), "{error}");
    let error = list(folder.path().parent().expect("a folder"), MEMORY).expect_err("a folder").to_string();
    assert!(error.contains("not a regular file"), "{error}");
}

/// A grid whose first leaf has 3 active samples and other numbers in between, with an inactive tile.
fn with_holes(channels: usize, off: f32, on: f32, background: f32) -> Vec<u8> {
    let mut builder = Builder::new(channels, [background, 0.0, 0.0]);
    let active = [0b1011, 0, 0, 0, 0, 0, 0, 0];
    let fill = |into: &mut [f32]| {
        into.fill(off);
        into[..4 * channels].fill(0.5);
        into[channels] = on;
        // Another number, so that the writer keeps all.
        into[9 * channels] = 7.0;
    };
    builder.leaf([8, 0, 0], active, fill).expect("placed");
    builder.tile([128, 0, 0], 128, [off, 0.0, 0.0], false).expect("placed");
    builder.tile([4096, 0, 0], 4096, [off, 0.0, 0.0], false).expect("placed");
    let grid = builder.finish("density", Class::FogVolume, DAffine3::IDENTITY);
    let mut bytes = std::io::Cursor::new(Vec::new());
    encode_vdb(&[grid], &mut bytes).expect("written");
    bytes.into_inner()
}

#[test]
fn numbers_that_are_not_finite_count_as_the_background_where_nothing_is_active() {
    for channels in [1, 3] {
        for off in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let folder = Folder::new("x.vdb", &with_holes(channels, off, 0.5, 0.0));
            let grid = folder.read("density");
            assert_eq!(grid.active_count(), 3);
            // 508 samples of the leaf without a number, and the two tiles.
            assert_eq!(grid.mended, 508 * channels as u64 + 1, "{channels} {off}");
            assert_eq!(
                [grid.at([8, 0, 0])[0], grid.at([10, 0, 0])[0], grid.at([9, 1, 0])[0]],
                [0.5, 0.5, 7.0]
            );
            for index in [[13, 0, 0], [15, 7, 7], [130, 1, 1], [4100, 1, 1], [0, 0, 0]] {
                assert_eq!(grid.at(index), [0.0; 3], "{index:?}");
            }
            let note = grid.note().expect("a note");
            assert!(note.contains(&grid.mended.to_string()) && note.contains("\"density\""), "{note}");
        }
    }
    // The background itself becomes 0, and with it the numbers that stand for it in the file's nodes. Numbers
    // outside another background become that.
    let grid = Folder::new("x.vdb", &with_holes(1, 0.25, 0.5, f32::NAN)).read("density");
    assert_eq!((grid.background, grid.mended, grid.at([13, 0, 0])[0]), ([0.0; 3], 32_767, 0.25));
    let grid = Folder::new("x.vdb", &with_holes(1, f32::NAN, 0.5, 3.0)).read("density");
    assert_eq!((grid.background[0], grid.at([13, 0, 0])[0]), (3.0, 3.0));
    let grid = Folder::new("x.vdb", &with_holes(1, 0.0, 0.5, 0.0)).read("density");
    assert_eq!((grid.mended, grid.note()), (0, None));
    // An active sample is refused with its index.
    let folder = Folder::new("x.vdb", &with_holes(1, f32::NAN, f32::NAN, 0.0));
    let said = read(&folder.path(), "density", MEMORY).expect_err("refused").to_string();
    assert!(said.contains("the sample [9, 0, 0] is not a finite number"), "{said}");
    let folder = Folder::new("x.vdb", &with_holes(1, f32::NAN, 0.5, 0.0));
    let info = run(taki(["volume", "info"]).arg(folder.path()));
    info.done();
    assert!(info.stdout().contains("note       the grid \"density\" has 509 numbers"), "{}", info.stdout());
}

#[test]
fn a_number_that_is_not_finite_never_changes_an_active_sample() {
    for (name, grid) in [("tool_off_two_32.nvdb", "density"), ("warp_none.nvdb", "grid")] {
        let whole = sample(name);
        // Numbers stand at multiples of 4 from the start of the grid.
        let start = (0..whole.len() - 7).rev().find(|&i| whole[i..].starts_with(b"NanoVDB")).expect("a grid");
        let truth = Folder::new(name, &whole).read(grid).statistics();
        let (mut mended, mut refused) = (0, 0);
        let step = ((whole.len() - start) / 12000).max(1) * 4;
        for at in (start..whole.len() - 4).step_by(step) {
            let mut bytes = whole.clone();
            bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            let folder = Folder::new(name, &bytes);
            match read(&folder.path(), grid, MEMORY) {
                Ok(grid) if grid.mended > 0 => {
                    assert_eq!(grid.statistics(), truth, "{name}, byte {at}");
                    mended += 1;
                }
                Ok(_) => {}
                Err(e) => refused += usize::from(e.to_string().contains("finite")),
            }
        }
        assert!(mended > 10 && refused > 10, "{name}: {mended} mended, {refused} refused");
    }
}
