//! Broken and hostile files: each answer says where and what to do.

use taki::grid::{list, read};

use super::{Folder, MEMORY, sample};

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
        let at = bytes.len() - 4;
        bytes[at..].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert!(text.contains("the sample [15, 15, 15] is not a finite number"), "{text}");
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
