#!/usr/bin/env bash
# The exr crate deletes the old file when it cannot open it to write a new one.
#
# Versions: exr 1.74.2 (crate).
# Expected: if the file cannot be opened, an error is returned and the old file stays as it is.
# Seen: with no file handle left ("Too many open files") nothing is written, the error is returned, and the
#   name is removed: the frame of the last run is gone. std::fs::File::create fails in the same way and
#   leaves the file.
# Why it matters: a renderer that overwrites its frames in place loses finished ones to a fault that passes.
#   Write to a temporary name beside the frame and rename it.
set -euo pipefail
source "$(dirname -- "$0")/lib/common.bash"
cargo_build 'exr = "=1.74.2"' <<'RUST'
use exr::prelude::write_rgb_file;

fn write(path: &str) -> exr::error::UnitResult {
    write_rgb_file(path, 8, 8, |x, y| (x as f32, y as f32, 0.5))
}
fn state(path: &str) -> &'static str {
    if std::path::Path::new(path).exists() { "there" } else { "gone" }
}
fn main() {
    let path = std::env::args().nth(1).unwrap();
    write(&path).unwrap();
    println!("before = {}", state(&path));
    let mut handles = Vec::new();
    while let Ok(file) = std::fs::File::open("/dev/null") {
        handles.push(file);
    }
    let std_says = std::fs::File::create(&path).map(|_| ()).map_err(|e| e.to_string());
    println!("std = {std_says:?}, the file is {}", state(&path));
    let exr_says = write(&path).map_err(|e| e.to_string());
    println!("exr = {exr_says:?}, the file is {}", state(&path));
}
RUST
ulimit -n 64
observe "$work/crate/target/debug/finding" "$work/frame.exr"
expect "after a first frame" "$(seen before)" there
expect "std, no handle left" "$(seen std)" 'Err("Too many open files (os error 24)"), the file is there'
expect "exr, no handle left" "$(seen exr)" 'Err("Too many open files (os error 24)"), the file is gone'
verdict
