//! `taki volume info` of files of simulations.

use serde_json::Value;

use super::{Folder, sample};
use crate::cli::faults::{Run, run, taki};

fn info(folder: &Folder, options: &[&str]) -> Run {
    let mut command = taki(["volume", "info"]);
    run(command.arg(folder.path()).args(options))
}

#[test]
fn grids_are_printed_with_their_statistics_and_the_reason_why_one_is_not_read() {
    let found = info(&Folder::sample("old_several.vdb"), &[]);
    found.done();
    let one = "one[0]: float, class unknown, compression blosc + active mask\n  \
               active     1 samples in 1 × 1 × 1 from [-1, -2, -3] to [-1, -2, -3]\n  \
               voxel      2 × 2 × 2, turned; index (0, 0, 0) lies at (10, 20, 30)\n  \
               values     0.75 to 0.75, mean 0.75\n";
    assert!(found.stdout().contains(one), "{}", found.stdout());
    let flags = "  not read   its type is bool, which is not read; convert it to a float or a vec3s grid";
    assert!(found.stdout().contains(flags), "{}", found.stdout());
    assert!(found.stdout().contains("empty: float"), "{}", found.stdout());
}

#[test]
fn the_same_is_one_object_of_json() {
    let found = info(&Folder::sample("tool_vector_32.nvdb"), &["--json"]);
    found.done();
    let object: Value = serde_json::from_str(found.stdout()).expect("JSON");
    let grids = object["grids"].as_array().expect("a list");
    assert_eq!(grids.len(), 2);
    for grid in grids {
        assert_eq!((grid["type"].as_str(), grid["class"].as_str()), (Some("Vec3f"), Some("staggered")));
        assert_eq!(grid["channels"], 3);
        // Codes 1 to 62 of the script: the least and the greatest that are no multiples of 3.
        let numbers = |key: &str| -> Vec<f64> {
            grid[key].as_array().expect("three").iter().filter_map(Value::as_f64).collect()
        };
        assert_eq!(numbers("min"), [1.0 / 64.0, -62.0 / 32.0, 1.0 / 16.0 - 1.0]);
        assert_eq!(numbers("max"), [62.0 / 64.0, -1.0 / 32.0, 62.0 / 16.0 - 1.0]);
        assert_eq!(grid["to_world"][0][0], 1.0);
        assert_eq!(grid["not_read"], Value::Null);
    }
}

#[test]
fn a_broken_grid_is_told_after_the_list() {
    let mut bytes = sample("tool_none_32.vdb");
    let end = bytes.len();
    // Sample 9 of the 512 of the last leaf.
    bytes[end - 4 * (512 - 9)..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let found = info(&Folder::new("broken.vdb", &bytes), &[]);
    found.refused(65, &["the sample [8, 9, 9] is not a finite number"]);
    assert!(
        found.stdout().contains("density: float") && found.stdout().contains("  not read   "),
        "{}",
        found.stdout()
    );
    let found = info(&Folder::sample("old_float.vdb"), &["--memory", "64KiB"]);
    found.refused(33, &["old_float.vdb: grid \"density\" needs"]);
}
